"""The output of a sweep: the best runs on the terminal, a folder with tables, facts and a picture."""

from __future__ import annotations

import argparse
import io
import math
import shlex
import sys
import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros import __version__
from automax_ros.cli.options.values import naming
from automax_ros.cli.output.figure import new_figure, plain, save
from automax_ros.cli.output.files import require_folder, write_report, write_text
from automax_ros.core.text import count_of, quoted, table
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.core.types import Value
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.sweep.measures import Measure, read_measures
from automax_ros.sweep.run import Plan, Row, best_rows
from automax_ros.sweep.tables import write_csv, write_npz

MOST_LANES = 8
"""Greatest number of measures, and of quantities, that are drawn (decision)."""
_WIDTH_IN, _LANE_IN, _MAP_IN, _CELL_IN = 9.0, 2.2, 4.5, 2.4
_MOST_TICKS = 20
_COLOUR, _BEST, _FONT = "#1f4e9c", "#c1272d", 8
_LETTERS_AN_INCH, _LEAST_LETTERS = 14.0, 12
"""Letters of that size per inch, and the shortest line of a label, in letters."""


@dataclass(frozen=True)
class _Axis:
    label: str
    numbers: list[float]
    texts: tuple[str, ...] = ()

    @property
    def distinct(self) -> list[float]:
        return sorted(set(self.numbers))


def draw(plan: Plan, rows: Sequence[Row], best: Sequence[Row], path: Path) -> None:
    """Draw the rows, unless nothing varies. The same rows give the same bytes.

    Raises:
        UsageError: matplotlib is missing, or the file cannot be written.
    """
    axes = [_axis(item.label, [row.point[place] for row in rows]) for place, item in enumerate(plan.quantities)]
    varied = [axis for axis in axes if len(axis.distinct) > 1][:MOST_LANES]
    if not varied:
        return
    measures = [
        _Axis(item.label, [math.nan if (value := row.outcome.measures[place]) is None else value for row in rows])
        for place, item in enumerate(plan.measures[:MOST_LANES])
    ]
    marked = [place for place, row in enumerate(rows) if row in best]
    is_grid = len(rows) == math.prod(len(axis.distinct) for axis in varied)
    if len(varied) == 1:
        figure = _lines(varied[0], measures, marked)
    elif len(varied) == 2 and is_grid:
        figure = _maps(varied[0], varied[1], measures, marked)
    else:
        figure = _points(varied, measures, marked)
    save(figure, path)


def _axis(label: str, values: Sequence[Value]) -> _Axis:
    if any(isinstance(value, str) for value in values):
        texts = tuple(sorted(set(map(str, values))))
        places = {text: place for place, text in enumerate(texts)}
        return _Axis(label, [places[str(value)] for value in values], texts)
    return _Axis(label, [float(value) for value in values])


def _lines(varied: _Axis, measures: Sequence[_Axis], marked: Sequence[int]) -> Any:
    figure = new_figure(_WIDTH_IN, _LANE_IN * len(measures) + 0.5)
    axes = figure.subplots(len(measures), 1, squeeze=False)
    order = sorted(range(len(varied.numbers)), key=lambda place: varied.numbers[place])
    for axis, measure in zip(axes[:, 0], measures, strict=True):
        numbers = [varied.numbers[place] for place in order], [measure.numbers[place] for place in order]
        axis.plot(*numbers, ".-", color=_COLOUR, linewidth=1)
        _mark(axis, varied, measure, marked)
        _name(axis, varied, measure)
    return figure


def _maps(across: _Axis, up: _Axis, measures: Sequence[_Axis], marked: Sequence[int]) -> Any:
    figure = new_figure(_WIDTH_IN, _MAP_IN * len(measures))
    axes = figure.subplots(len(measures), 1, squeeze=False)
    columns, lines = across.distinct, up.distinct
    for axis, measure in zip(axes[:, 0], measures, strict=True):
        cells = [[math.nan] * len(columns) for _ in lines]
        for x, y, value in zip(across.numbers, up.numbers, measure.numbers, strict=True):
            cells[lines.index(y)][columns.index(x)] = value
        drawn = axis.pcolormesh(columns, lines, cells, shading="nearest")
        figure.colorbar(drawn, ax=axis).ax.tick_params(labelsize=_FONT)
        axis.plot([across.numbers[at] for at in marked], [up.numbers[at] for at in marked], "o", color=_BEST)
        axis.set_title(_fold(measure.label, _WIDTH_IN), fontsize=_FONT + 1)
        _name(axis, across, up)
    return figure


def _points(varied: Sequence[_Axis], measures: Sequence[_Axis], marked: Sequence[int]) -> Any:
    figure = new_figure(max(_WIDTH_IN, _CELL_IN * len(varied)), _CELL_IN * len(measures) + 0.5)
    axes = figure.subplots(len(measures), len(varied), squeeze=False)
    for line, measure in zip(axes, measures, strict=True):
        for axis, quantity in zip(line, varied, strict=True):
            axis.plot(quantity.numbers, measure.numbers, ".", color=_COLOUR, markersize=3)
            _mark(axis, quantity, measure, marked)
            _name(axis, quantity, measure)
    return figure


def _mark(axis: Any, across: _Axis, up: _Axis, marked: Sequence[int]) -> None:
    axis.plot([across.numbers[at] for at in marked], [up.numbers[at] for at in marked], "o", color=_BEST)


def _name(axis: Any, across: _Axis, up: _Axis) -> None:
    _, _, width, height = axis.get_position().bounds
    inches = axis.figure.get_size_inches()
    axis.set_xlabel(_fold(across.label, width * inches[0]), fontsize=_FONT)
    axis.set_ylabel(_fold(up.label, height * inches[1]), fontsize=_FONT)
    for texts, set_ticks in ((across.texts, axis.set_xticks), (up.texts, axis.set_yticks)):
        if texts:
            every = -(-len(texts) // _MOST_TICKS)
            set_ticks(range(0, len(texts), every), [plain(text) for text in texts[::every]])
    axis.tick_params(labelsize=_FONT)
    axis.grid(alpha=0.3)


def _fold(text: str, inches: float) -> str:
    """Return a label in as many lines as it needs to be no longer than its axis."""
    lines = textwrap.wrap(text, max(_LEAST_LETTERS, int(inches * _LETTERS_AN_INCH)), break_on_hyphens=False)
    return "\n".join(map(plain, lines))


MOST_SHOWN = 10
"""Number of best runs that are shown (decision)."""
_MOST_FAULTS = 3
_WAYS = {"min": False, "max": True}


@dataclass(frozen=True)
class Wanted:
    """The request: ``installed`` is the fingerprint of the rack's installation, ``best`` the index of a measure."""

    arguments: argparse.Namespace
    installed: int
    best: int
    greatest: bool


def best_of(
    text: str | None, config: RackConfig, measures: Sequence[Measure], duration_ns: int
) -> tuple[Measure, bool]:
    """Return the measure by which runs are compared, and whether its greatest value is the best.

    Raises:
        UsageError: the text is not ``min MEASURE`` or ``max MEASURE``.
    """
    if text is None:
        return measures[0], False
    way, _, named = text.strip().partition(" ")
    with naming("--best"):
        found = read_measures(named, config, duration_ns) if way in _WAYS else ()
    if len(found) != 1:
        raise UsageError(f"--best: {quoted(text)} is not min MEASURE or max MEASURE", "such as 'min rms(SPEED_ERR%)'")
    return found[0], _WAYS[way]


@contextmanager
def prepared(folder: Path | None) -> Iterator[None]:
    """Create a folder for the results of the block; if the block fails and the folder is empty, remove it.

    Raises:
        UsageError: it cannot be made, or has files already.
    """
    if folder is None:
        yield
        return
    require_folder("--output", folder)
    made = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        full = any(folder.iterdir())
    except OSError as error:
        raise UsageError(f"--output: {folder} cannot be used: {error.strerror or error}") from error
    if full:
        raise UsageError(f"--output: {folder} has files already", "name a new folder")
    try:
        yield
    except BaseException:
        if made:
            with suppress(OSError):  # the folder is not empty
                folder.rmdir()
        raise


@dataclass(frozen=True)
class SweepOutput:
    """The rows of a sweep of ``count`` runs, and their output."""

    plan: Plan
    wanted: Wanted
    rows: Sequence[Row]
    count: int

    @property
    def best(self) -> list[Row]:
        """The rows without a fault, the best first."""
        return best_rows(self.rows, self.wanted.best, greatest=self.wanted.greatest)

    def repeat(self, row: Row) -> str:
        """Return the command that repeats the run of a row alone, with the same measures."""
        arguments = self.wanted.arguments
        words = ["automax", "sweep", str(arguments.config)]
        for quantity, value in zip(self.plan.quantities, row.point, strict=True):
            words += ["--vary", f"{quantity.label}={quantity.text(value)}"]
        words += ["--duration", seconds_text(self.plan.duration_ns)]
        words += ["--stimuli", str(arguments.stimuli)] if arguments.stimuli is not None else []
        words += ["--allow-outside"] if arguments.allow_outside else []
        words += ["--measure", " ".join(measure.label for measure in self.plan.measures)]
        return shlex.join(words)

    def write(self, folder: Path) -> None:
        """Write runs.csv, runs.npz, sweep.json, and sweep.png where there is something to draw.

        Raises:
            UsageError: a file cannot be written.
        """
        stream = io.StringIO()
        write_csv(self.plan, self.rows, self.repeat, stream)
        write_text(folder / "runs.csv", stream.getvalue())
        try:
            write_npz(self.plan, self.rows, folder / "runs.npz")
        except OSError as error:
            raise UsageError(f"{folder / 'runs.npz'} cannot be written: {error.strerror or error}") from error
        write_report(folder / "sweep.json", self._facts())
        try:
            draw(self.plan, self.rows, self.best[:1], folder / "sweep.png")
        except UsageError as error:
            print(f"automax sweep: no picture: {error}", file=sys.stderr)

    def _facts(self) -> dict[str, object]:
        given = self.wanted.arguments
        return {
            "version": __version__,
            "config": str(given.config),
            "installed": f"{self.wanted.installed:016x}",
            "vary": given.vary,
            "measures": [measure.label for measure in self.plan.measures],
            "best": f"{'max' if self.wanted.greatest else 'min'} {self.plan.measures[self.wanted.best].label}",
            "sample": given.sample,
            "seed": given.seed if given.seed is not None or given.sample is None else 1,
            "duration_s": self.plan.duration_ns / NS_PER_S,
            "stimuli": None if given.stimuli is None else str(given.stimuli),
            "runs": self.count,
            "done": len(self.rows),
            "faults": sum(bool(row.outcome.fault) for row in self.rows),
        }


def print_best(output: SweepOutput) -> None:
    """Print the best runs, the command that repeats the best, and the faults."""
    best, plan, wanted = output.best, output.plan, output.wanted
    if best:
        headings = ["run", *(item.label for item in plan.quantities), *(item.label for item in plan.measures)]
        rows = [headings, *(_cells(plan, row) for row in best[:MOST_SHOWN])]
        print("\n".join(table(rows, right=range(len(headings)))))
    if best and output.count > 1:
        way = "greatest" if wanted.greatest else "least"
        label = plan.measures[wanted.best].label
        print(f"\n{count_of(len(output.rows), 'run')}; the best has the {way} {label}. Again, alone:")
        print(f"  {output.repeat(best[0])}")
    _print_faults(output)


def _cells(plan: Plan, row: Row) -> list[str]:
    values = [quantity.text(value) for quantity, value in zip(plan.quantities, row.point, strict=True)]
    return [str(row.number), *values, *("-" if item is None else f"{item:.6g}" for item in row.outcome.measures)]


def _print_faults(output: SweepOutput) -> None:
    faults = Counter(row.outcome.fault for row in output.rows if row.outcome.fault)
    for text, number in faults.most_common(_MOST_FAULTS):
        first = next(row.number for row in output.rows if row.outcome.fault == text)
        print(f"automax sweep: {count_of(number, 'run')}, run {first} first: {text}", file=sys.stderr)
    if len(faults) > _MOST_FAULTS:
        print(f"automax sweep: and {len(faults) - _MOST_FAULTS} other faults", file=sys.stderr)
    if not output.best and not faults and output.rows:
        label = output.plan.measures[output.wanted.best].label
        print(f"automax sweep: no run has a value of {label}", file=sys.stderr)
