"""What a task keeps between two runs, as JSON has it: locals, tunables and error log (2.4.5, J2-3106-1 p. 13-4)."""

from __future__ import annotations

from typing import Any

from automax_ros.compile.layout import Role, StateField
from automax_ros.core.types import Value
from automax_ros.running.task import Task

KeptTask = dict[str, Any]
"""``source`` is the hash of the text that ran, ``values`` the variables by name, ``errors`` the log as numbers."""
_VARIABLES = (Role.LOCAL, Role.TUNABLE)


def kept_task(task: Task, source: str) -> KeptTask:
    """Return what a task keeps as it is now, between two scans."""
    flat, at = task.snapshot(), 0
    values: dict[str, Value | list[Value]] = {}
    errors: list[Value] = []
    for field in task.layout.fields:
        part = flat[at : at + field.size]
        at += field.size
        if field.role in _VARIABLES:
            values[field.name] = part if field.is_array else part[0]
        elif field.role is Role.LOG:
            errors = part
    return {"source": source, "values": values, "errors": errors}


def restore_task(task: Task, kept: KeptTask) -> int:
    """Give an installed task back what it has kept; return how many tunables are not as installed.

    Raises:
        KeyError: something is missing.
        ValueError: a value does not fit its variable, or lies outside the limits of tuning; nothing is restored.
        TypeError: it is not what ``kept_task`` returns.
    """
    flat: list[Value] = []
    fresh, at, tuned = task.snapshot(), 0, 0
    for field in task.layout.fields:
        part = fresh[at : at + field.size]
        at += field.size
        if field.role in _VARIABLES:
            part = _values_of(field, kept["values"][field.name])
        elif field.role is Role.LOG:
            part = [_whole(number) for number in kept["errors"]]
        if field.role is Role.TUNABLE:
            part = [task.tuning(field.name, part[0])]
            tuned += part[0] != field.initial
        if len(part) != field.size:
            raise ValueError(f"{field.name} of task {task.name} has {field.size} values, not {len(part)}")
        flat += part
    try:
        task.restore(flat)
    except OverflowError as error:
        raise ValueError(f"a value of task {task.name} is out of range") from error
    return tuned


def _values_of(field: StateField, value: Value | list[Value]) -> list[Value]:
    if isinstance(value, list) is not field.is_array:
        raise ValueError(f"{field.name} is {'an array' if field.is_array else 'not an array'}")
    part = value if isinstance(value, list) else [value]
    if not all(isinstance(item, bool | int | float | str) for item in part):
        raise TypeError(f"{field.name} cannot hold that")
    return part


def _whole(number: object) -> int:
    if not isinstance(number, int) or isinstance(number, bool):
        raise TypeError("an error log is whole numbers")
    return number
