"""Coefficients of the dynamic blocks: mapping constant, limits, range of the integrator (sections 41 to 51).

Also the limits where not every parameter that they read is known, and the parameters that several dynamic blocks share.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import product

from automax_ros.blocks.declare.declaration import Block, Bound, Coefficients, Form, Input, Limit, Output
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType

TWO_TO_MINUS_18 = 2.0**-18
LARGEST_HISTORY = 2.0**31
"""A filter of second order or more whose history leaves 32 bits starts again from the edge of 16 bits (decision).
No signal comes near it, but coefficients that change continually can make such a filter grow without bound."""


Ends = tuple[float, float]
"""The lowest and the highest value of a parameter."""
WM = Input("WM", DataType.REAL, "WM", "mapping frequency in rad/s, (2 pi / T) / 20 unless given", form=Form.LITERAL)
RESET = Input.boolean("RESET", "R", "TRUE holds OUTPUT at INITIAL_VALUE", default=False)
SATURATED = (
    Output("SATURATED_PLUS", DataType.BOOLEAN, "SP", "TRUE if OUTPUT reaches LIMIT_PLUS", required=False),
    Output("SATURATED_MINUS", DataType.BOOLEAN, "SM", "TRUE if OUTPUT reaches LIMIT_MINUS", required=False),
)


def default_wm(period_s: float) -> float:
    """Return the mapping frequency in rad/s where none is given: the scan frequency (2 pi / T) over 20."""
    return math.pi / (10.0 * period_s)


def mapping_default(period_s: float) -> dict[str, float]:
    """Return the default of WM, for ``Coefficients.defaults``."""
    return {"WM": default_wm(period_s)}


def mapping_constant(wm: float, period_s: float) -> float:
    """Return C = wm / tan(wm T / 2) in 1/s, for the bilinear mapping s = C (z - 1)/(z + 1)."""
    return wm / math.tan(wm * period_s / 2.0)


def no_defaults(_period_s: float) -> dict[str, float]:
    """Return no defaults, for ``Coefficients.defaults``."""
    return {}


def order_default(order: int) -> Callable[[float], dict[str, float]]:
    """Return the function that gives the default of ORDER, for ``Coefficients.defaults``."""
    return lambda _period_s: {"ORDER": float(order)}


def constant(value: float) -> Bound:
    """Return a limit that depends on nothing."""
    return lambda _period_s, _values: value


def per_period(factor: float) -> Bound:
    """Return the limit factor / T."""
    return lambda period_s, _values: factor / period_s


def by_order(factors: Mapping[int, float]) -> Bound:
    """Return the limit factor / T with the factor for ORDER; the Limit ``uses`` ORDER."""
    return lambda period_s, values: factors[int(values["ORDER"])] / period_s


def times_c(factor: float) -> Bound:
    """Return the limit factor x C, with C of the WM in force; the Limit ``uses`` WM."""
    return lambda period_s, values: factor * mapping_constant(values["WM"], period_s)


def integrator_range(coefficient: float) -> float:
    """Return the limit of an integrator's magnitude in counts by the size of its coefficient Kx (section 51)."""
    if coefficient < 0.125:
        return 8191.0
    return 16383.0 if coefficient < 0.25 else 32767.0


def is_within(value: float, low: float, high: float) -> bool:
    """Return whether a REAL lies within limits, both allowed.

    A REAL holds 24 bits, so the REAL nearest to a limit counts as the limit (decision): WM=0.01 is not below 0.01.
    """
    return low <= value <= high or value in (stored_real(low)[0], stored_real(high)[0])


def limited(declared: Coefficients, period_s: float, given: Mapping[str, float]) -> tuple[dict[str, float], list[str]]:
    """Return the parameters in force and the names of those that had to be moved to a limit.

    ``given`` are the parameters that the CALL programs; the others come from the declaration's defaults.
    A limit that reads a parameter sees its limited value: the order of ``limits`` counts. Only a given parameter is
    limited, not a default (decision): 42.1 bounds WM by 0.01 rad/s, the default falls below it at periods over 31 s.
    """
    values = {**declared.defaults(period_s), **given}
    moved = []
    for limit in declared.limits:
        if limit.parameter not in given:
            continue
        low, high = bounds_of(limit, period_s, values)
        value = values[limit.parameter]
        if not is_within(value, low, high):
            values[limit.parameter] = high if value > high else low
            moved.append(limit.parameter)
    return values, moved


def bounds_of(limit: Limit, period_s: float, values: Mapping[str, float]) -> tuple[float, float]:
    """Return the limits as numbers; where they cross, at scans of a minute and more, the high one wins (decision)."""
    high = limit.high(period_s, values)
    return min(limit.low(period_s, values), high), high


def evaluate(block: Block, period_s: float, given: Mapping[str, float]) -> tuple[tuple[float, ...], bool]:
    """Return the coefficients of a block in the order of their names, and whether a parameter was out of limits."""
    results, _, bits = evaluate_noting(block, period_s, given)
    return results, bool(bits)


def evaluate_noting(
    block: Block, period_s: float, given: Mapping[str, float], kept: tuple[float, ...] = ()
) -> tuple[tuple[float, ...], tuple[float, ...], int]:
    """Return the coefficients, the parameters to keep for the next evaluation, and a number with bits for what was out.

    There is a bit for each limit, in their order, that a parameter had to be moved to, and one for the relation; so a
    second parameter that leaves its limits is noticed while the first is still beyond its own. ``kept`` are the
    parameters that the last evaluation returned: those of the relation, 0 as long as there was none. While a variable
    breaks the relation, the last pair that kept it stays in force (decision).
    """
    declared = block.coefficients
    if declared is None:
        return (), (), 0
    values, moved = limited(declared, period_s, given)
    bits = sum(1 << number for number, limit in enumerate(declared.limits) if limit.parameter in moved)
    relation = declared.relation
    if relation is None:
        return declared.compute(period_s, values), (), bits
    if not relation.holds(values):
        bits |= 1 << len(declared.limits)
        last_good = dict(zip(relation.parameters, kept, strict=True)) if any(kept) else relation.first(period_s, values)
        values = {**values, **last_good}
    keep = tuple(float(values[name]) for name in relation.parameters)
    return declared.compute(period_s, values), keep, bits


def loose_bounds(
    limit: Limit, period_s: float, values: Mapping[str, float], ranges: Mapping[str, tuple[float, float]]
) -> tuple[float | None, float | None]:
    """Return the loosest limits of a parameter, for all values of the parameters that are known only by ``ranges``.

    A bound that reads one of these is computed at both ends of its range, and the loosest counts; every bound is
    monotonic in a parameter. One that reads a parameter of which nothing is known is None.
    """
    open_ones = [name for name in limit.uses if name not in values and name in ranges]
    corners = [
        {**values, **dict(zip(open_ones, ends, strict=True))} for ends in product(*(ranges[name] for name in open_ones))
    ]
    lows = [bound_now(limit.low, period_s, corner) for corner in corners]
    highs = [bound_now(limit.high, period_s, corner) for corner in corners]
    low = min((value for value in lows if value is not None), default=None)
    return low, max((value for value in highs if value is not None), default=None)


def range_within(limit: Limit, period_s: float, values: Mapping[str, float], low: float, high: float) -> Ends | None:
    """Return the values in force of a parameter that moves between ``low`` and ``high``, None where none are known."""
    least, most = loose_bounds(limit, period_s, values, {})
    if least is None or most is None:
        return None
    return min(max(low, least), most), min(max(high, least), most)


def bound_now(bound: Bound, scan_s: float, values: Mapping[str, float]) -> float | None:
    """Return a limit as a number, None where it needs an unknown parameter or has no meaning."""
    try:
        return bound(scan_s, values)
    except (KeyError, ArithmeticError, ValueError):
        return None
