"""Changes of a tunable by its STEP, as by an operator's raise and lower keys (2.4.5)."""

from __future__ import annotations

from decimal import Decimal
from typing import cast

from automax_ros.core.values import real_text
from automax_ros.runtime.tasks.task import Task


def stepped(task: Task, name: str, steps: int) -> int | float:
    """Return the value of a tunable after ``steps`` of its STEP up, or down if negative, within its limits.

    Steps are added as decimals, as they are written: ten of 0.1 are 1.0.

    Raises:
        KeyError: the task has no tunable of that name.
    """
    tuning = task.compiled.program.symbols[name].tuning
    if tuning is None:
        raise KeyError(name)
    value, step, low, high = (_exact(item) for item in (task.value(name), tuning.step, tuning.low, tuning.high))
    moved = min(max(value + step * steps, low), high)
    return float(moved) if isinstance(task.value(name), float) else int(moved)


def _exact(value: object) -> Decimal:
    return Decimal(real_text(value)) if isinstance(value, float) else Decimal(cast(int, value))
