"""Pieces done by processes of this machine, each of which gets one piece after the other.

concurrent.futures is not used: if one process dies, its pool abandons all and cannot report the piece.

The processes are copies of this one if that is safe, else fresh interpreters. A copy (fork) is ready after some
milliseconds with all that is imported and prepared here; a fresh interpreter imports it again for a second. A copy is
safe only if nothing else runs in this process, which could hold a lock for ever in the copy: no other thread of Python,
and none of a library (decision). Threads of numerical libraries that end before a fork, as OpenBLAS's do, do not count.
"""

from __future__ import annotations

import gc
import multiprocessing
import multiprocessing.connection
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NoReturn, Protocol

from automax_ros.parallel.job import MOST_TRIES, Job, JobResult, PieceFault, death_of
from automax_ros.parallel.worker import work

_THREADS = Path("/proc/self/task")
"""A folder with a name for each thread of this process; without it, processes are fresh interpreters."""
_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_PROGRAM = (
    "import sys; sys.path[:] = sys.argv[2:]; from multiprocessing.connection import Connection; "
    "from automax_ros.parallel.worker import work; work(Connection(int(sys.argv[1])))"
)
"""The program of a fresh interpreter: it imports only from our import path, not from its working folder."""


_POLL_S = 0.1
"""Seconds between two calls of ``should_stop``."""


class Process(Protocol):
    """A process that was started."""

    def kill(self) -> int:
        """End it at once; return its exit code, negative for a signal."""
        ...


def begin(end: Connection, ours: Iterable[Connection]) -> Process:
    """Start a process that does the pieces received from ``end``; ``ours`` are connections that it must close.

    It has its own session: Ctrl-C at the terminal reaches only this process, which ends it.
    """
    return _copy(end, ours) or _Fresh(end)


class _Fresh:
    """A fresh interpreter."""

    def __init__(self, end: Connection) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, str(end.fileno()), *sys.path],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=(end.fileno(),),
            start_new_session=True,
        )

    def kill(self) -> int:
        self._process.kill()
        return self._process.wait()


class _Copy:
    """A copy of this process."""

    def __init__(self, pid: int) -> None:
        self._pid = pid

    def kill(self) -> int:
        try:
            os.kill(self._pid, signal.SIGKILL)
            return os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1])
        except (ProcessLookupError, ChildProcessError):
            return 0  # the exit code is unknown if a program ignores SIGCHLD


def _copy(end: Connection, ours: Iterable[Connection]) -> Process | None:
    """Start a copy; return None if that would not be safe, or fails."""
    if threading.active_count() != 1 or not _THREADS.is_dir():
        return None
    # A copy must not be interrupted as if it were this process.
    held = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
    try:
        pid = os.fork()
        if not pid:
            _work_and_end(end, ours, held)
    except OSError:
        return None
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)
    copy = _Copy(pid)
    if len(list(_THREADS.iterdir())) == 1:
        return copy
    copy.kill()  # threads unknown to Python were running at the fork: the copy has done nothing yet
    return None


def _work_and_end(end: Connection, ours: Iterable[Connection], held: Iterable[int]) -> NoReturn:
    """Work, and exit without returning: cleaning up at exit is left to the process that was copied."""
    try:
        os.setsid()
        for number in _ENDING:
            signal.signal(number, signal.SIG_DFL)
        signal.set_wakeup_fd(-1)
        signal.pthread_sigmask(signal.SIG_SETMASK, held)
        for other in ours:
            other.close()
        null = os.open(os.devnull, os.O_RDWR)
        os.dup2(null, 0)
        os.dup2(null, 1)
        gc.freeze()  # copied objects are never traversed, so their memory stays shared
        work(end)
    finally:
        os._exit(1)


def in_processes(
    pieces: Sequence[Job], count: int, take: Callable[[int, JobResult], None], should_stop: Callable[[], bool]
) -> None:
    """Do pieces by ``count`` processes; the arguments and the end are those of ``run_pieces``."""
    todo = deque((number, 1) for number in range(len(pieces)))
    workers: dict[Connection, _Worker] = {}
    try:
        for _ in range(count):
            _begin(workers)
        while True:
            for worker in workers.values():
                if todo and worker.task is None:
                    worker.give(pieces, *todo.popleft())
            busy = [end for end, worker in workers.items() if worker.task is not None]
            if not busy or should_stop():
                return
            for end in multiprocessing.connection.wait(busy, _POLL_S):
                assert isinstance(end, Connection)
                _take_from(workers, end, pieces, todo, take)
    finally:
        for worker in workers.values():
            worker.kill()


def _take_from(
    workers: dict[Connection, _Worker],
    end: Connection,
    pieces: Sequence[Job],
    todo: deque[tuple[int, int]],
    take: Callable[[int, JobResult], None],
) -> None:
    """Receive the outcome from a worker, or replace the worker if it has died."""
    worker = workers[end]
    assert worker.task is not None
    number, tries = worker.task
    try:
        result, fault = worker.answer()
    except (EOFError, OSError):
        code = worker.kill()
        del workers[end]
        if tries < MOST_TRIES:
            todo.appendleft((number, tries + 1))
        else:
            piece = pieces[number]
            take(number, JobResult(piece, fault=death_of(piece.name, f"its process has died ({_ending(code)})")))
        if todo:
            _begin(workers)
        return
    worker.task = None
    take(number, JobResult(pieces[number], result, fault))


def _begin(workers: dict[Connection, _Worker]) -> None:
    worker = _Worker(list(workers))
    workers[worker.end] = worker


class _Worker:
    """A process that does one piece after the other; ``task`` is its present piece and the number of the try."""

    def __init__(self, ends: list[Connection]) -> None:
        """Start it; ``ends`` are those of the connections to others."""
        self.end, other = multiprocessing.Pipe()
        self.task: tuple[int, int] | None = None
        with other:
            self._process = begin(other, [self.end, *ends])

    def give(self, pieces: Sequence[Job], number: int, tries: int) -> None:
        """Send it a piece; if it has died by now, that is detected when its answer is read."""
        self.task = number, tries
        payload = pickle.dumps(pieces[number])
        try:
            self.end.send_bytes(payload)
        except OSError:
            return

    def answer(self) -> tuple[object, PieceFault | None]:
        """Return the outcome of the piece: its result, or its fault.

        Raises:
            EOFError: the process has died.
            OSError: the process has died while it answered.
        """
        answer: tuple[object, PieceFault | None] = pickle.loads(self.end.recv_bytes())
        return answer

    def kill(self) -> int:
        """End it at once; return its exit code, negative for a signal."""
        code = self._process.kill()
        self.end.close()
        return code


def _ending(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"
