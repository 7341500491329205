"""What a sweep tells: the best runs on the terminal, a folder with tables, facts and a picture."""

from __future__ import annotations

import argparse
import io
import shlex
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from automax_ros import __version__
from automax_ros.cli.output.files import require_folder, write_report, write_text
from automax_ros.cli.racks.sweep_picture import draw
from automax_ros.cli.usage import UsageError
from automax_ros.core.faults import UserError
from automax_ros.core.text import count_of, quoted, table
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.sweep.measures import Measure, read_measures
from automax_ros.sweep.run import Plan
from automax_ros.sweep.sweeping import Row, best_rows
from automax_ros.sweep.tables import write_csv, write_npz

MOST_SHOWN = 10
"""Best runs that are shown (decision)."""
_MOST_FAULTS = 3
_WAYS = {"min": False, "max": True}


@dataclass(frozen=True)
class Wanted:
    """What was asked for: ``installed`` is the number of what the rack has installed, ``best`` that of a measure."""

    arguments: argparse.Namespace
    installed: int
    best: int
    greatest: bool


def best_of(
    text: str | None, config: RackConfig, measures: Sequence[Measure], duration_ns: int
) -> tuple[Measure, bool]:
    """Return which measure says what is best, and whether its greatest value does.

    Raises:
        UsageError: the text is not ``min MEASURE`` or ``max MEASURE``.
    """
    if text is None:
        return measures[0], False
    way, _, named = text.strip().partition(" ")
    try:
        found = read_measures(named, config, duration_ns) if way in _WAYS else ()
    except UserError as fault:
        raise UsageError(f"--best: {fault.message}", fault.hint) from fault
    if len(found) != 1:
        raise UsageError(f"--best: {quoted(text)} is not min MEASURE or max MEASURE", "such as 'min rms(SPEED_ERR%)'")
    return found[0], _WAYS[way]


@contextmanager
def prepared(folder: Path | None) -> Iterator[None]:
    """Make a folder for what comes of the work in the block; one that is still empty after a failure is taken away.

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
            with suppress(OSError):  # something of it was written
                folder.rmdir()
        raise


@dataclass(frozen=True)
class Output:
    """The rows of a sweep of ``count`` runs with all that is told of them."""

    plan: Plan
    wanted: Wanted
    rows: Sequence[Row]
    count: int

    @property
    def best(self) -> list[Row]:
        """The rows without a fault, the best first."""
        return best_rows(self.rows, self.wanted.best, greatest=self.wanted.greatest)

    def repeat(self, row: Row) -> str:
        """Return the command that runs a row alone, with the same measures."""
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
            UsageError: one cannot be written.
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


def print_best(output: Output) -> None:
    """Print the best runs, the command of the first, and what went wrong."""
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


def _print_faults(output: Output) -> None:
    faults = Counter(row.outcome.fault for row in output.rows if row.outcome.fault)
    for text, number in faults.most_common(_MOST_FAULTS):
        first = next(row.number for row in output.rows if row.outcome.fault == text)
        print(f"automax sweep: {count_of(number, 'run')}, run {first} first: {text}", file=sys.stderr)
    if len(faults) > _MOST_FAULTS:
        print(f"automax sweep: and {len(faults) - _MOST_FAULTS} other faults", file=sys.stderr)
    if not output.best and not faults and output.rows:
        label = output.plan.measures[output.wanted.best].label
        print(f"automax sweep: no run has a value of {label}", file=sys.stderr)
