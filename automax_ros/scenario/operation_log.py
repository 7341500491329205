"""What others than stimuli have done to a rack: operations of services and commands, for the report of a run."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.rack.base.observers import Operation
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.scan.scan_record import ScanRecord
from automax_ros.runtime.tasks.task import Task
from automax_ros.scenario.stimuli.reader import RACK_ONLY
from automax_ros.scenario.stimuli.stage import OperationRecord


class OperationLog:
    """An observer that keeps operations with the names of stimuli verbs, and whatever was refused.

    ``is_own`` says whether stimuli are acting, which keep their own list. Faults are not operations.
    """

    def __init__(self, is_own: Callable[[], bool]) -> None:
        """Begin with none."""
        self._is_own = is_own
        self.happened: list[OperationRecord] = []

    def operated(self, operation: Operation) -> None:
        """Keep an operation that a person has asked for."""
        is_fault = operation.what == "stop_all" and bool(operation.task or operation.detail)
        if self._is_own() or is_fault or (operation.ok and operation.what not in RACK_ONLY):
            return
        name, assigned, _ = operation.detail.partition(" = ")
        of = name if assigned or not operation.task else operation.task
        why = "" if operation.ok else operation.reason
        self.happened.append(OperationRecord(operation.at_ns, operation.what, of, operation.ok, why))

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        """Keep nothing of scans."""

    def written(self, writes: list[WriteGroup]) -> None:
        """Keep nothing of writes."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Keep nothing of tunables: setting one as an operator is an operation."""
