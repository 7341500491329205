"""Creates the kind of task that a program needs."""

from __future__ import annotations

from automax_ros.compile.compiler import CompiledTask
from automax_ros.runtime.memory.registers import NO_MODULES, Backplane
from automax_ros.runtime.memory.views import Memory
from automax_ros.runtime.scan.channels import ChannelAccess
from automax_ros.runtime.scan.drives import DriveAccess
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.tasks.task import Task


def make_task(
    compiled: CompiledTask,
    memory: Memory,
    *,
    writer: int = 0,
    slot: int = 0,
    priority: int = 11,
    backplane: Backplane = NO_MODULES,
    events: Events | None = None,
    channels: ChannelAccess | None = None,
    drives: DriveAccess | None = None,
) -> Task:
    """Install a task: a BASIC one with channels, one of a drive with the rack's drives, or a plain one that scans."""
    program = compiled.program
    if program.is_basic:
        return BasicTask(
            compiled,
            memory,
            writer=writer,
            slot=slot,
            priority=priority,
            backplane=backplane,
            events=events,
            channels=channels,
        )
    if program.cml is not None:
        return CmlTask(
            compiled,
            memory,
            writer=writer,
            slot=slot,
            priority=priority,
            backplane=backplane,
            events=events,
            drives=drives,
        )
    return Task(compiled, memory, writer=writer, slot=slot, priority=priority, backplane=backplane, events=events)
