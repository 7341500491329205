"""Those who are told what happens in a rack, in order: streams, nodes, tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task

HALT, STEP, RESUME = "pause", "step", "resume"
"""Operations that concern time alone: they leave every task as it was."""
_ON_TIME = frozenset({HALT, STEP, RESUME})


@dataclass(frozen=True)
class Operation:
    """Something that was done to a rack: ``what`` as stimuli files call it, ``task`` where it concerns one.

    ``ok`` is FALSE where it was refused; ``reason`` says why, or what was the cause. ``detail`` is what was asked for
    besides: ``REF% = 200`` of a force.
    """

    at_ns: int
    what: str
    task: str = ""
    ok: bool = True
    reason: str = ""
    detail: str = ""

    def concerns(self, task: str) -> bool:
        """Return whether a task may be another after it; ``task`` of a STOP ALL is only the one that caused it."""
        return self.what not in _ON_TIME and (self.task in ("", task) or self.what == "stop_all")


class RackObserver(Protocol):
    """Somebody who is told what happens in a rack, in order."""

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        """A task has scanned (or, as scan 0, executed what stands before SCAN_LOOP), with its writes to memory."""
        ...

    def written(self, writes: list[WriteGroup]) -> None:
        """Memory was written, or a view forced or released, from outside the tasks."""
        ...

    def tuned(self, task: Task, now_ns: int) -> None:
        """A tunable of a task was set between two scans, or a local forced or released."""
        ...

    def operated(self, operation: Operation) -> None:
        """The rack or a task was operated: put into RUN, stopped, reloaded, switched off ..."""
        ...


class Observers:
    """All observers of one rack; they get writes in the order in which they happened."""

    def __init__(self, memory: CommonMemory) -> None:
        """Begin with none."""
        self._memory = memory
        self._all: list[RackObserver] = []

    def add(self, observer: RackObserver) -> None:
        """Tell an observer everything from now on; the write log is kept from then on."""
        self._all.append(observer)
        self._memory.keep_log()

    def scanned(self, task: Task, record: ScanRecord) -> None:
        """Tell of a scan and of its writes."""
        writes = self._memory.take_writes()
        for observer in self._all:
            observer.scanned(task, record, writes)

    def tell_writes(self) -> None:
        """Tell of writes that no scan has made."""
        writes = self._memory.take_writes()
        if writes:
            for observer in self._all:
                observer.written(writes)

    def tuned(self, task: Task, now_ns: int) -> None:
        """Tell that a tunable was set, or a local forced or released."""
        for observer in self._all:
            observer.tuned(task, now_ns)

    def operated(self, operation: Operation) -> None:
        """Tell of an operation, after the writes that belong to it."""
        self.tell_writes()
        for observer in self._all:
            observer.operated(operation)
