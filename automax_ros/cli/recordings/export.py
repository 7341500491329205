"""Write a recording to a table, as CSV or as NumPy arrays, or what came from outside as a stimuli file.

Without --scans: common memory, one row for each instant at which a watched variable changed, or every S seconds. With
--scans TASK: one row for each scan of the task, with what it latched and what it wrote back. With --stimuli FILE: what
operator, ROS and stimuli did, for `automax run --simulated --stimuli FILE`, which then gives the same run as far as
verbs can say it.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping
from pathlib import Path

from automax_ros.cli.options.values import (
    add_grid_argument,
    add_output_argument,
    add_watch_argument,
    add_window_arguments,
    watch_list,
    window_of,
)
from automax_ros.cli.output.files import require_folder, require_writable, write_text
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
    add_output_argument(parser, "OUT", "the table to write: OUT.csv, or OUT.npz for NumPy")
    add_watch_argument(parser, "every simple common that is not a string")
    parser.add_argument("--scans", metavar="TASK", help="the scans of a task instead of common memory")
    parser.add_argument(
        "--stimuli",
        type=Path,
        metavar="FILE.yaml",
        help="write what came from outside as a stimuli file, and the sources of reloads into a folder next to it",
    )
    parser.add_argument(
        "--force", action="store_true", help="write over a stimuli file, or its sources, that are there"
    )
    add_window_arguments(parser)
    add_grid_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Export the recording."""
    if arguments.stimuli is not None:
        return _write_stimuli(arguments)
    if arguments.force:
        raise UsageError("--force is for --stimuli FILE.yaml: a table is written over anyway", "leave it out")
    if arguments.output is None:
        raise UsageError(
            "the table needs a file", "--output OUT.csv, or --stimuli FILE.yaml for what came from outside"
        )
    as_numpy = arguments.output.suffix.lower() == ".npz"
    require_another_file(arguments.bag, arguments.output)
    if not as_numpy and arguments.output.suffix.lower() != ".csv" and not is_direct(arguments.output):
        raise UsageError(f"{arguments.output}: a table is written as .csv or .npz", "name it OUT.csv or OUT.npz")
    with ended_by_signals(), share_shown("export") as progress:
        rows = _write(arguments, as_numpy, progress)
    if sys.stderr.isatty():
        print(f"{arguments.output}: {count_of(rows, 'row')}", file=sys.stderr)
    return 0


def _write_stimuli(arguments: argparse.Namespace) -> int:
    """Write the stimuli file, and the sources that it names."""
    from automax_ros.replay.rerun.outside import recorded_outside  # a rack takes a while to load
    from automax_ros.replay.rerun.stimuli_text import sources_folder, stimuli_text

    path, window = arguments.stimuli, window_of(arguments)
    for option in ("output", "watch", "scans", "every"):
        if getattr(arguments, option) is not None:
            raise UsageError(f"--{option} is for a table, --stimuli for what came from outside", "one after the other")
    if path.suffix.lower() not in (".yaml", ".yml") and not is_direct(path):
        raise UsageError(f"{path}: a stimuli file is written as .yaml", "name it FILE.yaml")
    require_another_file(arguments.bag, path)
    require_writable(path)
    if path.exists() and not is_direct(path) and not arguments.force:
        raise _edited(path)
    with ended_by_signals(), share_shown("export") as progress:
        config, outside = recorded_outside(arguments.bag, progress, window.end_ns)
    title = f"What came from outside in {Path(os.path.abspath(arguments.bag)).name}, rack {config.name}"
    folder = sources_folder(path)
    made = stimuli_text(
        arguments.bag, config, outside, title, folder=folder, from_ns=window.start_ns, to_ns=window.end_ns
    )
    if made.sources:
        _write_sources(path, path.parent / folder, made.sources, over=arguments.force)
    write_text(path, made.text)
    if sys.stderr.isatty():
        print(f"{path}: {made.entries} entries", file=sys.stderr)
    return 0


def _write_sources(stimuli: Path, folder: Path, sources: Mapping[str, str], *, over: bool) -> None:
    """Write the sources that a stimuli file names into the folder next to it: all of them, or none.

    Raises:
        UsageError: they cannot be written, or one is there that is another, unless ``over``.
    """
    if is_direct(stimuli):
        hint = "name a FILE.yaml, or a part without reloads with --from and --to"
        raise UsageError(f"{stimuli}: the sources of reloads need a folder next to a stimuli file", hint)
    require_folder("--stimuli", folder)
    folder.mkdir(exist_ok=True)
    texts = {folder / name: text for name, text in sources.items()}
    for file, text in texts.items():
        require_writable(file)
        if not over and file.exists() and file.read_bytes() != text.encode():
            raise _edited(file)
    for file, text in texts.items():
        write_text(file, text)


def _edited(path: Path) -> UsageError:
    return UsageError(f"{path} exists already, and may have been edited", "--force writes over it")


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
