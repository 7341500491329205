"""The report of a run, as ``automax run --report`` writes it: docs/stimuli.md has the form."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.operator.faults import displays_of
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.scan.error_log import ErrorLog, LogEntry
from automax_ros.runtime.scan.scan_record import ScanRecord
from automax_ros.runtime.tasks.task import Status, Task
from automax_ros.scenario.stimuli.player import OperationRecord
from automax_ros.scenario.stimuli.reader import RACK_ONLY

STATUS_WORDS = {
    Status.RUNNING: "running",
    Status.STOPPED: "stopped",
    Status.ENDED: "ended",
    Status.FAULTED: "faulted",
}


def report_of(rack: Rack, happened: Iterable[OperationRecord] = ()) -> dict[str, Any]:
    """Return the report of a rack as it is now, with the operations that ``happened``, as data for JSON."""
    return {
        "rack": rack.config.name,
        "time_s": seconds(rack.now_ns),
        "stopped": _stop_record(rack.operations.stopped),
        "tasks": {task.name: _task(rack, task.name) for task in rack.tasks},
        "commons": {
            variable.name: _nest(rack.memory.present(view), variable)
            for view, variable in enumerate(rack.config.variables)
            if variable.bank is None
        },
        "displays": {
            shown.module: {"code": shown.code or None, "meaning": shown.meaning} for shown in displays_of(rack)
        },
        "forced": [item.name for item in rack.forces()],
        "operations": [_operation(item) for item in happened],
    }


def seconds(time_ns: int) -> float:
    """Return a time in seconds, as the nearest float."""
    return time_ns / NS_PER_S


def _stop_record(cause: StopCause | None) -> dict[str, Any] | None:
    if cause is None:
        return None
    return {"time_s": seconds(cause.time_ns), "code": cause.code, "task": cause.task or None, "reason": cause.reason}


def _task(rack: Rack, name: str) -> dict[str, Any]:
    item = next(item for item in rack.scheduled if item.task.name == name)
    module = next(module for module in rack.modules if item in module.tasks)
    return {
        "module": module.config.name,
        "status": STATUS_WORDS[item.task.status],
        "scans": item.statistics.scans,
        "skipped": item.statistics.skipped,
        "errors": _errors(item.task.errors),
    }


def _errors(log: ErrorLog) -> dict[str, Any]:
    """Return an error log; an entry is listed once, so ``last`` is null if it is the first or the second."""
    kept = [_entry(item) for item in log.entries]
    first, second, last = [*kept, None, None, None][:3]
    return {"count": log.count, "first": first, "second": second, "last": last}


def _entry(entry: LogEntry) -> dict[str, Any]:
    found: dict[str, Any] = {"line": entry.line, "code": entry.problem, "scan": entry.scan}
    return {**found, "hardware": entry.hardware} if entry.hardware is not None else found


def _nest(value: Value | Sequence[Value], variable: CommonVariable) -> Any:
    """Return a variable's value, an array's as nested lists, one level for each subscript."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        return value
    nested: list[Any] = list(value)
    for size in reversed(variable.dimensions[1:]):
        nested = [nested[start : start + size] for start in range(0, len(nested), size)]
    return nested


def _operation(item: OperationRecord) -> dict[str, Any]:
    found: dict[str, Any] = {"at": seconds(item.at_ns), "what": item.what, "ok": item.ok}
    if item.of:
        found["of"] = item.of
    return {**found, "why": item.why} if not item.ok else found


class OperationLog:
    """An observer that keeps operations with the names of stimuli verbs, and all refused ones.

    ``is_own`` returns whether stimuli are acting, which keep their own list. Faults are not operations.
    """

    def __init__(self, is_own: Callable[[], bool]) -> None:
        self._is_own = is_own
        self.happened: list[OperationRecord] = []

    def operated(self, operation: Operation) -> None:
        """Keep an operation that an operator has requested."""
        is_fault = operation.what == "stop_all" and bool(operation.task or operation.detail)
        if self._is_own() or is_fault or (operation.ok and operation.what not in RACK_ONLY):
            return
        name, assigned, _ = operation.detail.partition(" = ")
        of = name if assigned or not operation.task else operation.task
        why = "" if operation.ok else operation.reason
        self.happened.append(OperationRecord(operation.at_ns, operation.what, of, operation.ok, why))

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        """Ignore scans."""

    def written(self, writes: list[WriteGroup]) -> None:
        """Ignore writes."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Ignore tunables: setting one as an operator is an operation."""
