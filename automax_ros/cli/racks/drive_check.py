"""Judge the drives of a rack by the manual's formulas, each with its numbers put in (section 52.4 to 52.6).

Of every drive with a plant: the tach loss threshold and its upper limit, JBAR, the largest armature inductance for fast
bridge change, IOC_THRESH against LIM_BAR, AC_LINE_FREQ against the line, and the gains that this motor asks for. Each
is fine, asks for attention, or is wrong. Exit code 1: something is wrong, or a task has errors.
"""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from automax_ros.cli.options.rack import add_outside_argument, add_set_argument, config_of, settings_of
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.text import printable
from automax_ros.core.user_error import UsageError
from automax_ros.drive.assess.assessment import assess
from automax_ros.drive.assess.drive_case import DriveCase, DriveFindings, Finding, Verdict
from automax_ros.language.program import Program
from automax_ros.rackfile.checks.drives import drive_cases
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.config import RackConfig

_WIDTH = 120
_INDENT = " " * 14


def lines_of(found: Iterable[DriveFindings]) -> list[str]:
    """Return the lines that describe drives: each rule with its verdict, then its formula and the numbers in it."""
    lines: list[str] = []
    for drive in found:
        lines += [*([""] if lines else []), *_drive(drive)]
    return lines


def _drive(drive: DriveFindings) -> list[str]:
    lines = [f"{drive.name}: {drive.where}", *(f"  {text}" for text in _facts(drive.case))]
    for item in drive.findings:
        lines += ["", *_finding(item)]
    return lines


def _facts(case: DriveCase | None) -> list[str]:
    if case is None:
        return []
    motor, parameters = case.parameters.motor, case.parameters
    rated = f"{case.armature_v:.4g} V, {parameters.amps:.4g} A, {case.base_rpm:.4g} rpm, {case.rated_n_m:.4g} N m"
    armature = f"{motor.resistance_ohm:.4g} ohm, {motor.inductance_h * 1e3:.4g} mH"
    line = f"{parameters.line_v:.4g} V, {parameters.line_hz:g} Hz, {parameters.source_h * 1e3:.4g} mH a phase"
    computing = case.computing
    loop = "" if computing is None else f" on a {computing.model}, {computing.execution} execution"
    return [
        f"motor: {rated}; armature {armature}; inertia {motor.inertia_kg_m2 * case.inertia:.4g} kg m2 with its load",
        f"line: {line}" + (f"; current minor loop: task {case.task}{loop}" if case.task else ""),
    ]


def _finding(item: Finding) -> list[str]:
    head = f"  {item.verdict.value:<10}  {item.rule}: {printable(item.result)}"
    lines = textwrap.wrap(head, _WIDTH, subsequent_indent=_INDENT, break_long_words=False)
    lines[0] = head[: len(head) - len(head.lstrip())] + lines[0].lstrip()
    if item.formula:
        lines.append(f"{_INDENT}{item.formula}")
    if item.numbers:
        lines.append(f"{_INDENT}{item.numbers}")
    return lines


def records_of(found: Iterable[DriveFindings]) -> list[dict[str, Any]]:
    """Return the data that describe drives, for JSON; unknown numbers are null."""
    return [
        {
            "drive": drive.name,
            "where": drive.where,
            "task": drive.case.task or None if drive.case is not None else None,
            **_execution(drive.case),
            "verdict": drive.verdict.value,
            "findings": [_record(item) for item in drive.findings],
        }
        for drive in found
    ]


def _execution(case: DriveCase | None) -> dict[str, str | None]:
    computing = case.computing if case is not None else None
    if computing is None:
        return {"execution": None, "model": None}
    return {"execution": computing.execution, "model": computing.model}


def _record(item: Finding) -> dict[str, Any]:
    record = {"rule": item.rule, "verdict": item.verdict.value, "result": item.result, "formula": item.formula}
    return {**record, "numbers": item.numbers, "values": dict(item.values)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax drive-check``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file, or its folder")
    add_set_argument(parser)
    add_outside_argument(parser)
    parser.add_argument("--json", action="store_true", help="print one list of drives for programs to read")


def run(arguments: argparse.Namespace) -> int:
    """Print the findings; errors of the rack are printed on standard error."""
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
    return 1 if wrong or any(item.verdict is Verdict.WRONG for drive in found for item in drive.findings) else 0


def _programs(config: RackConfig) -> tuple[list[Program], bool]:
    """Return the tasks without errors, and whether others have errors, which are printed."""
    programs: list[Program] = []
    wrong = False
    for item in check_tasks(config):
        if has_errors(item.result.diagnostics):
            print_diagnostics(item.result.diagnostics, item.source, sys.stderr)
            wrong = True
        elif item.result.program is not None:
            programs.append(item.result.program)
    return programs, wrong
