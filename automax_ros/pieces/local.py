"""Pieces done by processes of this machine, each of which gets one piece after the other.

Not by concurrent.futures: when one process dies its pool gives up all of them and cannot say which piece it was.
"""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import pickle
from collections import deque
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection

from automax_ros.pieces.piece import MOST_TRIES, Done, Piece, PieceFault, death_of
from automax_ros.pieces.processes import begin

_POLL_S = 0.1
"""How often ``should_stop`` is asked."""


def in_processes(
    pieces: Sequence[Piece], count: int, take: Callable[[int, Done], None], should_stop: Callable[[], bool]
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
    pieces: Sequence[Piece],
    todo: deque[tuple[int, int]],
    take: Callable[[int, Done], None],
) -> None:
    """Take what a worker tells, or put another one in the place of one that has died."""
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
            take(number, Done(piece, fault=death_of(piece.name, f"its process has died ({_ending(code)})")))
        if todo:
            _begin(workers)
        return
    worker.task = None
    take(number, Done(pieces[number], result, fault))


def _begin(workers: dict[Connection, _Worker]) -> None:
    worker = _Worker(list(workers))
    workers[worker.end] = worker


class _Worker:
    """A process that does one piece after the other; ``task`` is the piece under way and its try."""

    def __init__(self, ends: list[Connection]) -> None:
        """Begin it; ``ends`` are those of the connections to others."""
        self.end, other = multiprocessing.Pipe()
        self.task: tuple[int, int] | None = None
        with other:
            self._process = begin(other, [self.end, *ends])

    def give(self, pieces: Sequence[Piece], number: int, tries: int) -> None:
        """Let it do a piece; one that has died by now is found out when it is listened to."""
        self.task = number, tries
        payload = pickle.dumps(pieces[number])
        try:
            self.end.send_bytes(payload)
        except OSError:
            return

    def answer(self) -> tuple[object, PieceFault | None]:
        """Return what came of the piece: its result, or its fault.

        Raises:
            EOFError: the process has died.
            OSError: likewise, within its answer.
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
