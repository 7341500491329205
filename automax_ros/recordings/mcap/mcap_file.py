"""Reads one mcap file from its beginning to its end, trusting nothing in it.

Memory stays bounded whatever the file states: a length is compared with the limit and with the bytes available before
anything is read or decompressed. Every checksum in the file is verified: those of chunks before their messages are
returned, the others at the end.
"""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, Metadata, Schema

from automax_ros.recordings.mcap.checked_stream import CheckedStream
from automax_ros.recordings.mcap.chunk_builder import MESSAGE_FIELDS, RECORD_HEAD
from automax_ros.recordings.mcap.chunk_table import WholeChunk
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_output import MAGIC
from automax_ros.recordings.mcap.opening import NO_BAG_HINT, opened
from automax_ros.recordings.mcap.unpacking import DAMAGED_HINT, MAX_RECORD_BYTES, Buffer, Room, Unpacker

_FIRST_PRIVATE_OPCODE = 0x80
"""First private opcode; readers skip records that they do not know."""
TRUNCATED_HINT = "the recording was not finished or copied in part; `automax bag repair` saves what is sound"

_NOTHING: frozenset[int] = frozenset()
_INDEXES = frozenset({int(Opcode.MESSAGE_INDEX)})
_MESSAGES = _INDEXES | {int(Opcode.CHUNK), int(Opcode.MESSAGE)}
"""Records that may be skipped."""
_END = -1
"""Marks the end of the data in place of an opcode."""
_Record = TypeVar("_Record")


class RawMessage(NamedTuple):
    """One message as stored in the file; times in nanoseconds."""

    channel: Channel
    schema: Schema | None
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


class McapFile:
    """One mcap file with ROS 2 messages, to be read once.

    ``chunks_read``, ``stored_bytes`` and ``unpacked_bytes`` count the chunks read so far and the bytes in them, as
    stored and decompressed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.channels: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self._definition_bytes = 0
        self._stream: CheckedStream | None = None
        self._place: int | None = None
        self._unpacker = Unpacker(path, 0)
        self.chunks_read = 0
        self.stored_bytes = 0
        self.unpacked_bytes = 0

    @property
    def position(self) -> int:
        """Number of bytes read so far."""
        return self._stream.position if self._stream is not None else 0

    def records(self, *, messages: bool = True) -> Iterator[RawMessage | Attachment | Metadata]:
        """Yield messages (unless ``messages`` is FALSE), attachments and metadata in the order of the file.

        Raises:
            BagError: the file is truncated, damaged, beyond the limits or not a recording of ROS 2.
        """
        for opcode, content in self._parts(_INDEXES if messages else _MESSAGES):
            if opcode == Opcode.CHUNK:
                data = self._unpacked(self._parsed(Chunk.read, content))
                yield from self.chunk_messages(WholeChunk(data, self.position))
            elif opcode == Opcode.MESSAGE:
                yield self._message(content)
            elif opcode == Opcode.ATTACHMENT:
                yield self._parsed(Attachment.read, content)
            elif opcode == Opcode.METADATA:
                yield self._parsed(Metadata.read, content)

    def chunks(self, *, indexed: bool = True, room: Room | None = None) -> Iterator[WholeChunk | RawMessage]:
        """Yield the chunks, unpacked, with their indexes (if ``indexed``), and the messages outside of chunks.

        ``room`` returns the buffer into which each chunk is unpacked, in the order of the chunks.
        A chunk is yielded before an error in what follows it is raised. ``chunk_messages`` returns its messages.

        Raises:
            BagError: as ``records`` does, except for errors inside a chunk.
        """
        pending: WholeChunk | None = None
        parts = self._parts(_NOTHING if indexed else _INDEXES)
        while True:
            try:
                opcode, content = next(parts, (_END, b""))
                chunk = None
                if opcode == Opcode.CHUNK:
                    chunk = WholeChunk(self._unpacked(self._parsed(Chunk.read, content), room), self.position)
                elif opcode == Opcode.ATTACHMENT:
                    self._parsed(Attachment.read, content)
                elif opcode == Opcode.METADATA:
                    self._parsed(Metadata.read, content)
            except BagError:
                if pending is not None:
                    yield pending
                raise
            if opcode == Opcode.MESSAGE_INDEX:
                if pending is not None:
                    pending.add_index(content)
                continue
            if pending is not None:
                yield pending
            pending = chunk
            if opcode == _END:
                return
            if opcode == Opcode.MESSAGE:
                yield self._message(content)

    def chunk_messages(self, chunk: WholeChunk) -> Iterator[RawMessage]:
        """Yield the messages of an unpacked chunk, and add its definitions.

        Raises:
            BagError: the chunk is damaged or beyond the limits.
        """
        data, position = bytes(chunk.data), 0
        self._place = chunk.place
        while position < len(data):
            start = position + RECORD_HEAD.size
            if start > len(data):
                raise self._damaged("a chunk ends inside a record")
            opcode, length = RECORD_HEAD.unpack_from(data, position)
            position = start + length
            if position > len(data):
                raise self._damaged(f"a record of {length} bytes in the last {len(data) - start} bytes of a chunk")
            if opcode == Opcode.MESSAGE:
                yield self._message(data[start:position])
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self.define(opcode, data[start:position])
            elif opcode < _FIRST_PRIVATE_OPCODE:
                raise self._damaged(f"a record of kind {opcode} inside a chunk")
        self._place = None

    def _parts(self, without: frozenset[int]) -> Iterator[tuple[int, bytes]]:
        """Yield opcode and content of each record of the data; check the parts around the data, add definitions."""
        with opened(self.path) as file:
            self._unpacker = Unpacker(self.path, os.fstat(file.fileno()).st_size)
            self._stream = stream = CheckedStream(file)
            if stream.take(len(MAGIC)) != MAGIC:
                raise BagError("AMX6810", self.path, "is not an mcap file", NO_BAG_HINT)
            self._check_header(*self._next_record(stream))
            while True:
                opcode, length = self._next_head(stream)
                if opcode in without:
                    self._skip(stream, length)
                    stream.pass_over(RECORD_HEAD, without)
                    continue
                crc = stream.crc(RECORD_HEAD.size) if opcode == Opcode.DATA_END else 0
                content = self._read(stream, length)
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self.define(opcode, content)
                elif opcode == Opcode.DATA_END:
                    self._check_crc(self._parsed(DataEnd.read, content).data_section_crc, crc, "the data")
                    break
                elif opcode == Opcode.FOOTER:
                    raise self._damaged("a footer without the end of the data")
                else:
                    yield opcode, content
            self._read_summary(stream)

    def _read_summary(self, stream: CheckedStream) -> None:
        """Read the section after the data, and check its checksum and its end."""
        stream.begin_crc()
        opcode, length = self._next_head(stream)
        while opcode != Opcode.FOOTER:
            self._skip(stream, length)
            opcode, length = self._next_head(stream)
        crc = stream.crc(RECORD_HEAD.size)
        content = self._read(stream, length)
        expected = self._parsed(Footer.read, content).summary_crc
        covered = RECORD_HEAD.pack(opcode, length) + content[: -len(b"crc4")]
        self._check_crc(expected, zlib.crc32(covered, crc), "the summary")
        if stream.take(len(MAGIC) + 1) != MAGIC:
            raise self._damaged("the closing mark is missing or does not end the file")

    def _next_record(self, stream: CheckedStream) -> tuple[int, bytes]:
        opcode, length = self._next_head(stream)
        return opcode, self._read(stream, length)

    def _next_head(self, stream: CheckedStream) -> tuple[int, int]:
        """Read the opcode of a record and the length of its content."""
        head = stream.numbers(RECORD_HEAD)
        if not head:
            raise self._ends_early(stream)
        opcode, length = head
        if length > MAX_RECORD_BYTES:
            raise self._too_large(f"a record of {length} bytes, at most {MAX_RECORD_BYTES} are read")
        return opcode, length

    def _read(self, stream: CheckedStream, length: int) -> bytes:
        data = stream.take(length)
        if len(data) < length:
            raise self._ends_early(stream)
        return data

    def _skip(self, stream: CheckedStream, length: int) -> None:
        if stream.skip(length) < length:
            raise self._ends_early(stream)

    def _ends_early(self, stream: CheckedStream) -> BagError:
        return BagError("AMX6812", self.path, f"ends early, at byte {stream.position}", TRUNCATED_HINT)

    def _parsed(self, parse: Callable[[ReadDataStream], _Record], content: bytes) -> _Record:
        """Parse one record by the package mcap, which cannot read beyond the record's end."""
        try:
            return parse(ReadDataStream(io.BytesIO(content)))
        except (McapError, struct.error, ValueError, OverflowError) as error:
            raise self._damaged(f"a malformed record: {str(error) or type(error).__name__}") from error

    def _check_header(self, opcode: int, content: bytes) -> None:
        if opcode != Opcode.HEADER:
            raise self._damaged("the file does not begin with a header")
        profile = self._parsed(Header.read, content).profile
        if profile != "ros2":
            raise BagError(
                "AMX6811",
                self.path,
                f"holds messages of profile {profile[:40]!r}, not 'ros2'",
                "only recordings of ROS 2 can be read",
            )

    def _check_crc(self, expected: int, actual: int, what: str) -> None:
        if expected not in (0, actual):
            raise self._damaged(f"the checksum of {what} is wrong")

    def define(self, opcode: int, content: bytes) -> None:
        """Add a schema or channel; files may repeat them, the first one counts.

        Raises:
            BagError: it is damaged, or all of them together are beyond the limits.
        """
        if opcode == Opcode.SCHEMA:
            schema = self._parsed(Schema.read, content)
            if schema.id not in self.schemas:
                self._admit_definition(content)
                self.schemas[schema.id] = schema
        else:
            channel = self._parsed(Channel.read, content)
            if channel.id not in self.channels:
                self._admit_definition(content)
                self.channels[channel.id] = channel

    def _admit_definition(self, content: bytes) -> None:
        if self._definition_bytes + len(content) > MAX_RECORD_BYTES:
            raise self._too_large(f"schemas and channels of more than {MAX_RECORD_BYTES} bytes")
        self._definition_bytes += len(content)

    def _message(self, content: bytes) -> RawMessage:
        if len(content) < MESSAGE_FIELDS.size:
            raise self._damaged(f"a message record of {len(content)} bytes")
        number, sequence, log_time, publish_time = MESSAGE_FIELDS.unpack_from(content)
        channel = self.channels.get(number)
        if channel is None:
            raise self._damaged(f"a message on channel {number}, which is not defined")
        schema = self.schemas.get(channel.schema_id)
        return RawMessage(channel, schema, sequence, log_time, publish_time, content[MESSAGE_FIELDS.size :])

    def _unpacked(self, chunk: Chunk, room: Room | None = None) -> Buffer:
        data: Buffer
        try:
            data = self._unpacker.unpacked(chunk) if room is None else self._unpacker.unpacked_in(chunk, room)
        except BagError as error:
            raise BagError(
                error.code, self.path, f"{error.message} (before byte {self.position})", error.hint
            ) from error
        self.chunks_read += 1
        self.stored_bytes += len(chunk.data)
        self.unpacked_bytes += len(data)
        return data

    def _too_large(self, message: str) -> BagError:
        return BagError("AMX6814", self.path, message)

    def _damaged(self, message: str) -> BagError:
        place = self.position if self._place is None else self._place
        return BagError("AMX6813", self.path, f"{message} (before byte {place})", DAMAGED_HINT)
