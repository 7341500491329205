"""Views of common memory: variables as memory, tasks, recordings and replays use them.

A variable is a view, identified by its index in the rack's table of variables. The registers of a module are one view,
an array of 16-bit words (its bank); an I/O point is a view with a ``Place`` in it: a word and its bits show the same.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from typing import NamedTuple, Protocol

from automax_ros.core.kinds import WriteKind
from automax_ros.core.machine_code import mypyc_attr
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType, Latched, Value


@dataclass(frozen=True)
class Place:
    """An I/O point's bank (a view), first register (of two: high word first, 57C421 p. 4-4), bit if it is a BOOLEAN."""

    bank: int
    register: int
    bit: int | None = None


@dataclass(frozen=True)
class ViewSpec:
    """The properties of a variable in memory: ``elements`` values of one type, ``length`` of a string."""

    name: str
    type: DataType
    elements: int = 1
    is_array: bool = False
    length: int = 0
    non_volatile: bool = False
    place: Place | None = None


class Write(NamedTuple):
    """One entry of the write log. ``sequence`` counts from 1 without gaps; ``writer`` is the id of a writer."""

    sequence: int
    time_ns: int
    writer: int
    kind: WriteKind
    view: int
    element: int
    value: Value


class WriteGroup:
    """Entries of the write log from one operation, such as a scan's commit; ``sequence`` is that of the first.

    ``changes`` are (view, value) in order, not to be modified.
    """

    __slots__ = ("changes", "element", "kind", "sequence", "time_ns", "writer")

    def __init__(
        self,
        sequence: int,
        time_ns: int,
        writer: int,
        kind: WriteKind,
        element: int,
        changes: Sequence[tuple[int, Value]],
    ) -> None:
        self.sequence = sequence
        self.time_ns = time_ns
        self.writer = writer
        self.kind = kind
        self.element = element
        self.changes = changes

    @property
    def key(self) -> tuple[int, int, WriteKind]:
        """Time, writer and kind: neighbours with the same key are in one message."""
        return self.time_ns, self.writer, self.kind

    def __repr__(self) -> str:
        return f"WriteGroup({', '.join(map(repr, self.entries()))})"

    def entries(self) -> Iterator[Write]:
        """Yield the entries one by one."""
        for number, (view, value) in enumerate(self.changes, self.sequence):
            yield Write(number, self.time_ns, self.writer, self.kind, view, self.element, value)


LatchPlan = Callable[[list[Value]], Latched]
"""Takes all cells of a memory and returns those that a task latches."""


class Memory(Protocol):
    """The memory of a task: ``CommonMemory`` describes the operations; values are within their view's type already.

    The live memory of a rack, the local memory of a UDC and the memory of a replay implement it. ``now_ns`` is the time
    of the next access; code that runs tasks sets it.
    """

    now_ns: int

    def view(self, name: str) -> int: ...  # noqa: D102

    def plan(self, views: Sequence[int]) -> LatchPlan: ...  # noqa: D102

    def latch(self, plan: LatchPlan) -> Latched: ...  # noqa: D102

    def commit(self, changes: Sequence[tuple[int, Value]], writer: int) -> None: ...  # noqa: D102

    def read_now(self, view: int, element: int = 0) -> Value: ...  # noqa: D102

    def write_now(  # noqa: D102
        self, view: int, value: Value, writer: int, element: int = 0, kind: WriteKind = WriteKind.BASIC
    ) -> None: ...

    def is_forced(self, view: int) -> bool: ...  # noqa: D102

    def under_force(self, view: int) -> Value: ...  # noqa: D102

    def watch_forces(self, changed: Callable[[], None]) -> None: ...  # noqa: D102


class MemoryValueError(ValueError):
    """A value from outside does not fit the variable it is meant for."""


@mypyc_attr(native_class=False)
class CellLatch(partial[Latched]):
    """A latch of a plan over ``cells``: native scans, which know the plan's views, read the cells directly."""

    __slots__ = ()

    @property
    def cells(self) -> list[Value]:
        """The cells that it latches, by view."""
        cells: list[Value] = self.args[0]
        return cells


class CellCommit(NamedTuple):
    """Allows a commit without a call: native scans store changed values of ``plain`` views directly in the cells.

    ``gate`` is two integers of 64 bits: 1 while a commit changes only cells, and the number of values stored so.
    """

    cells: list[Value]
    plain: list[bool]
    gate: array[int]


def latch_plan(views: Sequence[int]) -> LatchPlan:
    """Return the fastest function that picks views from the list of cells."""
    if not views:
        return lambda _: ()
    if len(views) == 1:
        only = views[0]
        return lambda cells: (cells[only],)
    return itemgetter(*views)


def fitting(spec: ViewSpec, value: Value) -> Value:
    """Return a value from outside in the variable's type; MemoryValueError for a wrong kind or one out of range."""
    kind = spec.type
    if kind is DataType.BOOLEAN:
        if isinstance(value, bool) or value in (0, 1):
            return bool(value)
    elif kind is DataType.STRING:
        if isinstance(value, str) and len(value) <= spec.length:
            return value
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        if kind is DataType.REAL:
            # Not contextlib.suppress, which takes longer than the rest: feeds of plants pass here.
            try:
                single, clamped = stored_real(float(value))
            except OverflowError:
                clamped = True
            if not clamped:
                return single
        else:
            low, high = kind.range
            if low <= value <= high and value == int(value):
                return int(value)
    raise MemoryValueError(f"{value!r} is not a value for {spec.name}, type {kind.word}")
