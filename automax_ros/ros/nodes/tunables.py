"""Tunable variables as ROS parameters: ``TASK.NAME`` with limits and step in the descriptor.

They are declared, checked, set, and updated after a task was tuned by other means.
"""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.node import Node
from rclpy.parameter import Parameter

from automax_ros.core.types import DataType, bare_name
from automax_ros.core.values import real_text
from automax_ros.language.program import TuningLimits
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.ros_names import TYPE_WORDS
from automax_ros.ros.setup.parameter_files import ParameterValue
from automax_ros.runtime.tasks.task import Task

_GRID_TOLERANCE = 1e-7
"""Stricter than rclpy's 1e-6."""
_MOST_STEPS = 1_000_000
"""With more steps the rounding of floating point can exceed the tolerance."""


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
        """The parameter's first value: that in the task, a REAL without digits beyond its precision."""
        return self._shown_value(self.task.value(self.variable))

    def descriptor(self) -> ParameterDescriptor:
        """Return limits and step.

        rclpy refuses values off the grid of LOW and steps, which it computes in floating point. If it would refuse
        HIGH, the present value or 0, or the grid is too fine, only the text gives the step.
        """
        low, high, step = (self._shown_value(value) for value in (self.limits.low, self.limits.high, self.limits.step))
        descriptor = ParameterDescriptor(description=f"tunable {self.variable} of task {self.task.name}, step {step:g}")
        anchors = (high, self.initial, 0) if low < 0 < high else (high, self.initial)
        on_grid = (high - low) / step <= _MOST_STEPS and all(_on_grid(value, low, step) for value in anchors)
        if self.type is DataType.REAL:
            span = FloatingPointRange(from_value=low, to_value=high, step=step if on_grid else 0.0)
            descriptor.floating_point_range = [span]
        else:
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high, step=step if on_grid else 1)]
        return descriptor

    def _shown_value(self, value: object) -> float | int:
        assert isinstance(value, (int, float))
        return float(real_text(value)) if self.type is DataType.REAL else int(value)


def _on_grid(value: float, low: float, step: float) -> bool:
    """Whether rclpy finds a value on the grid: it compares relatively, so a 0 must be met exactly."""
    return math.isclose(low + round((value - low) / step) * step, value, rel_tol=_GRID_TOLERANCE)


def tunables_of(tasks: Sequence[Task]) -> list[Tunable]:
    """Return all tunables; if two of a task differ only in type, the type's word is appended to their names."""
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


class TunableParameters:
    """Keeps the parameters of a node equal to the tunables of its tasks."""

    def __init__(self, node: Node, rack: Rack, present: Callable[[], AbstractContextManager[None]]) -> None:
        self._node, self._rack, self._present = node, rack, present
        self._tunables: dict[str, Tunable] = {}
        self._following = 0
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._tune)

    @property
    def names(self) -> Iterable[str]:
        """The names of the parameters."""
        return self._tunables.keys()

    def declare(self, tasks: Sequence[Task]) -> None:
        """Declare the tunables of tasks, as installed now, in place of earlier ones.

        Values from the command line are set by ``start_parameters``, not by rclpy.
        """
        for name in [name for name, item in self._tunables.items() if item.task in tasks]:
            del self._tunables[name]
            self._node.undeclare_parameter(name)
        found = tunables_of(tasks)
        for tunable in found:
            self._node.declare_parameter(tunable.parameter, tunable.initial, tunable.descriptor(), ignore_override=True)
        self._tunables |= {item.parameter: item for item in found}

    def begin_with(self, name: str, value: ParameterValue) -> str:
        """Set a tunable as a client would; return the reason of a refusal, else ""."""
        if self._tunables[name].type is DataType.REAL and type(value) is int:
            value = float(value)
        try:
            (result,) = self._node.set_parameters([Parameter(name, value=value)])
        except (InvalidParameterTypeException, TypeError, ValueError) as error:
            return str(error)
        return "" if result.successful else str(result.reason) or "refused"

    def follow(self, task: Task) -> None:
        """Set the parameters to the values of a task that was tuned by other means."""
        changed = [
            Parameter(name, value=item.initial)
            for name, item in self._tunables.items()
            if item.task is task and self._node.get_parameter(name).value != item.initial
        ]
        if changed and not self._is_own_doing:
            with self._following_now():
                self._node.set_parameters(changed)

    @property
    def _is_own_doing(self) -> bool:
        """Whether this thread is setting parameters because of tunables, or tunables because of parameters."""
        return self._following == threading.get_ident()

    @contextmanager
    def _following_now(self) -> Iterator[None]:
        """Make ``_is_own_doing`` true for this thread, which must hold the rack's lock."""
        self._following = threading.get_ident()
        try:
            yield
        finally:
            self._following = 0

    def _check(self, parameters: list[Parameter[Any]]) -> SetParametersResult:
        """Refuse values that a task would refuse, before any parameter is set; those of other parameters pass."""
        for parameter in parameters:
            tunable = self._tunables.get(parameter.name)
            if tunable is None:
                continue
            try:
                tunable.task.tuning(tunable.variable, parameter.value)
            except ValueError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _tune(self, parameters: list[Parameter[Any]]) -> None:
        chosen = [(self._tunables[item.name], item.value) for item in parameters if item.name in self._tunables]
        if not chosen or self._is_own_doing:
            return
        with self._present(), self._following_now():
            for tunable, value in chosen:
                self._rack.tune(tunable.task, tunable.variable, value)
