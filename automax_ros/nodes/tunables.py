"""Tunable variables as ROS parameters: ``TASK.NAME`` with limits and step in the descriptor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

from automax_ros.core.types import DataType, bare_name
from automax_ros.language.program import TuningLimits
from automax_ros.rack.ros_names import TYPE_WORDS
from automax_ros.runtime.task import Task

_GRID_TOLERANCE = 1e-6


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
        """The parameter's first value: the one the task has, a REAL as its eight digits say."""
        return self._shown(self.task.value(self.variable))

    def descriptor(self) -> ParameterDescriptor:
        """Return limits and step. Where the limits and values do not lie on the step's grid, rclpy would refuse them:
        the step then stands in the text alone."""
        low, high, step = (self._shown(value) for value in (self.limits.low, self.limits.high, self.limits.step))
        descriptor = ParameterDescriptor(description=f"tunable {self.variable} of task {self.task.name}, step {step:g}")
        on_grid = all(_on_grid(value - low, step) for value in (high, self.initial))
        if self.type is DataType.REAL:
            span = FloatingPointRange(from_value=low, to_value=high, step=step if on_grid else 0.0)
            descriptor.floating_point_range = [span]
        else:
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high, step=step if on_grid else 1)]
        return descriptor

    def _shown(self, value: object) -> float | int:
        assert isinstance(value, (int, float))
        return float(f"{value:.8g}") if self.type is DataType.REAL else int(value)


def _on_grid(distance: float, step: float) -> bool:
    return abs(distance / step - round(distance / step)) < _GRID_TOLERANCE


def tunables_of(tasks: Sequence[Task]) -> list[Tunable]:
    """Return all tunables; two of a task that differ only in type get the type's word behind the name."""
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
