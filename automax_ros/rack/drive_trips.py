"""The drive faults that stand in the current minor loops of a rack, in words, with the time at which each came."""

from __future__ import annotations

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.ticks import NS_PER_S
from automax_ros.drive.cml.faults import KINDS
from automax_ros.rack.observers import Operation
from automax_ros.rack.rack import Rack
from automax_ros.running.cml_task import CmlTask
from automax_ros.running.task import ScanRecord, Task
from automax_ros.running.views import WriteGroup

_PROBLEMS = frozenset(kind.problem for kind in KINDS)


class DriveTrips:
    """Observes one rack and notes when drive faults come; a fault from before is told without its time."""

    def __init__(self, rack: Rack) -> None:
        """Begin to observe."""
        self._rack = rack
        self._times: dict[tuple[str, int], int] = {}
        rack.observe(self)

    def lines(self) -> list[str]:
        """Return a line for each fault that is latched: ``CML: tach loss at 188.9 s, not cleared``."""
        return [
            f"{task.name}: {_words(kind.problem)}{self._time(task.name, kind.problem)}, not cleared"
            for task in self._rack.tasks
            if isinstance(task, CmlTask)
            for kind in KINDS
            if task.loop.faults.active & kind.bit
        ]

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Note when a drive fault was logged."""
        for _, code in record.errors:
            if code in _PROBLEMS:
                self._times[task.name, code] = record.time_ns

    def written(self, writes: list[WriteGroup]) -> None:
        """Writes from outside are not drive faults."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """A tunable that is set is not a drive fault."""

    def operated(self, operation: Operation) -> None:
        """An operation is not a drive fault."""

    def _time(self, task: str, problem: int) -> str:
        at_ns = self._times.get((task, problem))
        return "" if at_ns is None else f" at {at_ns / NS_PER_S:.1f} s"


def _words(problem: int) -> str:
    return PROBLEMS[f"AMX{problem:04d}"].title.removeprefix("drive fault: ")
