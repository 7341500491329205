"""Compresses and writes chunks in a separate thread, one after the other, so that no scan waits for it.

At most one chunk is being written: handing over the next one waits until the previous one is in the file. So a killed
process loses the open chunk and the one being written, order and bytes are those of one thread, and memory is bounded.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from queue import SimpleQueue

_HAND_OVER_S = 0.0005
"""Longest wait for the thread to accept a chunk, s (decision): Python switches to another thread only where this one
waits or after 5 ms, in which a simulated rack has filled the next chunks."""
_LOOK_S = 0.05
"""Pause between two checks whether a job is done, s: where two threads wait, or a wait was interrupted."""

_Job = Callable[[], None]


class ChunkThread:
    """Carries out jobs one after the other. The thread starts with the first job and ends with this object."""

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
            self._begin()
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

    def _begin(self) -> None:
        arguments = self._calls, self._jobs, self._taken, self._done, self._failed
        self._worker = threading.Thread(target=_work, args=arguments, name="recording", daemon=True)
        self._worker.start()


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
