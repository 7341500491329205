"""Compares what a rack does with what a recording holds, message by message, while it runs again."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import seconds_text
from automax_ros.messages.cdr.cdr import CdrError, Message, decode
from automax_ros.messages.types.messages import (
    NAMES,
    NO_VALUES,
    CommonWrite,
    Operation,
    PlantState,
    RollState,
    Scan,
    TaskState,
    WebState,
)
from automax_ros.messages.types.topics import Take, Topic
from automax_ros.rackfile.model.writers import PRESET_WRITER
from automax_ros.recordings.mcap.mcap_file import RawMessage
from automax_ros.recordings.read.reader import BagReader

_SCAN, _WRITE = NAMES[Scan], NAMES[CommonWrite]
_MOST_WAITING = 200_000
"""Most messages of other topics that wait for theirs (decision: a bound on memory)."""
_ENDED = "the recording has ended"


@dataclass(frozen=True)
class Deviation:
    """The first message that is not as recorded: ns of the run, and in words what it is."""

    time_ns: int
    what: str

    @property
    def text(self) -> str:
        """The deviation in words."""
        return f"at {seconds_text(max(0, self.time_ns))} s: {self.what}"


class RecordedCheck:
    """Follows a recording with the messages of a stream, each compared with the recorded one.

    ``exact``: every message, bit for bit and in order. Else scans and writes alone, by what they latched no longer but
    by what they read and wrote: a rack on the wall clock measures execution times, and sends further states to others.
    """

    def __init__(self, reader: BagReader, origin: int, *, exact: bool) -> None:
        self._records: Iterator[RawMessage] = reader.records()
        self._origin, self.exact = origin, exact
        self._waiting: dict[str, deque[RawMessage]] = {}
        self.compared = 0
        self.deviation: Deviation | None = None
        self._on = True

    def sink(self, topic: Topic) -> Take:
        """Return what compares the messages of a topic."""
        name, type_name = topic.name, topic.type_name

        def take(stamp: int, payload: bytes) -> None:
            if self._on and self.deviation is None:
                self._take(name, type_name, stamp, payload)

        return take

    def stop(self) -> None:
        """Compare no more."""
        self._on = False

    def loosen(self) -> None:
        """From now on compare scans and writes by their contents: the stream repeats states and whole latches."""
        self.exact = False

    def _take(self, name: str, type_name: str, stamp: int, payload: bytes) -> None:
        if self.exact:
            record = next(self._records, None)
            if record is None:
                self._deviate(stamp, f"{_ENDED}, and {_words(_decoded(type_name, payload))} comes")
            elif (record.channel.topic, record.publish_time, record.data) != (name, stamp, payload):
                self._deviate(min(stamp, record.publish_time), _apart(_recorded(record), _decoded(type_name, payload)))
            else:
                self.compared += 1
            return
        if type_name not in (_SCAN, _WRITE) or _is_repeated(type_name, payload):
            return
        record = self._next(name)
        if record is None:
            lacks = f"the next {_MOST_WAITING} recorded messages are of other topics" if self._full else _ENDED
            self._deviate(stamp, f"{lacks}, and {_words(_decoded(type_name, payload))} comes")
        elif record.data != payload:
            self._compare_contents(stamp, _recorded(record), _decoded(type_name, payload))
        else:
            self.compared += 1

    def _compare_contents(self, stamp: int, recorded: Message | None, here: Message | None) -> None:
        if _contents(recorded) == _contents(here):
            self.compared += 1
        else:
            self._deviate(stamp, _apart(recorded, here, _contents))

    @property
    def _full(self) -> bool:
        return sum(map(len, self._waiting.values())) >= _MOST_WAITING

    def _next(self, name: str) -> RawMessage | None:
        """Return the next recorded message of a topic; None at the end, and where too many of others come before it."""
        queue = self._waiting.setdefault(name, deque())
        while not queue:
            record = None if self._full else next(self._records, None)
            if record is None:
                return None
            kind = record.schema.name if record.schema else ""
            if kind in (_SCAN, _WRITE) and not _is_repeated(kind, record.data):
                self._waiting.setdefault(record.channel.topic, deque()).append(record)
        return queue.popleft()

    def _deviate(self, stamp: int, what: str) -> None:
        self.deviation = Deviation(stamp - self._origin, what)


def _is_repeated(type_name: str, payload: bytes) -> bool:
    """Return whether a write only repeats what is forced, as it does after each image."""
    if type_name != _WRITE:
        return False
    message = _decoded(type_name, payload)
    return isinstance(message, CommonWrite) and message.writer == PRESET_WRITER and message.kind == WriteKind.FORCE


def _contents(message: Message | None) -> Message | None:
    """Return a scan or a write without what depends on the host, or on when a recorder joined."""
    if isinstance(message, Scan):
        return message._replace(duration_ns=0, skipped=0, full=False, latched=NO_VALUES)
    return message._replace(sequence=0, run_id=0) if isinstance(message, CommonWrite) else message


def _decoded(type_name: str, payload: bytes) -> Message | None:
    try:
        return decode(type_name, payload)
    except (CdrError, KeyError):
        return None


def _recorded(record: RawMessage) -> Message | None:
    return _decoded(record.schema.name if record.schema else "", record.data)


def _apart(
    recorded: Message | None, here: Message | None, part: Callable[[Message | None], Message | None] = lambda it: it
) -> str:
    """Return in words how a message differs from the recorded one: it is another one, or its first field that differs.

    ``part`` gives the part of a message that counts.
    """
    words = _words(here)
    if type(recorded) is not type(here) or _words(recorded) != words:
        return f"recorded is {_words(recorded)}, here comes {words}"
    fields = getattr(here, "_fields", ())
    for field, before, now in zip(fields, part(recorded) or (), part(here) or (), strict=True):
        if repr(before) != repr(now):  # NaN has one repr
            numbers = f" {before} is recorded, here it is {now}" if isinstance(now, int | float) else " differs"
            return f"{words}: {field}{numbers}"
    return f"{words} comes at another instant than in the recording"


def _words(message: Message | None) -> str:
    """Return in words what a message is."""
    if message is None:
        return "a message that cannot be read"
    if isinstance(message, Scan):
        return f"scan {message.scan} of task {message.task}"
    if isinstance(message, TaskState):
        return f"the state of task {message.task} after scan {message.scan}"
    if isinstance(message, Operation):
        return f"the operation {message.what} {message.task}".rstrip()
    if isinstance(message, CommonWrite):
        return f"write {message.sequence} of writer {message.writer}"
    if isinstance(message, PlantState | RollState):
        return f"the {type(message).__name__} of {message.plant}"
    if isinstance(message, WebState):
        return f"the WebState of {message.web}"
    return f"a {type(message).__name__}"
