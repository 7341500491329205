"""The data file of a recording, and the options for storing it: compression, file size, time of a chunk."""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

from automax_ros.core.ticks import NS_PER_S

CHUNK_NS = NS_PER_S // 2
"""Period of the messages' time at which chunks end, ns (decision: one is open and one is being written, so a
killed process loses a second at most)."""
COMPRESSIONS = {"zstd": "zstd", "lz4": "lz4", "none": ""}
"""Compressions of chunks: the name of the option, and the name in the file."""
MIN_SPLIT_BYTES = 1 << 16
"""Smallest size at which a recording is split (decision): a smaller file has little but the facts at its beginning."""


@dataclass(frozen=True)
class StorageOptions:
    """Options for storing a recording.

    ``compression`` is a key of COMPRESSIONS. A file ends when it has ``split_bytes`` bytes, 0 for never. A chunk ends
    every ``chunk_ns`` of the messages' time: a killed process loses two of them at most.
    """

    compression: str = "zstd"
    split_bytes: int = 0
    chunk_ns: int = CHUNK_NS

    def __post_init__(self) -> None:
        """Check the options.

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
    """A new file, unbuffered; after a failed write it is truncated to its former size."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = FileIO(path, "xb")
        self._size = 0
        self._lock = threading.Lock()

    def write(self, data: bytes) -> int:
        """Append all bytes."""
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
        """Return the number of bytes in the file."""
        return self._size

    def sync(self) -> None:
        """Wait until everything is on the disk. May be called from another thread."""
        with self._lock:
            descriptor = -1 if self._file.closed else os.dup(self._file.fileno())
        if descriptor >= 0:
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._file.close()
