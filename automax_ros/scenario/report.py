"""How a run ended, as ``automax run --report`` writes it: docs/stimuli.md has the form."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.operator.faults import displays_of
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.runtime.scan.error_log import ErrorLog, LogEntry
from automax_ros.runtime.tasks.task import Status
from automax_ros.scenario.stimuli.stage import OperationRecord

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
        "stopped": _stopped(rack.operations.stopped),
        "tasks": {task.name: _task(rack, task.name) for task in rack.tasks},
        "commons": {
            variable.name: _nested(rack.memory.present(view), variable)
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
    """Return a time in seconds, the float that is nearest."""
    return time_ns / NS_PER_S


def _stopped(cause: StopCause | None) -> dict[str, Any] | None:
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
    """Return an error log; an entry stands once, so ``last`` is null where it is the first or the second."""
    kept = [_entry(item) for item in log.entries]
    first, second, last = [*kept, None, None, None][:3]
    return {"count": log.count, "first": first, "second": second, "last": last}


def _entry(entry: LogEntry) -> dict[str, Any]:
    found: dict[str, Any] = {"line": entry.line, "code": entry.problem, "scan": entry.scan}
    return {**found, "hardware": entry.hardware} if entry.hardware is not None else found


def _nested(value: Value | Sequence[Value], variable: CommonVariable) -> Any:
    """Return a variable's value, an array's as lists in lists, one level for each subscript."""
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
