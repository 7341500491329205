"""What a rack offers its modules: memory, time, wiring, and the installation of their tasks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from automax_ros.core.kinds import WriterKind
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.rack.tasks.installation import Installation
from automax_ros.rack.tasks.scheduled_task import After, ScheduledTask
from automax_ros.rack.tasks.triggers import (
    ClockTrigger,
    DriveTrigger,
    EventTrigger,
    MakeTrigger,
    Trigger,
    WaitTrigger,
)
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import TaskConfig
from automax_ros.rackfile.model.writers import WriterSpec, writers_of
from automax_ros.runtime.memory.common_clock import CommonClock
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.process_inputs import ProcessInputs
from automax_ros.runtime.memory.registers import Backplane
from automax_ros.runtime.memory.views import Memory
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.scan.drives import Drives
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.scan.execution import Execution
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.tasks.interrupts import Interrupts
from automax_ros.runtime.tasks.make_task import task_class
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import Scheduler


@dataclass(frozen=True)
class RackServices:
    """Services of a rack for its modules.

    ``execution`` returns, for a module's name, the execution of its scans; ``after`` is called after each scan, with
    None if a task has faulted, ``no_event`` with a task whose event did not come in time. ``report_writes`` reports to
    observers the writes that were not made by a scan. A 57C406 attaches itself to ``drives``. ``plants`` are those with
    a motor, by name; the rack keeps their states. ``stopwatch`` (ns, monotonic) measures execution times; without one
    they count as 0.
    """

    config: RackConfig
    installation: Installation
    memory: CommonMemory
    scheduler: Scheduler
    backplane: Backplane
    events: Events
    channels: Channels
    clock: CommonClock
    interrupts: Interrupts
    inputs: ProcessInputs
    drives: Drives
    plants: Mapping[str, DrivePlant]
    execution: Callable[[str], Execution]
    after: After
    no_event: Callable[[Task], None]
    report_writes: Callable[[], None]
    stopwatch: Callable[[], int] | None

    @cached_property
    def _writers(self) -> dict[tuple[WriterKind, str], WriterSpec]:
        return {(item.kind, item.name): item for item in writers_of(self.config)}

    def writer(self, module: str) -> int:
        """Return the id under which a module writes registers."""
        return self._writers[WriterKind.IO, module].id

    def install(
        self,
        task: TaskConfig,
        execution: Execution,
        *,
        memory: Memory | None = None,
        trigger: MakeTrigger | None = None,
        then: Callable[[Task], None] | None = None,
    ) -> ScheduledTask:
        """Return a task of a module's configuration, installed; it works on the rack's ``memory`` unless one is given.

        Without ``trigger`` its scans start by the clock, or by the event that SCAN_LOOP names. ``then`` is called after
        each scan, and after its start-up part, when observers were notified.
        """
        compiled, place = self.installation.compiled(task.name), self._writers[WriterKind.TASK, task.name]
        installed = task_class(compiled.program)(
            compiled,
            memory or self.memory,
            writer=place.id,
            slot=place.slot,
            priority=task.priority,
            backplane=self.backplane,
            events=self.events,
            channels=self.channels,
            drives=self.drives,
        )

        def after(scanned: Task, record: ScanRecord | None) -> None:
            self.after(scanned, record)
            if then is not None:
                then(scanned)

        return ScheduledTask(
            installed,
            self.installation.sources[task.name],
            scheduler=self.scheduler,
            trigger=trigger or self._usual_trigger,
            execution=execution,
            after=self.after if then is None else after,
            stopwatch=self.stopwatch,
        )

    def _usual_trigger(self, task: Task) -> Trigger:
        """Return the trigger of a Processor's task, and connect the interrupts that it waits for.

        It is a drive's 57C406, the wait of a BASIC task, the event that SCAN_LOOP names, else the clock (4.0).
        """
        self.interrupts.bind(task)
        if isinstance(task, CmlTask):
            return DriveTrigger(task)
        if isinstance(task, BasicTask):
            return WaitTrigger(task, self.events, self.channels, self.scheduler, lambda: self.no_event(task))
        event = task.compiled.program.event
        if event is None:
            return ClockTrigger(task, self.scheduler)
        return EventTrigger(self.events.event(event), task, self.scheduler, lambda: self.no_event(task))
