"""The verb ``table``: columns of a CSV table, such as a plant's historian writes, drive signals by their times.

``{file: shift.csv, time: time_s, columns: {TACH%: tach}, hold: linear, values: unit}``. The first row happens at
``at``, each other one as much later as its time is (decision: as in tables of ``automax trace``). With ``hold: true`` a
row is written at its time, to the nanosecond, and holds until the next one; with ``linear`` numbers go from row to row
in straight lines, a sample each ms as a ramp has, while booleans and texts hold (decision). A cell without content
leaves its signal as it is, or on its line. All that is wrong is told, a text that no cell of a column may have once
(decision). Values of whole numbers are rounded to the nearest, as a ramp's are
(decision: historians store means). Cells are counts, as those of ``set``; with ``values: unit`` they are in the
engineer's unit of variables with a ``scale``, and beyond it they are clamped, as an instrument does (decision).

The file lies where the source of ``reload`` may lie, and is read as a whole before the run begins.
"""

from __future__ import annotations

from array import array
from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from automax_ros.core.numbers import nearest, stored_real
from automax_ros.core.text import count_of, did_you_mean, near_or_listed, quoted
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UserError
from automax_ros.core.values import is_number, number, value_of, value_text, wanted
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.rackfile.reading.csv_table import NO_VALUE, ONE_SIGN, TIME, TIMES, CsvFault, CsvTable, RowTimes
from automax_ros.rackfile.reading.files import stays_next_to
from automax_ros.rackfile.reading.values import ProblemList, Section, kind_of, text_value
from automax_ros.scenario.stimuli.player import Action, WavePlayer
from automax_ros.scenario.stimuli.signals import Signal, Signals
from automax_ros.scenario.stimuli.values import DriveSignal, StimuliVerb, named, signal_of
from automax_ros.scenario.stimuli.waves import Course

MOST_BYTES = 100_000_000
"""Largest table, in bytes (decision: a bound on untrusted files)."""
MOST_CELLS = 5_000_000
"""Most cells of a table that drive signals, and most rows (decision: about 80 MB of memory)."""
KEYS = ("file", "time", "columns", "hold", "values")
LINEAR = "linear"
VALUES = ("counts", "unit")
_CODE = "AMX6745"
_LONGEST = 200
_MOST_LISTED = 1000
MOST_TOLD = 20
"""Most errors of one table that are told (decision)."""


@dataclass(frozen=True)
class Places:
    """Where the files that a stimuli file names may lie: next to ``files`` or below, anywhere if ``allow_outside``."""

    files: tuple[Path, ...]
    allow_outside: bool = False

    def find(self, text: str) -> Path | None:
        """Return the path of a file, of several the first that exists; None if it lies outside."""
        inside = [file.parent / text for file in self.files if self.allow_outside or stays_next_to(text, file)]
        return next((path for path in inside if path.exists()), inside[0] if inside else None)


@dataclass(frozen=True)
class HoldRows:
    """Writes a column's values to a signal, each at its time after the entry's."""

    signal: Signal
    times_ns: Sequence[int]
    values: Sequence[Value]

    @property
    def of(self) -> str:
        """The signal's name."""
        return self.signal.label

    def do(self, stage: WavePlayer) -> None:
        """Begin with the first row."""
        stage.follow(self.signal, self.times_ns, self.values)


def table_verb(signals: Signals, places: Places) -> StimuliVerb:
    """Return the verb for the signals of a rack or of a task."""
    return StimuliVerb(partial(_read, signals, places), is_value=True)


class _Refused(UserError):
    """What is wrong with a table; the message names file, line and column."""


class _Table(CsvTable):
    names = ("columns", "time_s,tach")


class _CellFaults:
    """What is wrong with the cells of a table, in the order of lines."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[tuple[str, str], tuple[str, str | None]] = {}
        self._again: dict[tuple[str, str], list[int]] = {}

    def add(self, line: int, column: str, cell: str, message: str, hint: str | None) -> None:
        """Add a cell; of one text in one column only the first is told, the others are counted."""
        if (column, cell) in self._found:
            self._again.setdefault((column, cell), []).append(line)
        else:
            self._found[column, cell] = f"{self._path}:{line}: column {quoted(column)}: {message}", hint

    @property
    def is_full(self) -> bool:
        """Whether there are as many as are told."""
        return len(self._found) >= MOST_TOLD

    def all(self) -> list[_Refused]:
        """Return what is told."""
        told = []
        for key, (message, hint) in self._found.items():
            again = self._again.get(key, [])
            more = f"; the same in {count_of(len(again), 'more row')}, the last in line {again[-1]}" if again else ""
            told.append(_Refused(message + more, hint))
        if self.is_full:
            told.append(_Refused(f"{self._path}: no more than {MOST_TOLD} errors of a table are told"))
        return told


@dataclass(frozen=True)
class _Column:
    """A column of the table: its signal, how a cell is read, and what was read so far."""

    signal: Signal
    header: str
    in_unit: bool
    times_ns: MutableSequence[int]
    values: MutableSequence[Any]

    def value(self, cell: str) -> Value | None:
        """Return the value of a cell as the signal holds it, None if it cannot."""
        kind = self.signal.type
        if not kind.is_numeric:
            return value_of(cell if kind is DataType.STRING else cell.strip(), kind, self.signal.length)
        try:
            given = number(cell.strip())
        except ValueError:
            return None
        scale = self.signal.scale if self.in_unit else None
        if scale is not None:
            given = scale.counts_of(given)[0]
        if not self.signal.low <= given <= self.signal.high:
            return None
        if kind.is_integer:
            return nearest(given)
        held, clamped = stored_real(float(given))
        return None if clamped else held

    @property
    def takes(self) -> str:
        """What a cell must be, in words."""
        kind, low, high = self.signal.type, self.signal.low, self.signal.high
        if not kind.is_numeric:
            return wanted(kind, self.signal.length)
        whole = (low, high) == tuple(kind.range)
        return "a number" if whole and not kind.is_integer else f"a number from {value_text(low)} to {value_text(high)}"

    def action(self, *, linear: bool) -> Action:
        """Return what drives the signal."""
        kind = self.signal.type
        if linear and kind.is_numeric:
            return DriveSignal(self.signal, Course(kind, self.times_ns, self.values))
        return HoldRows(self.signal, self.times_ns, self.values)


def _column(signal: Signal, header: str, *, in_unit: bool) -> _Column:
    kind = signal.type
    values: MutableSequence[Any]
    values = array("q") if kind.is_integer else array("d") if kind is DataType.REAL else []
    return _Column(signal, header, in_unit, array("q"), values)


def _read(signals: Signals, places: Places, node: Node, what: str, findings: ProblemList) -> list[Action]:
    section = Section(node, what, KEYS, findings)
    if not section.require(("file", "columns"), what, node.span):
        return []
    before = findings.errors
    path = _path(section, what, places, findings)
    time = _text(section, "time", what, findings) if "time" in section else TIME
    linear = _is_linear(section, what, findings)
    in_unit = _is_unit(section, what, findings)
    columns = _columns(section, what, signals, in_unit, findings)
    if path is None or time is None or not columns or findings.errors > before:
        return []
    span = section.key_span("file")
    for fault in _fill(path, time, columns):
        findings.add(_CODE, fault.message, span, fault.hint)
    if findings.errors > before:
        return []
    return [column.action(linear=linear) for column in columns if column.times_ns]


def _text(section: Section, key: str, what: str, findings: ProblemList) -> str | None:
    node = section.get(key)
    return text_value(node, f"{key} of {what}", findings, limit=_LONGEST) if node is not None else None


def _path(section: Section, what: str, places: Places, findings: ProblemList) -> Path | None:
    text = _text(section, "file", what, findings)
    if text is None:
        return None
    path, node = places.find(text), section.get("file")
    if path is None and node is not None:
        of_rack = len(places.files) > 1
        folders = "folders of the stimuli file and of the rack file" if of_rack else "folder of the stimuli file"
        hint = f"put it next to the stimuli file{', or allow it with --allow-outside' if of_rack else ''}"
        findings.add(_CODE, f"{quoted(text)} lies outside the {folders}", node.span, hint)
    elif path is not None and node is not None and not path.exists():
        near = did_you_mean(path.name, (item.name for item in sorted(path.parent.glob("*.csv"))))
        findings.add(_CODE, f"the table {quoted(text)} does not exist", node.span, near)
        return None
    return path


def _is_linear(section: Section, what: str, findings: ProblemList) -> bool:
    node = section.get("hold")
    if node is None or (isinstance(node, Scalar) and node.text == LINEAR):
        return node is not None
    if not isinstance(node, Scalar) or not node.plain or value_of(node.text, DataType.BOOLEAN) is not True:
        message = f"hold of {what} cannot be {kind_of(node)}: it takes true or {LINEAR}"
        findings.add("AMX6736", message, node.span)
    return False


def _is_unit(section: Section, what: str, findings: ProblemList) -> bool:
    node = section.get("values")
    if node is None:
        return False
    if not isinstance(node, Scalar) or node.text not in VALUES:
        message = f"values of {what} cannot be {kind_of(node)}: it takes {' or '.join(VALUES)}"
        findings.add("AMX6736", message, node.span)
        return False
    return node.text == "unit"


def _columns(section: Section, what: str, signals: Signals, in_unit: bool, findings: ProblemList) -> list[_Column]:
    found: list[_Column] = []
    node = section.get("columns")
    if node is None:
        return found
    for key, item in named(node, f"columns of {what}", findings):
        signal = signal_of(key, signals, findings)
        header = text_value(item, f"column of {quoted(key.text)} in {what}", findings, limit=_LONGEST)
        if signal is None or header is None:
            continue
        if in_unit and signal.type.is_integer and signal.scale is None and not signal.unit:
            message = f"values: unit, and {signal.label} has neither a scale nor a unit: its counts mean nothing"
            hint = "give it a scale in the rack file; or a table of its own, whose values are counts"
            findings.add(_CODE, message, key.span, hint)
        else:
            found.append(_column(signal, header.strip(), in_unit=in_unit))
    return found


def _fill(path: Path, time: str, columns: Sequence[_Column]) -> list[_Refused]:
    """Read a table into its columns; return what is wrong: it cannot be read, lacks a column, has too much, cells."""
    faults = _CellFaults(path)
    try:
        with _Table(path, regular=True) as table:
            if table.size > MOST_BYTES:
                raise _Refused(f"the table {path} has more than {MOST_BYTES} bytes", "cut it into several entries")
            headers = [time, *(column.header for column in columns)]
            lacks = [fault for name in dict.fromkeys(headers) if (fault := _why_not(table, name)) is not None]
            if lacks:
                return lacks
            _fill_rows(table, time, columns, faults)
    except CsvFault as fault:
        return [*faults.all(), _Refused(f"{fault.place}: {fault.message}", fault.hint)]
    except UserError as error:
        return [*faults.all(), _Refused(error.message, error.hint)]
    return faults.all()


def _fill_rows(table: CsvTable, time: str, columns: Sequence[_Column], faults: _CellFaults) -> None:
    headers = [cell.strip() for cell in table.header]
    when, placed = headers.index(time), [(column, headers.index(column.header)) for column in columns]
    times, cells, rows, time_ns = RowTimes(time), 0, 0, 0
    for line, row in table.numbered_rows():
        rows += 1
        try:
            time_ns = times.since_first(row[when])
        except ValueError as error:
            faults.add(line, time, row[when], str(error), None if is_number(row[when].replace(",", ".")) else TIMES)
        for column, place in placed:
            cell = row[place]
            if not cell or (column.signal.type is not DataType.STRING and not cell.strip()):
                continue
            try:
                text = table.decimal(cell, line) if column.signal.type.is_numeric else cell
            except ValueError as error:
                faults.add(line, column.header, cell, f"{quoted(cell)} cannot be used: {error}", ONE_SIGN)
                continue
            value = column.value(text)
            if value is None:
                message = f"{quoted(cell)} cannot be used: {column.signal.label} takes {column.takes}"
                is_word = column.signal.type.is_numeric and not is_number(text)
                faults.add(line, column.header, cell, message, NO_VALUE if is_word else None)
                continue
            column.times_ns.append(time_ns)
            column.values.append(value)
            cells += 1
        if faults.is_full:
            return
        if max(cells, rows) > MOST_CELLS:
            raise _Refused(
                f"{table.path}:{line}: the table has more than {MOST_CELLS} cells", "take fewer columns, or fewer rows"
            )
    if not rows:
        raise _Refused(f"the table {table.path} has no rows")


def _why_not(table: CsvTable, name: str) -> _Refused | None:
    """Return why a column cannot be used, None if it can."""
    headers = [cell.strip() for cell in table.header]
    if headers.count(name) == 1:
        return None
    if name in headers:
        return _Refused(f"{table.path}:1: two columns are called {quoted(name)}", "give each a name of its own")
    known = [quoted(header, marks="") for header in headers[:_MOST_LISTED]]
    return _Refused(f"{table.path}:1: the table has no column {quoted(name)}", near_or_listed(name, known))
