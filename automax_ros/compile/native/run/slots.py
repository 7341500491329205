"""Converts a task's state to the slots of C (``abi.h``) and back, with the kind of each field."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from automax_ros.compile.base.layout import Layout, StateField, StateValue
from automax_ros.core.types import DataType, Value

BOOLEAN, INTEGER, REAL = range(3)
"""The kinds of values, numbered as in ``abi.h``."""
Slots = npt.NDArray[np.int64]
"""64 bits each; those of a double where the kind is REAL."""
_KINDS = {DataType.BOOLEAN: BOOLEAN, DataType.INTEGER: INTEGER, DataType.DOUBLE: INTEGER, DataType.REAL: REAL}
_INT64 = (-(1 << 63), (1 << 63) - 1)


class Misfit(Exception):
    """A state has a value that the C code does not support; it scans in Python."""


def kind_of(type_: DataType) -> int:
    """Return the kind of a type; KeyError for a STRING, which no native task has."""
    return _KINDS[type_]


class StateSlots:
    """The slots of one layout. ``limits`` are the least and greatest integers of each field, () for any 64 bits."""

    def __init__(self, layout: Layout, limits: Sequence[tuple[int, int]] = ()) -> None:
        self._fields = layout.fields
        self._limits = tuple(limits) or (_INT64,) * len(layout.fields)
        self._size = sum(field.size for field in layout.fields)
        python = {BOOLEAN: bool, INTEGER: int, REAL: float}
        kinds = [python[kind_of(field.type)] for field in layout.fields]
        self._fitting = [(kind, low, high) for kind, (low, high) in zip(kinds, self._limits, strict=True)]
        """The Python type of each field, and its least and greatest integer."""
        self._places = [
            (position, index) for position, field in enumerate(layout.fields) for index in range(field.size)
        ]
        """Field and element of each slot."""

    @property
    def fields(self) -> tuple[tuple[int, int, bool, int, int], ...]:
        """The data of each field for the host: kind, size, whether it is an array, least and greatest integer."""
        return tuple(
            (kind_of(field.type), field.size, field.is_array, low, high)
            for field, (low, high) in zip(self._fields, self._limits, strict=True)
        )

    def taken(self, state: Sequence[StateValue]) -> Slots:
        """Return a state as slots.

        Raises:
            Misfit: a value is not of its field's type, or an integer outside its limits.
        """
        slots = np.empty(self._size, np.int64)
        reals = slots.view(np.float64)
        place = 0
        for field, (python, low, high), held in zip(self._fields, self._fitting, state, strict=True):
            into = reals if python is float else slots
            values = _elements(field, held) if field.is_array else (held,)
            for number, value in enumerate(values, place):
                if type(value) is not python or (python is int and not low <= value <= high):  # type: ignore[operator]
                    raise Misfit(field.name)
                into[number] = value
            place += field.size
        return slots

    def put(self, slots: Slots, before: Slots, state: list[StateValue]) -> None:
        """Write the slots that differ from ``before`` into a state, in place."""
        for place in np.flatnonzero(slots != before).tolist():
            position, index = self._places[place]
            value = _object(self._fields[position], slots[place])
            held = state[position]
            if isinstance(held, list):
                held[index] = value
            else:
                state[position] = value


def _elements(field: StateField, held: StateValue) -> list[Value]:
    if not isinstance(held, list) or len(held) != field.size:
        raise Misfit(field.name)
    return held


def _object(field: StateField, slot: np.int64) -> Value:
    if field.type is DataType.REAL:
        return float(slot.view(np.float64))
    return bool(slot) if field.type is DataType.BOOLEAN else int(slot)
