"""The scans of one task as a table: the values that each latched, read and wrote, its errors, and its locals."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from automax_ros.core.names import element_name
from automax_ros.core.text import did_you_mean
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType, type_of_name
from automax_ros.messages.types.messages import Scan, TaskState, VariableTable
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Cell, CommonLog, Key
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import run_facts
from automax_ros.recordings.tables.export import Column, column, count_column
from automax_ros.recordings.tables.series import WHOLE_RUN, Progress, Window

_TYPES = frozenset(f"automax_msgs/msg/{name}" for name in ("Scan", "TaskState", "VariableTable"))
_LOCAL = re.compile(r"[A-Z_][A-Z0-9_]{0,63}[%!@]?")
"""Names of state fields that are variables of the task; those of blocks contain blanks and periods."""
_OWN = (
    count_column("scan"),
    count_column("duration_ns", "ns"),
    count_column("skipped"),
    count_column("errors"),
    count_column("error_line"),
    count_column("error_code"),
)
"""Columns of every scan; line and code are those of its first error, 0 without one."""


class ScanTable:
    """The scans of one task: one row per scan from scan 1 on, in the window.

    Columns: ``scan``, ``duration_ns``, ``skipped``, ``errors`` (how many), ``error_line``, ``error_code`` (of the
    first), then ``in.NAME`` for each variable that the task latches or reads, ``out.NAME`` for each that it writes, and
    ``local.NAME`` for each local where a state was recorded after every scan. A value holds until the next one is
    recorded; ``out`` begins as it was latched or read. After missing scans the ``in`` values are unknown until a scan
    contains them all. The recording is read twice, first to find the columns.

    Raises:
        BagError: the recording cannot be read, has no table of variables, or has no scan of the task.
    """

    def __init__(self, bag: Path, task: str, window: Window = WHOLE_RUN, progress: Progress | None = None) -> None:
        self._bag = bag
        self._window = window
        self._task = task.upper()
        self._progress = progress
        self._reader = BagReader(bag)
        self._log = CommonLog(bag, run_facts(self._reader))
        self._variables = {item.id: item for item in self._log.variables.values()}
        self._columns: list[Column] = list(_OWN)
        self._inputs: dict[Key, int] = {}
        self._outputs: dict[Key, int] = {}
        self._locals: list[tuple[int, int]] = []
        self._layout = ""
        self._find_columns()

    @property
    def columns(self) -> Sequence[Column]:
        """The columns after the time."""
        return self._columns

    def rows(self) -> Iterator[tuple[int, Mapping[int, Cell | None]]]:
        """Return the rows: time of the latch, and the cells that differ from the row before.

        Raises:
            BagError: the recording is damaged, or the window holds no scan.
        """
        held: dict[int, Cell | None] = {}
        before: int | None = None
        row: int | None = None
        found = False
        last = 0
        known: dict[int, Cell | None] = {}
        for time, message in self._scans(first_half=False):
            if isinstance(message, TaskState):
                held.update(self._local_cells(message))
                continue
            if row is not None:
                yield row, held
                held = {}
            last, scan = time, message
            if before is not None and scan.scan > before + 1 and not scan.full:
                held.update((index, None) for index in self._inputs.values())
            cells = self._recorded_cells(scan)
            known.update(cells)
            for key, index in self._outputs.items():
                if index not in known and (value := known.get(self._inputs.get(key, -1))) is not None:
                    known[index] = cells[index] = value
            held.update(cells)
            before = scan.scan
            row = last if scan.scan and last >= self._window.start_ns else None
            if row is not None:
                found = True
                held.update(_own_cells(scan))
        if row is not None:
            yield row, held
        if not found:
            hint = f"the last one in reach is at {seconds_text(last)} s"
            raise BagError("AMX6825", self._bag, f"holds no scan of {self._task} in the range asked for", hint)

    def _recorded_cells(self, scan: Scan) -> dict[int, Cell | None]:
        """Return the inputs and outputs in a scan's message, by column."""
        log, stamp = self._log, scan.stamp
        cells: dict[int, Cell | None] = {}
        own: set[Key] = set()
        for entry in log.entries(scan.latched, stamp):
            cells[self._inputs[entry[:2]]] = entry[2]
        for entry in log.reads(scan.read, stamp):  # the first read counts: a later one may see the scan's own write
            index = self._inputs.get(entry[:2])
            if index is not None and entry[:2] not in own:
                own.add(entry[:2])
                cells.setdefault(index, entry[2])
        for values in (scan.written, scan.committed):
            for entry in log.reads(values, stamp):
                index = self._outputs.get(entry[:2])
                if index is not None:
                    cells[index] = entry[2]
        return cells

    def _local_cells(self, state: TaskState) -> dict[int, Cell | None]:
        if state.layout_hash != self._layout:
            return {index: None for index, _ in self._locals}
        values = state.value
        return {index: _local_value(self._columns[index], values[at]) for index, at in self._locals if at < len(values)}

    def _scans(self, *, first_half: bool) -> Iterator[tuple[int, Scan | TaskState]]:
        """Yield the task's scans and states up to the end of the window."""
        reader = self._reader
        if self._progress is not None:
            progress = self._progress
            reader.on_progress = lambda share: progress(share / 2 if first_half else (1 + share) / 2)
        tasks: set[str] = set()
        for entry in reader.messages(types=_TYPES):
            message = entry.message
            if isinstance(message, VariableTable):
                self._log.check_table(message)
            elif isinstance(message, (Scan, TaskState)):
                if isinstance(message, Scan) and len(tasks) < _MOST_NAMES:
                    tasks.add(message.task)
                if message.task != self._task:
                    continue
                time = max(0, message.stamp - self._log.facts.table.stamp)
                if self._window.end_ns is not None and time > self._window.end_ns:
                    break
                yield time, message
        if first_half and self._task not in tasks:
            raise self._unknown_task(tasks)

    def _find_columns(self) -> None:
        inputs: dict[Key, None] = {}
        outputs: dict[Key, None] = {}
        first: TaskState | None = None
        scans = states = 0
        for _, message in self._scans(first_half=True):
            if isinstance(message, TaskState):
                first, states = first or message, states + bool(message.scan)
                continue
            scans += bool(message.scan)
            for keys, values in ((inputs, message.latched), (outputs, message.committed)):
                keys.update(dict.fromkeys(zip(values.variable, values.element, strict=False)))
            for keys, values in ((inputs, message.read), (outputs, message.written)):
                places = zip(values.variable, values.element, strict=False)
                keys.update(dict.fromkeys(key for key in places if key[0] in self._variables))
        self._inputs = self._add("in", inputs)
        self._outputs = self._add("out", outputs)
        if first is not None and states >= scans:
            self._add_locals(first)

    def _add_locals(self, state: TaskState) -> None:
        """Add a column for each local and for each element of local arrays."""
        self._layout, place = state.layout_hash, 0
        for name, size in zip(state.field, state.size, strict=False):
            kind = type_of_name(name)
            if _LOCAL.fullmatch(name) and size <= _MOST_NAMES and len(self._locals) < _MOST_LOCALS:
                for element in range(size):
                    self._locals.append((len(self._columns), place + element))
                    label = f"local.{name}({element})" if size > 1 else f"local.{name}"
                    self._columns.append(column(label, kind))
            place += size

    def _add(self, direction: str, keys: Mapping[Key, None]) -> dict[Key, int]:
        """Add a column for each variable in the order of the rack's table; return their indices."""
        indices: dict[Key, int] = {}
        for number, element in sorted(keys):
            variable = self._variables.get(number)
            if variable is None or element >= math.prod(variable.dimensions):
                text = f"a scan of {self._task} names variable {number}, element {element}, which a scan cannot latch"
                raise BagError("AMX6813", self._bag, text)
            indices[number, element] = len(self._columns)
            label = f"{direction}.{element_name(variable, element)}"
            self._columns.append(column(label, DataType.numbered(variable.type), variable.unit))
        return indices

    def _unknown_task(self, tasks: set[str]) -> BagError:
        names = sorted(tasks)
        there = f"there are {', '.join(names[:8])}" if names else "it holds no scans at all"
        hint = did_you_mean(self._task, names) or there
        return BagError("AMX6827", self._bag, f"holds no scan of a task {self._task[:40]!r}", hint)


def _local_value(place: Column, value: float) -> Cell:
    return value if place.typecode == "d" or not math.isfinite(value) else int(value)


_MOST_LOCALS = 10_000
"""Most columns of locals (decision)."""
_MOST_NAMES = 1000
"""Most names of tasks kept for the hint, and most elements of a local with columns; a rack has fewer tasks."""


def _own_cells(scan: Scan) -> dict[int, Cell | None]:
    line, code = (scan.errors[0].line, scan.errors[0].code) if scan.errors else (0, 0)
    return dict(enumerate((scan.scan, scan.duration_ns, scan.skipped, len(scan.errors), line, code)))
