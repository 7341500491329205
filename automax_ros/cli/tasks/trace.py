"""Run a task (.BLK) without a rack, one scan per row of a CSV table, and print its variables after each scan.

The header of IN.csv names variables with their type character: REF%, RUN@, GAIN, TABLE%(3). A cell sets its variable
before the scan latches; an empty cell leaves it as it is. Commons, locals and tunables can be set. What stands before
SCAN_LOOP runs once before the first row. The task's own COMMON statements define the common memory, all 0 at first.
Cells are separated by commas or by semicolons.

A table with a column time_s, as `automax export` and historians write one, has its rows by time instead: a row is set
before the first scan at or after its time, counted from the first row's, and holds until the next one's. A table with a
column scan, as trace writes it, is one scan per row again. Inputs of the task that the table lacks are named. In a
table by time whole numbers are rounded to the nearest, as by the verb `table` of stimuli, and columns that the task
does not have are named and passed over; in one by scans both are errors.

With --stimuli a YAML file sets variables by time (set, ramp, sine, square, table), the first scan being at 0; without a
table the task then scans for --duration seconds, or until the last entry has happened.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import TextIO

from automax_ros.cli.options.stimuli import StimuliRefused, entries_of
from automax_ros.cli.options.task import add_target_arguments, check_task_file, require_clock, target_of
from automax_ros.cli.options.values import add_watch_argument, naming, seconds_above_0, watch_list
from automax_ros.cli.options.work import add_native_arguments, native_forms, print_native
from automax_ros.cli.output.files import opened_for_writing, require_different_files
from automax_ros.cli.output.screen import ProgressBar, print_diagnostics
from automax_ros.cli.tasks.input_table import InputTable
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.text import count_of, printable
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import value_text
from automax_ros.rackfile.reading.csv_table import CsvFault
from automax_ros.runtime.scan.error_log import LogEntry
from automax_ros.runtime.tasks.standalone_task import LoneVariable, StandaloneTask
from automax_ros.runtime.tasks.task import ScanRecord, Status
from automax_ros.runtime.time.scheduler import Scheduler
from automax_ros.scenario.stimuli.player import StimuliPlayer, Stimulus
from automax_ros.scenario.stimuli.reader import read_for_task
from automax_ros.scenario.stimuli.values import goes_on_for_ever


class StimulatedScans:
    """Scans of a task without a rack, from time 0 on: one for each row of a table, or as many as a duration has.

    Without both the last scan is the first one at or after the end of the last entry (decision).
    Entries of a scan's instant happen before its row is set, so a cell overrides them (decision).
    """

    done: int
    """Number of scans that are over."""

    def __init__(
        self, lone: StandaloneTask, stimuli: Sequence[Stimulus], table: InputTable | None, duration_ns: int | None
    ) -> None:
        """Create the scans of a table, a duration, or the shorter of both; without both the entries must end."""
        self._period_ns = lone.task.period_ns
        self._scheduler = Scheduler()
        self._stimulation = StimuliPlayer(stimuli, self._scheduler)
        self._table = table
        self._most = None if duration_ns is None else -(-duration_ns // self._period_ns)
        self.done = 0

    @property
    def size(self) -> int:
        """The total amount, in units of ``position``; 0 where it is unknown."""
        return self._table.size if self._table is not None else self._most or 0

    @property
    def position(self) -> int:
        """The amount that is done: bytes of the table, or scans."""
        return self._table.position if self._table is not None else self.done

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
            self.done += 1

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
        if table is not None and (unset := table.unset(lone, stimuli)):
            rest = "it stays 0" if len(unset) == 1 else "they stay 0"
            print(f"{lone.task.name}: {arguments.input} does not set {_listed(unset)}: {rest}", file=sys.stderr)
        if table is not None and table.passed_over:
            names = _listed([printable(name) for name in table.passed_over])
            print(
                f"{lone.task.name}: it has no variable for these columns of {arguments.input}: {names}", file=sys.stderr
            )
        scans = StimulatedScans(lone, stimuli, table, arguments.duration)
        output = files.enter_context(opened_for_writing(arguments.output))
        errors = files.enter_context(opened_for_writing(arguments.errors)) if arguments.errors else None
        bar = files.enter_context(ProgressBar("trace", scans.size, wanted=arguments.output is not None))
        try:
            _Trace(lone, watched, output, errors).run(scans, bar)
        except CsvFault:
            cut = " and ".join(str(path) for path in (arguments.output, arguments.errors) if path is not None)
            if cut:
                print(
                    f"{cut}: cut short after {count_of(scans.done, 'scan')} by the error that follows", file=sys.stderr
                )
            raise
    return _conclusion(lone, all_told=errors is not None)


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:_NAMED])}{' ...' if len(names) > _NAMED else ''}"


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
