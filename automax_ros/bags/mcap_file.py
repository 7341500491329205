"""Reads one mcap file from its beginning to its end, trusting nothing in it.

Memory stays bounded whatever the file says: a length is compared with the limit and with what is there before anything
is read or decompressed. Every checksum that the file has is verified: before the messages of a chunk are handed out,
and at the end for the rest.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeVar

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, Metadata, Schema

from automax_ros.bags.errors import BagError

MAX_RECORD_BYTES = 64 << 20
"""Longest record, longest chunk after decompression, and sum of all schemas and channels that is read (decision)."""
_MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_TRUNCATED_HINT = "the recording was not finished or copied in part; all whole chunks before this place are sound"
_DAMAGED_HINT = "copy the file again from where it was recorded"

_Record = TypeVar("_Record")


class RawMessage(NamedTuple):
    """One message as it stands in the file; times in nanoseconds."""

    channel: Channel
    schema: Schema | None
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


class McapFile:
    """One mcap file with ROS 2 messages, to be read once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._channels: dict[int, Channel] = {}
        self._schemas: dict[int, Schema] = {}
        self._definition_bytes = 0
        self._position = 0
        self._crc = 0

    def records(self, *, messages: bool = True) -> Iterator[RawMessage | Attachment | Metadata]:
        """Return messages (if wanted), attachments and metadata in the order of the file.

        Raises:
            BagError: the file is truncated, damaged, beyond the limits or no recording of ROS 2.
        """
        try:
            with self.path.open("rb") as file:
                yield from self._records(file, messages)
        except OSError as error:
            raise BagError("AMX6810", self.path, f"cannot be read: {error.strerror or error}") from error
        except MemoryError as error:
            raise BagError("AMX6814", self.path, "not enough memory for a record of this file") from error

    def _records(self, file: BinaryIO, messages: bool) -> Iterator[RawMessage | Attachment | Metadata]:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise BagError(
                "AMX6810", self.path, "is not an mcap file", "give the folder or the .mcap file of a recording"
            )
        self._position, self._crc = len(_MAGIC), zlib.crc32(_MAGIC)
        self._check_header(*self._next_record(file)[1:])
        while True:
            crc_before, opcode, content = self._next_record(file)
            if opcode == Opcode.CHUNK:
                if messages:
                    yield from self._chunk_messages(self._parsed(Chunk.read, content))
            elif opcode == Opcode.MESSAGE:
                if messages:
                    yield self._message(content)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, content)
            elif opcode == Opcode.ATTACHMENT:
                yield self._parsed(Attachment.read, content)
            elif opcode == Opcode.METADATA:
                yield self._parsed(Metadata.read, content)
            elif opcode == Opcode.DATA_END:
                expected = self._parsed(DataEnd.read, content).data_section_crc
                self._check_crc(expected, crc_before, "the data")
                break
            elif opcode == Opcode.FOOTER:
                raise self._damaged("a footer without the end of the data")
        self._read_summary(file)

    def _read_summary(self, file: BinaryIO) -> None:
        """Read what stands behind the data; only its checksum and its end matter here."""
        self._crc = 0
        opcode: int = Opcode.DATA_END
        while opcode != Opcode.FOOTER:
            crc_before, opcode, content = self._next_record(file)
        expected = self._parsed(Footer.read, content).summary_crc
        covered = _RECORD_HEAD.pack(opcode, len(content)) + content[: -len(b"crc4")]
        self._check_crc(expected, zlib.crc32(covered, crc_before), "the summary")
        if file.read(len(_MAGIC) + 1) != _MAGIC:
            raise self._damaged("the closing mark is missing or does not end the file")

    def _next_record(self, file: BinaryIO) -> tuple[int, int, bytes]:
        """Read a record: the checksum of all before it, its opcode and its content."""
        crc = self._crc
        head = self._read(file, _RECORD_HEAD.size)
        opcode, length = _RECORD_HEAD.unpack(head)
        if length > MAX_RECORD_BYTES:
            raise self._too_large(f"a record of {length} bytes, at most {MAX_RECORD_BYTES} are read")
        return crc, opcode, self._read(file, length)

    def _read(self, file: BinaryIO, length: int) -> bytes:
        data = file.read(length)
        self._position += len(data)
        if len(data) < length:
            raise BagError("AMX6812", self.path, f"ends early, at byte {self._position}", _TRUNCATED_HINT)
        self._crc = zlib.crc32(data, self._crc)
        return data

    def _parsed(self, parse: Callable[[ReadDataStream], _Record], content: bytes) -> _Record:
        """Let the library parse one record, which cannot read beyond the record's end."""
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

    def _define(self, opcode: int, content: bytes) -> None:
        """Take over a schema or channel; files may repeat them, the first one counts."""
        if opcode == Opcode.SCHEMA:
            schema = self._parsed(Schema.read, content)
            if schema.id in self._schemas:
                return
            self._schemas[schema.id] = schema
        else:
            channel = self._parsed(Channel.read, content)
            if channel.id in self._channels:
                return
            self._channels[channel.id] = channel
        self._definition_bytes += len(content)
        if self._definition_bytes > MAX_RECORD_BYTES:
            raise self._too_large(f"schemas and channels of more than {MAX_RECORD_BYTES} bytes")

    def _message(self, content: bytes) -> RawMessage:
        if len(content) < _MESSAGE_HEAD.size:
            raise self._damaged(f"a message record of {len(content)} bytes")
        number, sequence, log_time, publish_time = _MESSAGE_HEAD.unpack_from(content)
        channel = self._channels.get(number)
        if channel is None:
            raise self._damaged(f"a message on channel {number}, which is not defined")
        schema = self._schemas.get(channel.schema_id)
        return RawMessage(channel, schema, sequence, log_time, publish_time, content[_MESSAGE_HEAD.size :])

    def _chunk_messages(self, chunk: Chunk) -> Iterator[RawMessage]:
        data = self._decompressed(chunk)
        position = 0
        while position < len(data):
            start = position + _RECORD_HEAD.size
            if start > len(data):
                raise self._damaged("a chunk ends inside a record")
            opcode, length = _RECORD_HEAD.unpack_from(data, position)
            position = start + length
            if position > len(data):
                raise self._damaged(f"a record of {length} bytes in the last {len(data) - start} bytes of a chunk")
            if opcode == Opcode.MESSAGE:
                yield self._message(data[start:position])
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, data[start:position])

    def _decompressed(self, chunk: Chunk) -> bytes:
        size = chunk.uncompressed_size
        if size > MAX_RECORD_BYTES:
            raise self._too_large(f"a chunk of {size} bytes, at most {MAX_RECORD_BYTES} are read")
        try:
            data = self._unpacked(chunk.compression, chunk.data, size)
        except (zstandard.ZstdError, RuntimeError, EOFError) as error:  # lz4 raises RuntimeError
            raise self._damaged(f"a chunk cannot be decompressed: {error}") from error
        if len(data) != size:
            raise self._damaged(f"a chunk has {len(data)} bytes and should have {size}")
        self._check_crc(chunk.uncompressed_crc, zlib.crc32(data), "a chunk")
        return data

    def _unpacked(self, compression: str, data: bytes, size: int) -> bytes:
        if not compression:
            return data
        if compression == "lz4":
            unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
            return unpacked
        if compression != "zstd":
            raise BagError("AMX6811", self.path, f"is compressed with {compression[:40]!r}; zstd and lz4 can be read")
        # zstandard allocates what the frame states, so that has to be looked at too.
        stated = zstandard.get_frame_parameters(data).content_size
        if stated not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise self._damaged(f"a chunk holds {stated} bytes and should hold {size}")
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=size) if size else b""

    def _too_large(self, message: str) -> BagError:
        return BagError("AMX6814", self.path, message)

    def _damaged(self, message: str) -> BagError:
        return BagError("AMX6813", self.path, f"{message} (before byte {self._position})", _DAMAGED_HINT)
