"""Show a rack that runs, or a recording, in the browser: the rack, its diagrams with values, trends, drives, its log.

RACK is the name or namespace of a rack in the ROS domain, or its YAML file or folder; BAG is a recording, its folder or
its .mcap file. The address that is printed lets a browser of this machine in. A rack is only looked at, unless its file
says `operator: true` and --operate is given. Ctrl-C ends it. `automax run CONFIG --panel` runs a rack and shows it.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.cli.options.panel import add_panel_arguments, panel_served, wanted_panel
from automax_ros.cli.options.rack import is_rack_folder
from automax_ros.cli.options.replayed import (
    add_task_argument,
    add_tolerance_argument,
    print_refused_sources,
    task_files,
    task_sources,
    tolerance_of,
    with_repair,
)
from automax_ros.cli.options.ros import add_ros_arguments, add_wait_argument, prepare_ros, ros_arguments, space_of
from automax_ros.cli.output.screen import share_shown
from automax_ros.cli.output.signals import StopRequest, WorkInterrupted, stop_signals
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.recordings.mcap.errors import BagError

if TYPE_CHECKING:
    from automax_ros.panel.source import Source

_LOOK_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax panel``."""
    parser.add_argument("shown", metavar="RACK|BAG", help="a rack that runs, or a recording")
    parser.add_argument(
        "--against",
        type=Path,
        metavar="BAG2",
        help="with a recording: show another one next to it, and the first difference",
    )
    add_task_argument(parser, "with a recording: show what this source makes of it, too; may be given again")
    add_tolerance_argument(parser)
    add_wait_argument(parser)
    add_panel_arguments(parser)
    add_ros_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Serve the panel until Ctrl-C; 2 where there is nothing to show."""
    wanted = wanted_panel(arguments)
    assert wanted is not None, "only where it is optional"
    with stop_signals() as stop:
        try:
            source = _recording(arguments, stop) if _is_recording(arguments.shown) else _rack(arguments, stop)
        except WorkInterrupted:
            return 0
        except BagError as error:
            print(with_repair(error, _bag_at_fault(error, arguments)), file=sys.stderr)
            return 2
        if source is None:
            return 0 if stop.requested else 2
        with panel_served(source, wanted, lambda text: print(text, flush=True)):
            print("Ctrl-C ends the panel", flush=True)
            while not stop.requested:
                time.sleep(_LOOK_S)
    return 0


def _is_recording(text: str) -> bool:
    path = Path(text)
    return path.suffix.lower() == ".mcap" or (path.is_dir() and not is_rack_folder(path))


def _recording(arguments: argparse.Namespace, stop: StopRequest) -> Source | None:
    """Return the source of a recording; None if a source has errors, which are printed."""
    if arguments.ros is not None and arguments.ros.given:
        raise UsageError("--ros-args: nothing of ROS is started for a recording", "leave them out")
    tasks, tolerance = task_sources(task_files(arguments.tasks)), tolerance_of(arguments)
    from automax_ros.panel.recording import RecordingSource
    from automax_ros.replay.scans.stored_rack import SourceRefused

    try:
        with stop.cut_short(), share_shown("reading") as show:
            return RecordingSource(Path(arguments.shown), arguments.against, tasks, tolerance, show)
    except SourceRefused as error:
        print_refused_sources("panel", error, "nothing is shown")
        return None


def _bag_at_fault(error: BagError, arguments: argparse.Namespace) -> Path:
    """Return the recording that an error is about: that of --against, if the place of the error is in it."""
    other: Path | None = arguments.against
    return other if other is not None and Path(error.place).is_relative_to(other) else Path(arguments.shown)


def _rack(arguments: argparse.Namespace, stop: StopRequest) -> Source | None:
    """Return the source of a rack in the ROS domain; None where a stop is requested first."""
    for option, given in {"--against": arguments.against, "--task": arguments.tasks}.items():
        if given:
            raise UsageError(f"{option} is for recordings, and {arguments.shown} is not one")
    prepare_ros(arguments, "a recording can be shown without ROS: automax panel BAG")
    ros = ros_arguments(arguments)
    space = space_of(arguments.shown, ros)
    from automax_ros.panel.joined_rack import JoinedSource

    try:
        return JoinedSource(space, ros, arguments.wait, lambda: stop.requested)
    except UserError:
        if stop.requested:
            return None
        raise
