"""A task of a running rack: its trigger, its execution, its statistics, and what follows each of its scans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from automax_ros.compile.compiler import CompiledTask
from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.base.observers import Observers
from automax_ros.rack.tasks.triggers import Due, MakeTrigger
from automax_ros.runtime.memory.memory import ProcessInputs
from automax_ros.runtime.scan.execution import Execution, IdealExecution, Steps
from automax_ros.runtime.tasks.task import OVERLAP, ScanRecord, Status, Task
from automax_ros.runtime.time.scheduler import Scheduler


@dataclass
class Times:
    """Execution times and lateness of scans, ns; stepped scans are never late: rack time waits for them."""

    scans: int = 0
    skipped: int = 0
    total_ns: int = 0
    least_ns: int = 0
    longest_ns: int = 0
    late_ns: int = 0
    latest_ns: int = 0

    def add(self, taken_ns: int, late_ns: int) -> None:
        """Count a scan with its time and its lateness."""
        if taken_ns < self.least_ns or not self.scans:
            self.least_ns = taken_ns
        self.longest_ns = max(self.longest_ns, taken_ns)
        self.latest_ns = max(self.latest_ns, late_ns)
        self.scans += 1
        self.total_ns += taken_ns
        self.late_ns += late_ns

    @property
    def mean_ns(self) -> float:
        """The mean execution time; 0 without a scan."""
        return self.total_ns / self.scans if self.scans else 0.0

    @property
    def mean_late_ns(self) -> float:
        """The mean lateness; 0 without a scan."""
        return self.late_ns / self.scans if self.scans else 0.0


@dataclass
class TaskStatistics(Times):
    """Counts of one task since the rack was started; ``window`` counts since it was last taken.

    Times (ns) are the host's where the rack has a stopwatch, in modeled execution modeled ones, from start to end.
    """

    last_ns: int = 0
    window: Times = field(default_factory=Times)

    def add(self, taken_ns: int, late_ns: int = 0) -> None:
        """Count a scan with its time and its lateness."""
        self.last_ns = taken_ns
        super().add(taken_ns, late_ns)
        self.window.add(taken_ns, late_ns)

    def skip(self, scans: int) -> None:
        """Count missed deadlines."""
        self.skipped += scans
        self.window.skipped += scans

    def take_window(self) -> Times:
        """Return the times since the last call, and restart their count."""
        taken, self.window = self.window, Times()
        return taken


_FAULTED: Final = Status.FAULTED
_RUNNING = Status.RUNNING
"""Constants, since they are read at each scan and an enumeration's member is slow to get."""
StopAll = Callable[[str, str | None, str], None]
"""Stops the rack: called with the reason, the hardware's code if there is one, and the task."""
_LONGEST_NS = 2**32 - 1
"""Longest execution time that a message of a scan can hold."""
After = Callable[[Task, ScanRecord | None], None]
"""Called right after each scan, and after the part before SCAN_LOOP."""


class ScanEnd:
    """Ends scans of one rack: observers are notified, waiting inputs unfreeze, a fault stops all."""

    def __init__(self, observers: Observers, inputs: ProcessInputs, stop_all: StopAll) -> None:
        """Create it; ``stop_all`` stops the rack after a fault."""
        self._observers, self._inputs, self._stop_all = observers, inputs, stop_all

    def ended(self, task: Task, record: ScanRecord | None) -> None:
        """Complete a scan, or the part before SCAN_LOOP."""
        if record is not None:
            self._observers.scanned(task, record)
        inputs = self._inputs
        if inputs.frozen and inputs.scanned(task.name):
            self._observers.report_writes()
        if task.status is _FAULTED:
            last = task.errors.last
            reason = f"task {task.name}: {last.describe() if last else 'fault'}"
            self._stop_all(reason, last.hardware if last else None, task.name)


class ScheduledTask:
    """Puts a task into RUN and STOP, any number of times: in between its trigger decides when a scan is due."""

    def __init__(
        self,
        task: Task,
        source: SourceText,
        *,
        scheduler: Scheduler,
        trigger: MakeTrigger,
        execution: Execution,
        after: After,
        stopwatch: Callable[[], int] | None = None,
    ) -> None:
        """Create from an installed task; nothing is scheduled yet."""
        self.task = task
        self.source = source
        self.statistics = TaskStatistics()
        self._scheduler, self._execution = scheduler, execution
        self._after, self._stopwatch = after, stopwatch
        self._make_trigger = trigger
        self._began_ns: int | None = None
        self._late_ns = 0
        self.trigger = trigger(task)
        self.due: Due = self.whole if isinstance(execution, IdealExecution) else self._begin

    @property
    def name(self) -> str:
        """The task's name."""
        return self.task.name

    @property
    def priority(self) -> int:
        """The task's priority: 4 (first) to 11."""
        return self.task.priority

    def start_up(self) -> None:
        """Execute the part before SCAN_LOOP now; no scan is scheduled yet."""
        self.stop()
        record = self.task.run(self._scheduler.now_ns)
        self._after(self.task, record)

    def scan_from(self, first_ns: int) -> None:
        """Execute each scan that is due from ``first_ns`` on, if the task is in RUN."""
        self.trigger.disarm()
        if self.task.status is Status.RUNNING:
            self.trigger.arm(first_ns, self.due)

    def stop(self) -> None:
        """Stop the task: no scan is executed until it is put into RUN again; one in progress is abandoned."""
        self.trigger.disarm()
        self._execution.drop(self)
        self.task.heed_forces()
        self.task.stop()

    def install(self, compiled: CompiledTask, source: SourceText) -> None:
        """Replace the task's program; its state is as at installation, and it is stopped."""
        self.stop()
        self.task.install(compiled)
        self.trigger = self._make_trigger(self.task)
        self.source = source

    def state(self) -> dict[str, Any]:
        """Return the task's state, when its next scan is due (ns), and the progress of a scan under way."""
        task = self.task
        return {
            "source": task.compiled.program.source_hash,
            "status": task.status.name,
            "scan": task.scan_number,
            "values": task.snapshot(),
            "held": sorted(task.compiled.held),
            "forced": dict(task.forces),
            "waiting": task.waiting(),
            "next_ns": self.trigger.next_ns,
            "place": self._execution.place(self),
            "progress": task.progress,
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore a state; a task that ran continues. ValueError if it does not fit, or another source ran."""
        if state["source"] != self.task.compiled.program.source_hash:
            raise ValueError(f"task {self.task.name} had another source: reload it first")
        if state["status"] not in Status.__members__:
            raise ValueError(f"task {self.task.name} cannot be {state['status']!r}")
        self.stop()
        self.task.restore(list(state["values"]))
        values = {name: self.task.value(name) for name in state["held"]}
        self.task.hold({name: value for name, value in values.items() if not isinstance(value, list)})
        self.task.wait_again(state["waiting"])
        self.task.status, self.task.scan_number = Status[state["status"]], state["scan"]
        if state["next_ns"] is not None:
            self.scan_from(state["next_ns"])
        place, progress = state["place"], state["progress"]
        if place is not None:
            steps = None
            if progress is not None:
                self._began_ns = progress["began_ns"]
                steps = self.task.resume_scan(progress)
            self._execution.resume(self, place, steps)
            self.task.wait_again(state["waiting"])
        self.task.hold(state["forced"])

    def whole(self, now_ns: int, skipped: int) -> None:
        """Execute a scan at one instant."""
        task, statistics, stopwatch = self.task, self.statistics, self._stopwatch
        if task.status is not _RUNNING:
            return
        began = stopwatch() if stopwatch else 0
        record = task.scan(now_ns, skipped)
        if skipped:
            statistics.skip(skipped)
        if stopwatch:
            taken = stopwatch() - began
            statistics.add(taken, self._late(began, now_ns))
            if record is not None:
                record.duration_ns = taken
        else:
            statistics.scans += 1
        self._after(task, record)

    def steps(self, now_ns: int, skipped: int) -> Steps:
        """Return the steps of a scan."""
        self.statistics.skip(skipped)
        self._began_ns = now_ns
        self._late_ns = self._late(self._stopwatch(), now_ns) if self._stopwatch else 0
        return self.task.scan_modeled(now_ns, skipped)

    def done(self, record: ScanRecord | None) -> None:
        """Complete a scan whose last step was executed; its time is the modeled one."""
        taken = 0 if self._began_ns is None else self._scheduler.now_ns - self._began_ns
        self._began_ns = None
        self.statistics.add(taken, self._late_ns)
        if record is not None:
            record.duration_ns = min(taken, _LONGEST_NS)
        self._after(self.task, record)

    def fault(self, code: int) -> None:
        """Fault the task for a scan that is impossible; one in progress is abandoned."""
        self._execution.drop(self)
        self.task.heed_forces()
        self._after(self.task, self.task.fault(code, self._scheduler.now_ns))

    def _begin(self, now_ns: int, skipped: int) -> None:
        """Start a scan, unless the last one is still in progress: that is an overlap (J2-3106-1 p. C-1)."""
        if self.task.status is not _RUNNING:
            return
        if self._execution.busy(self):
            self.fault(OVERLAP)
        else:
            self._execution.begin(self, now_ns, skipped)

    def _late(self, began_ns: int, now_ns: int) -> int:
        """Return how much later than its instant the host started a scan, by the pacer's clock."""
        zero_ns = self._scheduler.zero_ns
        return 0 if zero_ns is None else max(0, began_ns - zero_ns - now_ns)
