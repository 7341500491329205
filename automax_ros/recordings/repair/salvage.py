"""Reads what is sound in one mcap file, however it was cut or damaged: whole chunks, and the beginning of a cut one.

A record counts if it lies in the file as a whole and can be parsed; a chunk or attachment with a checksum counts if the
checksum is right. After a place where records cannot be told apart, the next compressed chunk is looked for.
"""

from __future__ import annotations

import io
import re
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, Metadata, Schema

from automax_ros.recordings.mcap.chunk_builder import MESSAGE_FIELDS, RECORD_HEAD
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_output import MAGIC
from automax_ros.recordings.mcap.opening import NO_BAG_HINT, opened
from automax_ros.recordings.mcap.unpacking import MAX_RECORD_BYTES, Unpacker

_CHUNK_FIELDS = struct.Struct("<QQQII")
"""What a chunk begins with: first and last time, size and checksum unpacked, length of the compression's name."""
_MARKS = re.compile(rb"\x04\x00\x00\x00zstd|\x03\x00\x00\x00lz4")
_LONGEST_MARK = 8
_MARK_PLACE = RECORD_HEAD.size + 28
"""Where in a chunk's record the name of its compression stands."""
_SEARCH_BYTES = 1 << 20
_MAX_RESUMED = 1000
"""Most places that make no sense that are passed over in one file."""
_MAX_REASONS = 20
_KNOWN = frozenset(int(opcode) for opcode in Opcode)
_FIRST_PRIVATE = 0x80

_Record = TypeVar("_Record")


@dataclass(frozen=True)
class SoundChunk:
    """What can be used of a chunk: ``packed`` as it stands in the file, None where only ``data`` is left of it."""

    data: bytes
    packed: Chunk | None = None
    compression: str = ""
    """That of the chunk of which ``data`` is left."""
    cut: bool = False
    """Whether more stood in the chunk."""


SoundPiece = SoundChunk | Schema | Channel | Attachment | Metadata | bytes
"""A part of the file that is sound; bytes are the content of a message outside of chunks."""


@dataclass
class DamagedFileReader:
    """One file; ``pieces`` reads it once, and the other fields tell then how it went."""

    path: Path
    finished: bool = False
    """Whether the end of the data was reached; what is missing after it can be made again."""
    damage: list[str] = field(default_factory=list)
    """What was found damaged, for the person."""
    lost_chunks: int = 0
    lost_bytes: int = 0
    """Bytes of the data that could not be used."""
    _resumed: int = 0

    def pieces(self) -> Iterator[SoundPiece]:
        """Return what is sound, in the order of the file.

        Raises:
            BagError: the file cannot be read or is beyond the limits, or is not a recording of ROS 2 at all.
        """
        with opened(self.path) as file:
            size = file.seek(0, io.SEEK_END)
            file.seek(0)
            yield from self._pieces(file, size)

    def _pieces(self, file: BinaryIO, size: int) -> Iterator[SoundPiece]:
        unpacker = Unpacker(self.path, size)
        magic = file.read(len(MAGIC))
        if magic != MAGIC:
            if not MAGIC.startswith(magic):
                raise BagError("AMX6810", self.path, "is not an mcap file", NO_BAG_HINT)
            self._lose(len(magic), "is empty")
            return
        position = len(MAGIC)
        first = True
        while position < size:
            file.seek(position)
            opcode, length = _head(file.read(RECORD_HEAD.size))
            end = position + RECORD_HEAD.size + length
            if not _plausible(opcode, length) or end > size:
                if opcode == Opcode.CHUNK and end > size and (piece := self._cut_chunk(file, unpacker)):
                    yield piece
                position = self._resume(file, position, size)
                continue
            content = file.read(length)
            if first:
                self._check_header(opcode, content)
                first = False
            if opcode == Opcode.DATA_END:
                self.finished = True
            elif opcode == Opcode.FOOTER:
                return
            elif (found := self._piece(opcode, content, unpacker)) is not None:
                yield found
            position = end

    def _piece(self, opcode: int, content: bytes, unpacker: Unpacker) -> SoundPiece | None:
        """Return what a whole record gives; of the summary only schemas and channels, which may be lost elsewhere."""
        if opcode == Opcode.SCHEMA:
            return self._parsed(Schema.read, content)
        if opcode == Opcode.CHANNEL:
            return self._parsed(Channel.read, content)
        if self.finished:
            return None
        if opcode == Opcode.CHUNK:
            return self._chunk(content, unpacker)
        if opcode == Opcode.ATTACHMENT:
            if struct.unpack("<I", content[-4:].rjust(4, b"\0"))[0] not in (0, zlib.crc32(content[:-4])):
                self._lose(len(content), "an attachment is damaged")
                return None
            return self._parsed(Attachment.read, content)
        if opcode == Opcode.METADATA:
            return self._parsed(Metadata.read, content)
        if opcode == Opcode.MESSAGE and len(content) >= MESSAGE_FIELDS.size:
            return content
        return None

    def _chunk(self, content: bytes, unpacker: Unpacker) -> SoundChunk | None:
        chunk = self._parsed(Chunk.read, content)
        if chunk is None:
            self.lost_chunks += 1
            return None
        try:
            return SoundChunk(unpacker.unpacked(chunk), chunk)
        except BagError as error:
            self.lost_chunks += 1
            self._lose(len(content), error.message)
            return None

    def _cut_chunk(self, file: BinaryIO, unpacker: Unpacker) -> SoundChunk | None:
        """Return the beginning of a chunk of which the file holds only a part."""
        self.lost_chunks += 1
        content = file.read(MAX_RECORD_BYTES)
        if len(content) < _CHUNK_FIELDS.size:
            return None
        *_, size, crc, name_length = _CHUNK_FIELDS.unpack_from(content)
        start = _CHUNK_FIELDS.size + name_length + 8  # the length of the data
        if name_length > 4 or start > len(content) or size > MAX_RECORD_BYTES:
            return None
        compression = content[_CHUNK_FIELDS.size :][:name_length].decode("latin-1")
        try:
            data = unpacker.beginning(compression, content[start:], size)
        except BagError:
            return None
        if not data or (len(data) == size and crc not in (0, zlib.crc32(data))):
            return None
        return SoundChunk(data, compression=compression, cut=len(data) < size)

    def _resume(self, file: BinaryIO, position: int, size: int) -> int:
        """Return where the next chunk begins after a place that makes no sense, or the end of the file."""
        self._resumed += 1
        start = size if self._resumed > _MAX_RESUMED else _next_chunk(file, position + 1, size)
        end = "the end" if start == size else f"byte {start}"
        self._lose(start - position, f"no whole record stands from byte {position} to {end}")
        return start

    def _check_header(self, opcode: int, content: bytes) -> None:
        header = self._parsed(Header.read, content) if opcode == Opcode.HEADER else None
        if header is not None and header.profile != "ros2":
            raise BagError(
                "AMX6811",
                self.path,
                f"holds messages of profile {header.profile[:40]!r}, not 'ros2'",
                "only recordings of ROS 2 can be repaired",
            )

    def _parsed(self, parse: Callable[[ReadDataStream], _Record], content: bytes) -> _Record | None:
        record = parsed(parse, content)
        if record is None:
            self._lose(len(content), "a record is malformed")
        return record

    def _lose(self, count: int, reason: str) -> None:
        self.lost_bytes += count
        if reason not in self.damage and len(self.damage) < _MAX_REASONS:
            self.damage.append(reason)


def parsed(parse: Callable[[ReadDataStream], _Record], content: bytes) -> _Record | None:
    """Let the package mcap parse a record; None if it is malformed."""
    try:
        return parse(ReadDataStream(io.BytesIO(content)))
    except (McapError, struct.error, ValueError, OverflowError):
        return None


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Return opcode, begin and end of the content of each whole record in a chunk's data; a cut one ends it."""
    position = 0
    while position + RECORD_HEAD.size <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        start = position + RECORD_HEAD.size
        position = start + length
        if position > len(data) or opcode not in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            return
        yield opcode, start, position


def _next_chunk(file: BinaryIO, place: int, size: int) -> int:
    """Return where a compressed chunk seems to begin, from a place on; the end of the file if there is none."""
    while place < size:
        file.seek(place)
        block = file.read(_SEARCH_BYTES + _MARK_PLACE)
        for match in _MARKS.finditer(block, _MARK_PLACE):
            start = match.start() - _MARK_PLACE
            opcode, length = RECORD_HEAD.unpack_from(block, start)
            if opcode == Opcode.CHUNK and length <= MAX_RECORD_BYTES:
                return place + start
        place += _SEARCH_BYTES - _LONGEST_MARK
    return size


def _head(data: bytes) -> tuple[int, int]:
    if len(data) < RECORD_HEAD.size:
        return 0, 0
    opcode, length = RECORD_HEAD.unpack(data)
    return opcode, length


def _plausible(opcode: int, length: int) -> bool:
    return (opcode in _KNOWN or opcode >= _FIRST_PRIVATE) and length <= MAX_RECORD_BYTES
