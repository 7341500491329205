"""A task of a running rack with the one event that the scheduler keeps for its scans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from automax_ros.compile.compiler import CompiledTask
from automax_ros.core.diagnostics import SourceText
from automax_ros.running.scheduler import EventClass, EventKey, ScheduledEvent, Scheduler
from automax_ros.running.task import ScanRecord, Status, Task

After = Callable[[Task, ScanRecord | None], None]
"""Is told of each scan, and of what stands before SCAN_LOOP, right after it."""


@dataclass
class TaskStatistics:
    """Counts of one task since the rack was started; times in ns, measured only where the rack has a stopwatch."""

    scans: int = 0
    skipped: int = 0
    last_ns: int = 0
    longest_ns: int = 0
    total_ns: int = 0


class ScheduledTask:
    """Puts a task into RUN and STOP, any number of times: between the two there is one event, never more."""

    def __init__(
        self, task: Task, source: SourceText, scheduler: Scheduler, after: After, stopwatch: Callable[[], int] | None
    ) -> None:
        """Take an installed task; nothing is scheduled yet."""
        self.task = task
        self.source = source
        self.statistics = TaskStatistics()
        self._scheduler, self._after, self._stopwatch = scheduler, after, stopwatch
        self._event: ScheduledEvent | None = None

    def start_up(self) -> None:
        """Execute what stands before SCAN_LOOP, at the present; no scan is scheduled yet."""
        self.stop()
        record = self.task.run(self._scheduler.now_ns)
        self._after(self.task, record)

    def scan_from(self, first_ns: int) -> None:
        """Scan at ``first_ns`` and each period after it, if the task is in RUN."""
        self._cancel()
        if self.task.status is Status.RUNNING:
            key = EventKey(EventClass.SCAN, self.task.priority, self.task.name)
            self._event = self._scheduler.every(self.task.period_ns, first_ns, key, self._scan)

    def stop(self) -> None:
        """Stop the task: no scan happens until it is put into RUN again."""
        self._cancel()
        self.task.stop()

    def install(self, compiled: CompiledTask, source: SourceText) -> None:
        """Replace what the task executes; its state is as at installation, and it is stopped."""
        self.stop()
        self.task.install(compiled)
        self.source = source

    def state(self) -> dict[str, Any]:
        """Return what the task keeps, and when its next scan is due (ns)."""
        task = self.task
        return {
            "source": task.compiled.program.source_hash,
            "status": task.status.name,
            "scan": task.scan_number,
            "values": task.snapshot(),
            "next_ns": self._scheduler.due_ns(self._event) if self._event is not None else None,
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Take over a state; a task that ran goes on with its next scan.

        Raises:
            ValueError: the state does not fit the task, or another source ran.
        """
        if state["source"] != self.task.compiled.program.source_hash:
            raise ValueError(f"task {self.task.name} had another source: reload it first")
        if state["status"] not in Status.__members__:
            raise ValueError(f"task {self.task.name} cannot be {state['status']!r}")
        self.stop()
        self.task.restore(list(state["values"]))
        self.task.status, self.task.scan_number = Status[state["status"]], state["scan"]
        if state["next_ns"] is not None:
            self.scan_from(state["next_ns"])

    def _cancel(self) -> None:
        if self._event is not None:
            self._event.cancel()
            self._event = None

    def _scan(self, now_ns: int, skipped: int) -> None:
        task, statistics, stopwatch = self.task, self.statistics, self._stopwatch
        if task.status is not Status.RUNNING:
            return
        began = stopwatch() if stopwatch else 0
        record = task.scan(now_ns, skipped)
        statistics.scans += 1
        statistics.skipped += skipped
        if stopwatch:
            taken = stopwatch() - began
            statistics.last_ns = taken
            statistics.total_ns += taken
            statistics.longest_ns = max(statistics.longest_ns, taken)
            if record is not None:
                record.duration_ns = taken
        self._after(task, record)
