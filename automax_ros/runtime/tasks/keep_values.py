"""The values that a reloaded task keeps from the program that it ran before: by name, if they fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from automax_ros.compile.base.layout import Layout, Role, StateField
from automax_ros.core.types import Value


class Keeper(Protocol):
    """A task: its values, flat, in the order of its layout."""

    @property
    def layout(self) -> Layout: ...  # noqa: D102

    def snapshot(self) -> list[Value]: ...  # noqa: D102

    def restore(self, values: list[Value]) -> None: ...  # noqa: D102

    def tuning(self, name: str, value: object) -> int | float: ...  # noqa: D102


def carry_over(before: Layout, values: Sequence[Value], task: Keeper) -> tuple[str, ...]:
    """Restore variables of a task that was just installed again; return the names of those that it has kept.

    A local is kept if name, type and dimensions are the same (a string: if it fits), a tunable if it is also within its
    new limits. Blocks start again, as always when a task is put into RUN, and the error log is empty (decision).
    """
    old = _parts(before, values)
    layout, fresh = task.layout, task.snapshot()
    kept: list[str] = []
    at = 0
    for field in layout.fields:
        part = old.get((field.name, field.type, field.dimensions))
        if part is not None and _fits(field, part, task):
            fresh[at : at + field.size] = part
            kept.append(field.name)
        at += field.size
    task.restore(fresh)
    return tuple(kept)


def _parts(layout: Layout, values: Sequence[Value]) -> dict[tuple[object, ...], list[Value]]:
    parts: dict[tuple[object, ...], list[Value]] = {}
    at = 0
    for field in layout.fields:
        if field.role in (Role.LOCAL, Role.TUNABLE):
            parts[field.name, field.type, field.dimensions] = list(values[at : at + field.size])
        at += field.size
    return parts


def _fits(field: StateField, part: Sequence[Value], task: Keeper) -> bool:
    try:
        if field.role is Role.TUNABLE:
            task.tuning(field.name, part[0])
        for value in part:
            field.typed(value)
    except (ValueError, KeyError):
        return False
    return field.role in (Role.LOCAL, Role.TUNABLE)
