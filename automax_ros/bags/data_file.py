"""The file that a recording is written to, and how it reaches the disk."""

from __future__ import annotations

import os
import threading
from io import FileIO
from pathlib import Path


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
