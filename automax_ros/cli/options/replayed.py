"""What is executed again: a recording, and with ``--task`` sources that take the place of its own."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from automax_ros.cli.options.values import each_once, option_number
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.reading.files import FileFault, read_task_source
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.scans.stored_rack import SourceRefused

_MOST_COUNTS = 1e19
"""Greatest possible difference between two values of a variable."""
_TRUNCATED, _NO_RECORDING = "AMX6812", "AMX6810"


def add_task_argument(parser: argparse.ArgumentParser, text: str) -> None:
    """Add ``--task``, any number of times, as ``tasks``."""
    parser.add_argument("--task", action="append", default=[], metavar="NAME=FILE", dest="tasks", help=text)


def add_tolerance_argument(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Add ``--tolerance``, which ``tolerance_of`` reads; its help continues with ``more``."""
    parser.add_argument(
        "--tolerance",
        default="0",
        metavar="COUNTS",
        help=f"numbers that differ by at most this count as equal (default: 0, bit for bit){more}",
    )


def tolerance_of(arguments: argparse.Namespace) -> float:
    """Return the counts of ``--tolerance``.

    Raises:
        UsageError: it is not a number from 0 on.
    """
    return option_number("--tolerance", arguments.tolerance, 0.0, _MOST_COUNTS)


def task_files(texts: Sequence[str]) -> dict[str, Path]:
    """Return the files that the texts of ``--task`` give, by the tasks' names.

    Raises:
        UsageError: a text is wrong, or two are for the same task.
    """
    return each_once("--task", map(_task_file, texts))


def _task_file(text: str) -> tuple[str, Path]:
    name, equals, file = text.partition("=")
    name = name.strip().upper()
    if not (name and equals and file):
        raise UsageError(f"--task {text[:80]!r} is not NAME=FILE", "for example --task SPEED=new/SPEED.BLK")
    return name, Path(file)


def task_sources(files: Mapping[str, Path]) -> dict[str, SourceText]:
    """Return the sources in the files.

    Raises:
        UsageError: one cannot be read.
    """
    return {name: _source(name, path) for name, path in files.items()}


def print_refused_sources(command: str, error: SourceRefused, outcome: str) -> None:
    """Print the errors of sources, and what becomes of the command."""
    for source, diagnostics in error.findings:
        print_diagnostics(diagnostics, source, sys.stderr)
    print(f"automax {command}: errors in {error}; {outcome}", file=sys.stderr)


def _source(name: str, path: Path) -> SourceText:
    try:
        return read_task_source(path)
    except FileFault as fault:
        raise UsageError(f"--task {name}: {path} {fault}") from fault


def with_repair(error: BagError, bag: Path) -> BagError:
    """Return the error; for an unfinished recording, with a hint to repair it."""
    unfinished = error.code == _TRUNCATED or (error.code == _NO_RECORDING and any(bag.glob("*.mcap")))
    if not unfinished:
        return error
    return BagError(error.code, error.place, error.message, f"`automax bag repair {bag}` saves what is whole of it")
