"""Run PULSE_MULT and the Logix PMUL that takes its place over the same feedback, and print where they differ.

FEEDBACK.csv has a header and then one row per scan, such as the output of `automax trace` or a logger's table. A cell
is an INTEGER; an empty one repeats the row before, at first 0 (resets: FALSE). --word-size and --multiplier are those
of the CALL PULSE_MULT; left out they are its defaults, 0 (absolute mode) and a gain of exactly 1. Exit code: 0 no
difference, 1 differences, 2 wrong usage or unreadable file.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from automax_ros.cli.options.values import naming
from automax_ros.cli.output.files import opened_for_writing, require_different_files
from automax_ros.cli.output.screen import ProgressBar
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.text import count_of, did_you_mean, printable, quoted, table
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import value_of, wanted, whole_number
from automax_ros.logix.pmul import GAIN_ONE
from automax_ros.logix.pulse_comparison import DEFAULT_MULTIPLIER, Pair, PulseComparison, PulseParameters
from automax_ros.rackfile.reading.csv_table import CsvFault, CsvTable

_ROWS_A_LOOK = 256
"""Rows between two updates of the progress bar."""
_MOST_NAMES = 12
"""Most column names in one message."""
_MOST_GUESSES = 1000
"""Most column names that are searched for a similar one (decision: a header may have half a million)."""
_HEADER = (
    "scan", "feedback", "reset", "pulse_mult", "pmul", "difference",
    "pulse_mult_total", "pmul_total", "total_difference",
)  # fmt: skip


@dataclass(frozen=True)
class Report:
    """A finished comparison, with the names of its file and columns."""

    input: str
    column: str
    reset: str | None
    parameters: PulseParameters
    comparison: PulseComparison

    @property
    def rows(self) -> list[tuple[str, Pair]]:
        """The differences and the totals at the end, each with its title."""
        result = self.comparison
        rows = [
            ("first output that differs", result.first_output),
            ("greatest difference in one scan", result.greatest_output),
            ("first total that differs", result.first_total),
            ("greatest difference of the total", result.greatest_total),
            ("total at the end", result.total),
        ]
        return [(words, pair) for words, pair in rows if pair is not None]


def report_text(report: Report) -> str:
    """Return the report as lines of text."""
    result = report.comparison
    scans = f"{count_of(result.scans, 'scan')} of {printable(report.column)} compared"
    verdict = f"{count_of(result.differing, 'output')} differ{'s' if result.differing == 1 else ''}"
    lines = [
        f"PULSE_MULT  {_block_text(report)}",
        f"PMUL        {_tag_text(report)}",
        f"ratio       {_ratio_text(report.parameters)}",
        "",
        f"{scans}: {verdict if result.differing else 'no output differs'}",
        "",
        *_table(report.rows),
    ]
    return "\n".join(lines) + "\n"


def json_text(report: Report) -> str:
    """Return the report as one JSON object; differences that do not exist are null."""
    parameters, result = report.parameters, report.comparison
    tag = parameters.pmul()
    record = {
        "input": report.input,
        "column": report.column,
        "reset": report.reset,
        "pulse_mult": {
            "WORD_SIZE": parameters.word_size,
            "MULTIPLIER": parameters.numerator,
            "INITIAL_VALUE": parameters.initial_value,
        },
        "pmul": {
            "Mode": tag.Mode,
            "WordSize": tag.WordSize,
            "Multiplier": tag.Multiplier,
            "InitialValue": tag.InitialValue,
        },
        "error_per_million": parameters.error_per_million,
        "scans": result.scans,
        "differing": result.differing,
        "first_output_difference": _record(result.first_output),
        "greatest_output_difference": _record(result.greatest_output),
        "first_total_difference": _record(result.first_total),
        "greatest_total_difference": _record(result.greatest_total),
        "total": _record(result.total),
    }
    return json.dumps(record, indent=2) + "\n"


def _record(pair: Pair | None) -> dict[str, int] | None:
    if pair is None:
        return None
    return {"scan": pair.scan, "pulse_mult": pair.pulse_mult, "pmul": pair.pmul, "difference": pair.difference}


def _block_text(report: Report) -> str:
    parameters = report.parameters
    gain = "MULTIPLIER left out" if parameters.multiplier is None else f"MULTIPLIER={parameters.multiplier}"
    initial = f", INITIAL_VALUE={parameters.initial_value}" if report.reset is not None else ""
    return f"WORD_SIZE={parameters.word_size}, {gain}{initial}"


def _tag_text(report: Report) -> str:
    tag = report.parameters.pmul()
    size = f"Mode=1, WordSize={tag.WordSize}" if tag.Mode else "Mode=0"
    initial = f", InitialValue={tag.InitialValue}" if report.reset is not None else ""
    return f"{size}, Multiplier={tag.Multiplier}{initial}"


def _ratio_text(parameters: PulseParameters) -> str:
    old, new = f"{parameters.numerator}/{DEFAULT_MULTIPLIER}", f"{parameters.pmul_multiplier}/{GAIN_ONE}"
    error = parameters.error_per_million
    if error == 0.0:
        return f"{old} = {new} exactly"
    return f"{old} becomes {new}: PMUL gives {error:+.3f} counts in a million counts of feedback"


def _table(rows: list[tuple[str, Pair]]) -> list[str]:
    cells = [("", "scan", "PULSE_MULT", "PMUL", "difference")]
    cells += [
        (
            words,
            str(pair.scan),
            str(pair.pulse_mult),
            str(pair.pmul),
            f"{pair.difference:+d}" if pair.difference else "0",
        )
        for words, pair in rows
    ]
    return table(cells, right=range(1, 5))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax compare pulse``."""
    parser.add_argument(
        "--input", type=Path, required=True, metavar="FEEDBACK.csv", help="the feedback, one row per scan"
    )
    parser.add_argument("--column", metavar="NAME", help="its column (not needed where there is only one)")
    parser.add_argument("--reset", metavar="NAME", help="a column of 0 and 1 for RESET and Initialize")
    parser.add_argument("--word-size", default="0", metavar="N", help="WORD_SIZE, 0 or 2 to 16 (default: 0)")
    parser.add_argument("--multiplier", metavar="N", help="MULTIPLIER, gain x 32768 (default: a gain of exactly 1)")
    parser.add_argument("--initial-value", metavar="N", help="INITIAL_VALUE, for the end of a reset (default: 0)")
    parser.add_argument("--output", type=Path, metavar="OUT.csv", help="write both outputs and totals of every scan")
    parser.add_argument("--json", action="store_true", help="print one object for programs to read")


def run(arguments: argparse.Namespace) -> int:
    """Compare; 0 without a difference, 1 with one, 2 where the table is wrong."""
    parameters = _parameters(arguments)
    require_different_files({"--input": arguments.input}, {"--output": arguments.output})
    comparison = PulseComparison(parameters)
    with ExitStack() as files:
        table = files.enter_context(CsvTable(arguments.input))
        columns = _columns(table, arguments)
        output = files.enter_context(opened_for_writing(arguments.output)) if arguments.output else None
        bar = files.enter_context(ProgressBar("compare", table.size))
        _compare(comparison, table, columns, output, bar)
    if not comparison.scans:
        raise UsageError(f"{arguments.input} has no rows, there is nothing to compare")
    report = Report(str(arguments.input), columns.feedback, columns.reset, parameters, comparison)
    sys.stdout.write(json_text(report) if arguments.json else report_text(report))
    return 1 if comparison.differing else 0


@dataclass(frozen=True)
class _Columns:
    feedback: str
    feedback_at: int
    reset: str | None
    reset_at: int | None


def _parameters(arguments: argparse.Namespace) -> PulseParameters:
    if arguments.initial_value is not None and arguments.reset is None:
        raise UsageError("--initial-value counts on the scan that ends a reset", "name the column of resets: --reset")
    multiplier, initial_value = arguments.multiplier, arguments.initial_value
    return PulseParameters(
        _number("--word-size", arguments.word_size),
        None if multiplier is None else _number("--multiplier", multiplier),
        0 if initial_value is None else _number("--initial-value", initial_value),
    )


def _number(option: str, text: str) -> int:
    with naming(option):
        return whole_number(text)


def _columns(table: CsvTable, arguments: argparse.Namespace) -> _Columns:
    """Return the columns that the options choose."""
    names = [name.strip() for name in table.header]
    reset_at = None if arguments.reset is None else _position(table, names, "--reset", arguments.reset)
    if arguments.column is not None:
        feedback_at = _position(table, names, "--column", arguments.column)
    else:
        others = [place for place in range(len(names)) if place != reset_at]
        if len(others) != 1:
            what = f"one of {_list(names)}" if others else "the feedback: --reset has the only one"
            raise UsageError(f"which column of {table.path} is the feedback?", f"name {what} with --column")
        feedback_at = others[0]
    if feedback_at == reset_at:
        raise UsageError(f"--column and --reset are the same column, {quoted(names[feedback_at])}")
    reset = None if reset_at is None else names[reset_at]
    return _Columns(names[feedback_at], feedback_at, reset, reset_at)


def _position(table: CsvTable, names: list[str], option: str, wanted: str) -> int:
    """Return the position of a column; case and surrounding blanks are ignored, as in all names of the rack."""
    places = [place for place, name in enumerate(names) if name.casefold() == wanted.strip().casefold()]
    if not places:
        hint = (
            did_you_mean(wanted, names[:_MOST_GUESSES]) or f"there {'is' if len(names) == 1 else 'are'} {_list(names)}"
        )
        raise UsageError(f"{option}: {table.path} has no column {quoted(wanted)}", hint)
    if len(places) > 1:
        raise table.fault("AMX6912", f"there are two columns for {quoted(names[places[0]], marks='')}")
    return places[0]


def _list(names: list[str]) -> str:
    shown = [quoted(name, marks="") for name in names[:_MOST_NAMES]]
    return ", ".join([*shown, "..."] if len(names) > _MOST_NAMES else shown)


def _compare(
    comparison: PulseComparison, table: CsvTable, columns: _Columns, output: TextIO | None, bar: ProgressBar
) -> None:
    writer = None if output is None else csv.writer(output, lineterminator="\n")
    if writer is not None:
        writer.writerow(_HEADER)
    for feedback, reset in _scans(table, columns):
        comparison.scan(feedback, reset)
        if writer is not None:
            writer.writerow(_row(comparison, feedback, reset))
        if comparison.scans % _ROWS_A_LOOK == 0:
            bar.show(table.position)


def _row(comparison: PulseComparison, feedback: int, reset: bool) -> tuple[int, ...]:
    output, total = comparison.output, comparison.total
    return (
        output.scan,
        feedback,
        int(reset),
        output.pulse_mult,
        output.pmul,
        output.difference,
        total.pulse_mult,
        total.pmul,
        total.difference,
    )


def _scans(table: CsvTable, columns: _Columns) -> Iterator[tuple[int, bool]]:
    """Yield feedback and reset of each row."""
    feedback, reset = 0, False
    for line, cells in table.numbered_rows():
        if cell := cells[columns.feedback_at].strip():
            value = value_of(cell, DataType.INTEGER)
            if not isinstance(value, int):
                raise _wrong_cell(table, columns.feedback, cell, wanted(DataType.INTEGER), line, _unsigned_hint(cell))
            feedback = value
        if columns.reset_at is not None and (cell := cells[columns.reset_at].strip()):
            value = value_of(cell, DataType.BOOLEAN)
            if not isinstance(value, bool):
                raise _wrong_cell(table, str(columns.reset), cell, wanted(DataType.BOOLEAN), line)
            reset = value
        yield feedback, reset


def _wrong_cell(table: CsvTable, column: str, cell: str, takes: str, line: int, hint: str | None = None) -> CsvFault:
    message = f"{quoted(column, marks='')} = {quoted(cell, marks='')}, it must be {takes}"
    return table.fault("AMX6915", message, hint, line)


def _unsigned_hint(cell: str) -> str | None:
    """Return a hint for a word that a logger wrote without sign, None for other cells."""
    value = value_of(cell, DataType.DOUBLE)
    if isinstance(value, int) and INT16_MAX < value <= 0xFFFF:
        return f"as a word of 16 bits this is {value - 0x10000}"
    return None
