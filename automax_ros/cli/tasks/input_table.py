"""The table of `automax trace --input`: its rows set the variables of a task, by scans or by time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from automax_ros.core.names import NameFault, UnknownName
from automax_ros.core.numbers import nearest
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import is_number, number, value_of, value_text, wanted
from automax_ros.language.program import Symbol, lines_that_write
from automax_ros.language.tree.tree import Scope
from automax_ros.rackfile.reading.csv_table import NO_VALUE, ONE_SIGN, TIME, TIMES, CsvTable, RowTimes
from automax_ros.runtime.tasks.standalone_task import LoneVariable, StandaloneTask
from automax_ros.scenario.stimuli.player import Stimulus

_SCAN = "scan"
_NOT_SET = (_SCAN, TIME, "duration_ns", "skipped", "errors", "error_line", "error_code")
"""Columns of ``trace`` and ``export`` tables that set no variable."""
_SET, _NOT_SET_HERE = "in.", ("out.", "local.")
"""Prefixes of the columns of ``export --scans``: inputs of a scan are set, its results are not."""


class InputTable(CsvTable):
    """An open table. ``columns`` are the variables that the header names, in its order, None for an ignored column.

    Ignored are the columns with a scan's number and time, and, in a table whose rows go by time, what the task does not
    have (decision: a historian stores more than one task needs): these are ``passed_over``.
    """

    def __init__(self, path: Path, task: StandaloneTask) -> None:
        """Open a table and read its header.

        Raises:
            UsageError: the file cannot be read.
            CsvFault: the header is wrong.
        """
        super().__init__(path)
        self._period_ns = task.task.period_ns
        self.passed_over: list[str] = []
        try:
            names = [name.strip() for name in self.header]
            self._time = names.index(TIME) if TIME in names and _SCAN not in names else None
            self.columns = self._columns(task)
        except BaseException:
            self.close()
            raise

    def rows(self) -> Iterator[int]:
        """Set the variables to the cells of each row, and yield the row's line number before each scan.

        An empty cell leaves its variable unchanged. In a table with times but no scan numbers, a row is applied before
        the first scan at or after its time, counted from that of the first row, and holds until the next row.

        Raises:
            UsageError: the file can no longer be read.
            CsvFault: a row is wrong.
        """
        scans, last, times = 0, 0, RowTimes()
        for line, cells in self.numbered_rows():
            if self._time is not None:
                for _ in range(-(-self._since_first(times, cells[self._time], line) // self._period_ns) - scans):
                    yield last
                    scans += 1
            for variable, cell in zip(self.columns, cells, strict=True):
                if cell and variable is not None:
                    self._set(variable, cell, line)
            last = line
            if self._time is None:
                yield line
        if last and self._time is not None:
            yield last

    def unset(self, task: StandaloneTask, stimuli: Iterable[Stimulus] = ()) -> list[str]:
        """Return the commons of the task that it does not write itself, nor the stimuli, and that have no column."""
        given = {variable.symbol.name for variable in self.columns if variable is not None}
        given |= {action.of.partition("(")[0] for entry in stimuli for action in entry.actions}
        written = lines_that_write(task.program)
        commons = (item.name for item in task.program.symbols.values() if item.scope is Scope.COMMON)
        return [name for name in commons if name not in given and name not in written]

    def _since_first(self, times: RowTimes, cell: str, line: int) -> int:
        try:
            return times.since_first(cell)
        except ValueError as error:
            hint = None if is_number(cell.replace(",", ".")) else TIMES
            raise self.fault("AMX6803", str(error), hint, line=line) from error

    def _value(self, text: str, symbol: Symbol, line: int) -> Value | None:
        """Return the value of a cell, None if the variable cannot have it; by time, that of a whole number is nearest.

        Raises:
            ValueError: the decimal sign is another than before.
        """
        kind = symbol.type
        if kind is DataType.REAL or (kind.is_integer and self._time is not None):
            text = self.decimal(text, line)
        if kind.is_integer and self._time is not None and is_number(text):
            low, high = kind.range
            given = number(text)
            return nearest(given) if low <= given <= high else None
        return value_of(text, kind, symbol.length)

    def _columns(self, task: StandaloneTask) -> list[LoneVariable | None]:
        columns: dict[str, LoneVariable | None] = {}
        for name in self.header:
            plain = name.strip()
            if plain.startswith(_NOT_SET_HERE):
                columns[name] = None
                continue
            try:
                variable = task.variable(plain.removeprefix(_SET))
            except NameFault as fault:
                is_foreign = self._time is not None and isinstance(fault, UnknownName) and plain != TIME
                if (plain in _NOT_SET and name not in columns) or is_foreign:
                    if plain not in _NOT_SET:
                        self.passed_over.append(plain)
                    columns[f"{len(columns)} {name}" if is_foreign else name] = None
                    continue
                code = "AMX6911" if isinstance(fault, UnknownName) else "AMX6913"
                out = "take the column out where the task has no such variable"
                hint = f"{fault.hint}; {out}" if fault.hint else out
                raise self.fault(code, fault.message, _header_hint(name) or hint) from fault
            if variable.label in columns:
                raise self.fault("AMX6912", f"there are two columns for {variable.label}")
            columns[variable.label] = variable
        return list(columns.values())

    def _set(self, variable: LoneVariable, cell: str, line: int) -> None:
        symbol = variable.symbol
        text = cell if symbol.type is DataType.STRING else cell.strip()
        if not text:
            return
        given = f"{variable.label} = {quoted(text, marks='')}"
        try:
            value = self._value(text, symbol, line)
        except ValueError as error:
            raise self.fault("AMX6915", f"{given}: {error}", ONE_SIGN, line) from error
        try:
            if value is None:
                raise ValueError
            variable.write(value)
        except ValueError:
            is_one = is_number(text)
            tuned = symbol.tuning is not None and is_one
            takes = _accepted_values(symbol, tuned=tuned)
            takes = takes.replace("a whole number", "a number") if self._time is not None else takes
            hint = NO_VALUE if symbol.type.is_numeric and not is_one else None
            raise self.fault("AMX6916" if tuned else "AMX6915", f"{given}, it must be {takes}", hint, line) from None


def _accepted_values(symbol: Symbol, *, tuned: bool) -> str:
    """Return in words which values a variable accepts: within its tuning limits if ``tuned``, else of its type."""
    if tuned and symbol.tuning is not None:
        return f"inside its tuning limits, {value_text(symbol.tuning.low)} to {value_text(symbol.tuning.high)}"
    return wanted(symbol.type, symbol.length)


def _header_hint(name: str) -> str | None:
    if "(" in name and ")" not in name:
        return 'a name with several subscripts needs quotes in a CSV table: "TABLE%(1,2)"'
    return "columns are separated by commas or semicolons" if "\t" in name else None
