"""The codes on the displays of a rack's Processors, and the latched drive faults of its current minor loops.

The code of a STOP ALL is shown by the Processor whose task caused it; if no Processor's task did (a UDC's did, a module
was lost, two drive the common clock) by all of them, since the tasks of all have stopped, until the rack runs again
(decision). A code in the error log of a task, such as 87 for a shorted SCR without a STOP ALL (52.3.1), is shown until
that log is cleared (decision: J2-3106-1 names both in one step). A Processor without a code, and one without power,
shows nothing (decision). The codes d0 and E0 belong to an installation, which takes no time here and is refused with
the errors' own words: no rack that answers shows them (decision).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.ticks import NS_PER_S
from automax_ros.drive.current_loop.faults import KINDS
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.modules.processor import ProcessorConfig
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.tasks.task import ScanRecord, Task

MEANINGS = {
    "14": "overlap: a scan was not finished when the next one was due",
    "31": "bus error: a register or a module does not answer",
    "38": "two modules drive the common clock",
    "87": "shorted SCR",
    "95": "the tasks of a UDC have unequal TICKS",
    "C": "four receive time-outs in a row on the network",
    "E0": "a task and the configuration do not agree",
    "d0": "tasks are being installed",
}
"""Meanings of the codes that are known; the whole table of the manuals is not."""


_PROBLEMS = frozenset(kind.problem for kind in KINDS)


@dataclass(frozen=True)
class Display:
    """The display of one Processor: ``code`` is "" if it is blank, ``meaning`` is its meaning in words."""

    module: str
    code: str
    meaning: str


def displays_of(rack: Rack) -> list[Display]:
    """Return what the displays of the Processors in this process show now, by slot."""
    return [
        _display(rack, module.config.name, [item.name for item in module.tasks])
        for module in rack.modules
        if isinstance(module.config, ProcessorConfig)
    ]


def meaning_of(code: str) -> str:
    """Return the meaning of a code in words."""
    return MEANINGS.get(code, "a code of which the meaning is not known")


def _display(rack: Rack, module: str, tasks: list[str]) -> Display:
    if not rack.operations.powered:
        return Display(module, "", "the power is off")
    for code in _codes(rack, tasks):
        return Display(module, code, meaning_of(code))
    return Display(module, "", "no fault")


def _codes(rack: Rack, tasks: list[str]) -> Iterator[str]:
    """Yield the codes that concern a Processor with these tasks, the one to be shown first."""
    cause = rack.operations.stopped
    if cause is not None and cause.code and _concerns(rack, cause.task, tasks):
        yield cause.code
    for name in tasks:
        yield from (entry.hardware for entry in reversed(rack.task(name).errors.entries) if entry.hardware)


def _concerns(rack: Rack, task: str, tasks: list[str]) -> bool:
    """Return whether the Processor with these tasks shows a stop that ``task`` caused ("" is none)."""
    if not _is_on_processor(rack, task):
        return True
    return task in tasks and rack.task(task).errors.count > 0


def _is_on_processor(rack: Rack, task: str) -> bool:
    placed = rack.config.placed_tasks
    return any(item.name == task and isinstance(module, ProcessorConfig) for module, item in placed)


class DriveTrips:
    """Observes one rack and records when drive faults come; an earlier fault is listed without its time."""

    def __init__(self, rack: Rack) -> None:
        self._rack = rack
        self._times: dict[tuple[str, int], int] = {}
        rack.observe(self)

    def lines(self) -> list[str]:
        """Return a line for each latched fault: ``CML: tach loss at 188.9 s, not cleared``."""
        return [
            f"{task.name}: {_words(kind.problem)}{self._time(task.name, kind.problem)}, not cleared"
            for task in self._rack.tasks
            if isinstance(task, CmlTask)
            for kind in KINDS
            if task.loop.faults.active & kind.bit
        ]

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Record when a drive fault was logged."""
        for _, code in record.errors:
            if code in _PROBLEMS:
                self._times[task.name, code] = record.time_ns

    def written(self, writes: list[WriteGroup]) -> None:
        """Do nothing: writes from outside are not drive faults."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Do nothing: a tunable that is set is not a drive fault."""

    def operated(self, operation: Operation) -> None:
        """Do nothing: an operation is not a drive fault."""

    def _time(self, task: str, problem: int) -> str:
        at_ns = self._times.get((task, problem))
        return "" if at_ns is None else f" at {at_ns / NS_PER_S:.1f} s"


def _words(problem: int) -> str:
    return PROBLEMS[f"AMX{problem:04d}"].title.removeprefix("drive fault: ")
