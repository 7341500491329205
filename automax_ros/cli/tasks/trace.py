"""Run a task (.BLK) without a rack, one scan per row of a CSV table, and print its variables after each scan.

The header of IN.csv names variables with their type character: REF%, RUN@, GAIN, TABLE%(3). A cell sets its variable
before the scan latches; an empty cell leaves it as it is. Commons, locals and tunables can be set. What stands before
SCAN_LOOP runs once before the first row. The task's own COMMON statements define the common memory, all 0 at first.
Cells are separated by commas or by semicolons. A table of `automax export` can be read: its column time_s is passed
over, for each row is a scan; so export --every the task's scan time.

With --stimuli a YAML file sets variables by time (set, ramp, sine, square), the first scan being at 0; without a table
the task then scans for --duration seconds, or until the last entry has happened.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from decimal import Decimal
from itertools import count
from pathlib import Path
from typing import TextIO

from automax_ros.cli.options.stimuli import StimuliRefused, entries_of
from automax_ros.cli.options.task import add_target_arguments, check_task_file, require_clock, target_of
from automax_ros.cli.options.values import add_watch_argument, naming, seconds_above_0, watch_list
from automax_ros.cli.options.work import add_native_arguments, native_forms, print_native
from automax_ros.cli.output.csv_input import CsvTable
from automax_ros.cli.output.files import opened_for_writing, require_different_files
from automax_ros.cli.output.screen import ProgressBar, print_diagnostics
from automax_ros.core.names import NameFault, UnknownName
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.text import count_of, printable, quoted
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import is_number, value_of, value_text, wanted
from automax_ros.language.program import Symbol, lines_that_write
from automax_ros.language.tree.tree import Scope
from automax_ros.runtime.scan.error_log import LogEntry
from automax_ros.runtime.tasks.standalone_task import LoneVariable, StandaloneTask
from automax_ros.runtime.tasks.task import ScanRecord, Status
from automax_ros.runtime.time.scheduler import Scheduler
from automax_ros.scenario.stimuli.player import StimuliPlayer, Stimulus
from automax_ros.scenario.stimuli.reader import read_for_task
from automax_ros.scenario.stimuli.values import goes_on_for_ever

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
            message = f"{variable.label} = {quoted(text, marks='')}, it must be {_accepted_values(symbol, tuned=tuned)}"
            raise self.fault("AMX6916" if tuned else "AMX6915", message, line=line) from None


def _accepted_values(symbol: Symbol, *, tuned: bool) -> str:
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


_USAGE = "usage: automax trace FILE --input IN.csv, or: automax trace FILE --stimuli FILE"
_NAMED = 20
_CHARACTERS_A_ROW = 8
"""Characters of a table per expected scan, where the number of rows is unknown (decision)."""
_ROWS_A_LOOK = 256
"""Rows between two updates of the progress bar."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax trace``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a task (.BLK)")
    parser.add_argument("--input", type=Path, metavar="IN.csv", help="what to set before each scan")
    parser.add_argument("--stimuli", type=Path, metavar="FILE", help="what to set by time (docs/stimuli.md)")
    parser.add_argument(
        "--duration", type=seconds_above_0, metavar="S", help="seconds of task time after which the trace ends"
    )
    parser.add_argument("--output", type=Path, metavar="OUT.csv", help="where to write (default: standard output)")
    parser.add_argument(
        "--errors", type=Path, metavar="ERR.csv", help="where to write the run-time errors of each scan"
    )
    add_target_arguments(parser)
    add_watch_argument(parser, "every simple variable")
    add_native_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Trace the task; 1 if it has errors, stops or faults, 2 if the table or an option is wrong."""
    if arguments.input is None and arguments.stimuli is None:
        raise UsageError("nothing is given for the task to work on", _USAGE)
    target = target_of(arguments)
    source, result = check_task_file(arguments.file, target)
    if result.program is not None and result.program.is_basic:
        hint = "run it in a rack: automax run CONFIG --simulated --duration 10"
        raise UsageError(f"{arguments.file} is a BASIC task: it waits where it wants and has no scans to trace", hint)
    if result.program is None:
        print_diagnostics(result.diagnostics, source, sys.stderr)
        return 1
    require_clock(arguments.file, result.program)
    lone = StandaloneTask(result.program, native_forms(arguments, _expected_ns(arguments, result.program.period_ns)))
    if arguments.verbose:
        print_native([lone.native])
    watched = _find_watched(lone, watch_list(arguments.watch))
    read = {"FILE": arguments.file, "--input": arguments.input, "--stimuli": arguments.stimuli}
    require_different_files(
        {key: path for key, path in read.items() if path is not None},
        {"--output": arguments.output, "--errors": arguments.errors},
    )
    try:
        stimuli = entries_of(read_for_task(arguments.stimuli, lone)) if arguments.stimuli is not None else ()
    except StimuliRefused:
        return 1
    if arguments.input is None and arguments.duration is None and goes_on_for_ever(stimuli):
        raise UsageError("the stimuli have no end: a sine or a square lacks `for`", "give --duration S")
    with ExitStack() as files:
        table = files.enter_context(InputTable(arguments.input, lone)) if arguments.input is not None else None
        if table is not None and not stimuli and (unset := table.unset(lone)):
            names = f"{', '.join(unset[:_NAMED])}{' ...' if len(unset) > _NAMED else ''}"
            rest = "it stays 0" if len(unset) == 1 else "they stay 0"
            print(f"{lone.task.name}: {arguments.input} does not set {names}: {rest}", file=sys.stderr)
        scans = StimulatedScans(lone, stimuli, table, arguments.duration)
        output = files.enter_context(opened_for_writing(arguments.output))
        errors = files.enter_context(opened_for_writing(arguments.errors)) if arguments.errors else None
        bar = files.enter_context(ProgressBar("trace", scans.size, wanted=arguments.output is not None))
        _Trace(lone, watched, output, errors).run(scans, bar)
    return _conclusion(lone, all_told=errors is not None)


def _expected_ns(arguments: argparse.Namespace, period_ns: int) -> int:
    """Return about how long the task will scan, ns: the duration, or an estimate from the size of the table."""
    if arguments.duration is not None:
        duration: int = arguments.duration
        return duration
    table: Path | None = arguments.input
    if table is None or not table.is_file():
        return 0
    return table.stat().st_size // _CHARACTERS_A_ROW * period_ns


class _Trace:
    def __init__(
        self, lone: StandaloneTask, watched: Sequence[LoneVariable], output: TextIO, errors: TextIO | None
    ) -> None:
        self._lone = lone
        self._cells: list[tuple[Callable[[], Value], Callable[..., str]]] = [
            (item.read, printable if item.symbol.type is DataType.STRING else value_text) for item in watched
        ]
        self._output = csv.writer(output, lineterminator="\n")
        self._output.writerow(["scan", "time_s", *(item.label for item in watched)])
        self._errors = csv.writer(errors, lineterminator="\n") if errors is not None else None
        if self._errors is not None:
            self._errors.writerow(["scan", "line", "code", "message"])
            lone.task.record_scans()

    def run(self, scans: StimulatedScans, bar: ProgressBar) -> None:
        """Scan until the table, the duration or the task ends."""
        task, period = self._lone.task, self._lone.task.period_ns
        scans.begin()
        self._write_errors(task.run())
        self._show_printed()
        if not self._runs():
            return
        for number in scans.rows():
            time_ns = number * period
            self._write_errors(task.scan(time_ns))
            self._show_printed()
            cells = [text_of(read()) for read, text_of in self._cells]
            self._output.writerow([str(number + 1), seconds_text(time_ns), *cells])
            if not self._runs():
                return
            if number % _ROWS_A_LOOK == 0:
                bar.show(scans.position)

    def _runs(self) -> bool:
        return self._lone.task.status is Status.RUNNING

    def _show_printed(self) -> None:
        task = self._lone.task
        while task.printed:
            print(f"{task.name}: {printable(task.printed.popleft())}", file=sys.stderr)

    def _write_errors(self, record: ScanRecord | None) -> None:
        if self._errors is None or record is None:
            return
        for line, code in record.errors:
            entry = LogEntry(line, code, record.scan)
            self._errors.writerow([str(entry.scan), str(entry.line), entry.problem, PROBLEMS[entry.problem].title])


def _find_watched(lone: StandaloneTask, names: list[str] | None) -> list[LoneVariable]:
    if names is None:
        return lone.simple_variables()
    with naming("--watch"):
        found = [lone.variable(name) for name in names]
    return list({item.label: item for item in found}.values())


def _conclusion(lone: StandaloneTask, *, all_told: bool) -> int:
    task, log = lone.task, lone.task.errors
    if log.first is not None and not all_told:
        first = f"the first: {log.first.describe()}" if log.count > 1 else log.first.describe()
        print(f"{task.name}: {count_of(log.count, 'run-time error')}; {first}", file=sys.stderr)
    place = f"in scan {task.scan_number}" if task.scan_number else "before the first scan"
    if task.status is Status.ENDED:
        print(f"{task.name}: ended by STOP {place}", file=sys.stderr)
    elif task.status is Status.FAULTED and log.last is not None:
        print(f"{task.name}: faulted {place}: {log.last.describe()}", file=sys.stderr)
    return 0 if task.status is Status.RUNNING else 1
