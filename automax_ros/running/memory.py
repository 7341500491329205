"""Common memory: views, the four memory operations, forcing, and the ordered write log.

A variable is a view, known by its index in the rack's table of variables. The four operations:

- ``latch``: copies of simple views at the start of a scan;
- ``commit``: what a scan's blocks changed, at END;
- ``read_now`` and ``write_now``: actual memory, for BASIC statements, arrays, REALs and strings.

A force sits on the view: latch and read_now return it, writes are dropped. Every write that takes effect is an entry of
the write log, if anybody has asked for the log.
"""

from __future__ import annotations

import contextlib
import enum
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple

from automax_ros.core.numbers import INT16_MAX, INT16_MIN, INT32_MAX, INT32_MIN, stored_real
from automax_ros.core.types import DataType, Latched, Value


class WriteKind(enum.IntEnum):
    """How a value came into common memory; the numbers are those of ``CommonWrite.kind``."""

    COMMIT = 1
    BASIC = 2
    OUTSIDE = 3


@dataclass(frozen=True)
class ViewSpec:
    """What memory must know of a variable: ``elements`` values of one type, ``length`` of a string."""

    name: str
    type: DataType
    elements: int = 1
    is_array: bool = False
    length: int = 0
    non_volatile: bool = False


class Write(NamedTuple):
    """One entry of the write log. ``sequence`` counts from 1 without gaps; ``writer`` is the id of a writer."""

    sequence: int
    time_ns: int
    writer: int
    kind: WriteKind
    view: int
    element: int
    value: Value


LatchPlan = Callable[[list[Value]], Latched]


class MemoryValueError(ValueError):
    """A value from outside does not fit the variable it is meant for."""


def _latch_nothing(_: list[Value]) -> Latched:
    return ()


class CommonMemory:
    """The common variables of one rack.

    ``now_ns`` is the time that entries of the write log carry; whoever runs tasks or applies writes sets it.
    """

    def __init__(self, views: Sequence[ViewSpec]) -> None:
        """Make the memory as it is at installation: everything 0 (2.4.5)."""
        self.specs = tuple(views)
        self.now_ns = 0
        self.sequence = 0
        self._cells: list[Value] = []
        self._arrays: list[list[Value] | None] = []
        self._forced: set[tuple[int, int]] = set()
        self._log: list[Write] | None = None
        for spec in self.specs:
            self._cells.append(spec.type.zero)
            self._arrays.append([spec.type.zero] * spec.elements if spec.is_array else None)
        self._index = {spec.name: number for number, spec in enumerate(self.specs)}

    def view(self, name: str) -> int:
        """Return the view of a variable by its full name.

        Raises:
            KeyError: the rack has no such variable.
        """
        return self._index[name]

    def plan(self, views: Sequence[int]) -> LatchPlan:
        """Return the prepared list of simple views that a task latches."""
        if not views:
            return _latch_nothing
        if len(views) == 1:
            only = views[0]
            return lambda cells: (cells[only],)
        return itemgetter(*views)

    def latch(self, plan: LatchPlan) -> Latched:
        """Return copies of the planned views, in their order (3.3)."""
        return plan(self._cells)

    def commit(self, changes: Iterable[tuple[int, Value]], writer: int) -> None:
        """Write what a scan's blocks changed: pairs of view and value, already within the view's type."""
        for view, value in changes:
            self._store(view, 0, value, writer, WriteKind.COMMIT)

    def read_now(self, view: int, element: int = 0) -> Value:
        """Return the actual value of a simple variable or of an array's element (flat index, in range)."""
        array = self._arrays[view]
        return self._cells[view] if array is None else array[element]

    def present(self, view: int) -> Value | list[Value]:
        """Return the actual value of a simple variable, or a copy of an array's values."""
        array = self._arrays[view]
        return self._cells[view] if array is None else array[:]

    def write_now(
        self, view: int, value: Value, writer: int, element: int = 0, kind: WriteKind = WriteKind.BASIC
    ) -> None:
        """Write actual memory; ``value`` is already within the view's type, ``element`` in range."""
        self._store(view, element, value, writer, kind)

    def write_from_outside(self, view: int, value: Value, writer: int, element: int = 0) -> None:
        """Write a value that comes from ROS, a preset or an operator.

        Raises:
            MemoryValueError: the value does not fit the variable's type, or the element does not exist.
        """
        self._store(view, element, self.accepted(view, value, element), writer, WriteKind.OUTSIDE)

    def accepted(self, view: int, value: Value, element: int = 0) -> Value:
        """Return a value from outside as an element of the variable would hold it; nothing is written.

        Raises:
            MemoryValueError: the value does not fit the variable's type, or the element does not exist.
        """
        spec = self.specs[view]
        if not 0 <= element < spec.elements:
            raise MemoryValueError(f"{spec.name} has no element {element}: it has {spec.elements}")
        return fitting(spec, value)

    def force(self, view: int, value: Value, element: int = 0, writer: int = 0) -> None:
        """Hold a value against every write until it is released; the force itself is a write from outside.

        Raises:
            MemoryValueError: the value does not fit the variable's type.
        """
        fit = fitting(self.specs[view], value)
        self._forced.discard((view, element))
        self._store(view, element, fit, writer, WriteKind.OUTSIDE)
        self._forced.add((view, element))
        self._show_forcing(writer)

    def release(self, view: int, element: int = 0, writer: int = 0) -> None:
        """End a force; the value stays until the next write (semantics, Scan, memory, tasks)."""
        self._forced.discard((view, element))
        self._show_forcing(writer)

    def _show_forcing(self, writer: int) -> None:
        """Keep the pre-defined FORCINGSTATUS@ TRUE while anything is forced (2.4.6)."""
        view = self._index.get("FORCINGSTATUS@")
        if view is not None and self._cells[view] is not bool(self._forced):
            self._store(view, 0, bool(self._forced), writer, WriteKind.OUTSIDE)

    @property
    def forced(self) -> frozenset[tuple[int, int]]:
        """What is forced: pairs of view and element."""
        return frozenset(self._forced)

    def keep_log(self) -> None:
        """Begin to keep the write log; whoever asks must ``drain`` it."""
        if self._log is None:
            self._log = []

    def drain(self) -> list[Write]:
        """Return the entries since the last drain, oldest first."""
        entries, self._log = self._log or [], None if self._log is None else []
        return entries

    def image(self) -> list[tuple[int, int, Value]]:
        """Return all of memory as (view, element, value), in the order of the table of variables."""
        entries: list[tuple[int, int, Value]] = []
        for view, array in enumerate(self._arrays):
            values = [self._cells[view]] if array is None else array
            entries.extend((view, element, value) for element, value in enumerate(values))
        return entries

    def load_image(self, entries: Iterable[tuple[int, int, Value]]) -> None:
        """Take over an image without logging it: the start of a replay or of a late joiner."""
        for view, element, value in entries:
            self._put(view, element, value)

    def clear(self, writer: int = 0, *, keep_non_volatile: bool = True) -> None:
        """Set volatile variables to 0, except what is forced: STOP ALL and system restart (2.4.5)."""
        for view, spec in enumerate(self.specs):
            if spec.non_volatile and keep_non_volatile:
                continue
            for element in range(spec.elements):
                if self.read_now(view, element) != spec.type.zero:
                    self._store(view, element, spec.type.zero, writer, WriteKind.OUTSIDE)

    def _put(self, view: int, element: int, value: Value) -> None:
        array = self._arrays[view]
        if array is None:
            self._cells[view] = value
        else:
            array[element] = value

    def _store(self, view: int, element: int, value: Value, writer: int, kind: WriteKind) -> None:
        if self._forced and (view, element) in self._forced:
            return
        self._put(view, element, value)
        self.sequence += 1
        if self._log is not None:
            self._log.append(Write(self.sequence, self.now_ns, writer, kind, view, element, value))


def fitting(spec: ViewSpec, value: Value) -> Value:
    """Return a value from outside in the variable's own type.

    Raises:
        MemoryValueError: wrong kind of value, or out of the type's range.
    """
    kind = spec.type
    if kind is DataType.BOOLEAN:
        if isinstance(value, bool) or value in (0, 1):
            return bool(value)
    elif kind is DataType.STRING:
        if isinstance(value, str) and len(value) <= spec.length:
            return value
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        if kind is DataType.REAL:
            with contextlib.suppress(OverflowError):
                single, clamped = stored_real(float(value))
                if not clamped:
                    return single
        else:
            low, high = (INT16_MIN, INT16_MAX) if kind is DataType.INTEGER else (INT32_MIN, INT32_MAX)
            if low <= value <= high and value == int(value):
                return int(value)
    raise MemoryValueError(f"{value!r} is no value for {spec.name}, type {kind.word}")
