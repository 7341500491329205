"""Selects the kind of task that a program needs."""

from __future__ import annotations

from automax_ros.language.program import Program
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.tasks.task import Task


def task_class(program: Program) -> type[Task]:
    """Return the class of a BASIC task, of that of a drive's current minor loop, or of any other that scans."""
    if program.is_basic:
        return BasicTask
    return Task if program.cml is None else CmlTask
