"""LAG: the first-order filter (section 43)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from math import floor

from automax_ros.blocks.coefficients import (
    TWO_TO_MINUS_18,
    integrator_range,
    mapping_constant,
    mapping_default,
    per_period,
    times_c,
)
from automax_ros.blocks.declaration import Block, Coefficients, Form, Input, Limit, Output, State, Time, Times
from automax_ros.core.types import DataType


def lag_coefficients(period_s: float, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return gain of the inputs, gain of the last output and range, of 1/(1 + s/wlg) under s = C(z-1)/(z+1)."""
    kx = values["WLG"] / mapping_constant(values["WM"], period_s)
    return kx / (1.0 + kx), (1.0 - kx) / (1.0 + kx), integrator_range(kx)


def lag_step(
    input: int, reset: bool, initial_value: int, gain: float, feedback: float, span: float, x1: int, y1: float
) -> tuple[int, int, float]:
    """Direct form I; the history is limited to the integrator's range, the output is its nearest count."""
    if reset:
        y1 = float(initial_value)
        output = initial_value
    else:
        y1 = gain * (input + x1) + feedback * y1
        if y1 > span:
            y1 = span
        elif y1 < -span:
            y1 = -span
        output = floor(y1 + 0.5) if y1 >= 0.0 else -floor(0.5 - y1)
    x1 = input
    return output, x1, y1


LAG = Block(
    name="LAG",
    section="43",
    title="Lag",
    function="1 / (1 + s/WLG)",
    inputs=(
        Input("INPUT", DataType.INTEGER, "I", "signal input", required=True, form=Form.VARIABLE),
        Input("WLG", DataType.REAL, "WLG", "lag frequency in rad/s", required=True),
        Input("WM", DataType.REAL, "WM", "mapping frequency in rad/s, (2 pi / T) / 20 unless given", form=Form.LITERAL),
        Input("INITIAL_VALUE", DataType.INTEGER, "IV", "the output while RESET is TRUE", default=0),
        Input("RESET", DataType.BOOLEAN, "R", "TRUE holds OUTPUT at INITIAL_VALUE", default=False),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the filtered signal"),),
    states=(State("x1", DataType.INTEGER, 0), State("y1", DataType.REAL, 0.0)),
    coefficients=Coefficients(
        parameters=("WLG", "WM"),
        names=("gain", "feedback", "span"),
        limits=(
            Limit("WM", per_period(2.0**-17), per_period(2.0 * math.pi / 4.5), "2**-17 / T", "2 pi / (4.5 T)"),
            Limit("WLG", times_c(TWO_TO_MINUS_18), times_c(0.71), "C x 2**-18", "0.71 C", uses=("WM",)),
        ),
        defaults=mapping_default,
        compute=lag_coefficients,
    ),
    times=Times(Time(26.52), Time(118.0), Time(41.0), Time(18.56)),
    step=lag_step,
)
