"""The inputs of ``automax trace`` before each scan: stimuli up to that time, then the cells of a row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from itertools import count
from pathlib import Path

from automax_ros.cli.output.csv_input import CsvTable
from automax_ros.core.names import NameFault, UnknownName
from automax_ros.core.text import quoted
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.core.values import is_number, value_of, value_text, wanted
from automax_ros.language.program import Symbol, lines_that_write
from automax_ros.language.tree.tree import Scope
from automax_ros.runtime.tasks.standalone_task import LoneVariable, StandaloneTask
from automax_ros.runtime.time.scheduler import Scheduler
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.wave_player import Stimulus

_SCAN, _TIME = "scan", "time_s"
_NOT_SET = (_SCAN, _TIME, "duration_ns", "skipped", "errors", "error_line", "error_code")
"""Columns of ``trace`` and ``export`` tables that set no variable."""
_SET, _NOT_SET_HERE = "in.", ("out.", "local.")
"""Prefixes of the columns of ``export --scans``: inputs of a scan are set, its results are not."""
_LATEST_S = 10**10
"""Greatest ``time_s``; times of day are below it, s."""
_LONGEST_NS = 10**6 * NS_PER_S
"""A table lasts at most 11 days (decision): a longer one probably has ms instead of s."""


class InputTable(CsvTable):
    """An open table. ``columns`` are the variables that the header names, in its order, None for an ignored column."""

    def __init__(self, path: Path, task: StandaloneTask) -> None:
        """Open a table and read its header.

        Raises:
            UsageError: the file cannot be read.
            CsvFault: the header is wrong.
        """
        super().__init__(path)
        self._period_ns = task.task.period_ns
        try:
            self.columns = self._columns(task)
            names = [name.strip() for name in self.header]
            self._time = names.index(_TIME) if _TIME in names and _SCAN not in names else None
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
        scans, first_ns, before_ns, last = 0, 0, -1, 0
        for line, cells in self.numbered_rows():
            if self._time is not None:
                time_ns = self._time_of(cells[self._time], line)
                if last and time_ns < before_ns:
                    raise self.fault("AMX6803", f"{cells[self._time]} s is earlier than the row before", line=line)
                first_ns, before_ns = first_ns if last else time_ns, time_ns
                if time_ns - first_ns > _LONGEST_NS:
                    raise self.fault("AMX6803", f"{cells[self._time]} s is days after the first row", line=line)
                for _ in range(-(-(time_ns - first_ns) // self._period_ns) - scans):
                    yield last
                    scans += 1
            for variable, cell in zip(self.columns, cells, strict=True):
                if cell and variable is not None:
                    self._set(variable, self._decimal(cell, variable), line)
            last = line
            if self._time is None:
                yield line
        if last and self._time is not None:
            yield last

    def unset(self, task: StandaloneTask) -> list[str]:
        """Return the commons of the task that it does not write itself and that have no column."""
        given = {variable.symbol.name for variable in self.columns if variable is not None}
        written = lines_that_write(task.program)
        commons = (item.name for item in task.program.symbols.values() if item.scope is Scope.COMMON)
        return [name for name in commons if name not in given and name not in written]

    def _time_of(self, cell: str, line: int) -> int:
        text = cell.strip().replace(",", ".")
        if is_number(text) and 0 <= (seconds := Decimal(text)) <= _LATEST_S:
            return int(seconds * NS_PER_S)
        raise self.fault("AMX6803", f"time_s = {quoted(cell, marks='')}, it must be a time in s, 0 or more", line=line)

    def _decimal(self, cell: str, variable: LoneVariable) -> str:
        """Return a cell with a decimal point in place of the comma of a table with semicolons."""
        return cell.replace(",", ".") if self.separator == ";" and variable.symbol.type is DataType.REAL else cell

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
                if name.strip() in _NOT_SET and name not in columns:
                    columns[name] = None
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
        value = value_of(text, symbol.type, symbol.length)
        try:
            if value is None:
                raise ValueError
            variable.write(value)
        except ValueError:
            tuned = symbol.tuning is not None and is_number(text)
            message = f"{variable.label} = {quoted(text, marks='')}, it must be {_wanted(symbol, tuned=tuned)}"
            raise self.fault("AMX6916" if tuned else "AMX6915", message, line=line) from None


def _wanted(symbol: Symbol, *, tuned: bool) -> str:
    """Return in words which values a variable accepts: within its tuning limits if ``tuned``, else of its type."""
    if tuned and symbol.tuning is not None:
        return f"inside its tuning limits, {value_text(symbol.tuning.low)} to {value_text(symbol.tuning.high)}"
    return wanted(symbol.type, symbol.length)


def _header_hint(name: str) -> str | None:
    if "(" in name and ")" not in name:
        return 'a name with several subscripts needs quotes in a CSV table: "TABLE%(1,2)"'
    return "columns are separated by commas or semicolons" if "\t" in name else None


class StimulatedScans:
    """Scans of a task without a rack, from time 0 on: one for each row of a table, or as many as a duration has.

    Without both the last scan is the first one at or after the end of the last entry (decision).
    Entries of a scan's instant happen before its row is set, so a cell overrides them (decision).
    """

    def __init__(
        self, lone: StandaloneTask, stimuli: Sequence[Stimulus], table: InputTable | None, duration_ns: int | None
    ) -> None:
        """Create the scans of a table, a duration, or the shorter of both; without both the entries must end."""
        self._period_ns = lone.task.period_ns
        self._scheduler = Scheduler()
        self._stimulation = StimuliPlayer(stimuli, self._scheduler)
        self._table = table
        self._most = None if duration_ns is None else -(-duration_ns // self._period_ns)
        self._done = 0

    @property
    def size(self) -> int:
        """The total amount, in units of ``position``; 0 where it is unknown."""
        return self._table.size if self._table is not None else self._most or 0

    @property
    def position(self) -> int:
        """The amount that is done: bytes of the table, or scans."""
        return self._table.position if self._table is not None else self._done

    def begin(self) -> None:
        """Play the entries of time 0, before the statements before SCAN_LOOP are executed."""
        self._stimulation.begin()

    def rows(self) -> Iterator[int]:
        """Yield the scan's number, from 0, before each scan, after its inputs are set."""
        rows = iter(self._table.rows() if self._table is not None else count())
        for number in self._numbers():
            self._scheduler.run_until(number * self._period_ns + 1)
            if next(rows, None) is None:
                return
            yield number
            self._done = number

    def _numbers(self) -> Iterable[int]:
        if self._most is not None:
            return range(self._most)
        return count() if self._table is not None else self._until_over()

    def _until_over(self) -> Iterator[int]:
        for number in count():
            yield number
            if self._stimulation.is_over:
                return
