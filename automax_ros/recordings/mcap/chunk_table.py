"""Unpacked chunks whose messages are found by the index after the chunk, without reading them one by one.

The index is not trusted: it is used only if its messages and the chunk's own definitions fill the chunk without gaps.
The chunks of a block are unpacked one after the other into a buffer of a few megabytes.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Chunk
from numpy.typing import NDArray

from automax_ros.recordings.mcap.chunk_builder import MESSAGE_FIELDS, RECORD_HEAD
from automax_ros.recordings.mcap.unpacking import Buffer

BLOCK_BYTES = 16 << 20
"""Most unpacked bytes of a block; a larger chunk is a separate block (decision: a bound on memory)."""


class BlockBuffer:
    """Provides buffers for unpacked chunks. A full buffer is not reused; a new one is created."""

    def __init__(self) -> None:
        self._filling = np.empty(0, np.uint8)
        self._used = 0
        self._given: deque[tuple[NDArray[np.uint8], int]] = deque()

    def room(self, size: int) -> memoryview:
        """Return the memory for the next chunk."""
        if self._used + size > len(self._filling):
            self._filling, self._used = np.empty(max(BLOCK_BYTES, size), np.uint8), 0
        begin = self._used
        self._used += size
        self._given.append((self._filling, begin))
        return self._filling.data[begin : self._used]

    def taken(self) -> tuple[NDArray[np.uint8], int]:
        """Return the buffer of the next chunk in the order of ``room``, and where the chunk begins in it."""
        return self._given.popleft()


_INDEX_HEAD = struct.Struct("<HI")
"""Beginning of a message index's content: channel, and bytes of the entries."""
_ENTRY = np.dtype([("log_time", "<u8"), ("place", "<u8")])
_HEAD = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
"""Beginning of a message's record."""
MESSAGE_HEAD = RECORD_HEAD.size + MESSAGE_FIELDS.size
"""Bytes of a record before the message itself."""
Definition = tuple[int, int, bytes]
"""A schema or channel: the place of its record, its opcode and its content."""
DEFINITIONS = frozenset({int(Opcode.SCHEMA), int(Opcode.CHANNEL)})
MESSAGE = int(Opcode.MESSAGE)
"""A plain number: comparing with a member of an enumeration takes longer than finding a record."""
FIRST_PRIVATE_OPCODE = 0x80
"""First private opcode; readers skip records that they do not know."""
_IN_CHUNK = DEFINITIONS | {MESSAGE}
_MOST_DEFINITIONS = 10_000
MOST_MESSAGES = 400_000
"""The messages of a chunk with more than this are read one by one (decision: a bound on memory for untrusted
recordings)."""


@dataclass(frozen=True)
class ChunkTable:
    """The messages of a chunk in the order of the file: ``numbers`` of their channels, places, lengths and times.

    ``places`` are where their records begin. ``definitions`` are the schemas and channels: place, opcode, content.
    """

    numbers: NDArray[np.int64]
    places: NDArray[np.int64]
    lengths: NDArray[np.int64]
    log_times: NDArray[np.uint64]
    stamps: NDArray[np.uint64]
    definitions: tuple[Definition, ...]

    @property
    def starts(self) -> NDArray[np.int64]:
        """Where the messages themselves begin."""
        return self.places + MESSAGE_HEAD


class WholeChunk:
    """The unpacked bytes of a chunk, which ends at ``place`` in the file, and the indexes that follow it.

    Of a damaged file: ``packed`` is the chunk as stored, None if ``data`` was recovered of one that the file has only
    in part; ``cut``: there was more than that.
    """

    def __init__(self, data: Buffer, place: int = 0, packed: Chunk | None = None, *, cut: bool = False) -> None:
        self.data, self.place, self.packed, self.cut = data, place, packed, cut
        self._indexes: list[bytes] | None = []
        self._left = len(data) // MESSAGE_HEAD * _ENTRY.itemsize
        """Most bytes that further entries can have."""

    def add_index(self, content: bytes) -> None:
        """Add the content of a message index; one that cannot be that of the chunk invalidates all of them."""
        if self._indexes is None or len(content) < _INDEX_HEAD.size:
            self._indexes = None
            return
        _, size = _INDEX_HEAD.unpack_from(content)
        self._left -= size
        if size != len(content) - _INDEX_HEAD.size or size % _ENTRY.itemsize or self._left < 0:
            self._indexes = None
        elif size:
            self._indexes.append(content)

    def table(self) -> ChunkTable | None:
        """Return the table of the messages; None if the indexes do not account for every byte of the chunk."""
        if not self._indexes or sum(map(len, self._indexes)) > MOST_MESSAGES * _ENTRY.itemsize:
            return None
        parts = [np.frombuffer(content, _ENTRY, offset=_INDEX_HEAD.size)["place"] for content in self._indexes]
        told = np.sort(np.concatenate(parts))
        if told[-1] > len(self.data) - MESSAGE_HEAD:
            return None
        places = told.astype(np.int64)
        found = np.ndarray((len(self.data) - MESSAGE_HEAD + 1,), f"V{MESSAGE_HEAD}", self.data, strides=(1,))
        heads = found[places].view(_HEAD)
        lengths = heads["length"]
        if (heads["opcode"] != MESSAGE).any() or (lengths < MESSAGE_FIELDS.size).any():
            return None
        if (lengths > len(self.data)).any():
            return None
        ends = places + RECORD_HEAD.size + lengths.astype(np.int64)
        begins = np.append(places, len(self.data))
        known = np.concatenate(([0], ends))
        if (known > begins).any():
            return None
        gaps = np.flatnonzero(known < begins)
        definitions: list[Definition] = []
        try:
            for begin, end in zip(known[gaps].tolist(), begins[gaps].tolist(), strict=True):
                for opcode, start, _ in chunk_records(self.data[begin:end]):
                    if opcode == MESSAGE or len(definitions) == _MOST_DEFINITIONS:
                        return None
                    definitions.append(definition_at(self.data, begin + start - RECORD_HEAD.size))
        except ValueError:
            return None
        return ChunkTable(
            heads["channel"].astype(np.int64),
            places,
            lengths.astype(np.int64) - MESSAGE_FIELDS.size,
            heads["log_time"].copy(),
            heads["publish_time"].copy(),
            tuple(definitions),
        )


def chunk_records(data: Buffer) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of the content of each schema, channel and message in a chunk's data.

    Raises:
        ValueError: a record is cut, or is of a kind that a chunk does not hold; private ones are passed over.
    """
    position, size = 0, len(data)
    while position < size:
        start = position + RECORD_HEAD.size
        if start > size:
            raise ValueError("a chunk ends inside a record")
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        position = start + length
        if position > size:
            raise ValueError(f"a record of {length} bytes in the last {size - start} bytes of a chunk")
        if opcode in _IN_CHUNK:
            yield opcode, start, position
        elif opcode < FIRST_PRIVATE_OPCODE:
            raise ValueError(f"a record of kind {opcode} inside a chunk")


def definition_at(data: Buffer, place: int) -> Definition:
    """Return the schema or channel whose record begins at a place of a chunk."""
    opcode, length = RECORD_HEAD.unpack_from(data, place)
    start = place + RECORD_HEAD.size
    return place, opcode, bytes(data[start : start + length])
