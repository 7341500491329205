"""What a roller carries of the tension over it, and how the web slips where that is too much.

The web over a roller has no mass: where the two tensions differ by more than traction carries, so much web slips over
it, at once, that they differ by just that. This is dry friction; the slip is an unstretched length that changes sides.
"""

from __future__ import annotations

from typing import Final

from automax_ros.drive.web.end import WebEnd
from automax_ros.drive.web.span import WebSpan

STEPS: Final = 8
"""Most steps of Newton's method: two do between taut webs, and each that becomes taut or slack takes another."""
CLOSE: Final = 1e-12
"""Strain by which the tensions may miss the limit of traction."""


def slide(end: WebEnd, before: WebSpan | None, after: WebSpan | None) -> float:
    """Let the web slip over a roller as far as it must, in what both spans try; return how far forward, m.

    A roller between webs holds them by Eytelwein's ratio of tensions or by the part of the arriving tension that a lost
    traction leaves, whichever is less. Where no web was ever to come or to go, Eytelwein holds (decision: a nip, or web
    that is led on); traction that is lost lets go there too.
    """
    most, least = limits(end, before is None or after is None)
    if most < 0.0:
        return 0.0
    arriving = _tension(before)
    leaving = _tension(after)
    if leaving > most * arriving:
        ratio = most
    elif leaving < least * arriving:
        ratio = least
    else:
        return 0.0
    slipped = 0.0
    for _ in range(STEPS):
        miss = _tension(after) - ratio * _tension(before)
        slope = _slope(after) + ratio * _slope(before)
        if slope <= 0.0:
            break
        step = miss / slope
        slipped += step
        if before is not None:
            before.trial_m -= step
        if after is not None:
            after.trial_m += step
        if abs(miss) <= CLOSE * (_stiffness(before) + _stiffness(after)):
            break
    return slipped


def limits(end: WebEnd, alone: bool) -> tuple[float, float]:
    """Return the most and the least of the leaving tension over the arriving one; the most is below 0 without limit."""
    part = end.slip
    grip = 0.0 if alone else end.grip
    if part is None:
        return (grip, 1.0 / grip) if grip else (-1.0, -1.0)
    if not grip:
        return 1.0 + part, 1.0 - part
    return min(1.0 + part, grip), max(1.0 - part, 1.0 / grip)


def _tension(span: WebSpan | None) -> float:
    return 0.0 if span is None or span.broken else span.tension_of(span.trial_m)


def _slope(span: WebSpan | None) -> float:
    """Return how fast the tension falls with the unstretched length, N/m."""
    if span is None or span.broken or span.trial_m > span.length_m:
        return 0.0
    return span.stiffness_n * span.length_m / (span.trial_m * span.trial_m)


def _stiffness(span: WebSpan | None) -> float:
    return 0.0 if span is None else span.stiffness_n
