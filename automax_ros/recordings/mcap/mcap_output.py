"""Writes one mcap file: chunks that the caller has filled with records, and everything around them.

Records are those of the package mcap. The files have the same bytes as those of its writer.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping
from typing import Protocol

import lz4.frame
import zstandard
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
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from automax_ros.recordings.mcap.chunk_builder import ChunkBuilder, record_bytes, taken_bytes

MAGIC = b"\x89MCAP0\r\n"
_INDEX_HEAD = struct.Struct("<BQHI")
_INDEX_BYTES = 16
_COMPRESSORS: dict[str, Callable[[bytes], bytes]] = {
    "": lambda data: data,
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lz4.frame.compress,
}


class Output(Protocol):
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

    def __init__(self, output: Output, *, library: str, compression: str) -> None:
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
