"""A task of the kind that its program is of."""

from __future__ import annotations

from automax_ros.compile.compiler import CompiledTask
from automax_ros.running.backplane import NO_MODULES, Backplane
from automax_ros.running.basic_task import BasicTask
from automax_ros.running.channels import ChannelAccess
from automax_ros.running.cml_task import CmlTask
from automax_ros.running.drives import DriveAccess
from automax_ros.running.events import Events
from automax_ros.running.task import Task
from automax_ros.running.views import Memory


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
    """Install a task: a BASIC one with its channels, one of a drive with the rack's drives, or one that scans."""
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
