"""Write a recording to a table, as CSV or as NumPy arrays.

Without --scans: common memory, one row for each instant at which a watched variable changed, or every S seconds. With
--scans TASK: one row for each scan of the task, with what it latched and what it wrote back.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from automax_ros.cli.options.values import (
    add_grid_argument,
    add_output_argument,
    add_watch_argument,
    add_window_arguments,
    watch_list,
    window_of,
)
from automax_ros.cli.output.screen import share_shown
from automax_ros.cli.output.signals import ended_by_signals
from automax_ros.core.safe_file import is_direct
from automax_ros.core.text import count_of
from automax_ros.core.user_error import UsageError
from automax_ros.recordings.tables.export import CommonTable, Table, require_another_file, write_csv
from automax_ros.recordings.tables.scan_table import ScanTable
from automax_ros.recordings.tables.series import Progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax export``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    add_output_argument(parser, "OUT", "the table to write: OUT.csv, or OUT.npz for NumPy", required=True)
    add_watch_argument(parser, "every simple common that is not a string")
    parser.add_argument("--scans", metavar="TASK", help="the scans of a task instead of common memory")
    add_window_arguments(parser)
    add_grid_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Export the recording."""
    as_numpy = arguments.output.suffix.lower() == ".npz"
    require_another_file(arguments.bag, arguments.output)
    if not as_numpy and arguments.output.suffix.lower() != ".csv" and not is_direct(arguments.output):
        raise UsageError(f"{arguments.output}: a table is written as .csv or .npz", "name it OUT.csv or OUT.npz")
    with ended_by_signals(), share_shown("export") as progress:
        rows = _write(arguments, as_numpy, progress)
    if sys.stderr.isatty():
        print(f"{arguments.output}: {count_of(rows, 'row')}", file=sys.stderr)
    return 0


def _write(arguments: argparse.Namespace, as_numpy: bool, progress: Progress) -> int:
    table = _table(arguments, progress)
    if as_numpy:
        from automax_ros.recordings.tables.export_npz import write_npz  # NumPy takes a while to load

        return write_npz(arguments.bag, table, arguments.output)
    return write_csv(table, arguments.output)


def _table(arguments: argparse.Namespace, progress: Progress) -> Table:
    window = window_of(arguments)
    watch = watch_list(arguments.watch)
    if watch == []:
        raise UsageError("--watch names no variable", "`automax bag info BAG` lists them")
    if arguments.scans is None:
        return CommonTable(arguments.bag, watch, window, progress)
    if watch is not None or window.step_ns:
        raise UsageError("--scans gives every scan and all it used: without --watch and --every")
    return ScanTable(arguments.bag, arguments.scans, window, progress)
