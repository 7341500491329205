"""What ``automax compare pulse`` prints: a report for the engineer, or one JSON object."""

from __future__ import annotations

import json
from dataclasses import dataclass

from automax_ros.core.text import count_of, printable, table
from automax_ros.logix.pmul import GAIN_ONE
from automax_ros.logix.pulse_comparison import Pair, PulseComparison
from automax_ros.logix.pulse_conversion import DEFAULT_MULTIPLIER, PulseParameters


@dataclass(frozen=True)
class Report:
    """A comparison that has ended, with the names of its file and columns."""

    input: str
    column: str
    reset: str | None
    parameters: PulseParameters
    comparison: PulseComparison

    @property
    def rows(self) -> list[tuple[str, Pair]]:
        """What differs and the totals at the end, in words."""
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
    """Return the report as one JSON object; what does not differ is null."""
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
    """Return a table with a column for each number, right-justified."""
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
