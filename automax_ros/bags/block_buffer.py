"""Where the chunks of a block are unpacked to: one after the other in a few megabytes."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

BLOCK_BYTES = 16 << 20
"""Bytes unpacked that a block has at most; a larger chunk is a block of its own (decision: a bound on memory)."""


class BlockBuffer:
    """Gives room to chunks. A buffer that is full stays as it is, and another one is begun."""

    def __init__(self) -> None:
        self._filling = np.empty(0, np.uint8)
        self._used = 0
        self._given: deque[tuple[NDArray[np.uint8], int]] = deque()

    def room(self, size: int) -> memoryview:
        """Return the room of the next chunk."""
        if self._used + size > len(self._filling):
            self._filling, self._used = np.empty(max(BLOCK_BYTES, size), np.uint8), 0
        begin = self._used
        self._used += size
        self._given.append((self._filling, begin))
        return self._filling.data[begin : self._used]

    def taken(self) -> tuple[NDArray[np.uint8], int]:
        """Return the buffer of the chunk that was read next, and where it begins there."""
        return self._given.popleft()
