"""Executes many scans of a native task in one call: columns of latched values in, columns of values at END out."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from automax_ros.compile.base.scan_io import StateValues
from automax_ros.compile.native.run.slots import REAL, Misfit, Slots, StateSlots

Whole = npt.NDArray[np.int64]
Real = npt.NDArray[np.float64]
Column = npt.NDArray[np.int64] | npt.NDArray[np.float64]


_FULL = 4
"""AUTOMAX_FULL: the room for errors or writes is used up."""
_ROOM = 4
"""Initial room for errors and writes per scan; the call is repeated with more where that is not enough."""


@dataclass(frozen=True)
class BesideLatch:
    """The reads and writes of scans in actual memory: scan k has the rows ``offsets[k]`` to ``offsets[k + 1]``.

    Values are doubles, which hold integers of 32 bits and REALs exactly. Without ``write_offsets`` the writes of scans
    are not compared.
    """

    read_offsets: Whole
    read_views: Whole
    read_elements: Whole
    read_values: Real
    write_offsets: Whole | None = None
    write_views: Whole | None = None
    write_elements: Whole | None = None
    write_values: Real | None = None


@dataclass(frozen=True)
class Written:
    """The writes of scans in actual memory, in order, one row per write."""

    scans: Whole
    views: Whole
    elements: Whole
    values: Real


@dataclass(frozen=True)
class ExecutedScans:
    """The result of scans by columns.

    Attributes:
        done: scans executed completely. Where there are fewer than requested, the next one stopped, was too long, or
            deviated from the recording; the state is that before it.
        outputs: for each of ``CompiledTask.written`` its values at END of each completed scan.
        errors: a row for each logged error, in order: scan, line, code.
        written: the writes of the scans in actual memory.
    """

    done: int
    outputs: list[Column]
    errors: Whole
    written: Written


class _Rows(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("offsets", "views", "elements", "values")]


class _Call(ctypes.Structure):
    _fields_ = [
        ("count", ctypes.c_int64),
        ("latched", ctypes.c_void_p),
        ("outputs", ctypes.c_void_p),
        ("reads", _Rows),
        ("writes", _Rows),
        ("error_room", ctypes.c_int64),
        ("errors", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("error_scans", "error_lines", "error_codes")),
        ("written_room", ctypes.c_int64),
        ("written", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("written_scans", "written_views", "written_elements", "written_values")),
        ("done", ctypes.c_int64),
        ("ended", ctypes.c_int),
    ]


class Columns:
    """The scans of one library by columns."""

    def __init__(self, path: Path, slots: StateSlots, latched_kinds: Sequence[int], written: Sequence[int]) -> None:
        """Load the library; ``written`` are the places of the written commons among the latched ones.

        Raises:
            OSError: the library cannot be loaded.
        """
        self._function = ctypes.CDLL(str(path)).automax_columns
        self._function.argtypes, self._function.restype = (ctypes.c_void_p, ctypes.c_void_p), None
        self._slots = slots
        self._kinds, self._written = tuple(latched_kinds), tuple(written)

    def execute(
        self,
        state: StateValues,
        latched: Sequence[Column],
        count: int,
        actual: BesideLatch | None,
        *,
        latches_own: bool = False,
    ) -> ExecutedScans:
        """Execute ``count`` scans on these columns; the state is changed in place (see ``ExecutedScans``).

        Raises:
            ValueError: the columns do not fit the task or the count.
        """
        columns = self._check(latched, count)
        _require_rows(actual, count)
        try:
            before = self._slots.taken(state)
        except Misfit:
            return self._run(np.empty(0, np.int64), columns, 0, None, latches_own).executed()
        slots = before.copy()
        run = self._run(slots, columns, count, actual, latches_own)
        if run.done < count:
            # The state is now between two scans: the complete scans are executed again, from the state before.
            slots = before.copy()
            run = self._run(slots, columns, run.done, actual, latches_own)
        self._slots.put(slots, before, state)
        return run.executed()

    def _run(
        self, slots: Slots, columns: Sequence[Column], count: int, actual: BesideLatch | None, latches_own: bool
    ) -> _Run:
        room = _ROOM * count + 64
        while True:
            latched, outputs = self._tables(columns, count, latches_own)
            run = _Run(latched, outputs, count, actual, room)
            if not count:
                return run
            kept = slots.copy()
            self._function(slots.ctypes.data, ctypes.addressof(run.call))
            if run.call.ended != _FULL:
                return run
            slots[:] = kept
            room *= 8

    def _tables(self, columns: Sequence[Column], count: int, latches_own: bool) -> tuple[list[Column], list[Column]]:
        """Return the columns to latch from and those for the outputs."""
        if not latches_own or not count:
            kinds = [self._kinds[place] for place in self._written]
            return [*columns], [_as_column(np.empty(count, np.int64), kind) for kind in kinds]
        latched = [*columns]
        # One array for both: what scan k leaves in place k + 1 of it is what scan k + 1 latches.
        shared = [columns[place][:1].repeat(count + 1) for place in self._written]
        for place, column in zip(self._written, shared, strict=True):
            latched[place] = column
        return latched, [column[1:] for column in shared]

    def _check(self, latched: Sequence[Column], count: int) -> list[Column]:
        if len(latched) != len(self._kinds):
            raise ValueError(f"{len(latched)} columns where the task latches {len(self._kinds)} commons")
        columns: list[Column] = []
        for kind, column in zip(self._kinds, latched, strict=True):
            if len(column) < count:
                raise ValueError(f"a column of {len(column)} values for {count} scans")
            columns.append(_as_column(column, kind))
        return columns


def _require_rows(actual: BesideLatch | None, count: int) -> None:
    """Refuse rows that the C code would read past their end."""
    if actual is None:
        return
    for offsets, *arrays in (
        (actual.read_offsets, actual.read_views, actual.read_elements, actual.read_values),
        (actual.write_offsets, actual.write_views, actual.write_elements, actual.write_values),
    ):
        if offsets is None:
            continue
        ordered = len(offsets) > count and offsets[0] >= 0 and bool(np.all(np.diff(offsets) >= 0))
        if not ordered or any(array is None or len(array) < offsets[-1] for array in arrays):
            raise ValueError(f"rows of reads or writes that do not fit {count} scans")


class _Run:
    """One call: its arguments, which must live as long as it, and its results."""

    def __init__(
        self,
        columns: Sequence[Column],
        outputs: Sequence[Column],
        count: int,
        actual: BesideLatch | None,
        room: int,
    ) -> None:
        self._kept: list[Column] = [*columns]
        self._outputs = outputs
        self._errors = [np.empty(room, np.int64) for _ in range(3)]
        self._places = [np.empty(room, np.int64) for _ in range(3)]
        self._values = np.empty(room, np.float64)
        self._tables = [_table(columns), _table(self._outputs)]
        call = _Call(count=count, error_room=room, written_room=room)
        call.latched, call.outputs = (ctypes.addressof(table) for table in self._tables)
        call.error_scans, call.error_lines, call.error_codes = (item.ctypes.data for item in self._errors)
        call.written_scans, call.written_views, call.written_elements = (item.ctypes.data for item in self._places)
        call.written_values = self._values.ctypes.data
        if actual is not None:
            call.reads = self._rows(actual.read_offsets, actual.read_views, actual.read_elements, actual.read_values)
            if actual.write_offsets is not None:
                call.writes = self._rows(
                    actual.write_offsets,
                    actual.write_views,
                    actual.write_elements,
                    actual.write_values,
                )
        self.call = call

    @property
    def done(self) -> int:
        return int(self.call.done)

    def executed(self) -> ExecutedScans:
        done, errors, written = self.done, self.call.errors, self.call.written
        scans, views, elements = (item[:written].copy() for item in self._places)
        return ExecutedScans(
            done,
            [column[:done] for column in self._outputs],
            np.column_stack([item[:errors] for item in self._errors]),
            Written(scans, views, elements, self._values[:written].copy()),
        )

    def _rows(self, offsets: Whole, views: Whole | None, elements: Whole | None, values: Real | None) -> _Rows:
        assert views is not None
        assert elements is not None
        assert values is not None
        whole = [np.ascontiguousarray(array, np.int64) for array in (offsets, views, elements)]
        real = np.ascontiguousarray(values, np.float64)
        self._kept += [*whole, real]
        return _Rows(*(array.ctypes.data for array in whole), real.ctypes.data)


def _as_column(values: Column, kind: int) -> Column:
    """Return values of a kind in the form for C: contiguous, 64 bits each."""
    if kind == REAL:
        return np.ascontiguousarray(values, np.float64)
    return np.ascontiguousarray(values, np.int64)


def _table(columns: Sequence[Column]) -> ctypes.Array[ctypes.c_void_p]:
    return (ctypes.c_void_p * (len(columns) + 1))(*(column.ctypes.data for column in columns), None)
