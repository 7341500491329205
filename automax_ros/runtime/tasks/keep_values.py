"""Values of a task's variables: those that a reload keeps, and a tunable's after steps of an operator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from decimal import Decimal
from typing import cast

from automax_ros.compile.base.layout import Layout, Role, StateField
from automax_ros.core.types import Value
from automax_ros.core.values import real_text
from automax_ros.runtime.tasks.task import Task

_KEPT = (Role.LOCAL, Role.TUNABLE)


def carry_over(before: Layout, values: Sequence[Value], task: Task) -> tuple[str, ...]:
    """Restore variables of a task that was just installed again; return the names of those that it has kept.

    A local is kept if name, type and dimensions are the same (a string: if it fits), a tunable if it is also within its
    new limits. Blocks start again, as always when a task is put into RUN, and the error log is empty (decision).
    """
    parts = _parts(before, values)
    old = {(field.name, field.type, field.dimensions): part for field, part in parts if field.role in _KEPT}
    kept: list[str] = []
    restored: list[Value] = []
    for field, fresh in _parts(task.layout, task.snapshot()):
        part = old.get((field.name, field.type, field.dimensions))
        if field.role in _KEPT and part is not None and _fits(field, part, task):
            kept.append(field.name)
            restored += part
        else:
            restored += fresh
    task.restore(restored)
    return tuple(kept)


def _parts(layout: Layout, values: Sequence[Value]) -> Iterator[tuple[StateField, Sequence[Value]]]:
    at = 0
    for field in layout.fields:
        yield field, values[at : at + field.size]
        at += field.size


def _fits(field: StateField, part: Sequence[Value], task: Task) -> bool:
    try:
        if field.role is Role.TUNABLE:
            task.tuning(field.name, part[0])
        for value in part:
            field.typed(value)
    except (ValueError, KeyError):
        return False
    return True


def stepped(task: Task, name: str, steps: int) -> int | float:
    """Return the value of a tunable after ``steps`` of its STEP up, or down if negative, within its limits (2.4.5).

    Steps are added as decimals, as they are written: ten of 0.1 are 1.0. KeyError if the task has no such tunable.
    """
    tuning = task.compiled.program.symbols[name].tuning
    if tuning is None:
        raise KeyError(name)
    present = task.value(name)
    value, step, low, high = map(_exact, (present, tuning.step, tuning.low, tuning.high))
    moved = min(max(value + step * steps, low), high)
    return float(moved) if isinstance(present, float) else int(moved)


def _exact(value: object) -> Decimal:
    return Decimal(real_text(value)) if isinstance(value, float) else Decimal(cast(int, value))
