"""Executes a scan in steps of modeled time; ``scan_in_progress`` has its data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from automax_ros.compile.base.scan_io import ScanTooLong
from automax_ros.compile.compiler import ScanSteps
from automax_ros.runtime.scan.scan_record import Status, Steps

if TYPE_CHECKING:
    from automax_ros.runtime.tasks.task import Task


def scan_in_steps(task: Task, now_ns: int, skipped: int, form: ScanSteps | None) -> Steps:
    """Execute a scan: see ``Task.scan_modeled``. Plain Python: a compiled generator that is dropped is not closed."""
    if task.status is not Status.RUNNING:
        return None
    scan, record, steps = task.begin_steps(now_ns, skipped, form)
    outcome: Any = False
    try:
        while True:
            cost = next(steps)
            scan.steps += 1
            later = yield cost
            if later is not None:
                task.memory.now_ns = later
    except StopIteration as end:
        outcome = end.value
    except ScanTooLong as error:
        task.too_long(error)
    except BaseException:
        task.give_up_steps()
        raise
    task.end_steps(outcome)
    return record
