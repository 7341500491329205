"""Reads one mcap file from its beginning to its end, trusting nothing in it.

Memory stays bounded whatever the file states: a length is compared with the limit and with the bytes available before
anything is read or decompressed. Every checksum in the file is verified: those of chunks before their messages are
returned, the others at the end.

Reading ends at the first fault, or, to salvage a cut or damaged file, skips and notes what is not sound. Then a record
is sound if it is complete and can be parsed; a chunk or attachment with a checksum, if the checksum is right. After a
place where records cannot be recognized, reading continues at the next compressed chunk.
"""

from __future__ import annotations

import io
import os
import re
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, Metadata, Schema

from automax_ros.recordings.mcap.checked_stream import CheckedStream
from automax_ros.recordings.mcap.chunk_table import (
    DEFINITIONS,
    FIRST_PRIVATE_OPCODE,
    MESSAGE,
    WholeChunk,
    chunk_records,
)
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_output import MAGIC, MESSAGE_FIELDS, RECORD_HEAD
from automax_ros.recordings.mcap.opening import NO_BAG_HINT, opened
from automax_ros.recordings.mcap.unpacking import DAMAGED_HINT, MAX_RECORD_BYTES, Room, Unpacker

_MARKS = re.compile(rb"\x04\x00\x00\x00zstd|\x03\x00\x00\x00lz4")
_LONGEST_MARK = 8
_MARK_PLACE = RECORD_HEAD.size + 28
"""Offset of the length and name of the compression in a chunk's record."""
_SEARCH_BYTES = 1 << 20
_MAX_RESUMED = 1000
"""Most unreadable places that are passed over in one file."""
_MAX_REASONS = 20


@dataclass
class Damage:
    """The damage of a file that was read: descriptions for the user, lost chunks, bytes of the data that are unusable.

    ``finished``: the end of the data was reached; whatever is missing after it can be regenerated.
    """

    finished: bool = False
    texts: list[str] = field(default_factory=list)
    lost_chunks: int = 0
    lost_bytes: int = 0
    _resumed: int = 0

    def lose(self, count: int, reason: str) -> None:
        """Note bytes that are lost."""
        self.lost_bytes += count
        if reason not in self.texts and len(self.texts) < _MAX_REASONS:
            self.texts.append(reason)

    def resume(self, file: BinaryIO, position: int, size: int) -> int:
        """Return the position of the next chunk after an unreadable place, or the end of the file."""
        self._resumed += 1
        start = size if self._resumed > _MAX_RESUMED else _next_chunk(file, position + 1, size)
        end = "the end" if start == size else f"byte {start}"
        self.lose(start - position, f"no complete record from byte {position} to {end}")
        return start


def _next_chunk(file: BinaryIO, place: int, size: int) -> int:
    """Return the position, from ``place`` on, of what looks like a compressed chunk, or the end of the file."""
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


TRUNCATED_HINT = "the recording was not finished or copied in part; `automax bag repair` saves what is sound"

_KNOWN = frozenset(map(int, Opcode))
_ENDS = frozenset({int(Opcode.DATA_END), int(Opcode.FOOTER)})
_INDEXES = frozenset({int(Opcode.MESSAGE_INDEX)})
_MESSAGES = _INDEXES | {int(Opcode.CHUNK), MESSAGE}
_SUMMARY = frozenset(range(256)) - {int(Opcode.FOOTER)}
"""Records that may be skipped: between the end of the data and the footer all of them."""
_SALVAGED_SUMMARY = _KNOWN - DEFINITIONS - _ENDS
"""Those skipped there if the file is damaged: definitions may be lost elsewhere."""
_END, _CUT = -1, -2
"""In place of an opcode: the end of the data, a chunk of which the file has only a part."""
_Record = TypeVar("_Record")
Piece = WholeChunk | Attachment | Metadata | bytes
"""What a file holds; bytes are the content of a message outside of chunks."""


class RawMessage(NamedTuple):
    """One message as stored in the file; times in nanoseconds."""

    channel: Channel
    schema: Schema | None
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


class McapFile:
    """One mcap file with ROS 2 messages, to be read once; with ``salvage``, ``damage`` describes what was skipped.

    ``chunks_read``, ``stored_bytes`` and ``unpacked_bytes`` count the chunks read so far and the bytes in them, as
    stored and decompressed; ``compressions`` are those of the chunks.
    """

    def __init__(self, path: Path, *, salvage: bool = False) -> None:
        self.path = path
        self.damage = Damage()
        self.channels: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self.compressions: set[str] = set()
        self._salvage = salvage
        self._definition_bytes = self._size = 0
        self._stream: CheckedStream | None = None
        self._place: int | None = None
        self._begin = 0
        self._unpacker = Unpacker(path, 0)
        self.chunks_read = 0
        self.stored_bytes = 0
        self.unpacked_bytes = 0

    @property
    def position(self) -> int:
        """Number of bytes read so far."""
        return self._stream.position if self._stream is not None else 0

    def after(self, position: int) -> McapFile:
        """Return a reader of what follows on a ``position`` of this one, with the definitions that are known here.

        It verifies the checksums of chunks, not that of the data as a whole.
        """
        other = McapFile(self.path)
        other.channels, other.schemas, other._begin = self.channels, self.schemas, position
        return other

    def records(self, *, messages: bool = True) -> Iterator[RawMessage | Attachment | Metadata]:
        """Yield messages (unless ``messages`` is FALSE), attachments and metadata in the order of the file.

        Raises:
            BagError: the file is truncated, damaged, beyond the limits or not a recording of ROS 2.
        """
        for piece in self.pieces(_INDEXES if messages else _MESSAGES):
            if isinstance(piece, WholeChunk):
                yield from self.chunk_messages(piece)
            elif isinstance(piece, bytes):
                yield self._message(piece)
            else:
                yield piece

    def pieces(self, without: frozenset[int] = _INDEXES) -> Iterator[Piece]:
        """Yield chunks, messages outside of them, attachments and metadata, except records of the kinds ``without``.

        Raises:
            BagError: as ``records`` does; a damaged file to be salvaged only if it is beyond the limits, cannot be
                read, or is not a recording of ROS 2 at all.
        """
        for opcode, content in self._parts(without):
            piece = self._piece(opcode, content)
            if piece is not None:
                yield piece

    def chunks(self, room: Room) -> Iterator[WholeChunk | RawMessage]:
        """Yield the chunks, unpacked, and the messages outside of chunks.

        ``room`` returns the buffer into which each chunk is unpacked, in the order of the chunks.
        ``chunk_messages`` returns the messages of a chunk.

        Raises:
            BagError: as ``records`` does, except for errors inside a chunk.
        """
        for opcode, content in self._parts(_INDEXES):
            piece = self._piece(opcode, content, room)
            if isinstance(piece, WholeChunk):
                yield piece
            elif opcode == Opcode.MESSAGE:
                yield self._message(content)

    def chunk_messages(self, chunk: WholeChunk) -> Iterator[RawMessage]:
        """Yield the messages of an unpacked chunk, and add its definitions.

        Raises:
            BagError: the chunk is damaged or beyond the limits.
        """
        data = bytes(chunk.data)
        self._place = chunk.place
        try:
            for opcode, start, end in chunk_records(data):
                if opcode == MESSAGE:
                    yield self._message(data[start:end])
                else:
                    self.define(opcode, data[start:end])
        except ValueError as error:
            raise self._damage_error(str(error)) from error
        self._place = None

    def _parts(self, without: frozenset[int]) -> Iterator[tuple[int, bytes]]:
        """Yield opcode and content of each record of the data; check the parts around the data, add definitions."""
        with opened(self.path) as file:
            self._size = os.fstat(file.fileno()).st_size
            self._unpacker = Unpacker(self.path, self._size)
            self._stream = stream = CheckedStream(file)
            magic = MAGIC if self._begin else stream.take(len(MAGIC))
            if magic != MAGIC:
                if not self._salvage or not MAGIC.startswith(magic):
                    raise BagError("AMX6810", self.path, "is not an mcap file", NO_BAG_HINT)
                self.damage.lose(len(magic), "is empty")
                return
            skipped: frozenset[int] | None = None
            if self._begin:
                stream.jump(self._begin)
                skipped = without
            while True:
                begin = stream.position
                try:
                    opcode, length = self._next_head(stream)
                    if skipped is not None and opcode in skipped:
                        if stream.skip(length) < length:
                            raise self._ends_early(stream)
                        stream.pass_over(RECORD_HEAD, skipped)
                        continue
                    crc = stream.crc(RECORD_HEAD.size) if opcode in _ENDS else 0
                    content = stream.take(length)
                    if len(content) < length:
                        raise self._ends_early(stream)
                except BagError:
                    if not self._salvage:
                        raise
                    if begin >= self._size:
                        return
                    stream.jump(begin)
                    opcode, length = stream.numbers(RECORD_HEAD) or (_END, 0)
                    if opcode == Opcode.CHUNK and stream.position + length > self._size:
                        yield _CUT, stream.take(MAX_RECORD_BYTES)
                    stream.jump(self.damage.resume(file, begin, self._size))
                    continue
                if skipped is None:
                    self._check_header(opcode, content)
                    skipped = without
                if opcode in DEFINITIONS:
                    self.define(opcode, content)
                elif opcode not in _ENDS:
                    yield opcode, content
                elif self._begin:
                    return
                else:
                    if not self._salvage:
                        self._check_end(stream, opcode, content, crc)
                    if opcode == Opcode.FOOTER:
                        return
                    stream.begin_crc()
                    self.damage.finished = True
                    skipped = _SALVAGED_SUMMARY if self._salvage else _SUMMARY

    def _piece(self, opcode: int, content: bytes, room: Room | None = None) -> Piece | None:
        """Return what a record holds; None for one of another kind, and for one that is skipped."""
        if opcode == Opcode.CHUNK:
            return self._chunk(content, room)
        if opcode == Opcode.MESSAGE:
            return content if len(content) >= MESSAGE_FIELDS.size or not self._salvage else None
        if opcode == Opcode.METADATA:
            return self._parse(Metadata.read, content)
        if opcode == Opcode.ATTACHMENT:
            if not self._salvage or int.from_bytes(content[-4:], "little") in (0, zlib.crc32(content[:-4])):
                return self._parse(Attachment.read, content)
            self.damage.lose(len(content), "an attachment is damaged")
            return None
        return self._cut_chunk(content) if opcode == _CUT else None

    def _chunk(self, content: bytes, room: Room | None) -> WholeChunk | None:
        chunk = self._parse(Chunk.read, content)
        if chunk is None:
            self.damage.lost_chunks += 1
            return None
        try:
            data = self._unpacker.unpacked(chunk, room)
        except BagError as error:
            if not self._salvage:
                text = f"{error.message} (before byte {self.position})"
                raise BagError(error.code, self.path, text, error.hint) from error
            self.damage.lost_chunks += 1
            self.damage.lose(len(content), error.message)
            return None
        self.chunks_read += 1
        self.stored_bytes += len(chunk.data)
        self.unpacked_bytes += len(data)
        self.compressions.add(chunk.compression)
        return WholeChunk(data, self.position, chunk if self._salvage else None)

    def _cut_chunk(self, content: bytes) -> WholeChunk | None:
        self.damage.lost_chunks += 1
        found = self._unpacker.beginning(content)
        if found is None:
            return None
        data, compression, size = found
        self.compressions.add(compression)
        return WholeChunk(data, cut=len(data) < size)

    def _next_head(self, stream: CheckedStream) -> tuple[int, int]:
        """Read the opcode of a record and the length of its content."""
        head = stream.numbers(RECORD_HEAD)
        if not head:
            raise self._ends_early(stream)
        opcode, length = head
        if length > MAX_RECORD_BYTES:
            raise self._too_large(f"a record of {length} bytes, at most {MAX_RECORD_BYTES} are read")
        if self._salvage:
            known = opcode in _KNOWN or opcode >= FIRST_PRIVATE_OPCODE
            if not known or stream.position + length > self._size:
                raise self._ends_early(stream)
        return opcode, length

    def _ends_early(self, stream: CheckedStream) -> BagError:
        return BagError("AMX6812", self.path, f"ends early, at byte {stream.position}", TRUNCATED_HINT)

    def _parse(self, parse: Callable[[ReadDataStream], _Record], content: bytes) -> _Record | None:
        """Parse one record by the package mcap, which cannot read beyond the record's end; None if it is skipped."""
        try:
            return parse(ReadDataStream(io.BytesIO(content)))
        except (McapError, struct.error, ValueError, OverflowError) as error:
            if not self._salvage:
                raise self._damage_error(f"a malformed record: {str(error) or type(error).__name__}") from error
            self.damage.lose(len(content), "a record is malformed")
            return None

    def _check_header(self, opcode: int, content: bytes) -> None:
        if opcode != Opcode.HEADER and not self._salvage:
            raise self._damage_error("the file does not begin with a header")
        header = self._parse(Header.read, content) if opcode == Opcode.HEADER else None
        if header is not None and header.profile != "ros2":
            text = f"holds messages of profile {header.profile[:40]!r}, not 'ros2'"
            hint = f"only recordings of ROS 2 can be {'repaired' if self._salvage else 'read'}"
            raise BagError("AMX6811", self.path, text, hint)

    def _check_end(self, stream: CheckedStream, opcode: int, content: bytes, crc: int) -> None:
        """Check the checksum of the data, or of the section after them and the end of the file."""
        if opcode == Opcode.DATA_END:
            end = self._parse(DataEnd.read, content)
            self._check_crc(end.data_section_crc if end else 0, crc, "the data")
            return
        if not self.damage.finished:
            raise self._damage_error("a footer without the end of the data")
        footer = self._parse(Footer.read, content)
        covered = RECORD_HEAD.pack(opcode, len(content)) + content[: -len(b"crc4")]
        self._check_crc(footer.summary_crc if footer else 0, zlib.crc32(covered, crc), "the summary")
        if stream.take(len(MAGIC) + 1) != MAGIC:
            raise self._damage_error("the closing mark is missing or does not end the file")

    def _check_crc(self, expected: int, actual: int, what: str) -> None:
        if expected not in (0, actual):
            raise self._damage_error(f"the checksum of {what} is wrong")

    def definition(self, opcode: int, content: bytes) -> Schema | Channel | None:
        """Return a schema or channel; None for a malformed one that is skipped.

        Raises:
            BagError: it is malformed.
        """
        if opcode == Opcode.SCHEMA:
            return self._parse(Schema.read, content)
        return self._parse(Channel.read, content)

    def define(self, opcode: int, content: bytes) -> None:
        """Add a schema or channel; files may repeat them, the first one counts.

        Raises:
            BagError: it is damaged, or all of them together are beyond the limits.
        """
        record = self.definition(opcode, content)
        known: dict[int, Any] = self.schemas if opcode == Opcode.SCHEMA else self.channels
        if record is None or record.id in known or (self._salvage and isinstance(record, Schema) and not record.id):
            return
        self._definition_bytes += len(content)
        if self._definition_bytes > MAX_RECORD_BYTES:
            raise self._too_large(f"schemas and channels of more than {MAX_RECORD_BYTES} bytes")
        known[record.id] = record

    def _message(self, content: bytes) -> RawMessage:
        if len(content) < MESSAGE_FIELDS.size:
            raise self._damage_error(f"a message record of {len(content)} bytes")
        number, sequence, log_time, publish_time = MESSAGE_FIELDS.unpack_from(content)
        channel = self.channels.get(number)
        if channel is None:
            raise self._damage_error(f"a message on channel {number}, which is not defined")
        schema = self.schemas.get(channel.schema_id)
        return RawMessage(channel, schema, sequence, log_time, publish_time, content[MESSAGE_FIELDS.size :])

    def _too_large(self, message: str) -> BagError:
        return BagError("AMX6814", self.path, message)

    def _damage_error(self, message: str) -> BagError:
        place = self.position if self._place is None else self._place
        return BagError("AMX6813", self.path, f"{message} (before byte {place})", DAMAGED_HINT)
