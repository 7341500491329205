"""Unpacked chunks, the tables of their messages, and their records one by one.

The chunks of a block are unpacked one after the other into a buffer of a few megabytes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Chunk
from numpy.typing import NDArray

from automax_ros.recordings.mcap.mcap_output import MESSAGE_FIELDS, RECORD_HEAD
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
    """The unpacked bytes of a chunk, which ends at ``place`` in the file.

    Of a damaged file: ``packed`` is the chunk as stored, None if ``data`` was recovered of one that the file has only
    in part; ``cut``: there was more than that.
    """

    def __init__(self, data: Buffer, place: int = 0, packed: Chunk | None = None, *, cut: bool = False) -> None:
        self.data, self.place, self.packed, self.cut = data, place, packed, cut


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
