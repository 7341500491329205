"""What a damaged mcap file has lost, and where reading can continue after an unreadable place."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import BinaryIO

from mcap.opcode import Opcode

from automax_ros.recordings.mcap.chunk_builder import RECORD_HEAD
from automax_ros.recordings.mcap.unpacking import MAX_RECORD_BYTES

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
        self.lose(start - position, f"no whole record stands from byte {position} to {end}")
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
