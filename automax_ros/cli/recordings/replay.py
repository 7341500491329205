"""Execute every recorded scan again and tell what differs: with the recorded tasks, or with edited ones (--task).

It is an open loop: each task scans on the recorded inputs, whatever the other tasks do in the replay. Nothing is needed
but the recording, which holds the rack's file and all sources. Exit code 0: identical; 1: something differs; 2: the
recording cannot be read, or a new source has errors.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from automax_ros.cli.options.replayed import (
    add_task_argument,
    add_tolerance_argument,
    print_refused_sources,
    task_files,
    task_sources,
    tolerance_of,
    with_repair,
)
from automax_ros.cli.options.values import add_window_arguments, whole_number, window_of
from automax_ros.cli.options.work import add_native_arguments, add_where_arguments, native_forms, where_of
from automax_ros.cli.output.difference_figure import can_be_drawn, draw, traces
from automax_ros.cli.output.files import require_different_files, require_picture_file
from automax_ros.cli.output.screen import print_warning_count, share_shown
from automax_ros.cli.output.signals import ended_by_signals
from automax_ros.core.user_error import UsageError
from automax_ros.parallel.job import ClusterFault, Workers
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.engine import DEFAULT_MAX_DIFFERENCES, Replay, ReplayOptions
from automax_ros.replay.scans.report import ReplayReport
from automax_ros.replay.scans.stored_rack import SourceRefused
from automax_ros.replay.side_by_side import replay_side_by_side

_NS_A_BYTE = 20_000
"""Run time per byte of a recording, ns, about: 50 kB are a second of an example rack (decision)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax replay``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    add_task_argument(parser, "run this source in place of the recorded one; may be given again")
    parser.add_argument(
        "--only", action="append", metavar="TASK,...", help="replay these tasks only (default: all of the recording)"
    )
    add_tolerance_argument(parser)
    add_window_arguments(parser)
    add_where_arguments(parser, "replay the files of a split recording")
    add_native_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print the report for programs to read")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the first difference (needs matplotlib)")
    parser.add_argument(
        "--max-differences",
        type=whole_number,
        default=DEFAULT_MAX_DIFFERENCES,
        metavar="N",
        help=f"most variables to tell in full, by the time they first differ (default: {DEFAULT_MAX_DIFFERENCES})",
    )


def run(arguments: argparse.Namespace) -> int:
    """Replay; 1 if something differs, 2 if the recording or a source cannot be used."""
    options = _options(arguments)
    files = task_files(arguments.tasks)
    read = {"BAG": arguments.bag, **{f"--task {name}": path for name, path in files.items()}}
    require_different_files(read, {"--plot": arguments.plot})
    if arguments.plot is not None:
        require_picture_file(arguments.plot)
    where = where_of(arguments)
    new = task_sources(files)
    for name in new:
        if options.only is not None and name not in options.only:
            raise UsageError(f"--task {name}: --only leaves this task out", f"--only {','.join([*options.only, name])}")
    try:
        report = _run_replay(Replay(arguments.bag, new, options), where, arguments)
    except SourceRefused as error:
        print_refused_sources("replay", error, "nothing is replayed")
        return 2
    except ClusterFault as fault:
        print(fault, file=sys.stderr)
        return 2
    except BagError as error:
        print(with_repair(error, arguments.bag), file=sys.stderr)
        return 2
    return 0 if report.identical else 1


def _run_replay(replay: Replay, where: Workers, arguments: argparse.Namespace) -> ReplayReport:
    for source, diagnostics in replay.warnings:
        print_warning_count([(source, diagnostics)], Path(source.name).name, Path(source.name))
    with share_shown("replay") as show:
        notes: list[str] = []
        report = replay_side_by_side(replay, where, show, notes.append)
    sys.stderr.writelines(f"automax replay: {note}\n" for note in notes)
    if arguments.verbose:
        sys.stderr.writelines(f"{text}\n" for text in replay.native)
    if arguments.json:
        print(json.dumps(report.as_json(), indent=2, allow_nan=False))
    else:
        sys.stdout.write(report.text())
    if arguments.plot is not None:
        if can_be_drawn(report):
            with share_shown("picture") as show:
                found = traces(replay, report, show)
            with ended_by_signals():
                draw(found, report, arguments.plot)
        else:
            print("automax replay: no number differs, so there is nothing to draw", file=sys.stderr)
    return report


def _options(arguments: argparse.Namespace) -> ReplayOptions:
    window = window_of(arguments)
    if arguments.max_differences < 1:
        raise UsageError("--max-differences: at least 1")
    only = None
    if arguments.only is not None:
        names = [name.strip().upper() for text in arguments.only for name in text.split(",")]
        only = tuple(dict.fromkeys(name for name in names if name))
        if not only:
            raise UsageError("--only names no task")
    return ReplayOptions(
        only,
        tolerance_of(arguments),
        window.start_ns,
        window.end_ns,
        arguments.max_differences,
        native=native_forms(arguments, _expected_ns(arguments.bag)),
    )


def _expected_ns(bag: Path) -> int:
    """Return the approximate duration of a recording, ns, by its size; 0 for one that cannot be read."""
    files = list(bag.glob("*.mcap")) if bag.is_dir() else [bag]
    return sum(file.stat().st_size for file in files if file.is_file()) * _NS_A_BYTE
