"""Checks of the coefficients that a CALL gives as constants against limits that depend on the scan period."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from automax_ros.blocks.coefficients import is_within
from automax_ros.blocks.declaration import Block, Limit
from automax_ros.language.check_context import Context
from automax_ros.language.tree import BooleanLiteral, Expression, IntegerLiteral, RealLiteral

_NUMBERS = (IntegerLiteral, RealLiteral)
_CONSTANTS = (IntegerLiteral, RealLiteral, BooleanLiteral)
LOOP_TIME_MISS = 0.02
"""How far a LOOP_TIME may lie off a whole number of scan periods, as a share of it, without a warning (decision)."""


def check_coefficients(
    context: Context, block: Block, values: Mapping[str, Expression], given: Collection[str]
) -> None:
    """Report constants outside of their limits at the task's scan period.

    ``given`` are the keywords of the CALL, ``values`` the arguments among them that are good as such.
    A limit that reads other parameters is checked only where these are constants too, or defaulted, and good.
    """
    period = context.period_s
    if block.coefficients is None or period is None:
        return
    known = {name: value for name, value in block.coefficients.defaults(period).items() if name not in given}
    known.update({name: float(item.value) for name, item in values.items() if isinstance(item, _CONSTANTS)})
    for limit in block.coefficients.limits:
        value = values.get(limit.parameter)
        if not isinstance(value, _NUMBERS) or not all(name in known for name in limit.uses):
            continue
        bounds = _bounds(limit, period, known)
        if bounds is not None and not is_within(value.value, *bounds):
            if block.coefficients.limits_literals:
                _report_limited(context, limit, value, bounds)
            else:
                _report(context, limit, value, bounds, period)
            del known[limit.parameter]
    _check_relation(context, block, values, known)
    if block.coefficients.executed_every in known:
        _check_loop_time(context, values[block.coefficients.executed_every], period)


def _check_relation(
    context: Context, block: Block, values: Mapping[str, Expression], known: Mapping[str, float]
) -> None:
    """Report constants that break the relation between them; ``known`` has those within their limits."""
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


def _check_loop_time(context: Context, given: Expression, period: float) -> None:
    """Warn of a time between executions that cannot be: the block runs in each scan or each n-th (50)."""
    if not isinstance(given, RealLiteral) or any("EVENT" in call.arguments for call in context.calls.values()):
        return
    scans = max(1, round(given.value / period)) if given.value < 1e6 * period else 0
    if scans == 0 or abs(given.value - scans * period) <= LOOP_TIME_MISS * given.value:
        return
    message = f"LOOP_TIME = {given.value:.7g} s is {given.value / period:.4g} scan periods of {period * 1000.0:g} ms"
    hint = f"write {scans * period:.7g} if the block runs in every{'' if scans == 1 else f' {scans}th'} scan"
    context.report("AMX4099", message, given.span, hint)


def _bounds(limit: Limit, period: float, values: dict[str, float]) -> tuple[float, float] | None:
    """Return the limits as numbers, None where a parameter without limits of its own makes them no numbers."""
    try:
        return limit.low(period, values), limit.high(period, values)
    except (ArithmeticError, ValueError):
        return None


def _report_limited(
    context: Context, limit: Limit, value: IntegerLiteral | RealLiteral, bounds: tuple[float, float]
) -> None:
    message = f"{limit.parameter} = {value.value:g} is limited to {bounds[0]:g} to {bounds[1]:g} and logged at run time"
    context.report("AMX4098", message, value.span)


def _report(
    context: Context, limit: Limit, value: IntegerLiteral | RealLiteral, bounds: tuple[float, float], period: float
) -> None:
    above = value.value > bounds[1]
    side, bound = ("above its high", bounds[1]) if above else ("below its low", bounds[0])
    formula = limit.high_text if above else limit.low_text
    message = (
        f"{limit.parameter} = {value.value:.7g} is {side} limit {bound:.7g} ({formula}, T = {period * 1000.0:g} ms)"
    )
    context.report("AMX4084", message, value.span, f"it may be {bounds[0]:.7g} to {bounds[1]:.7g} at this scan period")
