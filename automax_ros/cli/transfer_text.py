"""Transfer functions and difference equations as text, with the numbers put in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from automax_ros.blocks.transfer import Transfer
from automax_ros.blocks.tuning import Tuning
from automax_ros.tuning.frequency import decibels

_FEWEST, _MOST = 7, 17
_TRUE_DIGITS = 1e-5
"""How far the response of the rounded coefficients may be off, as a share."""

Values = Mapping[str, float]


def number(value: float, digits: int = 6) -> str:
    """Return a number with so many digits at most, with an exponent only where it is very large or small."""
    return f"{value:.{digits}g}"


def fixed(value: float, places: int, sign: str = "") -> str:
    """Return a number with so many decimal places, 0 without a minus sign; ``sign`` is a format's, such as ``+``."""
    return f"{round(value, places) + 0.0:{sign}.{places}f}"


def laplace_text(tuning: Tuning) -> str:
    """Return the Laplace function of a block with its numbers, such as ``1 / (1 + s/10)``."""
    values = tuning.values
    if tuning.block.name == "PID":
        return _pid_text(values)
    if tuning.block.name == "THERMAL_OVERLOAD":
        return f"{_lag(tuning.corners[0].rad_s)} of I_FDBK**2, in counts of CALL_RISE"
    return _LAPLACE[tuning.block.name](values)


def _lag(rad_s: float) -> str:
    return f"1 / (1 + s/{number(rad_s)})"


def _pid_text(values: Values) -> str:
    terms = [(values["KI"], "/s"), (values["KD"], " s")]
    if values["ISA"]:
        inside = "".join(f" + {number(value)}{what}" for value, what in terms if value)
        return f"{number(values['KP'])} (1{inside})" if inside else number(values["KP"])
    parts = [number(values["KP"])] * bool(values["KP"])
    parts += [f"{number(value)}{what}" for value, what in terms if value]
    return " + ".join(parts) or "0"


def _notch(values: Values) -> str:
    square = f"{number(values['WN'])}**2"
    text = f"(s**2 + {square}) / (s**2 + {number(values['WN'] / values['Q_FACTOR'])} s + {square})"
    return f"({text})**2" if values.get("ORDER") == 4.0 else text


def _butterworth(name: str, high: bool) -> Callable[[Values], str]:
    def text(values: Values) -> str:
        w, order = values[name], int(values["ORDER"])
        powers = {1: "s", 2: "s**2", 3: "s**3"}
        below = {
            1: f"s + {number(w)}",
            2: f"s**2 + {number(math.sqrt(2.0) * w)} s + {number(w)}**2",
            3: f"s**3 + {number(2.0 * w)} s**2 + {number(2.0 * w * w)} s + {number(w)}**3",
        }[order]
        above = powers[order] if high else number(w) + ("" if order == 1 else f"**{order}")
        return f"{above} / ({below})"

    return text


_LAPLACE: dict[str, Callable[[Values], str]] = {
    "LAG": lambda values: _lag(values["WLG"]),
    "DIFF_LAG": lambda values: "(s/{0}) / (1 + s/{0})".format(number(values["WLG"])),
    "LEAD_LAG": lambda values: f"(1 + s/{number(values['WLD'])}) / (1 + s/{number(values['WLG'])})",
    "INTEGRATE": lambda values: f"{number(values['KI'])} / s",
    "PROP_INT": lambda values: f"{number(values['KP'])} (s + {number(values['WLD'])}) / s",
    "NOTCH": _notch,
    "NOTCHN": _notch,
    "HIGH_PASS_FILTER": _butterworth("WLD", high=True),
    "LOW_PASS_FILTER": _butterworth("WLG", high=False),
}


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
        tuple(float(number(value, digits)) for value in transfer.b),
        tuple(float(number(value, digits)) for value in transfer.a),
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
        text = power.strip() if size == 1.0 and power else number(size, digits) + power
        terms.append((" - " if factor < 0.0 else " + ") + text if terms else ("-" if factor < 0.0 else "") + text)
    return "".join(terms) or "0"


def equation_text(tuning: Tuning) -> str:
    """Return what the block executes each scan, in the terms of its coefficients, whose values follow."""
    return _EQUATIONS.get(tuning.block.name) or _order_equation(tuning)


_EQUATIONS = {
    "LAG": "y = gain (x + x1) + feedback y1",
    "DIFF_LAG": "y = x - i,  i = gain (x + x1) + feedback i1",
    "LEAD_LAG": "y = b0 x + b1 x1 + feedback y1",
    "INTEGRATE": "y = gain (x + x1) + y1",
    "PROP_INT": "y = i + proportional x,  i = integral (x + x1) + i1",
    "NOTCH": "y = x + e,  e = band (x - x2) + d1 e1 + d2 e2",
    "PID": "y = i + p_gain e + d_gain (d - d1),  i = i_gain (e + e1) + i1",
    "THERMAL_OVERLOAD": "y = gain (x + x1) + feedback y1,  x = scale I_FDBK**2; OVERLOAD above trip",
}


def _order_equation(tuning: Tuning) -> str:
    order = int(tuning.values["ORDER"])
    places = range(1, order + 1)
    if tuning.block.name == "NOTCHN":
        twice = ", twice" if order == 4 else ""
        return f"y = gain (x + b1 x1 + x2) + a1 y1 + a2 y2{twice}"
    return "y = gain (x" + "".join(f" + b{n} x{n}" for n in places) + ")" + "".join(f" + a{n} y{n}" for n in places)


def gain_text(gain: complex | None) -> str:
    """Return a gain in dB and degrees."""
    if gain is None:
        return "-"
    level = decibels(gain)
    if level is None or level < -200.0:
        return "0, no signal"
    degrees = math.degrees(math.atan2(gain.imag, gain.real))
    return f"{fixed(level, 2, '+')} dB {fixed(degrees, 1, '+')} deg"
