"""Pieces done by processes of this machine, each of which gets one piece after the other.

concurrent.futures is not used: if one process dies, its pool abandons all and cannot report the piece.

The processes are copies of this one if that is safe, else fresh interpreters. A copy (fork) is ready after some
milliseconds with all that is imported and prepared here; a fresh interpreter imports it again for a second. A copy is
safe only if nothing else runs in this process, which could hold a lock for ever in the copy: no other thread of Python,
and none of a library (decision). Threads of numerical libraries that end before a fork, as OpenBLAS's do, do not count.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import multiprocessing.connection
import os
import pickle
import select
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NoReturn

from automax_ros.parallel.job import MOST_TRIES, Job, JobFault, JobResult, death_of, fault_of, result_of

_THREADS = Path("/proc/self/task")
"""A folder with a name for each thread of this process; without it, processes are fresh interpreters."""
_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_PROGRAM = (
    "import sys; sys.path[:] = sys.argv[2:]; from multiprocessing.connection import Connection; "
    "from automax_ros.parallel.local import work; work(Connection(int(sys.argv[1])))"
)
"""The program of a fresh interpreter: it imports only from our import path, not from its working folder."""


_POLL_S = 0.1
"""Seconds between two calls of ``should_stop``."""


def begin(end: Connection, ours: Iterable[Connection]) -> Callable[[], int]:
    """Start a process that does the pieces received from ``end``; ``ours`` are connections that it must close.

    It has its own session: Ctrl-C at the terminal reaches only this process, which ends it. Returns what ends it at
    once, and gives its exit code, negative for a signal.
    """
    return _copy(end, ours) or _fresh(end)


def _fresh(end: Connection) -> Callable[[], int]:
    process = subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, str(end.fileno()), *sys.path],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        pass_fds=(end.fileno(),),
        start_new_session=True,
    )

    def kill() -> int:
        process.kill()
        return process.wait()

    return kill


def _copy(end: Connection, ours: Iterable[Connection]) -> Callable[[], int] | None:
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

    def kill() -> int:
        try:
            os.kill(pid, signal.SIGKILL)
            return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        except (ProcessLookupError, ChildProcessError):
            return 0  # the exit code is unknown if a program ignores SIGCHLD

    if len(list(_THREADS.iterdir())) == 1:
        return kill
    kill()  # threads unknown to Python were running at the fork: the copy has done nothing yet
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
    """Do pieces by ``count`` processes; the arguments and the end are those of ``run_jobs``."""
    todo = deque((number, 1) for number in range(len(pieces)))
    workers: dict[Connection, _Worker] = {}
    try:
        for _ in range(count):
            _Worker(workers)
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
            ending = f"signal {-code}" if code < 0 else f"exit code {code}"
            take(number, JobResult(piece, fault=death_of(piece.name, f"its process has died ({ending})")))
        if todo:
            _Worker(workers)
        return
    worker.task = None
    take(number, JobResult(pieces[number], result, fault))


class _Worker:
    """A process that does one piece after the other; ``task`` is its present piece and the number of the try."""

    def __init__(self, workers: dict[Connection, _Worker]) -> None:
        self.end, other = multiprocessing.Pipe()
        self.task: tuple[int, int] | None = None
        with other:
            self._kill = begin(other, [self.end, *workers])
        workers[self.end] = self

    def give(self, pieces: Sequence[Job], number: int, tries: int) -> None:
        """Send it a piece; if it has died by now, that is detected when its answer is read."""
        self.task = number, tries
        payload = pickle.dumps(pieces[number])
        with contextlib.suppress(OSError):
            self.end.send_bytes(payload)

    def answer(self) -> tuple[object, JobFault | None]:
        """Return the result and the fault of the piece; EOFError or OSError: the process has died."""
        answer: tuple[object, JobFault | None] = pickle.loads(self.end.recv_bytes())
        return answer

    def kill(self) -> int:
        code = self._kill()
        self.end.close()
        return code


def work(end: Connection) -> None:
    """Do the pieces received from a connection; return when its other end is closed."""
    threading.Thread(target=_end_when_alone, args=(end.fileno(),), daemon=True).start()
    with end:
        while True:
            try:
                end.send_bytes(_answer(end.recv_bytes()))
            except (EOFError, OSError):
                return


def _answer(payload: bytes) -> bytes:
    """Do a pickled piece; return its result and its fault, pickled, or a fault if the result cannot be pickled."""
    piece = pickle.loads(payload)
    done = result_of(piece)
    try:
        return pickle.dumps((done.result, done.fault))
    except Exception as error:
        return pickle.dumps((None, fault_of(piece.name, error)))


def _end_when_alone(number: int) -> None:
    """End this process, whatever it is doing, when the process that sends pieces has ended, also by a signal."""
    alone = select.poll()
    alone.register(number, 0)  # nothing but the end of the other side
    alone.poll()
    os._exit(1)
