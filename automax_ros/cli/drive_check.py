"""Judge the drives of a rack by the manual's formulas, each with its numbers put in (section 52.4 to 52.6).

Of every drive with a plant: the tach loss threshold and its upper limit, JBAR, the largest armature inductance for fast
bridge change, IOC_THRESH against LIM_BAR, AC_LINE_FREQ against the line, and the gains that this motor asks for. Each
is fine, asks for attention, or is wrong. Exit code 1: something is wrong, or a task has errors.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from automax_ros.cli.drive_check_text import lines_of, records_of
from automax_ros.cli.rack_arguments import config_of, settings_of
from automax_ros.cli.rack_file import add_outside_argument, add_set_argument
from automax_ros.cli.terminal import print_diagnostics
from automax_ros.cli.usage import UsageError
from automax_ros.core.diagnostics import has_errors
from automax_ros.drive.assessment import assess
from automax_ros.drive.drive_case import DriveFindings, Verdict
from automax_ros.language.program import Program
from automax_ros.rack.config import RackConfig
from automax_ros.rack.drive_cases import drive_cases
from automax_ros.rack.tasks_check import check_tasks


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax drive-check``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file, or its folder")
    add_set_argument(parser)
    add_outside_argument(parser)
    parser.add_argument("--json", action="store_true", help="print one list of drives for programs to read")


def run(arguments: argparse.Namespace) -> int:
    """Print what was found; what is wrong with the rack goes to the standard error."""
    config = config_of(arguments.config, allow_outside=arguments.allow_outside)
    if config is None:
        return 1
    settings = dict(settings_of(config, arguments.settings))
    programs, wrong = _programs(config)
    found = [assess(case) for case in drive_cases(config, programs, settings)]
    if not found and not wrong:
        hint = "a drive is a 57C406 or a UDC with a plant (docs/rack_yaml.md), or a task with DC_DRIVE_CML"
        raise UsageError(f"{arguments.config}: the rack has no drive", hint)
    if arguments.json:
        print(json.dumps(records_of(found), indent=2))
    else:
        print("\n".join(lines_of(found)))
    return 1 if wrong or _is_wrong(found) else 0


def _programs(config: RackConfig) -> tuple[list[Program], bool]:
    """Return the tasks without errors, and whether others have some: those are printed."""
    programs: list[Program] = []
    wrong = False
    for item in check_tasks(config):
        if has_errors(item.result.diagnostics):
            print_diagnostics(item.result.diagnostics, item.source, sys.stderr)
            wrong = True
        elif item.result.program is not None:
            programs.append(item.result.program)
    return programs, wrong


def _is_wrong(found: Sequence[DriveFindings]) -> bool:
    return any(item.verdict is Verdict.WRONG for drive in found for item in drive.findings)
