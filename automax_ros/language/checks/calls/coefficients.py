"""Checks the coefficients that a CALL gives as constants against limits that depend on the scan period."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from automax_ros.blocks.declare.coefficients import is_within, loose_bounds, range_within
from automax_ros.blocks.declare.declaration import Block, Coefficients, Limit
from automax_ros.language.checks.rules.context import Context
from automax_ros.language.tree.tree import BooleanLiteral, Element, Expression, IntegerLiteral, RealLiteral, Reference

_NUMBERS = (IntegerLiteral, RealLiteral)
_CONSTANTS = (IntegerLiteral, RealLiteral, BooleanLiteral)
LOOP_TIME_MISS = 0.02
"""Share by which a LOOP_TIME may miss a whole number of scan periods without a warning (decision)."""


@dataclass(frozen=True)
class _Sides:
    """The limits of a parameter, None for an unknown one; ``open_text`` has the ranges of variables they depend on."""

    low: float | None
    high: float | None
    open_text: str

    @property
    def crossed(self) -> bool:
        return self.low is not None and self.high is not None and self.low > self.high

    def holds(self, value: float) -> bool:
        high = math.inf if self.high is None else self.high
        return is_within(value, min(-math.inf if self.low is None else self.low, high), high)


def check_coefficients(
    context: Context, block: Block, values: Mapping[str, Expression], given: Collection[str]
) -> None:
    """Report constants outside of their limits at the task's scan period.

    ``given`` are the keywords of the CALL, ``values`` the arguments among them that are valid by themselves.
    A limit that depends on a variable parameter is used where it is loosest; one that depends on a bad constant is not
    checked.
    """
    period = context.period_s
    if block.coefficients is None or period is None:
        return
    known = {name: value for name, value in block.coefficients.defaults(period).items() if name not in given}
    known.update({name: float(item.value) for name, item in values.items() if isinstance(item, _CONSTANTS)})
    ranges: dict[str, tuple[float, float]] = {}
    for limit in block.coefficients.limits:
        value = values.get(limit.parameter)
        if isinstance(value, (Reference, Element)):
            ends = range_within(limit, period, known, *_tuning_range(context, value))
            if ends is not None:
                ranges[limit.parameter] = ends
        if not isinstance(value, _NUMBERS):
            continue
        sides = _sides(limit, period, known, ranges)
        if not sides.holds(value.value):
            if block.coefficients.limits_literals:
                allowed = _allowed_text(sides, "{:g}")
                message = f"{limit.parameter} = {value.value:g} is limited to {allowed} and logged at run time"
                context.report("AMX4098", message, value.span)
            else:
                _report(context, limit, value, sides, period)
            del known[limit.parameter]
    _check_relation(context, block, values, known)
    if block.coefficients.executed_every in known:
        _check_own_period(context, block.coefficients, values[block.coefficients.executed_every], period)


def _sides(
    limit: Limit, period: float, known: Mapping[str, float], ranges: Mapping[str, tuple[float, float]]
) -> _Sides:
    low, high = loose_bounds(limit, period, known, ranges)
    left = [f"{name} {_range_text(*ranges[name])}" for name in limit.uses if name in ranges]
    return _Sides(low, high, "".join(f", {text}" for text in left))


def _tuning_range(context: Context, variable: Reference | Element) -> tuple[float, float]:
    """Return the range of a variable: LOW and HIGH of a tunable."""
    symbol = context.symbols.get(variable.name)
    tuning = None if symbol is None else symbol.tuning
    if tuning is None or isinstance(tuning.low, str) or isinstance(tuning.high, str):
        return -math.inf, math.inf
    return float(tuning.low), float(tuning.high)


def _range_text(low: float, high: float) -> str:
    return f"{low:.7g}" if low == high else f"{low:.7g} to {high:.7g}"


def _check_relation(
    context: Context, block: Block, values: Mapping[str, Expression], known: Mapping[str, float]
) -> None:
    """Report constants that break the relation between them; ``known`` are those within their limits."""
    assert block.coefficients is not None
    relation = block.coefficients.relation
    if relation is None or not all(name in known for name in relation.parameters) or relation.holds(known):
        return
    last = next((values[name] for name in reversed(relation.parameters) if name in values), None)
    if last is None:
        return
    found = " and ".join(f"{name} = {known[name]:.7g}" for name in relation.parameters)
    message = f"{block.name}: {relation.text}: {found}"
    if block.coefficients.limits_literals:
        context.report("AMX4098", message, last.span, "it is logged at run time")
    else:
        context.report("AMX4084", message, last.span, "choose others; `automax blocks` tells the rule of the block")


def _check_own_period(context: Context, declared: Coefficients, given: Expression, period: float) -> None:
    """Warn of an impossible time between executions: the block runs in each scan or each n-th (50)."""
    if not isinstance(given, RealLiteral) or any("EVENT" in call.arguments for call in context.calls.values()):
        return
    scans = max(1, round(given.value / period)) if given.value < 1e6 * period else 0
    if scans == 0 or abs(given.value - scans * period) <= LOOP_TIME_MISS * given.value:
        return
    name, scan = declared.executed_every, f"{period * 1000.0:g} ms"
    message = f"{name} = {given.value:.7g} s is {given.value / period:.4g} scan periods of {scan}"
    least = max(limit.low(period, {}) for limit in declared.limits if limit.parameter == name)
    while not is_within(scans * period, least, math.inf):
        scans += 1
    hint = f"write {scans * period:.7g} if the block runs in every{'' if scans == 1 else f' {_ordinal(scans)}'} scan"
    context.report("AMX4099", message, given.span, hint)


def _ordinal(number: int) -> str:
    """Return a number as 2nd, 3rd, 4th, 11th, 21st ..."""
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"


def _report(context: Context, limit: Limit, value: IntegerLiteral | RealLiteral, sides: _Sides, period: float) -> None:
    name, now = limit.parameter, f"T = {period * 1000.0:g} ms"
    if sides.crossed:
        message = (
            f"{name} = {value.value:.7g} is not possible: its high limit {sides.high:.7g} ({limit.high_text})"
            f" lies below its low limit {sides.low:.7g} ({limit.low_text}), {now}"
        )
        hint = f"at this scan period hardly any {name} is possible: TICKS is too large"
        context.report("AMX4084", message, value.span, hint)
        return
    above = sides.high is not None and value.value > sides.high
    side, bound = ("above its high", sides.high) if above else ("below its low", sides.low)
    formula = limit.high_text if above else limit.low_text
    message = f"{name} = {value.value:.7g} is {side} limit {bound:.7g} ({formula}, {now}{sides.open_text})"
    hint = f"it may be {_allowed_text(sides, '{:.7g}')} at this scan period"
    context.report("AMX4084", message, value.span, hint)


def _allowed_text(sides: _Sides, number: str) -> str:
    low, high = sides.low, sides.high
    if low is None or high is None:
        return f"at most {number.format(high)}" if low is None else f"at least {number.format(low)}"
    return f"{number.format(min(low, high))} to {number.format(high)}"
