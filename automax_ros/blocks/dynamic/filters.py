"""LAG, DIFF_LAG and LEAD_LAG: the first-order filters (sections 41, 43, 44 and 51)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from math import floor

from automax_ros.blocks.declare.coefficients import (
    RESET,
    TWO_TO_MINUS_18,
    WM,
    constant,
    integrator_range,
    mapping_constant,
    mapping_default,
    per_period,
    times_c,
)
from automax_ros.blocks.declare.declaration import (
    Block,
    BlockTimes,
    Coefficients,
    Form,
    Input,
    Limit,
    Output,
    Relation,
    State,
    Time,
)
from automax_ros.blocks.declare.dynamics import Dynamics, Integrator, Transfer, corners_at, mapped
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType

_INPUT = Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE)
_WLG = Input.real("WLG", "WLG", "lag frequency in rad/s")
_INITIAL_VALUE = Input.integer("INITIAL_VALUE", "IV", "the output while RESET is TRUE", 0)
_LAG_LIMITS = (
    Limit("WM", per_period(2.0**-17), per_period(2.0 * math.pi / 4.5), "2**-17 / T", "2 pi / (4.5 T)"),
    Limit("WLG", times_c(TWO_TO_MINUS_18), times_c(0.71), "C x 2**-18", "0.71 C", uses=("WM",)),
)
"""The limits of LAG and of DIFF_LAG. The high limit of WLG with a defaulted WM is 0.71 C (decision): the .071 C of 41.2
is a misprint, its own 256.055/TICKS needs 0.71."""
_IN_FEEDBACK = "the integrator in the feedback path"
_RANGE_NOTE = "With Kx = WLG / C below 0.125 {what} is limited to +-8191, below 0.25 to +-16383 (section 51)."


def lag_coefficients(period_s: float, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return gain of the inputs, gain of the last output and range, of 1/(1 + s/wlg) under s = C(z-1)/(z+1)."""
    kx = values["WLG"] / mapping_constant(values["WM"], period_s)
    return kx / (1.0 + kx), (1.0 - kx) / (1.0 + kx), integrator_range(kx)


def lag_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return LAG's transfer function."""
    return mapped((1.0,), (1.0 / values["WLG"], 1.0), mapping_constant(values["WM"], period_s), period_s)


def _lag_rate(values: Mapping[str, float]) -> float:
    return values["WLG"]


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


def _coefficients(dynamics: Dynamics) -> Coefficients:
    return Coefficients(
        parameters=("WLG", "WM"),
        names=("gain", "feedback", "span"),
        limits=_LAG_LIMITS,
        defaults=mapping_default,
        compute=lag_coefficients,
        dynamics=dynamics,
    )


LAG = Block(
    name="LAG",
    section="43",
    title="Lag",
    function="1 / (1 + s/WLG)",
    inputs=(_INPUT, _WLG, WM, _INITIAL_VALUE, RESET),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the filtered signal"),),
    states=(State("x1", DataType.INTEGER, 0), State("y1", DataType.REAL, 0.0)),
    coefficients=_coefficients(
        Dynamics(
            transfer=lag_transfer,
            laplace="1 / (1 + s/{WLG:.6g})".format_map,
            equation="y = gain (x + x1) + feedback y1".format_map,
            corners=corners_at("WLG"),
            integrator=Integrator("y1", _lag_rate, "WLG / C", what="OUTPUT"),
        )
    ),
    times=BlockTimes(Time(26.52), Time(118.0), Time(41.0), Time(18.56)),
    notes=(_RANGE_NOTE.format(what="OUTPUT"),),
    step=lag_step,
)


def diff_lag_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return DIFF_LAG's transfer function."""
    slope = 1.0 / values["WLG"]
    return mapped((slope, 0.0), (slope, 1.0), mapping_constant(values["WM"], period_s), period_s)


def diff_lag_step(
    input: int, reset: bool, initial_value: int, gain: float, feedback: float, span: float, x1: int, integrator: float
) -> tuple[int, int, float]:
    """INPUT less the integrator in the feedback path, which lags INPUT and alone is limited by section 51.

    While RESET is TRUE the integrator is INPUT - INITIAL_VALUE, so that OUTPUT decays from INITIAL_VALUE (decision).
    """
    if reset:
        integrator = input - initial_value + 0.0
        output = initial_value
    else:
        integrator = gain * (input + x1) + feedback * integrator
        if integrator > span:
            integrator = span
        elif integrator < -span:
            integrator = -span
        rest = input - integrator
        output = floor(rest + 0.5) if rest >= 0.0 else -floor(0.5 - rest)
        if output > INT16_MAX:
            output = INT16_MAX
        elif output < INT16_MIN:
            output = INT16_MIN
    x1 = input
    return output, x1, integrator


DIFF_LAG = Block(
    name="DIFF_LAG",
    section="41",
    title="Differentiator lag",
    function="(s/WLG) / (1 + s/WLG)",
    inputs=(_INPUT, _WLG, WM, _INITIAL_VALUE, RESET),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "what changes in the signal"),),
    states=(State("x1", DataType.INTEGER, 0), State("integrator", DataType.REAL, 0.0)),
    coefficients=_coefficients(
        Dynamics(
            transfer=diff_lag_transfer,
            laplace="(s/{WLG:.6g}) / (1 + s/{WLG:.6g})".format_map,
            equation="y = x - i,  i = gain (x + x1) + feedback i1".format_map,
            corners=corners_at("WLG"),
            integrator=Integrator("integrator", _lag_rate, "WLG / C", what=_IN_FEEDBACK, in_feedback=True),
        )
    ),
    times=BlockTimes(Time(33.04), Time(154.0), Time(41.50), Time(23.12)),
    notes=(
        _RANGE_NOTE.format(what=_IN_FEEDBACK),
        "An INPUT beyond that range leaves its excess in OUTPUT: 32767 settles at 32767 - 8191 = 24576.",
    ),
    step=diff_lag_step,
)

LEAST_RATIO, GREATEST_RATIO = 2.0, 20.0
"""Bounds of WLD:WLG or WLG:WLD (44.1)."""
ROUNDING = 2.0**-23
"""Share by which LEAD_LAG's ratio may pass its bounds (decision): two REALs of 24 bits miss it by as much, so that
0.7 to 14.0 is not beyond 1 to 20."""
LEAST_FREQUENCY = 0.001


def _fastest(period_s: float) -> float:
    return 2.0 * math.pi / (4.5 * period_s)


def _ratio_holds(values: Mapping[str, float]) -> bool:
    ratio = max(values["WLD"], values["WLG"]) / min(values["WLD"], values["WLG"])
    return LEAST_RATIO * (1.0 - ROUNDING) <= ratio <= GREATEST_RATIO * (1.0 + ROUNDING)


def _nearest_ratio(period_s: float, values: Mapping[str, float]) -> dict[str, float]:
    """Return the pair with WLD moved to the nearest acceptable ratio, or WLG where WLD would leave its limits.

    The nearest ratio is that of the least factor; of two alike the one with the lower WLD (decisions).
    """
    lead, lag = values["WLD"], values["WLG"]
    ratios = (1.0 / LEAST_RATIO, LEAST_RATIO, 1.0 / GREATEST_RATIO, GREATEST_RATIO)
    ratio = min(ratios, key=lambda item: abs(math.log(item * lag / lead)))
    if LEAST_FREQUENCY <= lag * ratio <= _fastest(period_s):
        return {"WLD": lag * ratio, "WLG": lag}
    return {"WLD": lead, "WLG": lead / ratio}


def lead_lag_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return LEAD_LAG's transfer function."""
    c = mapping_constant(values["WM"], period_s)
    return mapped((1.0 / values["WLD"], 1.0), (1.0 / values["WLG"], 1.0), c, period_s)


def lead_lag_coefficients(period_s: float, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return the gains of INPUT, of INPUT(n-1) and of the previous output."""
    transfer = lead_lag_transfer(period_s, values)
    return transfer.b[0], transfer.b[1], -transfer.a[1]


def lead_lag_step(
    input: int, reset: bool, initial_value: int, b0: float, b1: float, feedback: float, x1: int, y1: float
) -> tuple[int, int, float]:
    """Direct form I; the clamp to 16 bits acts on the output alone."""
    if reset:
        y1 = float(initial_value)
        output = initial_value
    else:
        y1 = b0 * input + b1 * x1 + feedback * y1
        output = floor(y1 + 0.5) if y1 >= 0.0 else -floor(0.5 - y1)
        if output > INT16_MAX:
            output = INT16_MAX
        elif output < INT16_MIN:
            output = INT16_MIN
    x1 = input
    return output, x1, y1


LEAD_LAG = Block(
    name="LEAD_LAG",
    section="44",
    title="Lead/lag",
    function="(1 + s/WLD) / (1 + s/WLG)",
    inputs=(_INPUT, Input.real("WLD", "WLD", "lead frequency in rad/s"), _WLG, WM, _INITIAL_VALUE, RESET),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the filtered signal"),),
    states=(State("x1", DataType.INTEGER, 0), State("y1", DataType.REAL, 0.0)),
    coefficients=Coefficients(
        parameters=("WLD", "WLG", "WM"),
        names=("b0", "b1", "feedback"),
        limits=tuple(
            Limit(
                name, constant(LEAST_FREQUENCY), lambda period_s, _values: _fastest(period_s), "0.001", "2 pi / (4.5 T)"
            )
            for name in ("WM", "WLD", "WLG")
        ),
        defaults=mapping_default,
        compute=lead_lag_coefficients,
        relation=Relation(
            parameters=("WLD", "WLG"),
            holds=_ratio_holds,
            first=_nearest_ratio,
            text="WLD and WLG must be 2:1 to 20:1 apart, either way",
            ratio=(LEAST_RATIO, GREATEST_RATIO),
        ),
        dynamics=Dynamics(
            transfer=lead_lag_transfer,
            laplace="(1 + s/{WLD:.6g}) / (1 + s/{WLG:.6g})".format_map,
            equation="y = b0 x + b1 x1 + feedback y1".format_map,
            corners=corners_at("WLD", "WLG"),
        ),
    ),
    times=BlockTimes(Time(68.60), Time(284.0), Time(39.70), Time(48.04)),
    notes=(
        "WLD and WLG must be 2:1 to 20:1 apart, either way. Constants that are not are an error.",
        "Variables that are not are logged and the last good pair stays; a first pair moves to the nearest ratio.",
    ),
    step=lead_lag_step,
)
