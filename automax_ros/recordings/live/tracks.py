"""Messages of a live recording in the order of sending, its progress for each task, and gaps by lost messages."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any, Generic, Protocol, TypeVar

from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.messages.cdr.message_headers import ScanHead, StateHead, scan_head, state_head
from automax_ros.recordings.live.topics import LiveTopics
from automax_ros.recordings.write.writer import MAX_STAMP


class Stamped(Protocol):
    """A message, or its head, with the time for which it holds (ns)."""

    @property
    def stamp(self) -> int:
        """The time."""
        ...


_Stamped = TypeVar("_Stamped", bound=Stamped)


def possible(stamp: int) -> int:
    """Return a stamp.

    Raises:
        CdrError: it cannot be recorded; a message with it is left out, and the recording continues.
    """
    if not 0 <= stamp <= MAX_STAMP:
        raise CdrError(f"{stamp} ns is not the time of a message")
    return stamp


def timely(message: _Stamped) -> _Stamped:
    """Return a message, or its head, after checking that its stamp is ``possible``."""
    possible(message.stamp)
    return message


@dataclass(frozen=True)
class Gap:
    """Lost messages: their kind, how many (0 if unknown), and the stamp at which the loss was found."""

    stamp: int
    what: str
    missing: int

    def __str__(self) -> str:
        return f"{self.missing or 'some'} {self.what}"


@dataclass
class TaskProgress:
    """The recorded part of one task: number and stamp of its last scan, number of the last scan with a state.

    ``follows``: every scan since a full one is recorded. ``ready``: a state belongs to them, so they can be executed
    again. ``alone``: that is true for the present file of a split recording, too. ``early`` are its states that arrived
    before the scan that they follow, with their topic and time of sending.
    """

    last: int = -1
    stamp: int = -1
    state: int = -1
    follows: bool = False
    ready: bool = False
    alone: bool = False
    early: list[tuple[str, int, bytes]] = field(default_factory=list)

    def begin_file(self) -> None:
        """Wait for a state in a further file; scans continue."""
        self.state, self.alone = -1, False

    def rest(self) -> None:
        """Wait for a full scan and a state."""
        self.state, self.follows, self.ready, self.alone = -1, False, False, False

    def began_anew(self, scan: int, stamp: int, *, proven: bool = False) -> bool:
        """Whether a scan or state of this number and time belongs to a later run of the rack.

        If it is ``proven`` to be of this run, only the task was put into RUN again, and counts from 0.
        """
        again = scan < self.last and stamp > self.stamp
        if again and proven:
            self.last = -1
        return again and not proven

    def take_scan(self, scan: int, stamp: int) -> None:
        """Record a scan that is full or follows the last one."""
        self.follows = True
        self._join(self.state == scan - 1)
        self.last, self.stamp = scan, stamp

    def take_state(self, scan: int) -> None:
        """Record a state after a scan."""
        self.state = scan
        self._join(self.follows and scan == self.last)

    def _join(self, joined: bool) -> None:
        self.ready, self.alone = self.ready or joined, self.alone or joined


def task_head(topics: LiveTopics, topic: str, payload: bytes) -> ScanHead | StateHead | None:
    """Return the head of a scan or of a task's state; None for another or a malformed message."""
    try:
        if topic == topics.scans:
            return timely(scan_head(payload))
        return timely(state_head(payload)) if topic == topics.states else None
    except CdrError:
        return None


def has_written(payload: bytes, last_write: int) -> bool:
    """Whether a scan wrote common memory and its write must still follow; a pre-empted scan may have written before.

    ``last_write`` is the stamp of the last write received.
    """
    try:
        scan: Any = decode("automax_msgs/msg/Scan", payload)
    except CdrError:
        return False
    return bool(scan.committed.variable or (scan.written.variable and last_write <= scan.stamp))


Item = TypeVar("Item")
_SENT = itemgetter(0)


class SendOrder(Generic[Item]):
    """Sorts messages received on several topics into the order in which they were sent.

    A rack sends all its messages from one thread, each with the time of sending. A message is held until ``hold_ns``
    have passed on the local clock since one that was sent later was received.
    Times of sending are compared only with each other, and so are local times: the clocks may differ.
    """

    def __init__(self, hold_ns: int) -> None:
        self._hold_ns = hold_ns
        self._waiting: list[tuple[int, Item]] = []
        self._marks: deque[tuple[int, int]] = deque()
        self._newest = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, sent_ns: int, item: Item) -> None:
        """Add a message that was sent at a time of the sender's clock."""
        self._waiting.append((sent_ns, item))
        self._newest = max(self._newest, sent_ns)

    def due(self, now_ns: int) -> list[tuple[int, Item]]:
        """Return (time of sending, message) of the messages that need not be held longer, in order.

        ``now_ns`` is the local time at which the reading of the topics began that received the messages added last.
        """
        self._marks.append((now_ns, self._newest))
        mark = -1
        while self._marks and self._marks[0][0] <= now_ns - self._hold_ns:
            mark = self._marks.popleft()[1]
        if mark < 0 or not self._waiting:
            return []
        self._waiting.sort(key=_SENT)
        end = bisect_right(self._waiting, mark, key=_SENT)
        found, self._waiting = self._waiting[:end], self._waiting[end:]
        return found

    def rest(self) -> list[tuple[int, Item]]:
        """Return all held messages, in order."""
        found = sorted(self._waiting, key=_SENT)
        self._waiting = []
        return found
