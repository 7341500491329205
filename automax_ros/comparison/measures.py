"""How one variable responds to a step: rise time, overshoot, settling time, integral of the absolute error.

Definitions (decision), for a response y, a reference r and the part of the run that is measured:

- the step begins when r first changes there; at the start of that part where r is a constant or does not change;
- it goes from y just before that to the last value of r, without a reference to the last value of y;
- rise time: from the first instant at which y has 10 % of the step to the first with 90 %;
- overshoot: how far y goes beyond the step's end, % of the step;
- settling time: from the step on, until y stays within the band around the step's end, ``band_percent`` of the step;
- integral of the absolute error: of abs(y - r) over time, from the step to the end; none without a reference.

Without a reference only a step between two steady values has a response: one that is steady before the step, has
settled long before the end and never goes beyond its end by more than the step, as no damped response does (decision).

What does not happen is None, and so is all but the integral where the step is 0.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite

import numpy as np

from automax_ros.comparison.courses import Course, Times
from automax_ros.comparison.differences import both
from automax_ros.core.ticks import NS_PER_S
from automax_ros.sweep.functions import Accumulator, Overshoot, Rise, Settle

BAND_PERCENT = 2.0
"""Half of the width of the band in which a response has settled, % of the step, unless another one is given."""
_STEADY_SHARE = 0.9
"""By this share of the time that is measured a response must have settled to be step-like (decision)."""
_MOST_OVERSHOOT = 100.0
"""Overshoot of a response without any damping, %."""


@dataclass(frozen=True)
class Measures:
    """The numbers of one response: times in s, overshoot in % of the step, integral in the variable's unit times s."""

    rise_s: float | None = None
    overshoot_percent: float | None = None
    settling_s: float | None = None
    error_integral: float | None = None

    def less(self, other: Measures) -> Measures:
        """Return the change from another response: each number less its own, None where one of both is missing."""
        pairs = {item.name: (getattr(self, item.name), getattr(other, item.name)) for item in fields(self)}
        return Measures(
            **{name: None if own is None or its is None else own - its for name, (own, its) in pairs.items()}
        )


@dataclass(frozen=True)
class Response:
    """One response: when its step begins on the common axis, s, from where to where it goes, and its measures."""

    step_s: float
    start: float
    target: float
    measures: Measures


def response(
    course: Course, reference: Course | float | None, start_ns: int, end_ns: int, band_percent: float = BAND_PERCENT
) -> Response | None:
    """Return how a course responds from ``start_ns`` to ``end_ns``; None where it, or its reference, is not known."""
    if end_ns <= start_ns:
        return None
    step_ns = _step_time(reference, start_ns, end_ns) if isinstance(reference, Course) else start_ns
    if step_ns is None or step_ns >= end_ns:
        return None
    part = course.between(step_ns, end_ns)
    if not len(part.times) or part.times[0] > step_ns or not np.isfinite(part.values).all():
        return None
    before = course.value_at(step_ns - 1)
    start = before if isfinite(before) else float(part.values[0])
    last = float(part.values[-1])
    target = last if reference is None else reference if isinstance(reference, float) else reference.value_at(end_ns)
    integral = None if reference is None else _error_integral(part, reference, end_ns)
    measures = Measures(error_integral=integral)
    if target != start and isfinite(target):
        band = abs(target - start) * band_percent / 100.0
        rise, overshoot, settling = (
            _measured(accumulator, part, start, end_ns)
            for accumulator in (Rise(target), Overshoot(target), Settle(band, target, percent=False))
        )
        measures = Measures(rise, overshoot, settling, integral)
    return Response(step_ns / NS_PER_S, start, target, measures)


def is_step_like(found: Response, end_ns: int) -> bool:
    """Whether a response without a reference is one to a step: it has settled long before the end, and is damped."""
    settling_s, length_s = found.measures.settling_s, end_ns / NS_PER_S - found.step_s
    if settling_s is None or settling_s > _STEADY_SHARE * length_s:
        return False
    overshoot = found.measures.overshoot_percent
    return overshoot is None or overshoot <= _MOST_OVERSHOOT


def steady_before(
    course: Course, found: Response, begins_ns: int, length_ns: int, band_percent: float = BAND_PERCENT
) -> bool | None:
    """Whether a course is steady before the step of its response, within its band.

    It is looked at for a tenth of the time ``length_ns`` that is measured, as far as the recording, which begins at
    ``begins_ns``, has it. None where it has nothing of that.
    """
    step_ns = round(found.step_s * NS_PER_S)
    from_ns = max(step_ns - round((1 - _STEADY_SHARE) * length_ns), begins_ns)
    part = course.between(from_ns, step_ns - 1)
    if from_ns >= step_ns or not len(part.times):
        return None
    band = abs(found.target - found.start) * band_percent / 100.0
    return bool(np.all(np.abs(part.values - found.start) <= band))


def _step_time(reference: Course, start_ns: int, end_ns: int) -> int | None:
    """Return when a reference first changes in a range, the range's start if it does not; None if it is unknown."""
    part = reference.between(start_ns, end_ns)
    if not len(part.times) or part.times[0] > start_ns:
        return None
    before = reference.value_at(start_ns - 1)
    changes = part.times[part.values != (before if isfinite(before) else part.values[0])]
    return int(changes[0]) if len(changes) else start_ns


def _measured(accumulator: Accumulator, part: Course, before: float, end_ns: int) -> float | None:
    """Return the number of an accumulator over a part of a course that begins at its first time."""
    begin = int(part.times[0])
    times: list[int] = (part.times - begin).tolist()
    values: list[float] = part.values.tolist()
    accumulator.begin(before)
    for value, since, until in zip(values, times, [*times[1:], end_ns - begin], strict=True):
        accumulator.hold(value, since, until)
    return accumulator.result(values[-1], end_ns - begin)


def _error_integral(part: Course, reference: Course | float, end_ns: int) -> float | None:
    """Return the integral of the absolute error from the start of a part to a time; None if it is not a number."""
    if isinstance(reference, Course):
        times, wanted, values = both(reference, part, int(part.times[0]), end_ns)
        errors = np.abs(values - wanted)
    else:
        times, errors = part.times, np.abs(part.values - reference)
    total = float(np.dot(errors, _lengths(times, end_ns))) / NS_PER_S
    return total if isfinite(total) else None


def _lengths(times: Times, end_ns: int) -> Times:
    return np.diff(times, append=end_ns)
