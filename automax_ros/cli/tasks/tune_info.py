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
import math
import re
import sys
from pathlib import Path

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.cli.options.task import (
    add_call_arguments,
    add_target_arguments,
    check_task_file,
    chosen_calls,
    require_clock,
    target_of,
)
from automax_ros.cli.options.values import naming, number, whole_number
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.cli.tasks.tune_info_text import Found, report
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.ticks import MAX_TICKS, NS_PER_MS, NS_PER_S, UDC_MAX_TICKS
from automax_ros.core.user_error import UsageError
from automax_ros.language.program import Program
from automax_ros.tuning.dynamic_calls import DynamicCall, Source, tuning_of
from automax_ros.tuning.frequency import decibels
from automax_ros.tuning.tuning import Corner, LimitNow, Tuning


def task_record(path: Path, program: Program, found: Found) -> dict[str, object]:
    """Return the record of a task: frequencies in rad/s and Hz, times in s."""
    period_s = program.period_ns / NS_PER_S
    return {
        "file": str(path),
        "task": program.name,
        "target": program.target,
        "ticks": program.ticks,
        "tick_ms": program.tick_ns / NS_PER_MS,
        "period_s": period_s,
        "nyquist_rad_s": math.pi / period_s,
        "nyquist_hz": 0.5 / period_s,
        "blocks": [block_record(call, tuning) for call, tuning in found],
    }


def block_record(call: DynamicCall, tuning: Tuning) -> dict[str, object]:
    """Return the record of one block."""
    transfer, integrator, ratio = tuning.transfer, tuning.integrator, tuning.ratio
    return {
        "line": call.label,
        "block": call.block.name,
        "section": call.block.section,
        "output": call.output,
        "inside": call.inside or None,
        "period_s": tuning.period_s,
        "parameters": _parameters(call, tuning),
        "missing": list(tuning.missing),
        "laplace": None
        if transfer is None
        else {
            "text": tuning.laplace,
            "numerator": list(transfer.numerator),
            "denominator": list(transfer.denominator),
        },
        "discrete": None if transfer is None else {"b": list(transfer.b), "a": list(transfer.a)},
        "coefficients": dict(tuning.coefficients),
        "mapping_c": None if transfer is None else transfer.mapping,
        "corners": [_corner(item) for item in tuning.corners],
        "integrator": None
        if integrator is None
        else {
            "kx": integrator.kx,
            "formula": integrator.formula,
            "range_counts": integrator.counts,
            "near_edge": integrator.near_edge,
        },
        "limits": [_limit(item) for item in tuning.limits],
        "ratio": None
        if ratio is None
        else {"value": ratio.value, "low": ratio.low, "high": ratio.high, "verdict": ratio.verdict.value},
    }


def _parameters(call: DynamicCall, tuning: Tuning) -> dict[str, object]:
    declared = call.block.coefficients
    assert declared is not None
    found: dict[str, object] = {}
    for name in declared.parameters:
        given = call.parameters.get(name)
        found[name] = {
            "value": tuning.values.get(name) if given is None else call.coefficients[name],
            "in_force": tuning.values.get(name),
            "source": (Source.DEFAULT if given is None else given.source).value,
            "variable": None if given is None or not given.variable else given.variable,
        }
    return found


def _corner(corner: Corner) -> dict[str, object]:
    return {
        "name": corner.name,
        "rad_s": corner.rad_s,
        "hz": corner.hz,
        "time_constant_s": corner.time_constant_s,
        "laplace_db": decibels(corner.laplace),
        "laplace_deg": degrees_of(corner.laplace),
        "discrete_db": None if corner.discrete is None else decibels(corner.discrete),
        "discrete_deg": degrees_of(corner.discrete),
        "mapped_rad_s": corner.mapped_rad_s,
        "warping": corner.warping,
    }


def _limit(limit: LimitNow) -> dict[str, object]:
    return {
        "parameter": limit.parameter,
        "value": limit.value,
        "given": limit.given,
        "low": limit.low,
        "high": limit.high,
        "low_formula": limit.low_text,
        "high_formula": limit.high_text,
        "verdict": limit.verdict.value,
    }


def degrees_of(gain: complex | None) -> float | None:
    """Return the phase of a gain in degrees, None for 0."""
    return math.degrees(math.atan2(gain.imag, gain.real)) if gain else None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax tune-info``."""
    # argparse before 3.14 mistakes -1e-3 for an option and reports a missing number.
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
    """Print the blocks or the KI; 1 if the task has errors."""
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
            raise UsageError("--ticks and FILE both give the scan time", "give one of them")
        program = checked_program(arguments)
        if program is None:
            return 1
    if arguments.ki is not None:
        _print_rate(arguments, program)
    elif program is not None:
        found = [(call, tuning_of(call, program)) for call in chosen_calls(program, arguments)]
        if arguments.json:
            print(json.dumps(task_record(arguments.file, program, found), indent=2, allow_nan=False))
        else:
            sys.stdout.write(report(arguments.file, program, found))
    return 0


def checked_program(arguments: argparse.Namespace) -> Program | None:
    """Return the checked task; if it has errors, print them and return None."""
    source, result = check_task_file(arguments.file, target_of(arguments))
    if result.program is None or has_errors(result.diagnostics):
        print_diagnostics(result.diagnostics, source, sys.stderr)
        return None
    require_clock(arguments.file, result.program)
    return result.program


def _print_rate(arguments: argparse.Namespace, program: Program | None) -> None:
    from automax_ros.tuning.integrate_rate import Rate

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
    with naming("--ki"):
        rate = Rate.of(y, x, None if period_ns is None else period_ns / NS_PER_S)
    if arguments.json:
        print(json.dumps(rate.record(), indent=2, allow_nan=False))
    else:
        sys.stdout.write(rate.report())
