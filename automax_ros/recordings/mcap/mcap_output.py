"""Writes one mcap file: chunks of records with the indexes of their messages, and everything around them.

Records are those of the package mcap. The files have the same bytes as those of its writer.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import Final, Protocol

import lz4.frame
import zstandard
from librt.strings import BytesWriter, write_i16_le, write_i32_le, write_i64_le
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from automax_ros.messages.stream.task_messages import as_i16, as_i32, as_i64

RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length of every record."""
MESSAGE_FIELDS = struct.Struct("<HIQQ")
"""Beginning of a message: channel, sequence, log time and publish time."""
_FIELDS: Final = MESSAGE_FIELDS.size
_FRAME: Final = _FIELDS + RECORD_HEAD.size
_MESSAGE_CODE: Final = int(Opcode.MESSAGE)
"""A plain number: reading a member of an enumeration takes longer than all the rest."""


class ChunkBuilder:
    """The records of an open chunk, ``size`` bytes, with an index of the messages of each channel.

    Messages, which are most of the work of a recording, are framed here directly in the chunk: compiled, that takes
    0.14 us for each, packing by ``struct`` 0.32 us, and ``mcap.writer.Writer.add_message`` 4.2 us.

    ``first_time`` and ``last_time`` are the earliest and the latest log time; -1 without a message.
    """

    __slots__ = ("_index", "_records", "first_time", "last_time", "size")

    def __init__(self, index: Mapping[int, Sequence[int]] | None = None) -> None:
        """Create a chunk without records; ``index`` is the index of a chunk that is stored elsewhere."""
        self._records = BytesWriter()
        self.size = 0
        self._index: dict[int, BytesWriter] = {}
        self.first_time = self.last_time = -1
        for channel, entries in (index or {}).items():
            self._add_entries(channel, entries)

    @property
    def data(self) -> bytes:
        """All records."""
        return self._records.getvalue()

    @property
    def has_messages(self) -> bool:
        """Whether the chunk has messages."""
        return bool(self._index)

    @property
    def index(self) -> dict[int, bytes]:
        """Log time and place of each message (uint64 both), one after the other, by the number of the channel."""
        return {channel: entries.getvalue() for channel, entries in self._index.items()}

    def add_record(self, record: McapRecord) -> None:
        """Add a schema or a channel."""
        data = record_bytes(record)
        self._records.write(data)
        self.size += len(data)

    def add_message(self, channel: int, sequence: int, log_time: int, publish_time: int, payload: bytes) -> None:
        """Add a message.

        Raises:
            OverflowError: a number does not fit its field, unsigned, of 16, 32 and 64 bits; nothing is added.
        """
        length, place, records = len(payload), self.size, self._records
        number, order, time, published = as_i16(channel), as_i32(sequence), as_i64(log_time), as_i64(publish_time)
        if log_time > self.last_time:
            self.last_time = log_time
            if self.first_time < 0:
                self.first_time = log_time
        elif log_time < self.first_time:
            self.first_time = log_time
        entries = self._index.get(channel)
        if entries is None:
            entries = self._index[channel] = BytesWriter()
        write_i64_le(entries, time)
        write_i64_le(entries, place)
        records.append(_MESSAGE_CODE)
        write_i64_le(records, length + _FIELDS)
        write_i16_le(records, number)
        write_i32_le(records, order)
        write_i64_le(records, time)
        write_i64_le(records, published)
        records.write(payload)
        self.size = place + length + _FRAME

    def _add_entries(self, channel: int, entries: Sequence[int]) -> None:
        """Add the index of one channel: log time and place of each message, one after the other."""
        self._index[channel] = kept = BytesWriter()
        kept.write(struct.pack(f"<{len(entries)}Q", *entries))
        for time in entries[::2]:
            self.first_time = time if self.first_time < 0 else min(self.first_time, time)
            self.last_time = max(self.last_time, time)


def record_bytes(record: McapRecord) -> bytes:
    """Return a record of the package mcap as bytes."""
    builder = RecordBuilder()
    record.write(builder)
    return taken_bytes(builder)


def taken_bytes(builder: RecordBuilder) -> bytes:
    """Return the bytes of a builder, and empty it."""
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


MAGIC = b"\x89MCAP0\r\n"
_INDEX_HEAD = struct.Struct("<BQHI")
_INDEX_BYTES = 16
_COMPRESSORS: dict[str, Callable[[bytes], bytes]] = {
    "": lambda data: data,
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lz4.frame.compress,
}


class ByteSink(Protocol):
    """Receives the bytes of a file."""

    def write(self, data: bytes) -> int:
        """Append all bytes."""
        ...

    def tell(self) -> int:
        """Return the number of bytes in the file."""
        ...


class McapOutput:
    """Writes one mcap file of profile ``ros2``; an OSError of the output is not caught.

    The caller adds schemas and channels twice: to ``schemas`` and ``channels`` for the summary, and as records, in a
    chunk or by ``add_definition``.
    """

    def __init__(self, output: ByteSink, *, library: str, compression: str) -> None:
        """Write the header. ``compression`` is ``zstd``, ``lz4`` or empty."""
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self._output = output
        self._compression = compression
        self._compress = _COMPRESSORS[compression]
        self._crc = 0
        self._chunk_indexes = RecordBuilder()
        self._attachment_indexes = RecordBuilder()
        self._metadata_indexes = RecordBuilder()
        self.statistics = Statistics(
            attachment_count=0,
            channel_count=0,
            channel_message_counts={},
            chunk_count=0,
            message_count=0,
            message_start_time=0,
            message_end_time=0,
            metadata_count=0,
            schema_count=0,
        )
        self._write(MAGIC)
        self._write(record_bytes(Header("ros2", library)))

    def add_definition(self, record: Schema | Channel) -> None:
        """Write a schema or channel outside of chunks."""
        self._write(record_bytes(record))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write an attachment."""
        offset = self._output.tell()
        length = self._write(record_bytes(attachment))
        self.statistics.attachment_count += 1
        AttachmentIndex(
            offset=offset,
            length=length,
            create_time=attachment.create_time,
            log_time=attachment.log_time,
            data_size=len(attachment.data),
            name=attachment.name,
            media_type=attachment.media_type,
        ).write(self._attachment_indexes)

    def add_metadata(self, metadata: Metadata) -> None:
        """Write a metadata record."""
        offset = self._output.tell()
        length = self._write(record_bytes(metadata))
        self.statistics.metadata_count += 1
        MetadataIndex(offset=offset, length=length, name=metadata.name).write(self._metadata_indexes)

    def add_chunk(self, chunk: ChunkBuilder) -> None:
        """Write a chunk with its index, unless it has no messages."""
        if not chunk.has_messages:
            return
        data = chunk.data
        packed = Chunk(
            compression=self._compression,
            data=self._compress(data),
            message_start_time=chunk.first_time,
            message_end_time=chunk.last_time,
            uncompressed_crc=zlib.crc32(data),
            uncompressed_size=len(data),
        )
        self.add_packed_chunk(packed, chunk)

    def add_packed_chunk(self, packed: Chunk, chunk: ChunkBuilder) -> None:
        """Write a compressed chunk unchanged, with the index in ``chunk``."""
        start = self._output.tell()
        record = record_bytes(packed)
        length = len(record)
        offset = start + length
        offsets: dict[int, int] = {}
        parts = [record]
        length_of_indexes = 0
        index = chunk.index
        for channel, entries in index.items():
            offsets[channel] = offset + length_of_indexes
            size = len(entries)
            parts.append(_INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, size + 6, channel, size))
            parts.append(entries)
            length_of_indexes += _INDEX_HEAD.size + size
        self._write(b"".join(parts))
        self._count(index, chunk.first_time, chunk.last_time)
        self.statistics.chunk_count += 1
        ChunkIndex(
            message_start_time=packed.message_start_time,
            message_end_time=packed.message_end_time,
            chunk_start_offset=start,
            chunk_length=length,
            message_index_offsets=offsets,
            message_index_length=length_of_indexes,
            compression=packed.compression,
            compressed_size=len(packed.data),
            uncompressed_size=packed.uncompressed_size,
        ).write(self._chunk_indexes)

    def finish(self) -> None:
        """Write the summary and the end of the file."""
        self._write(record_bytes(DataEnd(self._crc)))
        start = self._output.tell()
        summary = RecordBuilder()
        offsets = RecordBuilder()
        self.statistics.schema_count, self.statistics.channel_count = len(self.schemas), len(self.channels)
        for opcode, records in (
            (Opcode.SCHEMA, b"".join(map(record_bytes, self.schemas.values()))),
            (Opcode.CHANNEL, b"".join(map(record_bytes, self.channels.values()))),
            (Opcode.STATISTICS, record_bytes(self.statistics)),
            (Opcode.CHUNK_INDEX, taken_bytes(self._chunk_indexes)),
            (Opcode.ATTACHMENT_INDEX, taken_bytes(self._attachment_indexes)),
            (Opcode.METADATA_INDEX, taken_bytes(self._metadata_indexes)),
        ):
            group_start = start + summary.count
            SummaryOffset(group_opcode=opcode, group_start=group_start, group_length=len(records)).write(offsets)
            summary.write(records)
        offset_start = start + summary.count
        data = taken_bytes(summary) + taken_bytes(offsets)
        footer = record_bytes(Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=0))
        crc = zlib.crc32(footer[:-4], zlib.crc32(data))
        self._write(data + footer[:-4] + struct.pack("<I", crc) + MAGIC)

    def _count(self, index: Mapping[int, bytes], first_time: int, last_time: int) -> None:
        total = self.statistics
        if not total.message_count:
            total.message_start_time, total.message_end_time = first_time, last_time
        total.message_start_time = min(total.message_start_time, first_time)
        total.message_end_time = max(total.message_end_time, last_time)
        counts = total.channel_message_counts
        for channel, entries in index.items():
            count = len(entries) // _INDEX_BYTES
            counts[channel] = counts.get(channel, 0) + count
            total.message_count += count

    def _write(self, data: bytes) -> int:
        self._output.write(data)
        self._crc = zlib.crc32(data, self._crc)
        return len(data)
