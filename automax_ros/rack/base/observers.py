"""Observers of a rack, called in order: streams, nodes, tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task

HALT, STEP, RESUME = "pause", "step", "resume"
"""Operations on rack time alone: they change no task."""
_ON_TIME = frozenset({HALT, STEP, RESUME})


@dataclass(frozen=True)
class Operation:
    """An operation on a rack: ``what`` as in stimuli files, ``task`` if it concerns one.

    ``reason`` is the cause, or why it was refused (``ok`` FALSE), ``detail`` the rest: ``REF% = 200`` of a force.
    """

    at_ns: int
    what: str
    task: str = ""
    ok: bool = True
    reason: str = ""
    detail: str = ""

    def concerns(self, task: str) -> bool:
        """Return whether it may change a task; ``task`` of a STOP ALL is only the one that caused it."""
        return self.what not in _ON_TIME and (self.task in ("", task) or self.what == "stop_all")


class RackObserver(Protocol):
    """Receives all that happens in a rack, in order."""

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        """A task has executed a scan, or its part before SCAN_LOOP as scan 0, with these writes to memory."""

    def written(self, writes: list[WriteGroup]) -> None:
        """Memory was written, or a view forced or released, from outside the tasks."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """A tunable of a task was set between two scans, or a local forced or released."""

    def operated(self, operation: Operation) -> None:
        """The rack or a task was operated: put into RUN, stopped, reloaded, switched off ..."""


class Observers:
    """All observers of one rack; they receive writes in the order in which they happened."""

    def __init__(self, memory: CommonMemory) -> None:
        self._memory = memory
        self._all: list[RackObserver] = []

    def add(self, observer: RackObserver) -> None:
        """Add an observer, and keep the write log from now on."""
        self._all.append(observer)
        self._memory.keep_log()

    def scanned(self, task: Task, record: ScanRecord) -> None:
        """Report a scan and its writes."""
        writes = self._memory.take_writes()
        for observer in self._all:
            observer.scanned(task, record, writes)

    def report_writes(self) -> None:
        """Report writes that were not made by a scan."""
        writes = self._memory.take_writes()
        if writes:
            for observer in self._all:
                observer.written(writes)

    def tuned(self, task: Task, now_ns: int) -> None:
        """Report that a tunable was set, or a local forced or released."""
        for observer in self._all:
            observer.tuned(task, now_ns)

    def operated(self, operation: Operation) -> None:
        """Report an operation, after the writes that belong to it."""
        self.report_writes()
        for observer in self._all:
            observer.operated(operation)
