"""The text that ``automax tune-info`` prints."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.values import source_text
from automax_ros.language.program import Program
from automax_ros.tuning.dynamic_calls import DynamicCall, Parameter, Source
from automax_ros.tuning.transfer_text import digits_for, discrete_text, gain_text, number_text
from automax_ros.tuning.tuning import Corner, LimitNow, LimitVerdict, Tuning

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
Found = Sequence[tuple[DynamicCall, Tuning]]
Rows = Iterator[tuple[str, str]]


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
