"""Executes chosen scans line by line, so that they can be held in the middle; all others at once."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import cast

from automax_ros.compile.base.scan_io import LineValues
from automax_ros.compile.compiler import ScanSteps
from automax_ros.core.types import Value
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.runtime.scan.execution import IDEAL, Job, Place, Steps
from automax_ros.runtime.tasks.task import ScanRecord


class HeldScan:
    """A scan that has started and is held before a line. ``line`` is that line, 0 before ``advance`` was called."""

    def __init__(self, item: ScheduledTask, now_ns: int, skipped: int) -> None:
        """Create the scan without executing it: ``advance`` goes to the first line."""
        task = item.task
        self.item = item
        self.line = 0
        self.values: Mapping[str, Value | list[Value]] = {}
        form = cast(ScanSteps, task.compiled.scan_lines.scan)
        self._names = [*(field.name for field in task.compiled.layout.fields), *task.compiled.latched]
        self._skipped = skipped
        self._record: ScanRecord | None = None
        self._steps = cast(
            Generator[LineValues, None, ScanRecord | None], task.scan_modeled(now_ns, skipped, form=form)
        )

    def advance(self) -> bool:
        """Go to the next line; return FALSE if the scan has ended, which ``finish`` reports.

        ``values`` are then the scan's values by names of its layout: locals, block states, and its latched commons.
        """
        try:
            self.line, values = next(self._steps)
        except StopIteration as end:
            self._record = end.value
            return False
        self.values = dict(zip(self._names, values, strict=True))
        return True

    def finish(self) -> None:
        """Report the ended scan, which may start other scans."""
        self.item.statistics.skipped += self._skipped
        self.item.done(self._record)

    def close(self) -> None:
        """Abandon the scan: the task is as before it; its writes to memory stay."""
        self._steps.close()


class ByLines:
    """An execution that holds the scans of the tasks in ``held_tasks``. ``held`` is the scan that waits."""

    def __init__(self) -> None:
        """Create an execution that holds no task."""
        self.held_tasks: dict[str, ScheduledTask] = {}
        self.held: HeldScan | None = None

    def begin(self, job: Job, now_ns: int, skipped: int) -> None:
        """Execute a job, or hold it."""
        item = self.held_tasks.get(job.name)
        if item is None:
            job.whole(now_ns, skipped)
        else:
            self.held = HeldScan(item, now_ns, skipped)

    def advance(self) -> bool:
        """Go to the next line of the held scan; return FALSE at its end: then none is held, or one that follows it."""
        held = self.held
        assert held is not None
        if held.advance():
            return True
        self.held = None
        held.finish()
        return False

    def busy(self, job: Job) -> bool:
        """Return whether a job's scan is held."""
        return self.held is not None and self.held.item is job

    def drop(self, job: Job) -> None:
        """Abandon a held scan."""
        if self.held is not None and self.held.item is job:
            self.held.close()
            self.held = None

    def place(self, job: Job) -> Place | None:
        """Return None: another rack could not continue a held scan."""
        return IDEAL.place(job)

    def resume(self, job: Job, place: Place, steps: Steps | None) -> None:
        """Refuse, as ideal execution does.

        Raises:
            ValueError: always.
        """
        IDEAL.resume(job, place, steps)
