"""NOTCH and NOTCHN: the notch filters (sections 45 and 48)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from math import floor

from automax_ros.blocks.declare.coefficients import (
    LARGEST_HISTORY,
    by_order,
    constant,
    mapping_constant,
    no_defaults,
    order_default,
    per_period,
)
from automax_ros.blocks.declare.declaration import (
    NOT_ON_UDC,
    UDC_ONLY,
    Block,
    Coefficients,
    Form,
    Input,
    Limit,
    Output,
    State,
    Time,
    Times,
)
from automax_ros.blocks.declare.dynamics import Dynamics, Polynomial, Transfer, bilinear, mapped
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType

_Q_LIMIT = Limit("Q_FACTOR", constant(0.5), constant(100.0), "0.5", "100.0")
_Q_FACTOR = Input.real("Q_FACTOR", "Q", "Q factor, 1 / (2 x damping factor)")


def notch_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return NOTCH's transfer function, mapped at its own WN (decision: it has no WM)."""
    wn, q = values["WN"], values["Q_FACTOR"]
    return mapped((1.0, 0.0, wn * wn), (1.0, wn / q, wn * wn), mapping_constant(wn, period_s), period_s)


def notch_laplace(values: Mapping[str, float]) -> str:
    """Return the Laplace function of a notch of second order with its numbers."""
    wn, q = values["WN"], values["Q_FACTOR"]
    return f"(s**2 + {wn:.6g}**2) / (s**2 + {wn / q:.6g} s + {wn:.6g}**2)"


def notch_corners(values: Mapping[str, float], narrowing: float = 1.0) -> list[tuple[str, float]]:
    """Return WN and the frequencies of -3 dB, WN (sqrt(1 + u**2) -+ u) with u = 1 / (2 Q narrowing), in rad/s."""
    wn, u = values["WN"], 0.5 / values["Q_FACTOR"] / narrowing
    middle = math.sqrt(1.0 + u * u)
    return [("-3 dB below WN", wn * (middle - u)), ("WN", wn), ("-3 dB above WN", wn * (middle + u))]


def notch_coefficients(period_s: float, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return the gain of INPUT - INPUT(n-2), and of the last two differences, for ``notch_step``."""
    c = 1.0 / math.tan(values["WN"] * period_s / 2.0)
    width = c / values["Q_FACTOR"]
    scale = c * c + width + 1.0
    return -width / scale, 2.0 * (c * c - 1.0) / scale, -(c * c - width + 1.0) / scale


def notch_step(
    input: int, reset: bool, band: float, d1: float, d2: float, x1: int, x2: int, e1: float, e2: float
) -> tuple[int, int, int, float, float]:
    """INPUT plus E, the removed band with its sign inverted: -(s WN/Q) / (s**2 + s WN/Q + WN**2).

    This is equivalent to direct form I: the histories of OUTPUT are those of INPUT plus E's. It uses differences of
    whole counts, so that the filter settles on INPUT exactly, however low WN is. While RESET is TRUE all of INPUT's
    history is INPUT, all of OUTPUT's 0: no step follows (decision).
    """
    if reset:
        x1 = input
        e1 = -input + 0.0
        e2 = e1
        output = 0
    else:
        e = band * (input - x2) + d1 * e1 + d2 * e2
        e2 = e1
        if e > LARGEST_HISTORY or e < -LARGEST_HISTORY:
            x1 = input
            e = (INT16_MAX if e > 0.0 else INT16_MIN) - input + 0.0
            e2 = e
        e1 = e
        y = input + e
        output = floor(y + 0.5) if y >= 0.0 else -floor(0.5 - y)
        if output > INT16_MAX:
            output = INT16_MAX
        elif output < INT16_MIN:
            output = INT16_MIN
    x2 = x1
    x1 = input
    return output, x1, x2, e1, e2


NOTCH = Block(
    name="NOTCH",
    section="45",
    title="Notch filter",
    function="(s**2 + WN**2) / (s**2 + s WN/Q_FACTOR + WN**2)",
    inputs=(
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
        _Q_FACTOR,
        Input.real("WN", "WN", "notch frequency in rad/s"),
        Input.boolean("RESET", "R", "TRUE holds OUTPUT at 0", default=False),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the filtered signal"),),
    states=(
        State("x1", DataType.INTEGER, 0),
        State("x2", DataType.INTEGER, 0),
        State("e1", DataType.REAL, 0.0),
        State("e2", DataType.REAL, 0.0),
    ),
    coefficients=Coefficients(
        parameters=("Q_FACTOR", "WN"),
        names=("band", "d1", "d2"),
        limits=(_Q_LIMIT, Limit("WN", constant(0.01), per_period(2.0 * math.pi / 10.0), "0.01", "2 pi / (10 T)")),
        defaults=no_defaults,
        compute=notch_coefficients,
        dynamics=Dynamics(
            transfer=notch_transfer,
            laplace=notch_laplace,
            equation="y = x + e,  e = band (x - x2) + d1 e1 + d2 e2".format_map,
            corners=notch_corners,
            time_constants=False,
            exact_at="WN",
        ),
    ),
    times=Times(Time(85.16), Time(393.0), None, Time(59.60)),
    runs_on=NOT_ON_UDC,
    notes=("WN maps onto itself: C = WN / tan(WN T / 2).",),
    step=notch_step,
)


def notchn_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return NOTCHN's transfer function, mapped at its own WN (decision: it has no WM)."""
    wn, q = values["WN"], values["Q_FACTOR"]
    numerator: Polynomial = (1.0, 0.0, wn * wn)
    denominator: Polynomial = (1.0, wn / q, wn * wn)
    if values["ORDER"] == 4.0:
        numerator, denominator = _square(numerator), _square(denominator)
    return mapped(numerator, denominator, mapping_constant(wn, period_s), period_s)


def _square(polynomial: Polynomial) -> Polynomial:
    first, second, third = polynomial
    return (
        first * first,
        2.0 * first * second,
        second * second + 2.0 * first * third,
        2.0 * second * third,
        third * third,
    )


def _notchn_laplace(values: Mapping[str, float]) -> str:
    text = notch_laplace(values)
    return f"({text})**2" if values["ORDER"] == 4.0 else text


def _notchn_equation(values: Mapping[str, float]) -> str:
    return f"y = gain (x + b1 x1 + x2) + a1 y1 + a2 y2{', twice' if values['ORDER'] == 4.0 else ''}"


def _notchn_corners(values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Return the corners of one stage or of two equal ones, which together attenuate by 3 dB."""
    return notch_corners(values, math.sqrt(math.sqrt(2.0) - 1.0) if values["ORDER"] == 4.0 else 1.0)


def notchn_coefficients(period_s: float, values: Mapping[str, float]) -> tuple[float, float, float, float]:
    """Return gain and b1 of gain (x + b1 x1 + x2), a1 and a2 of the histories, of one filter of second order."""
    wn, q = values["WN"], values["Q_FACTOR"]
    b, a = bilinear((1.0, 0.0, 1.0), (1.0, 1.0 / q, 1.0), 1.0 / math.tan(wn * period_s / 2.0))
    return b[0], b[1] / b[0], -a[1], -a[2]


def notchn_step(
    input: int,
    order: int,
    initial_value: int,
    reset: bool,
    gain: float,
    b1: float,
    a1: float,
    a2: float,
    x1: int,
    x2: int,
    x3: int,
    x4: int,
    y1: float,
    y2: float,
    y3: float,
    y4: float,
) -> tuple[int, int, int, int, int, float, float, float, float]:
    """Direct form I; only the output is clamped; a history beyond ``LARGEST_HISTORY`` starts again (decision).

    Order 4 is D D y = N N x with polynomials N and D of second order. It is computed in stages, P = D y and Q = N x,
    since the rounded coefficients of D D would misplace its poles. While RESET is TRUE all of INPUT's history
    is INPUT, all of OUTPUT's INITIAL_VALUE: no step follows (decision).
    """
    if reset:
        x1 = input
        x2 = input
        x3 = input
        y1 = float(initial_value)
        y2 = y1
        y3 = y1
        y4 = y1
        output = initial_value
    else:
        y = gain * (input + b1 * x1 + x2)
        if order == 4:
            y = gain * (y + b1 * (gain * (x1 + b1 * x2 + x3)) + gain * (x2 + b1 * x3 + x4))
            y = y + a1 * (y1 - a1 * y2 - a2 * y3) + a2 * (y2 - a1 * y3 - a2 * y4)
        y = y + a1 * y1 + a2 * y2
        y4 = y3
        y3 = y2
        y2 = y1
        if y > LARGEST_HISTORY or y < -LARGEST_HISTORY:
            x1 = input
            x2 = input
            x3 = input
            y = INT16_MAX + 0.0 if y > 0.0 else INT16_MIN + 0.0
            y2 = y
            y3 = y
            y4 = y
        y1 = y
        output = floor(y + 0.5) if y >= 0.0 else -floor(0.5 - y)
        if output > INT16_MAX:
            output = INT16_MAX
        elif output < INT16_MIN:
            output = INT16_MIN
    x4 = x3
    x3 = x2
    x2 = x1
    x1 = input
    return output, x1, x2, x3, x4, y1, y2, y3, y4


NOTCHN = Block(
    name="NOTCHN",
    section="48",
    title="Notch filter of order 2 or 4",
    function="((s**2 + WN**2) / (s**2 + s WN/Q_FACTOR + WN**2)) ** (ORDER / 2)",
    inputs=(
        Input.integer("INPUT", "INPUT", "signal input"),
        Input.real("Q_FACTOR", "Q_FACTOR", "Q factor, 1 / (2 x damping factor)"),
        Input.real("WN", "WN", "centre frequency in rad/s"),
        Input.integer("ORDER", "ORDER", "order", 2, form=Form.LITERAL, one_of=(2, 4)),
        Input.integer("INITIAL_VALUE", "INITIAL_VALUE", "the output while RESET is TRUE", 0),
        Input.boolean("RESET", "RESET", "TRUE holds OUTPUT at INITIAL_VALUE", default=False),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "OUTPUT", "the filtered signal"),),
    states=(
        *(State(f"x{number}", DataType.INTEGER, 0) for number in (1, 2, 3, 4)),
        *(State(f"y{number}", DataType.REAL, 0.0) for number in (1, 2, 3, 4)),
    ),
    coefficients=Coefficients(
        parameters=("Q_FACTOR", "WN", "ORDER"),
        names=("gain", "b1", "a1", "a2"),
        limits=(
            _Q_LIMIT,
            Limit(
                "WN",
                by_order({2: 0.02, 4: 0.3}),
                per_period(0.999 * math.pi),
                "0.02 / T or 0.3 / T by ORDER",
                "0.999 pi / T",
                uses=("ORDER",),
            ),
        ),
        defaults=order_default(2),
        compute=notchn_coefficients,
        dynamics=Dynamics(
            transfer=notchn_transfer,
            laplace=_notchn_laplace,
            equation=_notchn_equation,
            corners=_notchn_corners,
            time_constants=False,
            exact_at="WN",
        ),
    ),
    times=Times(None, None, Time(64.25, o=20.0), None),
    runs_on=UDC_ONLY,
    notes=("WN maps onto itself: C = WN / tan(WN T / 2).",),
    step=notchn_step,
)
