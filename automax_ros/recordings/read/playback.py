"""The playable part of a recording, ours or another program's: its topics, its time span, its messages as bytes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

from mcap.records import Channel, Schema

from automax_ros.messages.cdr.cdr import CdrError, decode, encode
from automax_ros.messages.types.definitions import message_types
from automax_ros.messages.types.messages import VariableTable
from automax_ros.messages.types.topics import QosProfile
from automax_ros.recordings.mcap.channels import is_known, recorded_qos
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_file import RawMessage
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.tally import Tally

TABLE_TYPE = "automax_msgs/msg/VariableTable"
MAX_LATCHED_BYTES = 256 << 20
"""Most bytes of latched messages that playback keeps, to send before all others (decision: a bound on memory)."""
_MAX_TOPICS = 10_000
_MAX_TOPIC = 247
_PROGRESS_MASK = 0x3FF


@dataclass
class PlayTopic:
    """One topic of a recording; ``fault`` says why it cannot be played, empty if it can."""

    name: str
    type_name: str
    type_hash: str
    qos: QosProfile
    fault: str = ""

    @property
    def is_latched(self) -> bool:
        """Whether the last message is kept for late joiners."""
        return self.qos.durability == "transient_local"


@dataclass
class PlayableRecording:
    """A recording that was read once from end to end without an error.

    Times are log times in ns. ``run_start`` is the stamp of the first VariableTable, the time of the first message
    where there is none; ``spaces`` are the namespaces of the racks in it. ``latched`` are the last messages of latched
    topics before the span. ``counts`` are all messages.
    """

    bag: BagReader
    counts: Tally = field(default_factory=Tally)
    topics: dict[str, PlayTopic] = field(default_factory=dict)
    spaces: list[str] = field(default_factory=list)
    latched: dict[str, RawMessage] = field(default_factory=dict)
    run_start: int | None = None
    first: int = 0
    last: int = 0
    begin: int = 0
    end: int = 0

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages of the span that can be played, in the order of the files.

        Raises:
            BagError: the recording has changed since and is damaged now.
        """
        for record in self.bag.records():
            topic = self.topics.get(record.channel.topic)
            if self.begin <= record.log_time <= self.end and topic is not None and not topic.fault:
                yield record


def survey(
    path: Path,
    begin_ns: int | None = None,
    end_ns: int | None = None,
    on_progress: Callable[[float], None] = lambda _: None,
    stopping: Callable[[], bool] = lambda: False,
) -> PlayableRecording:
    """Read a recording; ``begin_ns`` and ``end_ns`` count from the start of the run, None for all.

    ``stopping`` is called from time to time; if it returns TRUE the survey ends early and its result is unusable.

    Raises:
        BagError: it is not a recording, is damaged, or is empty in the span.
    """
    found = PlayableRecording(BagReader(path))
    found.bag.on_progress = on_progress
    for number, record in enumerate(found.bag.records()):
        if not number & _PROGRESS_MASK and stopping():
            return found
        topic = _topic(found, path, record)
        found.counts.add(topic.name, topic.type_name, record.log_time, record.publish_time)
        if topic.type_name == TABLE_TYPE and not topic.fault:
            _take_table(found, path, record)
    found.bag.on_progress = None
    if not found.counts.messages:
        raise BagError("AMX6840", path, "holds no message")
    found.first, found.last = found.counts.first_log, found.counts.last_log
    start = found.run_start if found.run_start is not None else found.first
    found.run_start = start
    found.begin = start + (begin_ns or 0)
    found.end = found.last if end_ns is None else start + end_ns
    if found.begin > found.last or found.end < found.first or found.end < found.begin:
        raise BagError(
            "AMX6825",
            path,
            "holds no message in the span that is asked for",
            f"it lasts from {(found.first - start) / 1e9:.3f} to {(found.last - start) / 1e9:.3f} s of the run",
        )
    if found.begin > found.first:
        _keep_latched(found, path, stopping)
    found.begin, found.end = max(found.begin, found.first), min(found.end, found.last)
    return found


def _keep_latched(found: PlayableRecording, path: Path, stopping: Callable[[], bool]) -> None:
    """Keep the last message of each latched topic before the span: late joiners of the run received it, too."""
    size = 0
    for number, record in enumerate(found.bag.records()):
        if not number & _PROGRESS_MASK and stopping():
            return
        topic = found.topics[record.channel.topic]
        if not topic.is_latched or record.log_time >= found.begin:
            continue
        before = found.latched.get(topic.name)
        size += len(record.data) - (len(before.data) if before else 0)
        if size > MAX_LATCHED_BYTES:
            raise BagError("AMX6814", path, f"more than {MAX_LATCHED_BYTES} bytes on latched topics before the span")
        found.latched[topic.name] = record


def choose(found: PlayableRecording, patterns: Collection[str]) -> list[str]:
    """Keep only the topics that match a pattern, such as ``/pm1/common/*``; return patterns that match none."""
    unused = [pattern for pattern in patterns if not any(fnmatchcase(name, pattern) for name in found.topics)]
    for name in list(found.topics):
        if not any(fnmatchcase(name, pattern) for pattern in patterns):
            found.topics[name].fault = found.topics[name].fault or NOT_CHOSEN
    return unused


NOT_CHOSEN = "not chosen"
"""The fault of a topic that was not requested."""


class Renaming:
    """Moves topics to another namespace, which replaces that of a rack; all other topics are placed below it."""

    def __init__(self, spaces: Collection[str], target: str | None) -> None:
        """Create a renaming of the racks' namespaces to a new one, both with their slash; None changes nothing."""
        self._spaces, self._target = sorted(spaces, key=len, reverse=True), target

    def space(self, space: str) -> str:
        """Return the new namespace of a rack."""
        if self._target is None:
            return space
        return self._target if len(self._spaces) == 1 else self._target + space

    def topic(self, name: str) -> str:
        """Return the new name of a topic."""
        if self._target is None:
            return name
        for space in self._spaces:
            if name.startswith(f"{space}/"):
                return self.space(space) + name[len(space) :]
        return self._target + name

    def payload(self, type_name: str, data: bytes) -> bytes:
        """Return a message adapted to the new names: a VariableTable contains names of topics."""
        if self._target is None or type_name != TABLE_TYPE:
            return data
        table = decode(TABLE_TYPE, data)
        assert isinstance(table, VariableTable)
        variables = [item._replace(topic=self.topic(item.topic) if item.topic else "") for item in table.variables]
        return encode(table._replace(variables=variables))


def _topic(found: PlayableRecording, path: Path, record: RawMessage) -> PlayTopic:
    name = record.channel.topic
    topic = found.topics.get(name)
    if topic is None:
        if len(found.topics) >= _MAX_TOPICS or len(name) > _MAX_TOPIC:
            raise BagError(
                "AMX6814", path, f"more than {_MAX_TOPICS} topics, or one with a name of {len(name)} characters"
            )
        topic = found.topics[name] = _new_topic(record.channel, record.schema)
    return topic


def _new_topic(channel: Channel, schema: Schema | None) -> PlayTopic:
    type_name = schema.name if schema else ""
    topic = PlayTopic(
        channel.topic,
        type_name,
        channel.metadata.get("topic_type_hash", ""),
        recorded_qos(channel.metadata.get("offered_qos_profiles", "")),
    )
    if channel.message_encoding != "cdr":
        topic.fault = f"its messages are in {channel.message_encoding[:40]!r}, not in CDR"
    elif schema is None or len(type_name) > _MAX_TOPIC:
        topic.fault = "its type is unknown"
    elif type_name in message_types() and not is_known(schema):
        topic.fault = f"{type_name} was recorded with another definition"
    return topic


def _take_table(found: PlayableRecording, path: Path, record: RawMessage) -> None:
    try:
        table = decode(TABLE_TYPE, record.data)
    except CdrError as error:
        raise BagError("AMX6816", path, f"the table of variables is malformed: {error}") from error
    assert isinstance(table, VariableTable)
    space = record.channel.topic.removesuffix("/variables")
    if space not in found.spaces and record.channel.topic.endswith("/variables"):
        found.spaces.append(space)
    if found.run_start is None:
        found.run_start = table.stamp
