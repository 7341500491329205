"""The bytes of a file, read in large pieces, with the checksum of the bytes returned."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Container
from typing import Any, BinaryIO

PIECE_BYTES = 1 << 18
"""Bytes that are read at once (decision: records of 100 bytes cost what they are, not a read each)."""


class CheckedStream:
    """Returns the bytes of a file one after the other; ``position`` counts them."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._buffer = b""
        self._at = self._summed = self._crc = 0
        self._before = 0
        """Bytes of the file before the buffer."""

    @property
    def position(self) -> int:
        """Number of bytes returned or skipped so far."""
        return self._before + self._at

    def take(self, length: int) -> bytes:
        """Return the next bytes, fewer if the file ends earlier."""
        count = self.skip(length)
        return self._buffer[self._at - count : self._at]

    def numbers(self, layout: struct.Struct) -> tuple[Any, ...]:
        """Return the numbers in the next bytes; none if the file ends earlier."""
        if self._at + layout.size > len(self._buffer):
            self._fill(layout.size)
            if layout.size > len(self._buffer):
                self._at = len(self._buffer)
                return ()
        self._at += layout.size
        return layout.unpack_from(self._buffer, self._at - layout.size)

    def pass_over(self, head: struct.Struct, kinds: Container[int]) -> None:
        """Skip records of some kinds as far as they are in the buffer; a head has kind and length of each."""
        at, buffer = self._at, self._buffer
        while at + head.size <= len(buffer):
            kind, length = head.unpack_from(buffer, at)
            if kind not in kinds or at + head.size + length > len(buffer):
                break
            at += head.size + length
        self._at = at

    def skip(self, length: int) -> int:
        """Skip the next bytes; return how many there were."""
        if self._at + length > len(self._buffer):
            self._fill(length)
        begin = self._at
        self._at = min(begin + length, len(self._buffer))
        return self._at - begin

    def jump(self, position: int) -> None:
        """Continue at another position; the checksum then covers nothing."""
        self._file.seek(position)
        self._buffer, self._before = b"", position
        self._at = self._summed = 0

    def crc(self, without: int = 0) -> int:
        """Return the CRC-32 of the bytes since ``begin_crc``, except the last ``without``, which were read at once."""
        end = self._at - without
        self._crc = zlib.crc32(memoryview(self._buffer)[self._summed : end], self._crc)
        self._summed = end
        return self._crc

    def begin_crc(self) -> None:
        """Start the checksum at the next byte."""
        self._crc, self._summed = 0, self._at

    def _fill(self, length: int) -> None:
        self.crc()
        rest = self._buffer[self._at :]
        self._before += self._at
        self._buffer = rest + self._file.read(max(PIECE_BYTES, length - len(rest)))
        self._at = self._summed = 0
