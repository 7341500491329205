"""Make a rack file (.yaml) from a folder of tasks (.BLK, .BAS), then check it.

Every COMMON of the tasks becomes a common variable of the rack, with its type, dimensions and length of strings; where
two tasks differ both places are named. Common memory stands in slot 0, the tasks share the Processors evenly, and the
one that scans most often gets the highest priority. Folders inside the folder are not looked at.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from automax_ros.cli.options.rack import DEFAULT_RACK_FILE
from automax_ros.cli.options.task import is_rack_file, tick_option
from automax_ros.cli.options.values import add_output_argument
from automax_ros.cli.output.files import write_whole
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.text import count_of, quoted
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.checks.tasks import findings_by_task, with_findings
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.modules.processor import MAX_PROCESSORS
from automax_ros.rackfile.old_plants.draft import Draft, draft


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax new``."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the folder of the tasks")
    add_output_argument(parser, "RACK.yaml", f"where to write (default: FOLDER/{DEFAULT_RACK_FILE})")
    parser.add_argument(
        "--processors",
        type=int,
        choices=range(1, MAX_PROCESSORS + 1),
        default=1,
        help="how many Processors share the tasks (default: 1)",
    )
    parser.add_argument("--tick-ms", metavar="MS", default="5.5", help="their tick (default: 5.5)")
    parser.add_argument(
        "--udc",
        action="append",
        default=[],
        metavar="TASK",
        help="a task that runs on a UDC, although no block of it says so; may be given again",
    )
    parser.add_argument("--force", action="store_true", help="write over a rack file that is there")


def run(arguments: argparse.Namespace) -> int:
    """Write the rack file; 1 where `automax check` would find errors in it or in its tasks."""
    folder = arguments.folder
    if not folder.is_dir():
        raise UsageError(f"{folder} is not a folder", "name the folder of the tasks")
    output = arguments.output if arguments.output is not None else folder / DEFAULT_RACK_FILE
    tick_ns = tick_option(arguments.tick_ms)
    require_free(output, force=arguments.force)
    drafted = draft(folder, output.parent, tick_ns, frozenset(name.upper() for name in arguments.udc))
    write_whole(output, drafted.text(arguments.processors).encode(), over=arguments.force)
    counts = ((arguments.processors, "Processor"), (len(drafted.tasks), "task"), (len(drafted.commons), "common"))
    print(f"wrote {output}: {', '.join(count_of(number, thing) for number, thing in counts)}")
    for name, reason in drafted.left_out:
        print(f"left out {quoted(name)}: it {reason}", file=sys.stderr)
    if _has_errors(output, drafted):
        print(f"correct what is shown above, then run: automax check {output}", file=sys.stderr)
        return 1
    print(f"next: automax run {output} --simulated --duration 10")
    return 0


def require_free(output: Path, *, force: bool) -> None:
    """Refuse a path at which no rack file may be written, before the work begins."""
    if output.is_dir():
        raise UsageError(f"{output} is a folder", f"name the file: --output {output / DEFAULT_RACK_FILE}")
    if not is_rack_file(output):
        raise UsageError(f"{output}: a rack file ends in .yaml or .yml")
    if not force and (output.exists() or output.is_symlink()):
        raise UsageError(f"{output} exists already", "--force writes over it")


def _has_errors(output: Path, drafted: Draft) -> bool:
    """Print the diagnostics of the rack file and its tasks, and return whether there are errors.

    Where commons differ, the places in both tasks are named.
    """
    loaded = load(output)
    print_diagnostics(loaded.diagnostics, loaded.source, sys.stderr)
    wrong = has_errors(loaded.diagnostics)
    programs = {name: result.program for name, result in drafted.results.items() if result.program is not None}
    among = findings_by_task(loaded.config, programs) if loaded.config is not None else {}
    for task in drafted.tasks:
        found = with_findings(drafted.results[task.name], among.get(task.name, ())).diagnostics
        print_diagnostics(found, task.source, sys.stderr)
        wrong = wrong or has_errors(found)
    return wrong
