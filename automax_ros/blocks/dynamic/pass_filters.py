"""HIGH_PASS_FILTER and LOW_PASS_FILTER: Butterworth filters of order 1 to 3 (sections 46 and 47)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from math import floor

from automax_ros.blocks.declare.coefficients import (
    LARGEST_HISTORY,
    by_order,
    mapping_constant,
    order_default,
    per_period,
)
from automax_ros.blocks.declare.declaration import (
    UDC_ONLY,
    Block,
    BlockTimes,
    Coefficients,
    Form,
    Input,
    Limit,
    Output,
    State,
    Time,
)
from automax_ros.blocks.declare.dynamics import Dynamics, Transfer, corners_at, mapped
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType

BUTTERWORTH = {1: (1.0, 1.0), 2: (1.0, math.sqrt(2.0), 1.0), 3: (1.0, 2.0, 2.0, 1.0)}
"""Denominators by order, as polynomials of s/w, highest power first."""
HIGHEST_ORDER = 3


def high_pass_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return HIGH_PASS_FILTER's transfer function, mapped at its own WLD (decision: it has no WM)."""
    order = int(values["ORDER"])
    return _butterworth(values["WLD"], period_s, (1.0, *(0.0,) * order))


def low_pass_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return LOW_PASS_FILTER's transfer function, mapped at its own WLG (decision: it has no WM)."""
    order = int(values["ORDER"])
    return _butterworth(values["WLG"], period_s, (*(0.0,) * order, 1.0))


def _butterworth(w: float, period_s: float, numerator: tuple[float, ...]) -> Transfer:
    """Return numerator(s/w) over the Butterworth polynomial of its degree."""
    order = len(numerator) - 1
    powers = [w**power for power in range(order + 1)]
    scaled = [
        tuple(factor * power for factor, power in zip(polynomial, powers, strict=True))
        for polynomial in (numerator, BUTTERWORTH[order])
    ]
    return mapped(scaled[0], scaled[1], mapping_constant(w, period_s), period_s)


def _coefficients(
    transfer: Callable[[float, Mapping[str, float]], Transfer], sign: float
) -> Callable[[float, Mapping[str, float]], tuple[float, ...]]:
    """Return a function that computes ``pass_filter_step``'s coefficients; inputs count as (1 + sign z**-1)**order."""

    def compute(period_s: float, values: Mapping[str, float]) -> tuple[float, ...]:
        made = transfer(period_s, values)
        order = len(made.b) - 1
        counts = [math.comb(order, place) * sign**place for place in range(1, order + 1)]
        missing = (0.0,) * (HIGHEST_ORDER - order)
        return (made.b[0], *counts, *missing, *(-value for value in made.a[1:]), *missing)

    return compute


def pass_filter_step(
    input: int,
    order: int,
    initial_value: int,
    reset: bool,
    gain: float,
    b1: float,
    b2: float,
    b3: float,
    a1: float,
    a2: float,
    a3: float,
    x1: int,
    x2: int,
    x3: int,
    y1: float,
    y2: float,
    y3: float,
) -> tuple[int, int, int, int, float, float, float]:
    """Direct form I; b1 to b3 are whole, so that a constant INPUT sums up exactly; only the output is clamped.

    A history beyond ``LARGEST_HISTORY`` starts again from the edge of 16 bits (decision).
    While RESET is TRUE all of INPUT's history is INPUT, all of OUTPUT's INITIAL_VALUE: no step follows (decision).
    """
    if reset:
        x1 = input
        x2 = input
        y1 = float(initial_value)
        y2 = y1
        y3 = y1
        output = initial_value
    else:
        if order == 1:
            y = gain * (input + b1 * x1) + a1 * y1
        elif order == 2:
            y = gain * (input + b1 * x1 + b2 * x2) + a1 * y1 + a2 * y2
            y2 = y1
        else:
            y = gain * (input + b1 * x1 + b2 * x2 + b3 * x3) + a1 * y1 + a2 * y2 + a3 * y3
            y3 = y2
            y2 = y1
        if y > LARGEST_HISTORY or y < -LARGEST_HISTORY:
            x1 = input
            x2 = input
            y = INT16_MAX + 0.0 if y > 0.0 else INT16_MIN + 0.0
            y2 = y
            y3 = y
        y1 = y
        output = floor(y + 0.5) if y >= 0.0 else -floor(0.5 - y)
        if output > INT16_MAX:
            output = INT16_MAX
        elif output < INT16_MIN:
            output = INT16_MIN
    x3 = x2
    x2 = x1
    x1 = input
    return output, x1, x2, x3, y1, y2, y3


def _dynamics(frequency: str, transfer: Callable[[float, Mapping[str, float]], Transfer], numerator: str) -> Dynamics:
    """Return the dynamics of a filter whose Laplace function has a power of ``numerator`` as its numerator."""

    def laplace(values: Mapping[str, float]) -> str:
        order = int(values["ORDER"])
        power = "" if order == 1 else f"**{order}"
        w = values[frequency]
        below = {
            1: f"s + {w:.6g}",
            2: f"s**2 + {math.sqrt(2.0) * w:.6g} s + {w:.6g}**2",
            3: f"s**3 + {2.0 * w:.6g} s**2 + {2.0 * w * w:.6g} s + {w:.6g}**3",
        }
        return f"{numerator.format(w=w)}{power} / ({below[order]})"

    return Dynamics(
        transfer=transfer, laplace=laplace, equation=_equation, corners=corners_at(frequency), exact_at=frequency
    )


def _equation(values: Mapping[str, float]) -> str:
    places = range(1, int(values["ORDER"]) + 1)
    return "y = gain (x" + "".join(f" + b{n} x{n}" for n in places) + ")" + "".join(f" + a{n} y{n}" for n in places)


def _filter(
    name: str,
    also_called: str,
    section: str,
    title: str,
    function: str,
    frequency: str,
    text: str,
    transfer: Callable[[float, Mapping[str, float]], Transfer],
    sign: float,
    numerator: str,
) -> Block:
    """Return a filter with its ``frequency``; the powers of ``numerator`` are those of its Laplace function.

    The histories of INPUT count as (1 + ``sign`` z**-1)**order.
    """
    lowest = by_order({1: 0.000004, 2: 0.02, 3: 0.1})
    lowest_text = "0.000004 / T, 0.02 / T or 0.1 / T by ORDER"
    return Block(
        name=name,
        also_called=(also_called,),
        section=section,
        title=title,
        function=function,
        inputs=(
            Input.integer("INPUT", "INPUT", "signal input"),
            Input.real(frequency, frequency, text),
            Input.integer("ORDER", "ORDER", "order", 1, form=Form.LITERAL, one_of=(1, 2, 3)),
            Input.integer("INITIAL_VALUE", "INITIAL_VALUE", "the output while RESET is TRUE", 0),
            Input.boolean("RESET", "RESET", "TRUE holds OUTPUT at INITIAL_VALUE", default=False),
        ),
        outputs=(Output("OUTPUT", DataType.INTEGER, "OUTPUT", "the filtered signal"),),
        states=(
            *(State(f"x{number}", DataType.INTEGER, 0) for number in (1, 2, 3)),
            *(State(f"y{number}", DataType.REAL, 0.0) for number in (1, 2, 3)),
        ),
        coefficients=Coefficients(
            parameters=(frequency, "ORDER"),
            names=("gain", "b1", "b2", "b3", "a1", "a2", "a3"),
            limits=(Limit(frequency, lowest, per_period(0.999 * math.pi), lowest_text, "0.999 pi / T", ("ORDER",)),),
            defaults=order_default(1),
            compute=_coefficients(transfer, sign),
            dynamics=_dynamics(frequency, transfer, numerator),
        ),
        times=BlockTimes(None, None, Time(39.25, o=4.0), None),
        runs_on=UDC_ONLY,
        notes=(f"{frequency} maps onto itself: C = {frequency} / tan({frequency} T / 2).",),
        step=pass_filter_step,
    )


HIGH_PASS_FILTER = _filter(
    "HIGH_PASS_FILTER",
    "LEADN",
    "46",
    "Butterworth high-pass filter",
    "ORDER 1: s / (s + WLD); 2: s**2 / (s**2 + sqrt(2) s WLD + WLD**2);"
    " 3: s**3 / (s**3 + 2 s**2 WLD + 2 s WLD**2 + WLD**3)",
    "WLD",
    "lead frequency in rad/s: slower signals are attenuated",
    high_pass_transfer,
    -1.0,
    "s",
)
LOW_PASS_FILTER = _filter(
    "LOW_PASS_FILTER",
    "LAGN",
    "47",
    "Butterworth low-pass filter",
    "ORDER 1: WLG / (s + WLG); 2: WLG**2 / (s**2 + sqrt(2) s WLG + WLG**2);"
    " 3: WLG**3 / (s**3 + 2 s**2 WLG + 2 s WLG**2 + WLG**3)",
    "WLG",
    "lag frequency in rad/s: faster signals are attenuated",
    low_pass_transfer,
    1.0,
    "{w:.6g}",
)
