"""Contents of a recording's data files, for its repair: message counts, the order of messages, and provenance.

The provenance is found in the data files if metadata.yaml is lost.
"""

from __future__ import annotations

import contextlib
import functools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mcap.records import Attachment, Channel, Metadata, Schema

from automax_ros.core.yaml_text import YamlFault, read_data
from automax_ros.messages.cdr.cdr import CdrError, decode, decoder
from automax_ros.messages.cdr.message_headers import scan_head, write_head
from automax_ros.messages.types.rack_files import RACK_FILE, RackFile, fingerprint
from automax_ros.recordings.mcap.channels import is_known
from automax_ros.recordings.mcap.metadata import FileSummary, TopicSummary
from automax_ros.recordings.read.information import custom_data_of, recorded_information
from automax_ros.recordings.read.tally import Tally

_MAX_FILES = 200
_MAX_BYTES = 16 << 20


class Provenance:
    """Collects provenance from the files of a recording, and returns it as ``custom_data`` for metadata.yaml."""

    def __init__(self) -> None:
        self._recorded: dict[str, str] = {}
        self._files: dict[str, RackFile] = {}
        self._bytes = 0

    def take(self, record: Attachment | Metadata) -> None:
        """Read an attachment or metadata record of a data file."""
        if isinstance(record, Metadata):
            information = None if self._recorded else recorded_information(record)
            if information is not None:
                self.take_information(information)
        elif record.name not in self._files and (record.name == RACK_FILE or record.name.endswith((".BLK", ".BAS"))):
            self._bytes += len(record.data)
            if self._bytes <= _MAX_BYTES and len(self._files) < _MAX_FILES:
                self._files[record.name] = RackFile(record.name, record.data.decode("utf-8", "replace"))

    def take_information(self, information: Mapping[str, Any]) -> None:
        """Read the contents of a readable metadata.yaml, or of its copy in a data file."""
        self._recorded = custom_data_of(information) or self._recorded

    def custom_data(self, rack: str) -> dict[str, str]:
        """Return the custom data that were read, else those that follow from the files and the rack's name."""
        if self._recorded or not rack:
            return dict(self._recorded)
        return {"rack": rack, "fingerprint": f"{fingerprint(list(self._files.values())):016x}"}


SCAN, WRITE, TABLE = (f"automax_msgs/msg/{name}" for name in ("Scan", "CommonWrite", "VariableTable"))
_MAX_QOS_TEXT = 1 << 14
_MAX_QOS = 100
_MOST_RUNS = 1000


class FileSequence:
    """Checks the order of messages in a recording of ours: log times and numbers of writes increase."""

    def __init__(self) -> None:
        """Create the check, before the first message."""
        self._last_log = -1
        self._writes: dict[int, int] = {}

    def fault(self, log_time: int, type_name: str, payload: bytes) -> str:
        """Return why a message does not follow those before it; empty if it does, and then the next must follow it."""
        if log_time <= self._last_log:
            return "log times that go backwards" if log_time < self._last_log else "log times that are repeated"
        if type_name == WRITE:
            with contextlib.suppress(CdrError):
                head = write_head(payload)
                if head.sequence <= self._writes.get(head.run_id, -1):
                    return "numbers of writes that go backwards or are repeated"
                if head.run_id in self._writes or len(self._writes) < _MOST_RUNS:
                    self._writes[head.run_id] = head.sequence
        self._last_log = log_time
        return ""


@dataclass
class FileContents(Tally):
    """Contents of one file; ``began`` is the stamp of its first message."""

    name: str
    scans: int = 0
    began: int = 0
    run_start: int | None = None
    """The stamp in the first VariableTable: the start of the run."""
    rack: str = ""
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    _decoders: dict[int, Callable[[bytes], object] | None] = field(default_factory=dict)

    def type_of(self, channel: int) -> str:
        """Return the type name of a channel's messages, empty if it is unknown."""
        known = self.channels.get(channel)
        schema = self.schemas.get(known.schema_id) if known else None
        return schema.name if schema else ""

    def fault(self, channel: int, payload: bytes) -> str:
        """Return why a message is malformed; empty if it is not, or if its type is unknown here."""
        if channel not in self._decoders:
            known = self.channels.get(channel)
            schema = self.schemas.get(known.schema_id) if known and known.message_encoding == "cdr" else None
            self._decoders[channel] = decoder(schema.name) if schema and is_known(schema) else None
        decode_message = self._decoders[channel]
        try:
            if decode_message is not None:
                decode_message(payload)
            elif self.type_of(channel) == SCAN:
                scan_head(payload)  # readers parse it so, whatever its definition says
        except CdrError as error:
            return str(error)
        return ""

    def count(self, channel: int, log_time: int, stamp: int, payload: bytes) -> None:
        """Count a message."""
        kind = self.type_of(channel)
        if not self.messages:
            self.began = stamp
        self.add(self.channels[channel].topic, kind, log_time, stamp)
        if kind == SCAN:
            self.scans += 1
        elif kind == TABLE and self.run_start is None:
            with contextlib.suppress(CdrError):
                table: Any = decode(TABLE, payload)
                self.run_start, self.rack = table.stamp, table.rack

    def summary(self) -> FileSummary:
        """Return the file's line in metadata.yaml."""
        return FileSummary(self.name, self.first_log, self.last_log - self.first_log, self.messages)


def topics_of(files: Sequence[FileContents]) -> list[TopicSummary]:
    """Return the topics of a recording's files, each with its number of messages in all files."""
    found: dict[str, TopicSummary] = {}
    counts: Counter[str] = Counter()
    for file in files:
        counts.update({topic: item.messages for topic, item in file.topics.items()})
    for file in files:
        for number, channel in file.channels.items():
            before = found.get(channel.topic)
            metadata = channel.metadata
            found[channel.topic] = TopicSummary(
                channel.topic,
                file.type_of(number),
                metadata.get("topic_type_hash", ""),
                before.qos if before else _qos(metadata.get("offered_qos_profiles", "")),
                counts[channel.topic],
            )
    return list(found.values())


@functools.lru_cache(maxsize=64)
def _qos(text: str) -> list[dict[str, object]]:
    """Return the QoS profiles in a channel's YAML text, without those of another form."""
    profiles: Any = None
    if len(text) <= _MAX_QOS_TEXT:
        with contextlib.suppress(YamlFault):
            profiles = read_data(text, typed=True)
    if not isinstance(profiles, list):
        return []
    return [item for item in profiles[:_MAX_QOS] if isinstance(item, dict) and all(map(_is_policy, item.items()))]


def _is_policy(item: tuple[object, object]) -> bool:
    key, value = item
    if isinstance(value, dict):
        return isinstance(key, str) and all(isinstance(part, (str, int)) for pair in value.items() for part in pair)
    return isinstance(key, str) and isinstance(value, (str, int))
