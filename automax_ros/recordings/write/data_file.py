"""The file that a recording is written to, and how it reaches the disk.

How a recording is stored: compression, size of its files, time of its chunks.
"""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

from automax_ros.core.ticks import NS_PER_S

CHUNK_NS = NS_PER_S // 2
"""A chunk ends with each of these times of the messages, ns (decision: one is open and one is being written, so a
killed process loses a second at most)."""
COMPRESSIONS = {"zstd": "zstd", "lz4": "lz4", "none": ""}
"""How chunks can be compressed: the word for it, and what the file calls it."""
MIN_SPLIT_BYTES = 1 << 16
"""Smallest size to split a recording at (decision): a smaller file holds little but the facts at its beginning."""


@dataclass(frozen=True)
class StorageOptions:
    """How a recording is stored.

    ``compression`` is a key of COMPRESSIONS. A file ends when it has ``split_bytes`` bytes, 0 for never. A chunk ends
    each ``chunk_ns`` of the messages' time: a killed process loses two of them at most.
    """

    compression: str = "zstd"
    split_bytes: int = 0
    chunk_ns: int = CHUNK_NS

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ValueError: an unknown compression, or a size or time out of range.
        """
        if self.compression not in COMPRESSIONS:
            raise ValueError(f"{self.compression!r} is not a compression: there are {', '.join(COMPRESSIONS)}")
        if self.split_bytes and self.split_bytes < MIN_SPLIT_BYTES:
            raise ValueError(
                f"files of {self.split_bytes} bytes are too small: at least {MIN_SPLIT_BYTES}, or 0 for no limit"
            )
        if self.chunk_ns <= 0:
            raise ValueError(f"chunks of {self.chunk_ns} ns")


class DataFile:
    """A new file, unbuffered; what a failed write left in it is cut off again."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = FileIO(path, "xb")
        self._size = 0
        self._lock = threading.Lock()

    def write(self, data: bytes) -> int:
        """Append all of the bytes."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
        except OSError:
            self._file.truncate(self._size)
            raise
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Return how many bytes stand in it."""
        return self._size

    def sync(self) -> None:
        """Wait until everything has reached the disk itself. May be called from another thread."""
        with self._lock:
            descriptor = -1 if self._file.closed else os.dup(self._file.fileno())
        if descriptor >= 0:
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def close(self) -> None:
        """Close it."""
        with self._lock:
            self._file.close()


def sync_path(path: Path) -> None:
    """Wait until a file or folder is on the disk itself."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
