"""The data file of a recording, the thread that writes it, and its options: compression, file size, time of a chunk."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from queue import SimpleQueue

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


_HAND_OVER_S = 0.0005
"""Longest wait for the thread to accept a chunk, s (decision): Python switches to another thread only where this one
waits or after 5 ms, in which a simulated rack has filled the next chunks."""
_LOOK_S = 0.05
"""Pause between two checks whether a job is done, s: where two threads wait, or a wait was interrupted."""

_Job = Callable[[], None]


class ChunkThread:
    """Compresses and writes chunks in a separate thread, one after the other, so that no scan waits for it.

    At most one chunk is being written: handing over the next one waits until the previous one is in the file. So a
    killed process loses the open chunk and the one being written, order and bytes are those of one thread, and memory
    is bounded. The thread starts with the first job and ends with this object.
    """

    def __init__(self) -> None:
        self._worker: threading.Thread | None = None
        self._calls: SimpleQueue[bool] = SimpleQueue()
        self._jobs: deque[_Job] = deque()
        """The present job, or none."""
        self._taken, self._done = threading.Lock(), threading.Lock()
        """Free when the job was accepted, and when it is done."""
        self._failed: list[Exception] = []

    def __del__(self) -> None:
        self._calls.put(False)

    def hand(self, job: _Job) -> None:
        """Hand over a job, after the previous one is done; a quick job may be done on return.

        Raises:
            Exception: that of a previous job; this one is not carried out.
        """
        if self._worker is None:
            arguments = self._calls, self._jobs, self._taken, self._done, self._failed
            self._worker = threading.Thread(target=_work, args=arguments, name="recording", daemon=True)
            self._worker.start()
        self.settle()
        self._taken.acquire(blocking=False)
        self._jobs.append(job)
        self._calls.put(True)
        self._taken.acquire(timeout=_HAND_OVER_S)

    def settle(self) -> None:
        """Wait until no job is left.

        Raises:
            Exception: that of a job.
        """
        while self._jobs:
            if not self._done.acquire(timeout=_LOOK_S):
                self._calls.put(True)  # a signal may have interrupted between the job and its call
        if self._failed:
            raise self._failed.pop()

    @property
    def failed(self) -> bool:
        """Whether a job has raised an exception that ``settle`` has not raised yet."""
        return bool(self._failed)

    def end(self) -> None:
        """End the thread after the present job."""
        if self._worker is not None:
            self._calls.put(False)
            self._worker.join()
            self._worker = None


def _work(
    calls: SimpleQueue[bool],
    jobs: deque[_Job],
    taken: threading.Lock,
    done: threading.Lock,
    failed: list[Exception],
) -> None:
    while calls.get():
        if jobs:
            _free(taken)
            try:
                jobs[0]()
            except Exception as error:  # raised when the next job is handed over
                failed.append(error)
            jobs.popleft()
            _free(done)


def _free(lock: threading.Lock) -> None:
    if lock.locked():
        lock.release()
