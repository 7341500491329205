"""Executes many scans of a task on columns of their latched and read values, and returns columns of the results.

``PythonColumns`` calls the compiled Python function scan by scan: it runs where nothing faster is available, and is the
model for faster forms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from automax_ros.compile.base.scan_io import ScanTooLong, StateValues
from automax_ros.compile.compiler import CompiledTask
from automax_ros.core.types import DataType, Latched, Value, type_of_name
from automax_ros.replay.columns.entries import Entries, Ints
from automax_ros.runtime.memory.registers import Backplane
from automax_ros.runtime.scan.task_io import register_read, register_written


@dataclass(frozen=True)
class Executed:
    """The results of scans. Fewer may be ``done`` than requested: then the next one must be executed separately.

    ``outputs`` has the values at END of each of ``CompiledTask.written``; ``errors`` has rows of scan (from 0), line
    and code; ``written`` are the writes of BASIC statements.
    """

    done: int
    outputs: list[Ints]
    errors: Ints
    written: Entries


class ColumnForm(Protocol):
    """Executes scans of one task; the state is changed in place, to that after the scans done."""

    def columns(
        self, state: StateValues, latched: Sequence[Ints], count: int, read: Entries, *, latches_own: bool = False
    ) -> Executed:
        """Execute ``count`` scans.

        ``latched`` are the values of each of ``CompiledTask.latched``, ``read`` those that BASIC statements read, in
        order. ``latches_own``: each scan latches of the outputs what the one before has left, the first one what is
        in ``latched``.
        """
        ...


class PythonColumns:
    """Executes the compiled Python function on columns; ``types`` are those of the rack's variables, by view."""

    def __init__(
        self, compiled: CompiledTask, views: Sequence[int], types: Sequence[DataType], backplane: Backplane
    ) -> None:
        """Create the form of a task; ``views`` are those of ``compiled.latched``."""
        self._compiled, self._types, self._backplane = compiled, types, backplane
        self._views = tuple(views)
        self._flags = [type_of_name(name) is DataType.BOOLEAN for name in compiled.latched]
        places = {name: place for place, name in enumerate(compiled.latched)}
        self._outputs = [places[name] for name in compiled.written]

    def columns(
        self, state: StateValues, latched: Sequence[Ints], count: int, read: Entries, *, latches_own: bool = False
    ) -> Executed:
        """Execute scans; see ``ColumnForm``."""
        before = [value[:] if isinstance(value, list) else value for value in state]
        io = self._execute(state, latched, count, read, latches_own)
        if io.done < count:
            # The scan that could not be executed has changed the state: execute the scans before it again.
            state[:] = before
            io = self._execute(state, latched, io.done, read, latches_own)
        return self._build_executed(io, latched, latches_own)

    def _execute(
        self, state: StateValues, latched: Sequence[Ints], count: int, read: Entries, latches_own: bool
    ) -> _ColumnIo:
        columns = [
            (column[:count] != 0 if flag else column[:count]).tolist()
            for column, flag in zip(latched, self._flags, strict=True)
        ]
        rows: list[Latched] = list(zip(*columns, strict=True)) if columns else [()] * count
        own = {self._views[place]: place for place in self._outputs} if latches_own else {}
        io = _ColumnIo(rows, read, self._types, self._backplane, own)
        scans = self._compiled.scans(state, io)
        try:
            for _ in range(count):
                io.begin()
                if next(scans):
                    break
                if not io.read_all:
                    break
                io.done += 1
        except (ArithmeticError, LookupError, TypeError, ValueError, ScanTooLong, _Elsewhere):
            pass  # the state is stored
        finally:
            scans.close()
        io.end()
        return io

    def _build_executed(self, io: _ColumnIo, latched: Sequence[Ints], latches_own: bool) -> Executed:
        done = io.done
        position = {self._views[place]: number for number, place in enumerate(self._outputs)}
        outputs = [latched[place][:done].copy() for place in self._outputs]
        ends = [done] * len(outputs)
        for scan, changes in reversed(io.commits):
            for view, value in changes:
                if scan < done:
                    number = position[view]
                    outputs[number][scan : ends[number] if latches_own else scan + 1] = value
                    ends[number] = scan
        for output, end in zip(outputs, ends, strict=True):
            if latches_own:
                output[:end] = output[:1]
        errors = np.array([row for row in io.errors if row[0] < done], np.int64).reshape(-1, 3)
        return Executed(done, outputs, errors, io.written(done))


class _Elsewhere(Exception):
    """A scan does something that columns cannot represent."""


class _ColumnIo:
    """The inputs and outputs of the scans, of which ``done`` are complete.

    ``own`` are the places, by view, of what is latched as the scan before has left it.
    """

    def __init__(
        self,
        rows: list[Latched],
        read: Entries,
        types: Sequence[DataType],
        backplane: Backplane,
        own: Mapping[int, int],
    ) -> None:
        self._rows = iter(rows)
        self._own, self._left = own, dict[int, Value]()
        self._types, self._backplane = types, backplane
        self._read, self._place, self._end = read, 0, 0
        self._places = list(zip(read.views.tolist(), read.elements.tolist(), strict=True))
        self._values = [
            _convert(types[view], value) for (view, _), value in zip(self._places, read.values, strict=True)
        ]
        self._offsets = read.offsets.tolist()
        self.done = 0
        self._scan = -1
        self.commits: list[tuple[int, list[tuple[int, Value]]]] = []
        self.errors: list[tuple[int, int, int]] = []
        self._writes: list[tuple[int, int, Value]] = []
        self._write_offsets: list[int] = []

    def begin(self) -> None:
        """Begin a scan."""
        self._scan += 1
        self._place, self._end = self._offsets[self._scan], self._offsets[self._scan + 1]
        self._write_offsets.append(len(self._writes))

    def end(self) -> None:
        """End the last scan."""
        self._write_offsets.append(len(self._writes))

    @property
    def read_all(self) -> bool:
        """Whether the scan has made all reads of the recorded one."""
        return self._place == self._end

    def written(self, done: int) -> Entries:
        """Return the writes of the first ``done`` scans."""
        offsets = np.array(self._write_offsets[: done + 1] if done else [0], np.int64)
        writes = self._writes[: int(offsets[-1])]
        return Entries(
            offsets,
            np.array([view for view, _, _ in writes], np.int64),
            np.array([element for _, element, _ in writes], np.int64),
            np.array([value for _, _, value in writes], np.float64),
        )

    # ScanIo

    def latch(self) -> Latched:
        """Return the latched values of the scan."""
        row = next(self._rows)
        if not self._own:
            return row
        if not self._left:
            self._left = {place: row[place] for place in self._own.values()}
        values = list(row)
        for place, value in self._left.items():
            values[place] = value
        return tuple(values)

    def forces(self) -> tuple[bool, ...]:
        """Leave the scan to scan-by-scan replay: nothing is forced here."""
        raise _Elsewhere

    def commit(self, changes: list[tuple[int, Value]]) -> None:
        """Record the changes by blocks."""
        self.commits.append((self._scan, changes))
        if self._own:
            self._left.update((self._own[view], value) for view, value in changes)

    def read_now(self, view: int, element: int = 0) -> Value:
        """Return the value that the recorded scan read at this place."""
        place = self._place
        if place == self._end or self._places[place] != (view, element):
            raise _Elsewhere
        self._place = place + 1
        return self._values[place]

    def write_now(self, view: int, value: Value, element: int = 0) -> None:
        """Record the write of a BASIC statement."""
        if isinstance(value, str) or isinstance(value, float) is not (self._types[view] is DataType.REAL):
            raise _Elsewhere
        self._writes.append((view, element, value))

    def log(self, line: int, code: int) -> None:
        """Record a run-time error."""
        self.errors.append((self._scan, line, code))

    def print_line(self, values: tuple[Value, ...], separators: str) -> None:  # noqa: ARG002
        """Leave the scan to scan-by-scan replay."""
        raise _Elsewhere

    def errors_logged(self) -> bool:
        """Leave the scan to scan-by-scan replay."""
        raise _Elsewhere

    def clear_errors(self) -> None:
        """Leave the scan to scan-by-scan replay."""
        raise _Elsewhere

    def set_event(self, name: str) -> None:  # noqa: ARG002
        """Leave the scan to scan-by-scan replay."""
        raise _Elsewhere

    def io_read(self, slot: int, register: int) -> tuple[int, int]:
        """Return a register's word and 0, or 0 and the bus error."""
        return register_read(self._backplane, self.read_now, slot, register)

    def io_write(self, slot: int, register: int, value: int) -> int:
        """Write a register's word; return 0 or the bus error."""
        return register_written(self._backplane, self.write_now, slot, register, value)

    def minor_loop(self, inputs: tuple[Value | None, ...], records: list[Value] | None) -> Sequence[Value] | None:  # noqa: ARG002
        """Leave the scan to scan-by-scan replay."""
        raise _Elsewhere


def _convert(kind: DataType, value: float) -> Value:
    if kind is DataType.REAL:
        return float(value)
    return bool(value) if kind is DataType.BOOLEAN else int(value)
