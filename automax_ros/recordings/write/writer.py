"""Writes a recording: a folder with ``scans_0.mcap``, ... and ``metadata.yaml``, in the format of rosbag2.

The same messages give the same bytes: nothing depends on the folder's name, the host or the wall clock. A chunk ends
by size or after half a second, always between two instants. It is handed to the operating system while the next one is
filled, or earlier, so that a killed process loses a second at most and only whole instants.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Final

from mcap.records import Attachment, Metadata, Schema
from mcap.records import Channel as ChannelRecord

import automax_ros
from automax_ros.core.safe_file import sync_path
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.types.definitions import message_types, schema_text
from automax_ros.messages.types.topics import QosProfile
from automax_ros.recordings.mcap.errors import RecordingError
from automax_ros.recordings.mcap.mcap_output import ChunkBuilder, McapOutput
from automax_ros.recordings.mcap.metadata import (
    METADATA_FILE,
    BagMetadata,
    FileSummary,
    TopicSummary,
    data_file_name,
    qos_text,
    yaml_text,
)
from automax_ros.recordings.write.data_file import COMPRESSIONS, ChunkThread, DataFile, StorageOptions

AT_ONCE_BYTES: Final = 1 << 16
"""A chunk of up to this many bytes, uncompressed, is written in the calling thread where no clock is followed
(decision): it takes 0.1 ms, and handing it to a thread takes longer than that."""
CHUNK_BYTES: Final = 1 << 20
"""A chunk ends before the next instant if it has more bytes than this, uncompressed."""
LONGEST_CHUNK_BYTES: Final = 24 << 20
"""A chunk with more bytes than this ends even within an instant, so that every reader accepts it."""
MAX_PAYLOAD_BYTES = 32 << 20
"""Longest message and longest attachment that is written, in bytes (decision: our own reader is sure to accept it)."""
MAX_STAMP = (2**31 - 1) * NS_PER_S
"""Latest time of a message in nanoseconds: the seconds of a ROS time have 31 bits."""
_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_MAX_TOPIC = 247


def _always() -> bool:
    return True


class RecordedChannel:
    """One topic of a recording, created by :meth:`BagWriter.channel`. ``message_count`` counts over all files."""

    __slots__ = ("message_count", "number", "qos", "topic", "type_name")

    def __init__(self, number: int, topic: str, type_name: str, qos: QosProfile) -> None:
        self.number = number
        self.topic = topic
        self.type_name = type_name
        self.qos = qos
        self.message_count = 0


class BagWriter:
    """Writes a recording; a context manager that finishes the files at its end.

    ``custom_data`` is stored in the metadata (provenance: hashes of program and YAML file, version). ``keeps_pace``
    returns whether the caller follows a clock and must not wait for the compression of a chunk, however small.

    To begin a further file, the caller checks ``split_due`` between two instants (or has other reasons), calls
    ``split`` and repeats the facts without which that file could not be read alone.

    Raises:
        RecordingError: the folder exists already, or cannot be written.
    """

    def __init__(
        self,
        folder: Path,
        *,
        custom_data: Mapping[str, str] | None = None,
        options: StorageOptions | None = None,
        keeps_pace: Callable[[], bool] = _always,
    ) -> None:
        self.folder = folder
        self._keeps_pace = keeps_pace
        self.custom_data = dict(custom_data or {})
        self._options = options or StorageOptions()
        self._channels: dict[str, RecordedChannel] = {}
        self._definitions: list[Schema | ChannelRecord] = []
        self._schemas: dict[str, int] = {}
        self._attachments: list[Attachment] = []
        self._files: list[FileSummary] = []
        self._own_text = ""
        """The metadata that the last file contains of itself."""
        self._counts_before: dict[str, int] = {}
        self._last_time = -1
        self._stamp: int | None = None
        """Time of the previous message; None if the next one must be checked."""
        self._chunk_end = 0
        self._open = True
        self._chunks = ChunkThread()
        self._sync_error: OSError | None = None
        self._finished: list[Path] = []
        """Files, and the folder with their names, that ``sync`` has not written to the disk yet."""
        try:
            folder.mkdir(parents=True)
            self._begin_file()
        except FileExistsError:
            hint = "record into another folder, or move this one away"
            raise RecordingError("AMX6800", folder, "exists already, not overwriting", hint) from None
        except OSError as error:
            raise self._write_error(error) from error

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def count(self, topics: Collection[str]) -> int:
        """Return the number of messages of these topics."""
        return sum(channel.message_count for name, channel in self._channels.items() if name in topics)

    def channel(self, topic: str, type_name: str, qos: QosProfile) -> RecordedChannel:
        """Return the channel of a topic; the first call for a topic creates it.

        Raises:
            RecordingError: the topic is not a ROS name or has another type already, or the type is unknown.
        """
        channel = self._channels.get(topic)
        if channel is not None:
            if (channel.type_name, channel.qos) != (type_name, qos):
                raise self._refusal(f"topic {topic} holds {channel.type_name}, not {type_name}, or has another QoS")
            return channel
        if len(topic) > _MAX_TOPIC or not _TOPIC.fullmatch(topic):
            raise self._refusal(f"{topic!r} is not the full name of a ROS topic")
        kind = message_types().get(type_name)
        if kind is None:
            raise self._refusal(f"messages of type {type_name!r} cannot be recorded")
        schema = self._schemas.get(type_name)
        if schema is None:
            schema = self._schemas[type_name] = len(self._schemas) + 1
            self._define(Schema(id=schema, data=schema_text(type_name).encode(), encoding="ros2msg", name=type_name))
        metadata = {"offered_qos_profiles": qos_text(qos), "topic_type_hash": kind.hash}
        number = len(self._channels) + 1
        self._define(ChannelRecord(id=number, topic=topic, message_encoding="cdr", metadata=metadata, schema_id=schema))
        channel = self._channels[topic] = RecordedChannel(number, topic, type_name, qos)
        return channel

    def write(self, channel: RecordedChannel, stamp: int, payload: bytes) -> None:
        """Add a message (CDR bytes) at a time in nanoseconds; messages of one time belong to one instant.

        Its log time is the stamp, or one nanosecond after the previous message if that is later: log times increase.

        Raises:
            RecordingError: time or length out of range, writer closed, or the disk cannot be written.
        """
        if stamp != self._stamp:
            self._begin_instant(channel, stamp, payload)
        log_time = self._last_time + 1
        if stamp > log_time or not log_time:
            log_time = stamp
        chunk = self._chunk
        if len(payload) + chunk.size > LONGEST_CHUNK_BYTES:
            if len(payload) > MAX_PAYLOAD_BYTES:
                raise self._bad_message(channel, stamp, payload)
            self.flush()
            chunk = self._chunk
        channel.message_count = count = channel.message_count + 1
        chunk.add_message(channel.number, count & 0xFFFFFFFF, log_time, stamp, payload)
        self._last_time = log_time

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Store a file that belongs to the recording, such as the rack's YAML or a task's source; in each data file.

        It replaces a former one of the same name in later data files.

        Raises:
            RecordingError: the file is too long, the writer is closed, or the disk cannot be written.
        """
        if not self._open or len(data) > MAX_PAYLOAD_BYTES:
            raise self._refusal(
                f"attachment {name} of {len(data)} bytes: the limit is {MAX_PAYLOAD_BYTES}, before close()"
            )
        attachment = Attachment(
            create_time=0, log_time=max(self._last_time, 0), name=name, media_type=media_type, data=data
        )
        self._attachments = [*(item for item in self._attachments if item.name != name), attachment]
        try:
            self._chunks.settle()
            self._mcap.add_attachment(attachment)
        except OSError as error:
            raise self._failure_error(error) from error

    @property
    def split_due(self) -> bool:
        """Whether the file has reached the size at which the next one begins; the open chunk does not count."""
        return 0 < self._options.split_bytes <= self._file.tell()

    def split(self) -> None:
        """Finish the file and begin the next one, with the same attachments and channels; between two instants only.

        Raises:
            RecordingError: the writer is closed, or the disk cannot be written.
        """
        if not self._open:
            raise self._refusal("a new file after the recording was closed")
        try:
            self._finish_file()
            self._begin_file()
        except OSError as error:
            raise self._failure_error(error) from error

    def flush(self, now: int | None = None) -> None:
        """Hand the open chunk to the operating system; with a time, only if the chunk's own time has passed by then.

        Without a time this is done on return, else soon after, and the next call raises an error of the disk.

        Raises:
            RecordingError: the disk cannot be written.
        """
        if self._open and (now is None or now >= self._chunk_end or self._chunks.failed):
            self._flush(wait=now is None)

    def sync(self) -> None:
        """Wait until flushed data are on the disk; may be called from another thread, since it may take long.

        An error of the disk is raised by the next ``write``, ``close`` or ``require_synced``.
        """
        try:
            self._chunks.settle()
            while self._finished:
                sync_path(self._finished.pop())
            self._file.sync()
        except OSError as error:
            self._sync_error = error

    def require_synced(self) -> None:
        """Check that no ``sync`` has failed.

        Raises:
            RecordingError: a ``sync`` has failed.
        """
        if self._sync_error is not None:
            raise self._failure_error(self._sync_error)

    def close(self) -> None:
        """Finish the files. After a failed write only data already on the disk are kept.

        Raises:
            RecordingError: the disk cannot be written, or a ``sync`` failed; in that case the files are finished.
        """
        if not self._open:
            return
        self._open, self._stamp = False, None
        try:
            self._finish_file()
            self._chunks.end()
            text = self._metadata(self._files).document(self._own_text if len(self._files) == 1 else None)
            (self.folder / METADATA_FILE).write_text(text, encoding="utf-8", newline="\n")
            self._finished += [self.folder / METADATA_FILE, self.folder]
        except OSError as error:
            raise self._failure_error(error) from error
        self.require_synced()

    def _begin_file(self) -> None:
        self._file = DataFile(self.folder / data_file_name(len(self._files)))
        self._finished.append(self.folder)
        self._mcap = McapOutput(
            self._file,
            library=f"automax_ros {automax_ros.__version__}",
            compression=COMPRESSIONS[self._options.compression],
        )
        for attachment in self._attachments:
            self._mcap.add_attachment(attachment)
        self._chunk = ChunkBuilder()
        self._counts_before = {topic: channel.message_count for topic, channel in self._channels.items()}
        definitions, self._definitions = self._definitions, []
        for definition in definitions:
            self._define(definition)

    def _finish_file(self) -> None:
        """Write the parts after the messages of a file: description, index, summary."""
        self._end_chunk(wait=True)
        statistics = self._mcap.statistics
        start, end = statistics.message_start_time, statistics.message_end_time
        summary = FileSummary(self._file.path.name, start, end - start, statistics.message_count)
        self._files.append(summary)
        self._own_text = own = yaml_text(self._metadata([summary]).information())
        self._mcap.add_metadata(Metadata(name="rosbag2", metadata={"serialized_metadata": own}))
        self._mcap.finish()
        self._file.close()
        self._finished.append(self._file.path)

    def _define(self, record: Schema | ChannelRecord) -> None:
        """Add a schema or channel to the open chunk, so that it precedes the first message that needs it."""
        self._definitions.append(record)
        if isinstance(record, Schema):
            self._mcap.schemas[record.id] = record
        else:
            self._mcap.channels[record.id] = record
        self._chunk.add_record(record)

    def _begin_instant(self, channel: RecordedChannel, stamp: int, payload: bytes) -> None:
        """Begin an instant with a message at a new time; end the chunk first if its time has passed or it is full."""
        if not self._open or not 0 <= stamp <= MAX_STAMP:
            raise self._bad_message(channel, stamp, payload)
        if self._sync_error is not None:
            raise self._failure_error(self._sync_error)
        time = self._last_time + 1
        time = max(time, stamp)
        if time >= self._chunk_end or self._chunk.size > CHUNK_BYTES:
            self._flush(wait=self._options.split_bytes > 0)
            period = self._options.chunk_ns
            self._chunk_end = (time // period + 1) * period
        self._stamp = stamp

    def _flush(self, *, wait: bool) -> None:
        try:
            self._end_chunk(wait=wait)
        except OSError as error:
            raise self._failure_error(error) from error

    def _end_chunk(self, *, wait: bool) -> None:
        """Write the open chunk; ``wait`` until that is done if the file's size is needed next, or the file itself."""
        chunk = self._chunk
        if chunk.has_messages:
            if chunk.size <= AT_ONCE_BYTES and not self._keeps_pace():
                self._chunks.settle()
                self._mcap.add_chunk(chunk)
            else:
                self._chunks.hand(partial(self._mcap.add_chunk, chunk))
            self._chunk = ChunkBuilder()
        if wait or self._chunks.failed:
            self._chunks.settle()

    def _metadata(self, files: list[FileSummary]) -> BagMetadata:
        """Return the metadata of the whole recording, or of its last file alone."""
        before = self._counts_before if len(files) < len(self._files) else {}
        counts = {item: item.message_count - before.get(item.topic, 0) for item in self._channels.values()}
        kinds = message_types()
        topics = [
            TopicSummary(item.topic, item.type_name, kinds[item.type_name].hash, [item.qos.as_yaml_data()], count)
            for item, count in counts.items()
        ]
        return BagMetadata(files, topics, self.custom_data)

    def _bad_message(self, channel: RecordedChannel, stamp: int, payload: bytes) -> RecordingError:
        if not self._open:
            return self._refusal(f"message on {channel.topic} after the recording was closed")
        if len(payload) > MAX_PAYLOAD_BYTES:
            return self._refusal(
                f"message on {channel.topic} of {len(payload)} bytes: the limit is {MAX_PAYLOAD_BYTES}"
            )
        return self._refusal(f"message on {channel.topic} at {stamp} ns: times lie from 0 to {MAX_STAMP} ns")

    def _refusal(self, message: str) -> RecordingError:
        return RecordingError("AMX6802", self.folder, message)

    def _failure_error(self, error: OSError) -> RecordingError:
        self._open, self._stamp = False, None
        self._chunks.end()
        with contextlib.suppress(OSError):
            self._file.close()
        kept = "what was recorded so far is kept, `automax bag repair` makes a whole recording of it"
        return self._write_error(error, f"check free space and permissions; {kept}")

    def _write_error(self, error: OSError, hint: str = "check free space and permissions") -> RecordingError:
        return RecordingError("AMX6801", self.folder, f"cannot write the recording: {error.strerror or error}", hint)
