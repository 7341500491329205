"""Limits of coefficients where not every parameter that they read is known."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

from automax_ros.blocks.declaration import Bound, Limit

Ends = tuple[float, float]
"""The lowest and the highest value of a parameter."""


def loose_bounds(
    limit: Limit, period_s: float, values: Mapping[str, float], ranges: Mapping[str, tuple[float, float]]
) -> tuple[float | None, float | None]:
    """Return what no value of a parameter may pass, whatever those parameters are that only ``ranges`` tells of.

    A bound that reads one of these is taken at both ends of its range, and the loosest counts; every bound goes one way
    as a parameter rises. One that reads a parameter of which nothing is known is None.
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
    """Return a limit as a number, None where it needs a parameter that is not known, or has no meaning."""
    try:
        return bound(scan_s, values)
    except (KeyError, ArithmeticError, ValueError):
        return None
