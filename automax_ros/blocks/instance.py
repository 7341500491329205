"""One block run by its step function as it stands: for tests, documentation, and comparison with compiled code."""

from __future__ import annotations

import inspect
from collections.abc import Mapping

from automax_ros.blocks.coefficients import evaluate_noting, limited
from automax_ros.blocks.declaration import COEFFICIENT_LIMITED, Block, Form, Input
from automax_ros.core.types import DataType, Value

NS_PER_S = 1e9


class InstanceError(ValueError):
    """A parameter that the block does not have, needs, or may not be given in this way."""


class Instance:
    """A block with its states.

    ``outputs`` and ``state`` are the values of its output variables and hidden states after the last scan, ``error`` is
    the number of the last problem that the last scan logged, 0 for none. Writing into ``outputs`` stands for a write of
    the variable by another: a block that holds an output sees it.
    """

    def __init__(self, block: Block, period_ns: int, **literals: Value) -> None:
        """Take the parameters that are literals in the CALL, by lower-case keyword, and the scan period.

        Raises:
            InstanceError: no parameter of that name, a literal outside its limits, or SCAN_LOOP.
        """
        if block.step is None:
            raise InstanceError(f"{block.name} has no step function: the task carries it out")
        self.block = block
        self.period_s = period_ns / NS_PER_S
        self._step = block.step
        self._wanted = tuple(inspect.signature(block.step).parameters)
        self._inputs = {item.variable: item for item in block.inputs}
        self._literals = dict(literals)
        self._check_literals()
        self.outputs: dict[str, Value] = {item.variable: item.type.zero for item in block.outputs}
        self.state: dict[str, Value] = {item.name: item.initial for item in block.states}
        self.error = 0
        self._given: dict[str, float] | None = None
        self._coefficients: dict[str, float] = {}
        self._limited = 0

    def scan(self, **inputs: Value) -> dict[str, Value]:
        """Run the block once with the inputs that are variables in the CALL, and return its outputs by name.

        Raises:
            InstanceError: no input of that name, a required one missing, a literal-only one or one given as a literal.
        """
        values = self._values(inputs)
        self.error = self._update_coefficients({**self._literals, **inputs})
        values.update(self._coefficients)
        values.update(self.state)
        values.update((item.variable, self.outputs[item.variable]) for item in self.block.outputs if item.holds)
        result = self._step(**{name: values[name] for name in self._wanted})
        self.outputs.update(zip(self.outputs, result, strict=False))
        self.state.update(zip(self.state, result[len(self.outputs) :], strict=False))
        if self.block.logs and result[-1]:
            self.error = int(result[-1])
        return dict(self.outputs)

    def _check_literals(self) -> None:
        for name, value in self._literals.items():
            item = self._input(name)
            if item.form is Form.VARIABLE:
                raise InstanceError(f"{self.block.name}: {item.name} must be a variable")
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                low, high = item.low, item.high
                if (low is not None and value < low) or (high is not None and value > high):
                    raise InstanceError(
                        f"{self.block.name}: {item.name} must lie between {low} and {high}, not {value}"
                    )
        declared = self.block.coefficients
        if declared is None:
            return
        given = _reals(self._literals, declared.parameters)
        if given.keys() >= {item.name for item in self.block.inputs if item.type is DataType.REAL and item.required}:
            _, moved = limited(declared, self.period_s, given)
            if moved:
                raise InstanceError(f"{self.block.name}: {', '.join(moved)} out of limits at {self.period_s} s")

    def _input(self, name: str) -> Input:
        if name not in self._inputs:
            raise InstanceError(f"{self.block.name} has no input {name.upper()}")
        return self._inputs[name]

    def _values(self, inputs: Mapping[str, Value]) -> dict[str, Value]:
        for name in inputs:
            item = self._input(name)
            if item.form is Form.LITERAL:
                raise InstanceError(f"{self.block.name}: {item.name} must be a literal")
            if name in self._literals:
                raise InstanceError(f"{self.block.name}: {item.name} is given as a literal already")
        values: dict[str, Value] = {}
        for name, item in self._inputs.items():
            if name in inputs:
                values[name] = inputs[name]
            elif name in self._literals:
                values[name] = self._literals[name]
            elif item.required:
                raise InstanceError(f"{self.block.name} needs {item.name}")
            elif item.default is not None:
                values[name] = item.default
        return values

    def _update_coefficients(self, values: Mapping[str, Value]) -> int:
        """Recompute the coefficients where a parameter changed; return the problem of one that just left its limits."""
        declared = self.block.coefficients
        if declared is None:
            return 0
        given = _reals(values, declared.parameters)
        if given == self._given:
            return 0
        results, moved = evaluate_noting(self.block, self.period_s, given)
        newly_out = moved & ~self._limited
        self._given, self._limited = given, moved
        self._coefficients = dict(zip(declared.names, results, strict=True))
        return COEFFICIENT_LIMITED if newly_out else 0


def _reals(values: Mapping[str, Value], names: tuple[str, ...]) -> dict[str, float]:
    """Return the REAL parameters that are among the values, by keyword."""
    return {name: float(values[name.lower()]) for name in names if name.lower() in values}
