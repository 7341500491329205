"""Texts ``TASK.NAME=VALUE`` against the tunables of a rack's tasks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from automax_ros.core.settings import setting as named_setting
from automax_ros.core.types import Value, bare_name
from automax_ros.language.program import Program, Symbol


@dataclass(frozen=True)
class Tuning:
    """A value for a tunable of a task, named with its type character."""

    task: str
    name: str
    value: Value


def tunables_of(program: Program) -> dict[str, Symbol]:
    """Return the tunables of a task by their full names."""
    return {full: symbol for full, symbol in program.symbols.items() if symbol.tuning is not None}


def tuning(programs: Mapping[str, Program], text: str) -> Tuning:
    """Return what a text gives a tunable of one of the tasks, whose type character may be left out.

    Raises:
        Fault: the task has none of that name, or the value is not of its type.
        KeyError: there is no such task.
    """
    owner, _, value = text.partition("=")
    task, _, name = owner.strip().upper().partition(".")
    tunables = tunables_of(programs[task])
    bare = {bare_name(full): full for full in tunables}
    full = name if name in tunables else bare.get(name, name)
    meant, found = named_setting(f"{full}={value}", tunables, f"task {task} has no tunable")
    return Tuning(task, meant.label, found)
