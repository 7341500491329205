"""Writes a recording: a folder with ``scans_0.mcap`` and ``metadata.yaml``, as rosbag2 makes them.

The same messages give the same bytes: nothing depends on the folder's name, the host or the wall clock. Chunks end by
size or with a simulated second, and reach the operating system when they end, so that a killed process loses little.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from io import FileIO
from pathlib import Path
from types import TracebackType

from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

import automax_ros
from automax_ros.bags.definitions import message_types, schema_text
from automax_ros.bags.errors import RecordingError
from automax_ros.bags.metadata import DATA_FILE, METADATA_FILE, BagMetadata, TopicSummary, yaml_text
from automax_ros.bags.qos import QosProfile

CHUNK_BYTES = 1 << 20
"""A chunk ends when it holds more bytes than this, uncompressed."""
MAX_PAYLOAD_BYTES = 32 << 20
"""Longest message and attachment (decision: what our own reader is sure to accept)."""
MAX_STAMP = (2**31 - 1) * 1_000_000_000
"""Latest time of a message in nanoseconds: the seconds of a ROS time have 31 bits."""
_SECOND = 1_000_000_000
_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_MAX_TOPIC = 247


class Channel:
    """One topic of a recording; :meth:`BagWriter.channel` makes them."""

    __slots__ = ("message_count", "number", "qos", "topic", "type_name")

    def __init__(self, number: int, topic: str, type_name: str, qos: QosProfile) -> None:
        self.number = number
        self.topic = topic
        self.type_name = type_name
        self.qos = qos
        self.message_count = 0


class _DataFile:
    """The mcap file, unbuffered; what a failed write left behind is cut off again."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = FileIO(path, "xb")
        self._size = 0

    def write(self, data: bytes) -> int:
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
        except OSError:
            self._file.truncate(self._size)
            raise
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        return self._size

    def flush(self) -> None:
        """Nothing waits here."""

    def close(self) -> None:
        self._file.close()


class BagWriter:
    """A recording being written; a context manager that finishes the files at its end.

    ``custom_data`` goes into the metadata (provenance: hashes of program and YAML file, version).

    Raises:
        RecordingError: the folder exists already, or cannot be written.
    """

    def __init__(self, folder: Path, *, custom_data: Mapping[str, str] | None = None) -> None:
        self.folder = folder
        self.custom_data = dict(custom_data or {})
        self._channels: dict[str, Channel] = {}
        self._schemas: dict[str, int] = {}
        self._first_time: int | None = None
        self._last_time = -1
        self._message_count = 0
        self._chunk_end = 0
        self._open = True
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            raise RecordingError(
                "AMX6800",
                folder,
                "exists already, not overwriting",
                "record into another folder, or move this one away",
            ) from None
        except OSError as error:
            raise self._write_error(error) from error
        try:
            self._file = _DataFile(folder / DATA_FILE)
            self._mcap = McapWriter(
                self._file,  # type: ignore[arg-type]  # it needs write, tell and flush, and gets them
                chunk_size=CHUNK_BYTES,
                compression=CompressionType.ZSTD,
                enable_data_crcs=True,
            )
            self._mcap.start(profile="ros2", library=f"automax_ros {automax_ros.__version__}")
        except OSError as error:
            raise self._write_error(error) from error

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def channel(self, topic: str, type_name: str, qos: QosProfile) -> Channel:
        """Return the channel of a topic; the first call for a topic makes it.

        Raises:
            RecordingError: the topic is no ROS name or has another type already, or recordings do not know the type.
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
        metadata = {"offered_qos_profiles": yaml_text([qos.as_yaml_data()]), "topic_type_hash": kind.hash}
        schema = self._schemas.get(type_name)
        if schema is None:
            schema = self._mcap.register_schema(type_name, "ros2msg", schema_text(type_name).encode())
            self._schemas[type_name] = schema
        number = self._mcap.register_channel(topic, "cdr", schema, metadata)
        channel = self._channels[topic] = Channel(number, topic, type_name, qos)
        return channel

    def write(self, channel: Channel, stamp: int, payload: bytes) -> None:
        """Add a message (CDR bytes) at a time in nanoseconds.

        Its log time is the stamp, or one nanosecond behind the message before if that is later: log times increase.

        Raises:
            RecordingError: time or length out of range, writer closed, or the disk refuses.
        """
        if not 0 <= stamp <= MAX_STAMP or len(payload) > MAX_PAYLOAD_BYTES or not self._open:
            raise self._bad_message(channel, stamp, payload)
        log_time = self._last_time + 1
        if stamp > log_time or self._first_time is None:
            log_time = stamp
        try:
            if log_time >= self._chunk_end:
                self._mcap.flush()  # type: ignore[no-untyped-call]
                self._chunk_end = (log_time // _SECOND + 1) * _SECOND
            channel.message_count += 1
            self._mcap.add_message(channel.number, log_time, payload, stamp, channel.message_count & 0xFFFFFFFF)
        except OSError as error:
            raise self._failed(error) from error
        if self._first_time is None:
            self._first_time = log_time
        self._last_time = log_time
        self._message_count += 1

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Store a file that belongs to the recording, such as the rack's YAML or a task's source.

        Raises:
            RecordingError: it is too long, the writer is closed, or the disk refuses.
        """
        if not self._open or len(data) > MAX_PAYLOAD_BYTES:
            raise self._refusal(
                f"attachment {name} of {len(data)} bytes: the limit is {MAX_PAYLOAD_BYTES}, before close()"
            )
        try:
            self._mcap.add_attachment(0, max(self._last_time, 0), name, media_type, data)
        except OSError as error:
            raise self._failed(error) from error

    def close(self) -> None:
        """Finish both files. After a failed write only what stands on disk is kept.

        Raises:
            RecordingError: the disk refuses.
        """
        if not self._open:
            return
        self._open = False
        information = self._metadata().information()
        try:
            self._mcap.flush()  # type: ignore[no-untyped-call]
            self._mcap.add_metadata("rosbag2", {"serialized_metadata": yaml_text(information)})
            self._mcap.finish()  # type: ignore[no-untyped-call]
            self._file.close()
            text = yaml_text({"rosbag2_bagfile_information": information})
            (self.folder / METADATA_FILE).write_text(text, encoding="utf-8", newline="\n")
        except OSError as error:
            raise self._failed(error) from error

    def _metadata(self) -> BagMetadata:
        start = self._first_time or 0
        return BagMetadata(
            starting_time=start,
            duration=max(self._last_time - start, 0),
            message_count=self._message_count,
            topics=[
                TopicSummary(
                    item.topic,
                    item.type_name,
                    message_types()[item.type_name].hash,
                    [item.qos.as_yaml_data()],
                    item.message_count,
                )
                for item in self._channels.values()
            ],
            custom_data=self.custom_data,
        )

    def _bad_message(self, channel: Channel, stamp: int, payload: bytes) -> RecordingError:
        if not self._open:
            return self._refusal(f"message on {channel.topic} after the recording was closed")
        if len(payload) > MAX_PAYLOAD_BYTES:
            return self._refusal(
                f"message on {channel.topic} of {len(payload)} bytes: the limit is {MAX_PAYLOAD_BYTES}"
            )
        return self._refusal(f"message on {channel.topic} at {stamp} ns: times lie from 0 to {MAX_STAMP} ns")

    def _refusal(self, message: str) -> RecordingError:
        return RecordingError("AMX6802", self.folder, message)

    def _failed(self, error: OSError) -> RecordingError:
        self._open = False
        with contextlib.suppress(OSError):
            self._file.close()
        return self._write_error(error)

    def _write_error(self, error: OSError) -> RecordingError:
        return RecordingError(
            "AMX6801",
            self.folder,
            f"cannot write the recording: {error.strerror or error}",
            "check free space and permissions; what was recorded so far is kept",
        )
