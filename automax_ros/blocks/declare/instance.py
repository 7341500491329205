"""Runs one block outside a task by calling its step function."""

from __future__ import annotations

import inspect
from collections.abc import Generator, Iterable, Mapping, Sequence
from typing import Any

from automax_ros.blocks.declare.channels import MOST_CHANNELS, programmed_channels
from automax_ros.blocks.declare.coefficients import evaluate_noting, limited
from automax_ros.blocks.declare.declaration import COEFFICIENT_LIMITED, Access, Block, Form, Input, Special, State
from automax_ros.core.types import DataType, Value

Given = Value | Sequence[int]
"""The value of an input, or the elements of a table."""

NS_PER_S = 1e9


class InstanceError(ValueError):
    """A parameter is unknown to the block, missing, or given in a form that it may not have."""


class Instance:
    """A block with its states.

    ``outputs`` and ``state`` are the values of its output variables and hidden states after the last scan, ``error`` is
    the number of the last problem that the last scan logged, 0 for none; ``coefficients`` are those it was run with.
    ``results`` names the values that the step function returns: outputs, then states. ``wrote`` says whether the last
    scan wrote outputs that hold; those it does not write keep their values in ``outputs``, also values written there
    from outside. A table is any sequence of numbers. The name of a data structure is not given: READ and WRITE blocks
    get the instance of the SHIFT block that makes theirs.
    """

    def __init__(self, block: Block, period_ns: int, structure: Instance | None = None, /, **literals: Value) -> None:
        """Create the instance from the literals of the CALL, by lower-case keyword, and the scan period.

        ``structure`` is the SHIFT block whose data structure a READ or WRITE block uses. A SHIFT block may be given its
        ``channels``; without them it has all eight.

        Raises:
            InstanceError: no parameter of that name, a literal outside its limits, no or the wrong structure, or
                SCAN_LOOP.
        """
        if block.step is None:
            raise InstanceError(f"{block.name} has no step function: the task carries it out")
        if (block.structure is Access.USES) != (structure is not None):
            raise InstanceError(f"{block.name}: the instance of a SHIFT block is missing, or given where none is used")
        self.block = block
        self.period_s = period_ns / NS_PER_S
        self._step = block.step
        self.results = (*(item.variable for item in block.outputs), *(item.name for item in block.states))
        self._wanted = tuple(inspect.signature(block.step).parameters)
        self._inputs = {item.variable: item for item in block.inputs}
        self._channels = int(literals.pop("channels", MOST_CHANNELS)) if block.structure is Access.MAKES else 0
        self._literals = dict(literals)
        self._check_literals()
        self._facts: dict[str, int] = {"channels": self._channels} if structure is None else structure.shape
        self.outputs: dict[str, Value] = {item.variable: item.type.zero for item in block.outputs}
        self.state: dict[str, Value | list[Value]] = {item.name: self._initial(item) for item in block.states}
        self._structure = {} if structure is None else structure.state
        self.error = 0
        self.wrote = True
        self._given: dict[str, float] | None = None
        self.coefficients: dict[str, float] = {}
        self._kept: tuple[float, ...] = ()
        self._limited = 0

    @property
    def shape(self) -> dict[str, int]:
        """Columns and channels of the data structure that the block makes."""
        return {"max_columns": int(self._literals.get("max_columns", 0)), "channels": self._channels}

    def scan(self, **inputs: Given) -> dict[str, Value]:
        """Run the block once with the inputs that are variables in the CALL, and return its outputs by name.

        Raises:
            InstanceError: no input of that name, a required one missing, a literal-only one or one given as a literal.
        """
        self._keep(self._step(*self._arguments(inputs)))
        return dict(self.outputs)

    def drive(self, name: str, signal: Iterable[Value], **inputs: Given) -> Generator[tuple[Any, ...], None, None]:
        """Run the block once for each value of one input, the others constant, and yield the ``results``.

        Far faster than ``scan``; ``outputs``, ``state`` and ``error`` are set at the end.

        Raises:
            InstanceError: as for ``scan``.
        """
        arguments = self._arguments({**inputs, name: 0})
        place = self._wanted.index(name)
        returning = [
            (self._wanted.index(item), position)
            for position, item in enumerate(self.results)
            if item in self.state and item in self._wanted
        ]
        step, result = self._step, None
        try:
            for value in signal:
                arguments[place] = value
                result = step(*arguments)
                for argument, position in returning:
                    arguments[argument] = result[position]
                yield result
        finally:
            if result is not None:
                self._keep(result)

    def _arguments(self, inputs: Mapping[str, Given]) -> list[object]:
        """Return the step function's arguments, in their order, for a scan with these inputs."""
        values = self._values(inputs)
        self.error = self._update_coefficients({**self._literals, **inputs})
        values.update(self.coefficients)
        values.update(self._facts)
        values.update(self._facts_of(inputs))
        values.update(self._structure)
        values.update(self.state)
        return [values[name] for name in self._wanted]

    def _keep(self, result: tuple[Any, ...]) -> None:
        after_states = len(self.outputs) + len(self.state)
        self.wrote = bool(result[after_states]) if self.block.holds else True
        for output, value in zip(self.block.outputs, result, strict=False):
            if self.wrote or not output.holds:
                self.outputs[output.variable] = value
        self.state.update(zip(self.state, result[len(self.outputs) : after_states], strict=True))
        if self.block.logs and result[-1]:
            self.error = int(result[-1])

    def _initial(self, state: State) -> Value | list[Value]:
        size = 0 if state.size is None else state.size({**self._literals, **self._facts})
        return state.initial if state.size is None else [state.initial] * size

    def _facts_of(self, inputs: Mapping[str, Given]) -> dict[str, int]:
        """Return the facts that depend on which inputs are programmed, and on the tables."""
        given = {*inputs, *self._literals}
        table = inputs.get("table1")
        facts = {"programmed": programmed_channels(name.upper() for name in given)}
        if isinstance(table, Sequence):
            facts["elements"] = len(table)
        return facts

    def _check_literals(self) -> None:
        for name, value in self._literals.items():
            item = self._input(name)
            if item.form is Form.VARIABLE:
                raise InstanceError(f"{self.block.name}: {item.name} must be a variable")
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                low, high = item.low, item.high
                if item.one_of and value not in item.one_of:
                    raise InstanceError(f"{self.block.name}: {item.name} must be one of {item.one_of}, not {value}")
                if (low is not None and value < low) or (high is not None and value > high):
                    raise InstanceError(
                        f"{self.block.name}: {item.name} must lie between {low} and {high}, not {value}"
                    )
        declared = self.block.coefficients
        if declared is None or declared.limits_literals:
            return
        given = _reals(self._literals, declared.parameters)
        if given.keys() >= {item.name for item in self.block.inputs if item.type is DataType.REAL and item.required}:
            in_force, moved = limited(declared, self.period_s, given)
            if moved:
                raise InstanceError(f"{self.block.name}: {', '.join(moved)} out of limits at {self.period_s} s")
            if declared.relation is not None and not declared.relation.holds(in_force):
                raise InstanceError(f"{self.block.name}: {declared.relation.text}")

    def _input(self, name: str) -> Input:
        if name not in self._inputs:
            raise InstanceError(f"{self.block.name} has no input {name.upper()}")
        return self._inputs[name]

    def _values(self, inputs: Mapping[str, Given]) -> dict[str, object]:
        for name in inputs:
            item = self._input(name)
            if item.form is Form.LITERAL:
                raise InstanceError(f"{self.block.name}: {item.name} must be a literal")
            if name in self._literals:
                raise InstanceError(f"{self.block.name}: {item.name} is given as a literal already")
        values: dict[str, object] = {}
        for name, item in self._inputs.items():
            if name in inputs:
                values[name] = inputs[name]
            elif name in self._literals:
                values[name] = self._literals[name]
            elif item.type is Special.TABLE:
                values[name] = ()
            elif item.required and not isinstance(item.type, Special):
                raise InstanceError(f"{self.block.name} needs {item.name}")
            elif item.default is not None:
                values[name] = item.default
            elif isinstance(item.type, DataType):
                values[name] = item.type.zero
        return values

    def _update_coefficients(self, values: Mapping[str, Given]) -> int:
        """Recompute the coefficients where a parameter changed; return the problem of one that just left its limits."""
        declared = self.block.coefficients
        if declared is None:
            return 0
        given = _reals(values, declared.parameters)
        if given == self._given:
            return 0
        results, self._kept, moved = evaluate_noting(self.block, self.period_s, given, self._kept)
        newly_out = moved & ~self._limited
        self._given, self._limited = given, moved
        self.coefficients = dict(zip(declared.names, results, strict=True))
        return COEFFICIENT_LIMITED if newly_out else 0


def _reals(values: Mapping[str, Given], names: tuple[str, ...]) -> dict[str, float]:
    """Return the parameters of coefficients that are among the values, by keyword."""
    found = {name: values.get(name.lower()) for name in names}
    return {name: float(value) for name, value in found.items() if isinstance(value, (int, float))}
