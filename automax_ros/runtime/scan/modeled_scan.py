"""Executes a scan in steps of modeled time; ``scan_under_way`` has its data."""

from __future__ import annotations

from typing import Any, Protocol

from automax_ros.compile.base.scan_io import ScanTooLong
from automax_ros.compile.compiler import ScanSteps
from automax_ros.runtime.memory.views import Memory
from automax_ros.runtime.scan.scan_in_progress import Begun
from automax_ros.runtime.scan.scan_record import Status, Steps


class Stepped(Protocol):
    """A task as ``scan_in_steps`` sees it: the beginning and the three ends of a scan."""

    memory: Memory

    @property
    def status(self) -> Status: ...  # noqa: D102

    def begin_steps(self, now_ns: int, skipped: int, form: ScanSteps | None) -> Begun: ...  # noqa: D102

    def end_steps(self, outcome: Any) -> None: ...  # noqa: D102

    def give_up_steps(self) -> None: ...  # noqa: D102

    def too_long(self, error: ScanTooLong) -> None: ...  # noqa: D102


def scan_in_steps(task: Stepped, now_ns: int, skipped: int, form: ScanSteps | None) -> Steps:
    """Execute one scan of a task in steps: see ``Task.scan_modeled``.

    It is plain Python, because a compiled generator that is dropped is not closed: the scan would never end.
    """
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
