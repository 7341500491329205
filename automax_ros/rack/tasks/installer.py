"""Installs the tasks of a running rack: their execution, their triggers, what follows each scan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

from automax_ros.rack.tasks.basic_trigger import WaitTrigger
from automax_ros.rack.tasks.installation import Installation
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rack.tasks.triggers import DriveTrigger, MakeTrigger, Trigger, usual_trigger
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import TaskConfig
from automax_ros.rackfile.model.writers import writers_of
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.registers import Backplane
from automax_ros.runtime.memory.views import Memory
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.scan.drives import Drives
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.scan.execution import Execution
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.tasks.interrupts import Interrupts
from automax_ros.runtime.tasks.make_task import make_task
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import Scheduler


@dataclass(frozen=True)
class Installer:
    """Installs tasks in one rack.

    ``after`` is called after each scan, with None if a task has faulted; ``no_event`` with a task whose event did not
    come in time. ``stopwatch`` (ns, monotonic) measures execution times; without one they count as 0.
    """

    config: RackConfig
    installation: Installation
    memory: CommonMemory
    scheduler: Scheduler
    backplane: Backplane
    events: Events
    channels: Channels
    drives: Drives
    interrupts: Interrupts
    after: Callable[[Task, ScanRecord | None], None]
    no_event: Callable[[Task], None]
    stopwatch: Callable[[], int] | None

    @cached_property
    def _ids(self) -> dict[str, int]:
        return {writer.name: writer.id for writer in writers_of(self.config) if writer.is_task}

    @cached_property
    def _slots(self) -> dict[str, int]:
        return {task.name: module.slot for module, task in self.config.placed_tasks}

    def install(
        self,
        task: TaskConfig,
        execution: Execution,
        *,
        memory: Memory | None = None,
        trigger: MakeTrigger | None = None,
        then: Callable[[Task], None] | None = None,
    ) -> ScheduledTask:
        """Return a task of the rack's file, installed (``rack/modules/module.Install``)."""
        installed = make_task(
            self.installation.compiled(task.name),
            memory or self.memory,
            writer=self._ids[task.name],
            slot=self._slots[task.name],
            priority=task.priority,
            backplane=self.backplane,
            events=self.events,
            channels=self.channels,
            drives=self.drives,
        )
        return ScheduledTask(
            installed,
            self.installation.sources[task.name],
            scheduler=self.scheduler,
            trigger=trigger or self._usual_trigger,
            execution=execution,
            after=self.after if then is None else partial(self._after_and, then),
            stopwatch=self.stopwatch,
        )

    def _usual_trigger(self, task: Task) -> Trigger:
        """Return the trigger of a task at its installation, and connect the interrupts it waits for."""
        self.interrupts.bind(task)
        if isinstance(task, CmlTask):
            return DriveTrigger(task)
        if isinstance(task, BasicTask):
            return WaitTrigger(task, self.events, self.channels, self.scheduler, lambda: self.no_event(task))
        return usual_trigger(task, self.events, self.scheduler, self.no_event)

    def _after_and(self, then: Callable[[Task], None], task: Task, record: ScanRecord | None) -> None:
        self.after(task, record)
        then(task)
