"""The typed layout of a task's state, which the task keeps from scan to scan: its fields by name.

Snapshots, monitoring, forcing of locals, hot reload and replay access a task's state only through its layout and the
layout's hash.
"""

from __future__ import annotations

import enum
import hashlib
import math
from collections.abc import Container, Sequence
from dataclasses import dataclass

from automax_ros.core.types import DataType, Value
from automax_ros.language.program import Symbol

StateValue = Value | list[Value]
"""A field's value in the state: a list for an array."""


class Role(enum.Enum):
    """Role of a field of the state."""

    LOCAL = "local"
    TUNABLE = "tunable"
    BLOCK = "block"
    STACK = "stack"
    LOG = "log"


_VARIABLES = (Role.LOCAL, Role.TUNABLE)


def _in_range(kind: DataType, value: float) -> bool:
    low, high = kind.range
    return low <= value <= high


@dataclass(frozen=True)
class StateField:
    """One field: ``name`` is the variable's full name, or line, block and state as in ``1030 LAG.y1``.

    ``initial`` is the value at installation (locals), or at the block's first execution since RUN; ``dimensions`` are
    an array's, ``length`` is the longest text of a string. A ``below`` that is not 0 means that the value is 0 or more
    and less than it: a place in a buffer.
    """

    name: str
    type: DataType
    role: Role
    initial: Value
    size: int = 1
    is_array: bool = False
    dimensions: tuple[int, ...] = ()
    length: int = 0
    below: int = 0

    def fresh(self) -> StateValue:
        """Return the field's value at installation."""
        return [self.initial] * self.size if self.is_array else self.initial

    def typed(self, value: Value) -> Value:
        """Return a value from a snapshot in the field's type.

        Raises:
            ValueError: the field cannot hold it.
        """
        if isinstance(value, str) or self.type is DataType.STRING:
            if isinstance(value, str) and self.type is DataType.STRING and len(value) <= self.length:
                return value
        elif self.type is DataType.BOOLEAN:
            return bool(value)
        elif self.type is DataType.REAL:
            return float(value)
        elif self.below and not 0 <= value < self.below:
            raise ValueError(f"{self.name} cannot be {value!r}: it is 0 to {self.below - 1}")
        elif math.isfinite(value) and (self.role not in _VARIABLES or _in_range(self.type, value)):
            return int(value)
        raise ValueError(f"{self.name} cannot be {value!r}: it is {self.type.word}")


@dataclass(frozen=True)
class Layout:
    """The fields of a task's state, in the order in which compiled code loads and stores them."""

    fields: tuple[StateField, ...]

    @property
    def hash(self) -> str:
        """SHA-256 of names, types, sizes and roles."""
        text = "\n".join(
            f"{field.name}:{field.type.word}:{field.dimensions or field.size}:{field.length}:{field.role.value}"
            for field in self.fields
        )
        return hashlib.sha256(text.encode()).hexdigest()

    def index(self, name: str) -> int:
        """Return the position of a field.

        Raises:
            KeyError: no field has that name.
        """
        for position, field in enumerate(self.fields):
            if field.name == name:
                return position
        raise KeyError(name)

    def fresh(self) -> list[StateValue]:
        """Return the state at installation."""
        return [field.fresh() for field in self.fields]

    def restart(self, state: list[StateValue]) -> None:
        """Reset a state as RUN does: blocks and stacks start again, locals and tunables keep their values (2.4.5)."""
        for position, field in enumerate(self.fields):
            if field.role in (Role.BLOCK, Role.STACK):
                state[position] = field.fresh()

    def lose_locals(self, state: list[StateValue], kept: Container[str] = ()) -> None:
        """Set the locals of a state, except those ``kept`` and tunables, to their values at installation."""
        for position, field in enumerate(self.fields):
            if field.role is Role.LOCAL and field.name not in kept:
                state[position] = field.fresh()

    def flatten(self, state: Sequence[StateValue]) -> list[Value]:
        """Return all values one after the other, arrays element by element."""
        values: list[Value] = []
        for value in state:
            if isinstance(value, list):
                values.extend(value)
            else:
                values.append(value)
        return values

    def restore(self, values: Sequence[Value]) -> list[StateValue]:
        """Return the state from flat values, each converted to its field's type.

        Raises:
            ValueError: the number of values is not the layout's, or a field cannot hold its value.
        """
        expected = sum(field.size for field in self.fields)
        if len(values) != expected:
            raise ValueError(f"a state of {len(values)} values does not fit a layout of {expected}")
        state: list[StateValue] = []
        position = 0
        for field in self.fields:
            part = [field.typed(value) for value in values[position : position + field.size]]
            state.append(part if field.is_array else part[0])
            position += field.size
        return state


def local_field(symbol: Symbol) -> StateField:
    """Return the field of a local variable or a tunable."""
    if symbol.tuning is not None:
        return StateField(symbol.name, symbol.type, Role.TUNABLE, symbol.tuning.current)
    return StateField(
        symbol.name,
        symbol.type,
        Role.LOCAL,
        symbol.type.zero,
        symbol.elements,
        is_array=bool(symbol.dimensions),
        dimensions=symbol.dimensions,
        length=symbol.length,
    )
