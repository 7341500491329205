"""Executes one recorded scan again."""

from __future__ import annotations

from pathlib import Path

from automax_ros.bags.errors import BagError
from automax_ros.running.task import EVENT_TIMEOUT, OVERLAP, ScanRecord, Task
from automax_ros.wire.messages import Scan


def execute(bag: Path, task: Task, scan: Scan, now_ns: int) -> ScanRecord | None:
    """Execute a scan at an instant of rack time; None if the task does not run any more.

    Raises:
        BagError: with the recorded state it cannot be executed; no task can have come to such a state.
    """
    try:
        if scan.scan == 0:
            return task.run(now_ns)
        task.scan_number = scan.scan - 1
        return _overlap(task, scan, now_ns) or task.scan(now_ns, scan.skipped)
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        what = f"scan {scan.scan} of task {task.name} cannot be executed: {error}"
        hint = "its recorded state is none that the task can have"
        raise BagError("AMX6813", bag, what, hint) from error


def _overlap(task: Task, scan: Scan, now_ns: int) -> ScanRecord | None:
    """Fault the task where the recorded one was faulted by its time: no execution of a source tells that."""
    code = next((error.code for error in scan.errors if error.code in (OVERLAP, EVENT_TIMEOUT)), None)
    return None if code is None else task.fault(code, now_ns)
