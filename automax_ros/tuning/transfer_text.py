"""Numbers, gains and discrete transfer functions as text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from automax_ros.blocks.declare.dynamics import Transfer
from automax_ros.tuning.frequency import decibels
from automax_ros.tuning.tuning import Tuning

_FEWEST, _MOST = 7, 17
_TRUE_DIGITS = 1e-5
"""Most deviation of the response of the rounded coefficients, as a share."""


def number_text(value: float, digits: int = 6) -> str:
    """Return a number with at most this many digits, with an exponent only if it is very large or small."""
    return f"{value:.{digits}g}"


def fixed(value: float, places: int, sign: str = "") -> str:
    """Return a number with this many decimal places, 0 without a minus sign; ``sign`` is a format's, such as ``+``."""
    return f"{round(value, places) + 0.0:{sign}.{places}f}"


def digits_for(tuning: Tuning) -> int:
    """Return how many digits of the discrete coefficients its response at the corners and well below them needs."""
    transfer = tuning.transfer
    assert transfer is not None
    corners = [corner.rad_s for corner in tuning.corners if corner.discrete is not None]
    at_rad_s = [*corners, *(rad_s / 30.0 for rad_s in corners)]
    return next((count for count in range(_FEWEST, _MOST) if _is_enough(transfer, at_rad_s, count)), _MOST)


def discrete_text(transfer: Transfer, digits: int) -> tuple[str, str]:
    """Return numerator and denominator of the discrete function in z**-1."""
    return _polynomial(transfer.b, digits), _polynomial(transfer.a, digits)


def _is_enough(transfer: Transfer, at_rad_s: Sequence[float], digits: int) -> bool:
    rounded = Transfer(
        transfer.numerator,
        transfer.denominator,
        tuple(float(number_text(value, digits)) for value in transfer.b),
        tuple(float(number_text(value, digits)) for value in transfer.a),
        transfer.period_s,
        transfer.mapping,
    )
    for rad_s in at_rad_s:
        try:
            true, found = transfer.discrete_response(rad_s), rounded.discrete_response(rad_s)
        except ZeroDivisionError:
            return False
        if abs(found - true) > _TRUE_DIGITS * max(abs(true), 1e-3):
            return False
    return True


def _polynomial(factors: Sequence[float], digits: int) -> str:
    terms: list[str] = []
    for place, factor in enumerate(factors):
        if factor == 0.0:
            continue
        power = "" if place == 0 else " z**-1" if place == 1 else f" z**-{place}"
        size = abs(factor)
        text = power.strip() if size == 1.0 and power else number_text(size, digits) + power
        terms.append((" - " if factor < 0.0 else " + ") + text if terms else ("-" if factor < 0.0 else "") + text)
    return "".join(terms) or "0"


def gain_text(gain: complex | None) -> str:
    """Return a gain in dB and degrees."""
    if gain is None:
        return "-"
    level = decibels(gain)
    if level is None or level < -200.0:
        return "0, no signal"
    degrees = math.degrees(math.atan2(gain.imag, gain.real))
    return f"{fixed(level, 2, '+')} dB {fixed(degrees, 1, '+')} deg"
