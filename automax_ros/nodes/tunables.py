"""Tunable variables as ROS parameters: ``TASK.NAME`` with limits and step in the descriptor."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

from automax_ros.core.types import DataType, bare_name
from automax_ros.core.values import real_text
from automax_ros.language.program import TuningLimits
from automax_ros.rack.ros_names import TYPE_WORDS
from automax_ros.running.task import Task

_GRID_TOLERANCE = 1e-7
"""Stricter than rclpy's 1e-6."""
_MOST_STEPS = 1_000_000
"""With more the rounding of floating point can exceed the tolerance."""


@dataclass(frozen=True)
class Tunable:
    """One tunable: its task, its full name there, and the name of its parameter."""

    task: Task
    variable: str
    type: DataType
    limits: TuningLimits
    parameter: str

    @property
    def initial(self) -> float | int:
        """The parameter's first value: the one the task has, a REAL with no more digits than it has."""
        return self._shown(self.task.value(self.variable))

    def descriptor(self) -> ParameterDescriptor:
        """Return limits and step.

        rclpy refuses what does not lie on the grid of LOW and steps, which it computes in floating point. Where that
        would hit HIGH, the present value or 0, or the grid is too fine, the step stands in the text alone.
        """
        low, high, step = (self._shown(value) for value in (self.limits.low, self.limits.high, self.limits.step))
        descriptor = ParameterDescriptor(description=f"tunable {self.variable} of task {self.task.name}, step {step:g}")
        anchors = (high, self.initial, 0) if low < 0 < high else (high, self.initial)
        on_grid = (high - low) / step <= _MOST_STEPS and all(_on_grid(value, low, step) for value in anchors)
        if self.type is DataType.REAL:
            span = FloatingPointRange(from_value=low, to_value=high, step=step if on_grid else 0.0)
            descriptor.floating_point_range = [span]
        else:
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high, step=step if on_grid else 1)]
        return descriptor

    def _shown(self, value: object) -> float | int:
        assert isinstance(value, (int, float))
        return float(real_text(value)) if self.type is DataType.REAL else int(value)


def _on_grid(value: float, low: float, step: float) -> bool:
    """Whether rclpy finds a value on the grid: it compares relatively, so a 0 must be met exactly."""
    return math.isclose(low + round((value - low) / step) * step, value, rel_tol=_GRID_TOLERANCE)


def tunables_of(tasks: Sequence[Task]) -> list[Tunable]:
    """Return all tunables; two of a task that differ only in type get the type's word after the name."""
    found = []
    for task in tasks:
        symbols = [symbol for symbol in task.compiled.program.symbols.values() if symbol.tuning is not None]
        shared = Counter(bare_name(symbol.name) for symbol in symbols)
        for symbol in symbols:
            assert symbol.tuning is not None
            bare = bare_name(symbol.name)
            word = f"{bare}_{TYPE_WORDS[symbol.type]}" if shared[bare] > 1 else bare
            found.append(Tunable(task, symbol.name, symbol.type, symbol.tuning, f"{task.name}.{word}"))
    return found
