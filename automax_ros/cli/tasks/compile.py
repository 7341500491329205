"""Print the Python functions that a task (.BLK, .BAS) becomes: the part before SCAN_LOOP, a scan, and a scan in steps.

A BASIC task becomes what it does from one wait to the next, at once and in steps. With --native print the C of the
scans, which is compiled where scans are native, or why there is none.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from automax_ros.cli.options.task import add_target_arguments, check_task_file, target_of
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.translate.translation import translate
from automax_ros.runtime.tasks.standalone_task import compiled_alone


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax compile``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a task (.BLK, .BAS)")
    parser.add_argument("--native", action="store_true", help="print the scans as C instead, as native scans run them")
    add_target_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the generated functions, or the errors of the task."""
    source, result = check_task_file(arguments.file, target_of(arguments))
    if result.program is None:
        print_diagnostics(result.diagnostics, source, sys.stderr)
        return 1
    compiled = compiled_alone(result.program)
    if not arguments.native:
        sys.stdout.write(compiled.source)
        return 0
    try:
        sys.stdout.write(translate(compiled).text)
    except NotNative as error:
        print(f"{arguments.file}: not native: {error}", file=sys.stderr)
        return 1
    return 0
