"""A piece of work, its outcome, where pieces are done, and the errors of a cluster."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from automax_ros.core.text import printable
from automax_ros.core.user_error import UserError

MOST_TRIES = 2
"""How often a piece is started if its workers die (decision: whatever kills workers shall not kill them all)."""


@dataclass(frozen=True)
class Job:
    """One piece: ``work``, a function of a module, called with ``arguments``; all of it, and the result, is pickled.

    ``name`` identifies it in messages; it should be unlike that of every other piece.
    """

    name: str
    work: Callable[..., Any]
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True)
class JobFault:
    """Why a piece has no result: the piece's name, the error of its work with its kind, and the worker it came from.

    ``died``: there was no report, because each worker that started it has died. ``trace`` is for developers.
    """

    piece: str
    kind: str
    message: str
    worker: str = ""
    trace: str = ""
    died: bool = False

    def __str__(self) -> str:
        where = f" (on {self.worker})" if self.worker else ""
        return f"{self.piece}: {self.message or self.kind}{where}"


@dataclass(frozen=True)
class JobResult:
    """A piece that has ended: with its result, or with its fault."""

    piece: Job
    result: Any | None = None
    fault: JobFault | None = None


@dataclass(frozen=True)
class Workers:
    """Where pieces are done: by the cluster of a Dask ``scheduler``, else by ``jobs`` processes of this machine.

    ``jobs`` of 1 is this process itself, None one process per usable core.
    """

    jobs: int | None = 1
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise ValueError(f"{self.jobs} jobs: at least 1")

    @property
    def processes(self) -> int:
        """The number of processes of this machine that work in parallel."""
        return self.jobs if self.jobs is not None else usable_cores()


def usable_cores() -> int:
    """Return the number of cores of this machine that the process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def fault_of(name: str, error: Exception, worker: str = "") -> JobFault:
    """Return the fault of a piece whose work raised an error."""
    trace = "".join(traceback.format_exception(type(error), error, error.__traceback__))
    return JobFault(name, type(error).__name__, str(error), worker, trace)


def death_of(name: str, what: str, worker: str = "") -> JobFault:
    """Return the fault of a piece whose workers died as often as it may be tried."""
    return JobFault(name, "WorkerDied", f"{what}, {MOST_TRIES} times; it is not tried again", worker, died=True)


def result_of(piece: Job, worker: str = "") -> JobResult:
    """Do a piece in this process."""
    try:
        return JobResult(piece, piece.work(*piece.arguments))
    except Exception as error:
        return JobResult(piece, fault=fault_of(piece.name, error, worker))


class ClusterFault(UserError):
    """Pieces cannot be given to a cluster: ``place`` is the scheduler's address.

    ``code`` is AMX6851 to AMX6854, AMX6857 or AMX6858.
    """

    def __init__(self, code: str, place: str, message: str, hint: str) -> None:
        super().__init__(printable(message), printable(hint), code=code, place=printable(place))
