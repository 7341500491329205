"""Reads recordings: rosbag2 folders with mcap files, and single .mcap files, those of other programs too.

Messages are returned in the order in which they were sent. `ros2 bag record` stores them topic by topic in the order
in which it reads the topics, latched ones in the order of discovery. A rack sends from one thread, so the times of
sending give the order; in our own recordings that is the order of the file.
"""

from __future__ import annotations

import copy
import heapq
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from mcap.records import Attachment, Channel, Metadata, Schema

from automax_ros.core.text import printable
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import CdrError, Message, decoder
from automax_ros.recordings.mcap.channels import require_known
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_file import McapFile, RawMessage
from automax_ros.recordings.mcap.opening import no_recording, size_of
from automax_ros.recordings.read.information import custom_data_of, data_files, read_information, recorded_information

HOLD_NS = NS_PER_S
"""A message is held until one is read that was sent this much later (decision)."""
MOST_HELD = 20_000
MOST_HELD_BYTES = 64 << 20
"""Most messages and most bytes that are held (decision)."""

Source = TypeVar("Source")
Decode = Callable[[bytes], Message]
"""Returns the message in some bytes; raises CdrError."""


def in_sent_order(records: Iterator[tuple[Source, RawMessage]]) -> Iterator[tuple[Source, RawMessage]]:
    """Yield the messages by their times of sending; those of one time in the order of the file.

    Raises:
        BagError: ``records`` has raised it; all messages before have been yielded.
    """
    waiting: list[tuple[int, int, Source, RawMessage]] = []
    held = newest = 0
    failure: BagError | None = None
    try:
        for number, (source, taken) in enumerate(records):
            heapq.heappush(waiting, (taken.publish_time, number, source, taken))
            held += len(taken.data)
            newest = max(newest, taken.publish_time)
            while waiting and (waiting[0][0] <= newest - HOLD_NS or len(waiting) > MOST_HELD or held > MOST_HELD_BYTES):
                *_, its_source, record = heapq.heappop(waiting)
                held -= len(record.data)
                yield its_source, record
    except BagError as error:  # messages read before the damage are yielded first
        failure = error
    while waiting:
        *_, its_source, record = heapq.heappop(waiting)
        yield its_source, record
    if failure is not None:
        raise failure


ORDER_HINT = "`automax bag repair` leaves out what does not follow on what stands before it"
_PROGRESS_MASK = 0x3FF
"""Progress is reported once per this many records."""


class BagMessage(NamedTuple):
    """One message of a recording; times in nanoseconds.

    ``stamp`` is the time of sending, ``log_time`` that of the log, which is unique in our own recordings.
    """

    topic: str
    type_name: str
    stamp: int
    log_time: int
    message: Message


class Place(NamedTuple):
    """A place in a recording, between two chunks: number of the file, bytes in it, and the file as read so far."""

    file: int
    position: int
    data: McapFile


class BagReader:
    """A recording: a rosbag2 folder or one .mcap file. It may be read any number of times, always as a stream.

    ``on_progress``, if set, is called from time to time while messages are read, with the share of all bytes that has
    been read (0 to 1).
    ``order`` checks the files' times while messages are read; a part of a recording continues that of the part before.
    ``last_stamp`` is the stamp of the message read last, returned or not; None before the first.

    Raises:
        BagError: there is no recording at the path, or its metadata.yaml cannot be used.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._information: dict[str, Any] | None = None
        self.on_progress: Callable[[float], None] | None = None
        self.last_stamp: int | None = None
        self.order: FileOrder | None = None
        self._after: FileOrder | None = None
        self._reading: tuple[int, McapFile] | None = None
        if path.is_dir():
            self._information = read_information(path)
            self.files = data_files(path, self._information)
        elif path.is_file():
            self.files = [path]
        else:
            raise no_recording(path)

    def part(self, first: int, end: int, after: BagReader | None = None) -> BagReader:
        """Return a reader of the files from number ``first`` to before ``end``, counted from 0.

        ``after`` is a reader that has read the files before: the order in time is checked over both.
        """
        other = self.again()
        other.files = self.files[first:end]
        other._after = after.order if after is not None else None
        return other

    def again(self) -> BagReader:
        """Return a reader of the same recording that does not report its progress."""
        other = copy.copy(self)
        other.on_progress = other.last_stamp = other.order = other._after = other._reading = None
        return other

    @property
    def place(self) -> Place | None:
        """The place after the chunk of the message read last; None where messages are not in the order of the file."""
        if self._reading is None or not self.is_ours:
            return None
        number, data = self._reading
        return Place(number, data.position, data)

    @cached_property
    def custom_data(self) -> dict[str, str]:
        """The recorder's custom data in metadata.yaml, or in the copy of it in a single file; empty without any."""
        return custom_data_of(self._told)

    @cached_property
    def topics(self) -> dict[str, str]:
        """The types of the topics that have messages, as metadata.yaml or the copy of it in a single file has them."""
        entries = self._told.get("topics_with_message_count")
        found: dict[str, str] = {}
        for entry in entries if isinstance(entries, list) else ():
            topic = entry.get("topic_metadata") if isinstance(entry, dict) else None
            if isinstance(topic, dict) and str(entry.get("message_count")) != "0":
                found[str(topic.get("name"))] = str(topic.get("type"))
        return found

    @cached_property
    def _told(self) -> dict[str, Any]:
        """The content of metadata.yaml, or of the copy of it in a single file; empty without any."""
        if self._information is not None:
            return self._information
        try:
            return next(filter(None, map(recorded_information, self.metadata_records())), {})
        except BagError:  # raised again when the messages are read
            return {}

    @cached_property
    def is_ours(self) -> bool:
        """Whether our recorder made the recording: then the order of the file is the order of sending."""
        return "version" in self.custom_data

    def messages(
        self,
        *,
        topics: Collection[str] | None = None,
        types: Collection[str] | None = None,
        after: Place | None = None,
        decoders: Mapping[str, Decode] | None = None,
    ) -> Iterator[BagMessage]:
        """Yield the decoded messages in the order of sending, of all topics and types or only of those given.

        ``after`` is a ``place`` of an earlier reading: the messages after it are read alone. ``decoders`` decode
        messages of some types in another way, such as in parts.

        Raises:
            BagError: the recording is truncated, damaged or beyond the limits, its files do not follow each other in
                time, or a message to be returned has an unknown type or one that was recorded with another definition.
        """
        records = self._read_with_sources(after)
        for source, record in records if self.is_ours else in_sent_order(records):
            self.last_stamp = record.publish_time
            channel = source.channel(record, types, topics, decoders)
            if channel.wanted:
                yield channel.decoded(record)

    def records(self) -> Iterator[RawMessage]:
        """Yield the messages as stored in the files.

        Raises:
            BagError: the recording is truncated, damaged or beyond the limits, or its files overlap in time.
        """
        return (record for _, record in self._read_with_sources())

    def _read_with_sources(self, after: Place | None = None) -> Iterator[tuple[DataSource, RawMessage]]:
        """Yield the messages as stored in the files, each with its file."""
        total = sum(size_of(file) for file in self.files)
        before = 0
        order = self.new_order()
        for index, file in enumerate(self.files):
            if after is not None and index < after.file:
                continue
            source = DataSource(file)
            last_log: int | None = None
            data = McapFile(file) if after is None or index > after.file else after.data.after(after.position)
            self._reading = index, data
            for number, record in enumerate(data.records()):
                if not number & _PROGRESS_MASK and self.on_progress is not None:
                    self.on_progress(min(1.0, (before + data.position) / total))
                if not isinstance(record, RawMessage):
                    continue
                if last_log is None:
                    order.begin(file, record.log_time)
                elif record.log_time <= last_log and self.is_ours:
                    raise goes_backwards(file, record.log_time, last_log)
                last_log = record.log_time
                yield source, record
            before += data.position
            order.end(last_log)

    def new_order(self) -> FileOrder:
        """Return a new ``order``, which continues that of the files before if there are any."""
        self.order = copy.copy(self._after) or FileOrder(0 if self.is_ours else HOLD_NS)
        return self.order

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files stored in the recording; messages are not unpacked.

        Raises:
            BagError: the recording is truncated, damaged or beyond the limits.
        """
        return (record for record in self._beside_messages() if isinstance(record, Attachment))

    def metadata_records(self) -> Iterator[Metadata]:
        """Yield the metadata records of the mcap files.

        Raises:
            BagError: the recording is truncated, damaged or beyond the limits.
        """
        return (record for record in self._beside_messages() if isinstance(record, Metadata))

    def _beside_messages(self) -> Iterator[object]:
        for file in self.files:
            yield from McapFile(file).records(messages=False)


def goes_backwards(file: Path, log_time: int, before: int) -> BagError:
    """Return the error for a message of a recording of ours that is not later than the previous one."""
    if log_time == before:
        text = f"two messages have the log time {log_time} ns; in a recording of ours each has its own"
    else:
        text = f"log times go backwards: {log_time} ns after {before} ns"
    return BagError("AMX6813", file, text, ORDER_HINT)


class FileOrder:
    """Checks that the files of a recording follow each other in time, as they must to be read as one stream."""

    def __init__(self, slack_ns: int) -> None:
        """Create the check; a file may begin ``slack_ns`` before the end of the previous one."""
        self._slack_ns = slack_ns
        self._name = ""
        self._first = self._last = 0

    def begin(self, file: Path, log_time: int) -> None:
        """Set the log time of a file's first message.

        Raises:
            BagError: the previous file ends later.
        """
        if self._name and log_time < self._last - self._slack_ns + (not self._slack_ns):
            if log_time < self._first:
                text = f"is out of order: its messages begin before those of {self._name}, which is listed before it"
                hint = "`automax bag repair` writes a metadata.yaml that lists the files in the order of their times"
            else:
                text = f"overlaps {self._name}, the file before it: its messages begin before that one ends"
                hint = "read each file by its own name"
            raise BagError("AMX6813", file, text, hint)
        self._name, self._first = printable(file.name[:80]), log_time

    def end(self, log_time: int | None) -> None:
        """Set the log time of the last message of that file; None if it has none."""
        if log_time is not None:
            self._last = log_time


class DataSource:
    """One file of a recording, with the readers of its channels by channel number."""

    __slots__ = ("channels", "path")

    def __init__(self, path: Path) -> None:
        self.path = path
        self.channels: dict[int, ChannelReader] = {}

    def channel(
        self,
        record: RawMessage,
        types: Collection[str] | None,
        topics: Collection[str] | None = None,
        decoders: Mapping[str, Decode] | None = None,
    ) -> ChannelReader:
        """Return the reader of a message's channel; it is created at the channel's first message.

        Raises:
            BagError: messages of the channel are requested and cannot be read.
        """
        channel = self.channels.get(record.channel.id)
        if channel is None:
            type_name = record.schema.name if record.schema else ""
            wanted = (topics is None or record.channel.topic in topics) and (types is None or type_name in types)
            channel = self.channels[record.channel.id] = ChannelReader(
                self.path, record.channel, record.schema, wanted, (decoders or {}).get(type_name)
            )
        return channel


class ChannelReader:
    """Decodes the messages of one channel of one file."""

    def __init__(
        self, file: Path, channel: Channel, schema: Schema | None, wanted: bool, decode: Decode | None = None
    ) -> None:
        self.topic = channel.topic
        self.type_name = schema.name if schema else ""
        self.wanted = wanted
        self._file = file
        self._decode: Decode | None = None
        if wanted:
            if channel.message_encoding != "cdr":
                text = f"the messages of {channel.topic[:247]} are in {channel.message_encoding[:40]!r}, not in CDR"
                raise BagError("AMX6811", file, text)
            require_known(file, channel.topic, schema)
            self._decode = decode or decoder(self.type_name)

    def decoded(self, record: RawMessage) -> BagMessage:
        """Return a record of this channel with its decoded message.

        Raises:
            BagError: the message is malformed.
        """
        message = self.message(record.data, record.log_time)
        return BagMessage(self.topic, self.type_name, record.publish_time, record.log_time, message)

    def message(self, payload: bytes, log_time: int) -> Message:
        """Return a decoded message of this channel.

        Raises:
            BagError: the message is malformed.
        """
        assert self._decode is not None
        try:
            return self._decode(payload)
        except CdrError as error:
            raise BagError(
                "AMX6816",
                self._file,
                f"the message on {self.topic[:247]} at {log_time} ns is malformed: {error}",
                "`automax bag repair` leaves such messages out",
            ) from error
