"""Where two courses differ: each value holds until the next one, so the result is exact whatever the rates of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from automax_ros.comparison.courses import Course, Times, Values
from automax_ros.core.ticks import NS_PER_S


@dataclass(frozen=True)
class Apart:
    """Two values at one instant of the common axis, s; not a number where a recording has none."""

    time_s: float
    before: float
    after: float

    @property
    def difference(self) -> float:
        """The second value less the first."""
        return self.after - self.before


@dataclass(frozen=True)
class Difference:
    """How two courses differ: ``greatest`` and ``first`` are None where they do not, ``apart_s`` is for how long.

    ``greatest`` is the first instant with the greatest difference. A number and what is not a number differ most.
    """

    greatest: Apart | None
    first: Apart | None
    apart_s: float


def both(before: Course, after: Course, start_ns: int, end_ns: int) -> tuple[Times, Values, Values]:
    """Return the instants of a range at which one of two courses changes, and what both are from then on.

    It begins where both are known; the end of the range is part of it. Nothing where they never are both known.
    """
    parts = before.between(start_ns, end_ns), after.between(start_ns, end_ns)
    if not len(parts[0].times) or not len(parts[1].times):
        return np.empty(0, np.int64), np.empty(0), np.empty(0)
    times = np.union1d(parts[0].times, parts[1].times)
    times = times[times >= max(parts[0].times[0], parts[1].times[0])]
    return times, parts[0].at(times), parts[1].at(times)


def difference(before: Course, after: Course, start_ns: int, end_ns: int, tolerance: float) -> Difference | None:
    """Return how two courses on one axis differ in a range, in which both hold to its end.

    Numbers that differ by at most ``tolerance`` are equal: where courses are in a unit, that is decided on the counts
    that memory held, and the values told are those of the unit. None where the two are never both known.
    """
    times, one, two = both(before.in_memory, after.in_memory, start_ns, end_ns)
    if not len(times):
        return None
    distance, differs = _distance(one, two, tolerance)
    if not differs.any():
        return Difference(None, None, 0.0)
    first, greatest = int(np.argmax(differs)), int(np.argmax(distance))
    lengths = np.diff(times, append=max(end_ns, int(times[-1])))
    found = [
        Apart(int(at) / NS_PER_S, before.value_at(int(at)), after.value_at(int(at)))
        for at in (times[greatest], times[first])
    ]
    return Difference(found[0], found[1], int(lengths[differs].sum()) / NS_PER_S)


def _distance(one: Values, two: Values, tolerance: float) -> tuple[Values, NDArray[np.bool_]]:
    """Return how far apart values are, and whether that counts."""
    with np.errstate(invalid="ignore"):  # infinite less infinite
        distance = np.abs(two - one)
    same = (one == two) | (np.isnan(one) & np.isnan(two))
    distance = np.where(same, 0.0, np.where(np.isnan(distance), np.inf, distance))
    return distance, distance > tolerance
