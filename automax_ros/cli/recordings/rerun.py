"""Run the rack of a recording again in closed loop, with an edit from a moment on: what if, from here.

The rack that is stored in the recording runs up from the start of the run, and what came from outside (operator, ROS,
stimuli, other racks) happens again at its time. At --from the edited tasks and tunables take their place, in the state
of that moment; from there on --record records. Without an edit it is the recorded run again, byte for byte. Exit code
0: fine; 1: a message on the way is not as recorded, or a new source has errors; 2: the recording cannot be used.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from automax_ros.cli.options.rack import print_refused
from automax_ros.cli.options.recording import add_record_arguments, recording_options
from automax_ros.cli.options.replayed import (
    add_task_argument,
    print_refused_sources,
    task_files,
    task_sources,
    with_repair,
)
from automax_ros.cli.options.values import add_window_arguments, naming, window_of
from automax_ros.cli.options.work import add_native_arguments, native_forms, print_native
from automax_ros.cli.output.files import require_different_files, require_folder
from automax_ros.cli.output.screen import print_warning_count, share_shown
from automax_ros.cli.output.signals import WorkInterrupted, stop_signals
from automax_ros.core.user_error import UsageError
from automax_ros.rack.tasks.installation import RackError
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.rerun.report import RerunReport
from automax_ros.replay.rerun.rerun import Rerun, RerunOptions
from automax_ros.replay.scans.stored_rack import SourceRefused

_DEVIATES = "AMX6836"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax rerun``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    add_task_argument(parser, "run this source in place of the recorded one, from --from on; may be given again")
    parser.add_argument(
        "--tune",
        action="append",
        default=[],
        metavar="TASK.NAME=VALUE",
        help="set this tunable at --from; may be given again",
    )
    add_window_arguments(parser)
    parser.add_argument("--record", type=Path, metavar="AFTER", help="record, from --from on, into a new folder")
    parser.add_argument("--json", action="store_true", help="print the report for programs to read")
    add_record_arguments(parser)
    add_native_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run again; 1 if what should be as recorded is not, 2 if the recording cannot be used."""
    window = window_of(arguments)
    files = task_files(arguments.tasks)
    require_different_files({"BAG": arguments.bag, **{f"--task {name}": path for name, path in files.items()}}, {})
    if arguments.record is None and (files or arguments.tune):
        raise UsageError("an edit needs --record AFTER, or nothing would be seen of it", "add --record AFTER")
    if arguments.record is not None:
        require_folder("--record", arguments.record)
    new = task_sources(files)
    try:
        with stop_signals() as stop:
            with stop.cut_short():
                rerun = Rerun(arguments.bag, new, RerunOptions(window.start_ns, window.end_ns))
                rerun.native = native_forms(arguments, rerun.to_ns)
                with naming("--tune"):
                    rerun.tune(arguments.tune)
                recording = recording_options(arguments, rerun.config)
            for source, diagnostics in rerun.warnings:
                print_warning_count([(source, diagnostics)], Path(source.name).name, Path(source.name))
            with share_shown("rerun") as show:
                report = rerun.run(arguments.record, recording, show, lambda: stop.requested)
            if arguments.verbose:
                print_native(rerun.outcomes)
            return _shown(report, arguments) if not stop.requested else stop.code
    except WorkInterrupted:
        return stop.code
    except SourceRefused as error:
        print_refused_sources("rerun", error, "nothing is run")
        return 1
    except RackError as error:
        return print_refused("rerun", error)
    except BagError as error:
        print(with_repair(error, arguments.bag), file=sys.stderr)
        return 2


def _shown(report: RerunReport, arguments: argparse.Namespace) -> int:
    if arguments.json:
        print(json.dumps(report.as_json(), indent=2, allow_nan=False))
    else:
        sys.stdout.write(report.text())
    if report.deviation is None:
        return 0
    what = f"its rack did something else when it ran again, {report.deviation.text}"
    hint = "what follows is of another run than the recorded one: docs/howto/rerun.md"
    print(BagError(_DEVIATES, arguments.bag, what, hint), file=sys.stderr)
    return 1
