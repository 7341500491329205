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
import textwrap
from collections.abc import Iterator, Sequence
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
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.ticks import MAX_TICKS, NS_PER_MS, NS_PER_S, UDC_MAX_TICKS
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import source_text
from automax_ros.language.program import Program
from automax_ros.tuning.dynamic_calls import DynamicCall, Parameter, Source, tuning_of
from automax_ros.tuning.frequency import decibels
from automax_ros.tuning.transfer_text import digits_for, discrete_text, gain_text, number_text
from automax_ros.tuning.tuning import Corner, LimitNow, LimitVerdict, Tuning

Found = Sequence[tuple[DynamicCall, Tuning]]


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


_LABEL = 12
_WIDTH = 106
_JOINED = "\u00a0"
"""A blank at which lines are not wrapped."""
_HINTS = {
    LimitVerdict.NEAR_LOW: "! within 10 % of the low limit",
    LimitVerdict.NEAR_HIGH: "! within 10 % of the high limit",
    LimitVerdict.BELOW: "! too low: the limit is in force and AMX7004 is logged",
    LimitVerdict.ABOVE: "! too high: the limit is in force and AMX7004 is logged",
}


def report(path: Path, program: Program, found: Found) -> str:
    """Return the report on all dynamic blocks of a task."""
    if not found:
        return f"{path}: no dynamic block (sections 36 and 41 to 50)\n"
    parts = [heading(path, program), *(_block(call, tuning, program) for call, tuning in found)]
    return "\n".join(parts)


def heading(path: Path, program: Program) -> str:
    """Return the scan time and the frequencies that follow from it."""
    period_s = program.period_ns / 1e9
    text = (
        f"{path}: T = {program.ticks} x {program.tick_ns / NS_PER_MS:g} ms = {period_s * 1e3:g} ms,"
        f" scan frequency {frequency_text(2.0 * math.pi / period_s)}, Nyquist {frequency_text(math.pi / period_s)}\n"
    )
    if program.event is not None:
        text += (
            f"The event {program.event} starts the scan: all holds only where it comes every {period_s * 1e3:g} ms.\n"
        )
    return text


def frequency_text(rad_s: float) -> str:
    """Return a frequency in both units."""
    return f"{number_text(rad_s, 5)} rad/s = {number_text(rad_s / (2.0 * math.pi), 4)} Hz"


def _block(call: DynamicCall, tuning: Tuning, program: Program) -> str:
    lines = [f"{call.title}   (section {call.block.section})"]
    rows = [
        *_inside(call, tuning),
        *_values(call, tuning),
        *_functions(tuning, call),
        *_corners(tuning),
        *_range(tuning),
    ]
    rows += [*_limits(call, tuning), *_ratio(tuning), *_period(tuning, program)]
    last = ""
    for label, text in rows:
        lines.append(f"  {(label if label != last else '').ljust(_LABEL)}{text}".rstrip())
        last = label
    return "\n".join(lines) + "\n"


Rows = Iterator[tuple[str, str]]


def _inside(call: DynamicCall, tuning: Tuning) -> Rows:
    if call.inside:
        own_period = tuning.declared.executed_every
        every = f"every {own_period}" if own_period else "in every scan"
        article = "an" if call.inside == "IF" else "a"
        yield "inside", f"! {article} {call.inside}: all holds only where the CALL runs once {every}"


def _values(call: DynamicCall, tuning: Tuning) -> Rows:
    """Yield the variables of a block with their values and where these come from."""
    for name in call.coefficients:
        given = call.parameters[name]
        if not given.variable:
            continue
        if given.value is None:
            yield "values", f"{name} = {given.variable}, 0 at first: give --set {given.variable}=VALUE"
        else:
            what = "its CURRENT" if given.source is Source.TUNABLE else "as set"
            yield "values", f"{name} = {given.variable} = {source_text(given.value)}, {what}"
    if tuning.missing:
        yield "values", "limits follow; function, corners and range need the values"


def _functions(tuning: Tuning, call: DynamicCall) -> Rows:
    transfer = tuning.transfer
    if transfer is None:
        return
    digits = digits_for(tuning)
    yield "Laplace", tuning.laplace
    above, below = discrete_text(transfer, digits)
    if len(above) + len(below) > _WIDTH - 8:
        yield "discrete", f"({above})"
        yield "discrete", f"/ ({below})"
    else:
        yield "discrete", above if below == "1" else f"({above}) / ({below})"
    yield "as run", tuning.equation
    for line in textwrap.wrap(_coefficients(tuning, digits), _WIDTH):
        yield "as run", line.replace(_JOINED, " ")
    if transfer.mapping is not None:
        yield "mapping", f"C = {number_text(transfer.mapping, 7)}/s, {_exact_at(tuning, call)}"
    else:
        period = f"{tuning.declared.period_name} = {tuning.period_s:.7g} s"
        yield "mapping", f"steps of {period}: {tuning.declared.dynamics.steps}"


def _coefficients(tuning: Tuning, digits: int) -> str:
    """Return the coefficients that the block uses at its order."""
    order = tuning.values.get("ORDER", 9.0)
    shown = {name: value for name, value in tuning.coefficients.items() if name != "span"}
    return ", ".join(
        f"{name}{_JOINED}{number_text(value, digits)}"
        for name, value in shown.items()
        if not name[-1].isdigit() or int(name[-1]) <= order
    )


def _exact_at(tuning: Tuning, call: DynamicCall) -> str:
    """Return the frequency at which the discrete function equals the Laplace function."""
    own = tuning.declared.dynamics.exact_at
    if not own:
        return "2 / T: plain bilinear"
    if own in (corner.name for corner in tuning.corners):
        return f"exact at {own} itself"
    source = "" if own in call.parameters else ", the default: 1/20 of the scan frequency"
    return f"exact at {own} = {frequency_text(tuning.values[own])}{source}"


def _corners(tuning: Tuning) -> Rows:
    width = max((len(corner.name) for corner in tuning.corners), default=0)
    for corner in tuning.corners:
        time = f", 1/w = {number_text(corner.time_constant_s, 4)} s" if tuning.declared.dynamics.time_constants else ""
        yield "corner", f"{corner.name.ljust(width)}  {frequency_text(corner.rad_s)}{time}"
        if corner.discrete is None:
            yield "corner", f"{' ' * width}  ! above the Nyquist frequency"
            continue
        gains = f"Laplace {gain_text(corner.laplace)}, discrete {gain_text(corner.discrete)}"
        yield "corner", f"{' ' * width}  {gains}{_mapped_text(corner)}"


def _mapped_text(corner: Corner) -> str:
    if corner.warping is None or corner.mapped_rad_s is None or abs(corner.warping) < 5e-5:
        return ""
    return f"; mapped to {number_text(corner.mapped_rad_s, 5)} rad/s ({corner.warping * 100.0:+.2f} %)"


def _range(tuning: Tuning) -> Rows:
    found, declared = tuning.integrator, tuning.declared.dynamics.integrator
    if found is None or declared is None:
        return
    yield (
        "range",
        f"Kx = {found.formula} = {number_text(found.kx)}: {declared.what} goes to +-{found.counts} (section 51)",
    )
    if found.near_edge is not None:
        yield "range", f"! Kx is within 10 % of {found.near_edge:g}, where the range changes"
    if declared.in_feedback and found.counts < INT16_MAX:
        yield (
            "range",
            f"an INPUT of {INT16_MAX} settles at {INT16_MAX} - {found.counts} = {INT16_MAX - found.counts}, not at 0",
        )


def _limits(call: DynamicCall, tuning: Tuning) -> Rows:
    order = tuning.values.get("ORDER")
    rows = [_limit_cells(item, call.parameters.get(item.parameter), order) for item in tuning.limits]
    widths = [max(len(row[column]) for row in rows) for column in range(5)]
    for row in rows:
        name, value, low, high, formulas, hint = row
        yield (
            "limits",
            f"{name.ljust(widths[0])}  {value.ljust(widths[1])}  {low.rjust(widths[2])} .. {high.ljust(widths[3])}"
            f"  {formulas.ljust(widths[4])}  {hint}".rstrip(),
        )


def _limit_cells(limit: LimitNow, given: Parameter | None, order: float | None) -> tuple[str, str, str, str, str, str]:
    value = "?" if limit.value is None else number_text(limit.value, 7)
    hint = "" if limit.given else "default"
    if given is not None:
        hint = _HINTS.get(limit.verdict, "")
    if limit.crossed:
        hint = "! hardly any value is possible: TICKS is too large"
    return (
        limit.parameter,
        value,
        limit.low_text if limit.low is None else number_text(limit.low),
        limit.high_text if limit.high is None else number_text(limit.high),
        _formulas(limit, order),
        hint,
    )


def _formulas(limit: LimitNow, order: float | None) -> str:
    """Return the formulas of a limit, empty if they are plain numbers; of formulas by ORDER, the one that applies."""
    low = limit.low_text
    if not any(text.count("T") or text.count("C") for text in (low, limit.high_text)):
        return ""
    formulas, by_order, _ = low.partition(" by ORDER")
    if by_order and order is not None:
        choices = formulas.replace(" or ", ", ").split(", ")
        low = choices[int(order) - 1 if len(choices) == 3 else int(order) // 2 - 1]
    return f"({low} .. {limit.high_text})"


def _ratio(tuning: Tuning) -> Rows:
    found = tuning.ratio
    if found is None:
        return
    hints = {
        LimitVerdict.NEAR_LOW: f"  ! within 10 % of {found.low:g}:1",
        LimitVerdict.NEAR_HIGH: f"  ! within 10 % of {found.high:g}:1",
        LimitVerdict.BELOW: f"  ! beyond: {found.parameters[0]} is moved at first, and AMX7004 is logged",
        LimitVerdict.ABOVE: f"  ! beyond: {found.parameters[0]} is moved at first, and AMX7004 is logged",
    }
    names = " and ".join(found.parameters)
    hint = hints.get(found.verdict, "")
    yield "ratio", f"{number_text(found.value, 5)}:1 of {names}, {found.low:g}:1 .. {found.high:g}:1{hint}"


def _period(tuning: Tuning, program: Program) -> Rows:
    """Yield the time between executions of a block that has it as a parameter."""
    name = tuning.declared.executed_every
    if not name:
        return
    scans = tuning.period_s / tuning.scan_s
    every = round(scans)
    text = f"{tuning.period_s:.7g} s = {number_text(scans, 5)} x the scan of {program.period_ns / NS_PER_MS:g} ms"
    if every < 1 or abs(scans - every) > 0.02 * scans:
        text += "  ! no whole number of scans"
    elif every > 1:
        text += f": the CALL must run in one scan of {every} only"
    yield name, text
