"""What the coefficients of the dynamic blocks in a task (.BLK) mean at its scan time; or the KI for a rate of counts.

For every such block: Laplace and discrete transfer function, corner frequencies, the integrator's range (section 51),
and the limits of sections 36 and 41 to 50 as numbers; what comes within 10 % of one is marked with "!". A coefficient
that is a variable has a tunable's CURRENT, or what --set gives it.

--ki Y X gives the KI with which INTEGRATE gains Y counts per second at a constant INPUT of X (section 42.3). FILE, or
--ticks with --tick-ms, gives the scan time against which it is checked.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path

from automax_ros.blocks.declaration import Platform
from automax_ros.cli.call_options import add_call_arguments, chosen_calls
from automax_ros.cli.numbers import number, whole_number
from automax_ros.cli.task_files import add_target_arguments, check_task_file, require_clock, target_of
from automax_ros.cli.terminal import print_diagnostics
from automax_ros.cli.usage import UsageError
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.ticks import MAX_TICKS, NS_PER_S, UDC_MAX_TICKS
from automax_ros.language.program import Program
from automax_ros.tuning.dynamic_calls import tuning_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax tune-info``."""
    # argparse before 3.14 takes -1e-3 for an option and asks for a number.
    parser._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)
    parser.add_argument("file", nargs="?", type=Path, metavar="FILE", help="a task (.BLK)")
    add_target_arguments(parser)
    add_call_arguments(parser, required=False)
    parser.add_argument(
        "--ki", nargs=2, type=number, metavar=("Y", "X"), help="KI for Y counts/s at a constant INPUT of X counts"
    )
    parser.add_argument("--ticks", type=whole_number, metavar="N", help="with --ki and no FILE: ticks per scan")
    parser.add_argument("--json", action="store_true", help="print all as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Print what is asked for; 1 if the task has errors."""
    if arguments.ki is None:
        if arguments.ticks is not None:
            raise UsageError("--ticks is for --ki", "a task says itself how many ticks its scan has")
        if arguments.file is None:
            raise UsageError("a FILE is missing", "name a task (.BLK); only --ki Y X does without")
    elif arguments.settings or arguments.block is not None:
        raise UsageError("--ki goes without --block and --set")
    program = None
    if arguments.file is not None:
        if arguments.ticks is not None:
            raise UsageError("--ticks and FILE both tell the scan time", "give one of them")
        program = checked_program(arguments)
        if program is None:
            return 1
    if arguments.ki is not None:
        _print_rate(arguments, program)
    elif program is not None:
        _print_blocks(arguments, program)
    return 0


def checked_program(arguments: argparse.Namespace) -> Program | None:
    """Return the task, None after printing what is wrong with it."""
    source, result = check_task_file(arguments.file, target_of(arguments))
    if result.program is None or has_errors(result.diagnostics):
        print_diagnostics(result.diagnostics, source, sys.stderr)
        return None
    require_clock(arguments.file, result.program)
    return result.program


def _print_blocks(arguments: argparse.Namespace, program: Program) -> None:
    from automax_ros.cli.tune_info_json import task_record
    from automax_ros.cli.tune_info_text import report

    found = [(call, tuning_of(call, program)) for call in chosen_calls(program, arguments)]
    if arguments.json:
        print(json.dumps(task_record(arguments.file, program, found), indent=2, allow_nan=False))
    else:
        sys.stdout.write(report(arguments.file, program, found))


def _print_rate(arguments: argparse.Namespace, program: Program | None) -> None:
    from automax_ros.tuning.integrate_rate import Rate, RateFault

    period_ns = None
    if program is not None:
        period_ns = program.period_ns
    elif arguments.ticks is not None:
        target = target_of(arguments)
        most = UDC_MAX_TICKS if target.processor is Platform.UDC else MAX_TICKS
        if not 1 <= arguments.ticks <= most:
            raise UsageError(f"--ticks {arguments.ticks}: it must be 1 to {most}")
        period_ns = arguments.ticks * target.tick_ns
    elif arguments.tick_ms is not None:
        raise UsageError("--tick-ms needs --ticks or a FILE", "the scan time is ticks x tick")
    y, x = arguments.ki
    try:
        rate = Rate.of(y, x, None if period_ns is None else period_ns / NS_PER_S)
    except RateFault as fault:
        raise UsageError(f"--ki: {fault.message}", fault.hint) from fault
    if arguments.json:
        print(json.dumps(rate.record(), indent=2, allow_nan=False))
    else:
        sys.stdout.write(rate.report())
