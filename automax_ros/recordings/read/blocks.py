"""Reads recordings in blocks of thousands of messages, which are decoded together.

The messages of a chunk with unexpected records are returned one by one, and so are those of other programs'
recordings, which are not stored in the order of sending.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from automax_ros.recordings.mcap.chunk_table import MOST_MESSAGES, BlockBuffer, ChunkTable, WholeChunk
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_file import McapFile, RawMessage
from automax_ros.recordings.mcap.opening import size_of
from automax_ros.recordings.mcap.unpacking import Buffer
from automax_ros.recordings.read.reader import (
    BagMessage,
    BagReader,
    ChannelReader,
    DataSource,
    FileOrder,
    goes_backwards,
)

Bytes = NDArray[np.uint8]
_CHANNELS = 1 << 16
TableOf = Callable[[Buffer, Sequence[int]], ChunkTable | None]
"""Returns the table of messages of unpacked chunks, given the end of each; None if one must be read separately."""
_TWO_NUMBERS = struct.Struct("<HH")
"""Beginning of a schema or channel: its own number, and in a channel that of its schema."""


@dataclass(frozen=True)
class MessageBlock:
    """Messages of one file in the order of sending: the start of each in ``data``, its length, and its times in ns.

    ``kinds`` are indices of the requested types, ``numbers`` those of the channels.
    """

    source: DataSource
    data: NDArray[np.uint8]
    kinds: NDArray[np.int64]
    numbers: NDArray[np.int64]
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]
    log_times: NDArray[np.uint64]
    stamps: NDArray[np.uint64]

    def __len__(self) -> int:
        return len(self.starts)

    def message(self, number: int) -> BagMessage:
        """Return one message, decoded alone.

        Raises:
            BagError: the message is malformed.
        """
        channel = self.source.channels[int(self.numbers[number])]
        start = int(self.starts[number])
        payload = self.data[start : start + int(self.lengths[number])].tobytes()
        log_time = int(self.log_times[number])
        return BagMessage(
            channel.topic, channel.type_name, int(self.stamps[number]), log_time, channel.message(payload, log_time)
        )


def message_blocks(reader: BagReader, types: Sequence[str], table_of: TableOf) -> Iterator[MessageBlock | BagMessage]:
    """Yield the messages of these types in the order of sending: in blocks, or one by one.

    ``table_of`` finds the messages of chunks.

    Raises:
        BagError: as ``BagReader.messages`` does, at the same message.
    """
    if not reader.is_ours:
        yield from reader.messages(types=frozenset(types))
        return
    total = sum(size_of(file) for file in reader.files)
    before, order = 0, reader.new_order()
    for path in reader.files:
        file = _BlockFile(McapFile(path), DataSource(path), types, order, table_of)
        for item in file.items():
            if reader.on_progress is not None:
                reader.on_progress(min(1.0, (before + file.position) / total))
            yield item
        before += file.position
        order.end(file.last_log)


class _BlockFile:
    """Reads one file in blocks."""

    def __init__(
        self, file: McapFile, source: DataSource, types: Sequence[str], order: FileOrder, table_of: TableOf
    ) -> None:
        self._file, self._source, self._order, self._table_of = file, source, order, table_of
        self._types = frozenset(types)
        self._kind_of = {name: kind for kind, name in enumerate(types)}
        self._kinds = np.full(_CHANNELS, -1, np.int64)
        self._begun = False
        self.last_log: int | None = None
        self._is_known = np.zeros(_CHANNELS, bool)
        self._buffer = BlockBuffer()
        self._data: Bytes = np.empty(0, np.uint8)
        self._chunks: list[tuple[int, WholeChunk]] = []

    @property
    def position(self) -> int:
        """Number of bytes of the file read so far."""
        return self._file.position

    def items(self) -> Iterator[MessageBlock | BagMessage]:
        """Yield the messages of the file; those read before an error are yielded first."""
        try:
            for record in self._file.chunks(self._buffer.room):
                if isinstance(record, WholeChunk):
                    data, begin = self._buffer.taken()
                    if data is not self._data:
                        yield from self._take_kept()
                        self._data = data
                    self._chunks.append((begin, record))
                else:
                    yield from self._take_kept()
                    yield from self._one_by_one(record)
        except BagError:
            yield from self._take_kept()
            raise
        yield from self._take_kept()

    def _take_kept(self) -> Iterator[MessageBlock | BagMessage]:
        """Yield the messages of the chunks kept so far, as one block if possible, and discard the chunks."""
        chunks, self._chunks = self._chunks, []
        whole = self._whole_table(chunks)
        if whole is not None:
            yield from self._block([(chunks[0][0], whole)])
            return
        tables: list[tuple[int, ChunkTable]] = []
        for begin, chunk in chunks:
            table = self._table(chunk)
            if table is not None:
                tables.append((begin, table))
                if sum(len(known.places) for _, known in tables) < MOST_MESSAGES:
                    continue
            yield from self._block(tables)
            tables = []
            if table is None:
                yield from self._one_by_one(chunk)
        yield from self._block(tables)

    def _whole_table(self, chunks: Sequence[tuple[int, WholeChunk]]) -> ChunkTable | None:
        """Return the table of all messages of consecutive chunks; None if each chunk must be read separately."""
        if not chunks:
            return None
        begin = chunks[0][0]
        ends = [place - begin + len(chunk.data) for place, chunk in chunks]
        return self._admit(self._table_of(self._data[begin : begin + ends[-1]].data, ends))

    def _table(self, chunk: WholeChunk) -> ChunkTable | None:
        """Return the table of the messages of a chunk; None if they must be read one by one."""
        return self._admit(self._table_of(chunk.data, [len(chunk.data)]))

    def _admit(self, table: ChunkTable | None) -> ChunkTable | None:
        """Return a table if all its messages can be read, and add its definitions and times; else return None."""
        if table is None or not self._is_defined(table):
            return None
        times = table.log_times
        before = self.last_log
        if (times[1:] <= times[:-1]).any() or (before is not None and int(times[0]) <= before):
            return None  # read one by one, so that the messages before the wrong one are returned
        if not self._begun:
            self._order.begin(self._file.path, int(times[0]))
            self._begun = True
        self.last_log = int(table.log_times[-1])
        return table

    def _is_defined(self, table: ChunkTable) -> bool:
        """Add the definitions of a chunk; return whether its channels precede their messages and can be read."""
        if not table.definitions and self._is_known[table.numbers].all():
            return True
        unknown = [
            (number, int(table.places[np.argmax(table.numbers == number)]))
            for number in np.flatnonzero(np.bincount(table.numbers)).tolist()
            if not self._is_known[number]
        ]
        if not unknown and not table.definitions:
            return True
        if not self._stand_before(unknown, table.definitions):
            return False
        for _, opcode, content in table.definitions:
            try:
                self._file.define(opcode, content)
            except BagError:
                return False
        return all(self._is_readable(number) for number, _ in unknown)

    def _stand_before(self, unknown: list[tuple[int, int]], definitions: Sequence[tuple[int, int, bytes]]) -> bool:
        """Return whether channels and their schemas are known or precede their first messages."""
        begins: dict[tuple[int, int], int] = {}
        schemas = {number: channel.schema_id for number, channel in self._file.channels.items()}
        for place, opcode, content in definitions:
            if len(content) < _TWO_NUMBERS.size:
                return False
            number, schema = _TWO_NUMBERS.unpack_from(content)
            begins.setdefault((opcode, number), place)
            if opcode == Opcode.CHANNEL:
                schemas.setdefault(number, schema)
        for number, first in unknown:
            if number not in schemas:
                return False
            channel_begins = -1 if number in self._file.channels else begins[int(Opcode.CHANNEL), number]
            known = schemas[number] in self._file.schemas
            schema_begins = -1 if known else begins.get((int(Opcode.SCHEMA), schemas[number]), -1)
            if max(channel_begins, schema_begins) > first:
                return False
        return True

    def _is_readable(self, number: int) -> bool:
        """Create the reader of a channel; return whether it can be read."""
        made = self._source.channels.get(number)
        if made is None:
            channel = self._file.channels[number]
            schema = self._file.schemas.get(channel.schema_id)
            wanted = schema is not None and schema.name in self._types
            try:
                made = self._source.channels[number] = ChannelReader(self._source.path, channel, schema, wanted)
            except BagError:
                return False
        self._is_known[number] = True
        if made.wanted:
            self._kinds[number] = self._kind_of[made.type_name]
        return True

    def _block(self, tables: Sequence[tuple[int, ChunkTable]]) -> Iterator[MessageBlock]:
        """Yield the messages of these tables as a block."""
        if not tables:
            return
        starts = _join([table.starts + begin for begin, table in tables])
        numbers, lengths = (_join([getattr(table, name) for _, table in tables]) for name in ("numbers", "lengths"))
        log_times, stamps = (_join([getattr(table, name) for _, table in tables]) for name in ("log_times", "stamps"))
        columns: tuple[NDArray[Any], ...] = self._kinds[numbers], numbers, starts, lengths, log_times, stamps
        if (columns[0] < 0).any():
            wanted = np.flatnonzero(columns[0] >= 0)
            columns = tuple(column[wanted] for column in columns)
        if len(columns[0]):
            yield MessageBlock(self._source, self._data, *columns)

    def _one_by_one(self, record: WholeChunk | RawMessage) -> Iterator[BagMessage]:
        """Yield messages that are not in a block."""
        records = self._file.chunk_messages(record) if isinstance(record, WholeChunk) else iter([record])
        for raw in records:
            if not self._begun:
                self._order.begin(self._file.path, raw.log_time)
                self._begun = True
            elif self.last_log is not None and raw.log_time <= self.last_log:
                raise goes_backwards(self._file.path, raw.log_time, self.last_log)
            self.last_log = raw.log_time
            channel = self._source.channel(raw, self._types)
            if channel.wanted:
                yield channel.decoded(raw)


def _join(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    return columns[0] if len(columns) == 1 else np.concatenate(columns)
