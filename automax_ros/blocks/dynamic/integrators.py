"""INTEGRATE and PROP_INT (sections 42, 49 and 51)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from math import floor

from automax_ros.blocks.declare.coefficients import (
    RESET,
    SATURATED,
    TWO_TO_MINUS_18,
    WM,
    constant,
    integrator_range,
    mapping_constant,
    mapping_default,
    per_period,
    times_c,
)
from automax_ros.blocks.declare.declaration import Block, BlockTimes, Coefficients, Input, Limit, Output, State, Time
from automax_ros.blocks.declare.dynamics import Dynamics, Integrator, Transfer, corners_at, mapped
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType


def integrate_coefficients(period_s: float, values: Mapping[str, float]) -> tuple[float, float]:
    """Return the gain Kx = KI / C of INPUT + INPUT(n-1) and the integrator's range."""
    kx = values["KI"] / mapping_constant(values["WM"], period_s)
    return kx, integrator_range(kx)


def integrate_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return INTEGRATE's transfer function."""
    return mapped((values["KI"],), (1.0, 0.0), mapping_constant(values["WM"], period_s), period_s)


def integrate_step(
    input: int,
    initial_value: int,
    limit_plus: int,
    limit_minus: int,
    reset: bool,
    hold_plus: bool,
    hold_minus: bool,
    gain: float,
    span: float,
    x1: int,
    y1: float,
) -> tuple[bool, bool, int, int, float]:
    """OUTPUT = Kx (INPUT + INPUT(n-1)) + OUTPUT(n-1), the integrator itself held and limited (42.3).

    A hold keeps the integrator from moving in its direction, then the limits act, clamped to the range of section 51;
    LIMIT_PLUS comes last and wins. While RESET is TRUE, INITIAL_VALUE is shown as it is, even beyond a
    limit or the range, and the next free scan limits it; the history of INPUT continues (decisions). SATURATED compares
    OUTPUT as shown, not the range of section 51 (decision).
    """
    if reset:
        y1 = float(initial_value)
        output = initial_value
    else:
        y = gain * (input + x1) + y1
        if (hold_plus and y > y1) or (hold_minus and y < y1):
            y = y1
        low = -span if limit_minus < -span else limit_minus + 0.0
        if y < low:
            y = low
        high = span if limit_plus > span else -span if limit_plus < -span else limit_plus + 0.0
        if y > high:
            y = high
        y1 = y
        output = floor(y1 + 0.5) if y1 >= 0.0 else -floor(0.5 - y1)
    x1 = input
    saturated_plus = output >= limit_plus
    saturated_minus = output <= limit_minus
    return saturated_plus, saturated_minus, output, x1, y1


INTEGRATE = Block(
    name="INTEGRATE",
    section="42",
    title="Integrate",
    function="KI / s",
    inputs=(
        Input.integer("INPUT", "I", "signal input"),
        Input.real("KI", "KI", "gain in 1/s"),
        WM,
        Input.integer("INITIAL_VALUE", "IV", "the output while RESET is TRUE", 0),
        Input.integer("LIMIT_PLUS", "LP", "upper limit of the integrator", INT16_MAX),
        Input.integer("LIMIT_MINUS", "LM", "lower limit of the integrator", -32767),
        RESET,
        Input.boolean("HOLD_PLUS", "HP", "TRUE keeps OUTPUT from becoming more positive", default=False),
        Input.boolean("HOLD_MINUS", "HM", "TRUE keeps OUTPUT from becoming more negative", default=False),
    ),
    outputs=(*SATURATED, Output("OUTPUT", DataType.INTEGER, "O", "the integral")),
    states=(State("x1", DataType.INTEGER, 0), State("y1", DataType.REAL, 0.0)),
    coefficients=Coefficients(
        parameters=("KI", "WM"),
        names=("gain", "span"),
        limits=(
            Limit("WM", constant(0.01), per_period(0.9 * math.pi), "0.01", "0.9 pi / T"),
            Limit("KI", times_c(TWO_TO_MINUS_18), per_period(0.9 * math.pi), "C x 2**-18", "0.9 pi / T", uses=("WM",)),
        ),
        defaults=mapping_default,
        compute=integrate_coefficients,
        dynamics=Dynamics(
            transfer=integrate_transfer,
            laplace="{KI:.6g} / s".format_map,
            equation="y = gain (x + x1) + y1".format_map,
            corners=lambda values: [("unity gain, KI", values["KI"])],
            integrator=Integrator("y1", lambda values: values["KI"], "KI / C"),
        ),
    ),
    times=BlockTimes(Time(39.14), Time(193.0), Time(58.60), Time(27.40)),
    notes=(
        "With Kx = KI / C below 0.125 the integrator is limited to +-8191, below 0.25 to +-16383 (section 51).",
        "For y counts/s at a constant input of x, with WM not programmed: KI = 0.9918 y / x.",
        "A limit wins over a hold; SATURATED compares OUTPUT as shown.",
    ),
    step=integrate_step,
)


def prop_int_coefficients(period_s: float, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return KP, the integrator's gain Kx = KP WLD / C of INPUT + INPUT(n-1), and its range."""
    kx = values["KP"] * values["WLD"] / mapping_constant(values["WM"], period_s)
    return values["KP"], kx, integrator_range(kx)


def prop_int_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return PROP_INT's transfer function."""
    c = mapping_constant(values["WM"], period_s)
    return mapped((values["KP"], values["KP"] * values["WLD"]), (1.0, 0.0), c, period_s)


def prop_int_step(
    input: int,
    initial_value: int,
    limit_plus: int,
    limit_minus: int,
    reset: bool,
    hold_plus: bool,
    hold_minus: bool,
    proportional: float,
    integral: float,
    span: float,
    x1: int,
    integrator: float,
) -> tuple[bool, bool, int, int, float]:
    """OUTPUT = INTEGRATOR + KP INPUT, where INTEGRATOR gains Kx (INPUT + INPUT(n-1)) per scan (49).

    Holds act on INTEGRATOR, then the limits, clamped to the range of section 51, LIMIT_PLUS last, so that it never
    winds up; then the limits act on OUTPUT. A coefficient that changes does not change INTEGRATOR. While RESET is TRUE
    both are INITIAL_VALUE, even beyond a limit, and the history of INPUT continues (decisions).
    """
    if reset:
        integrator = float(initial_value)
        output = initial_value
    else:
        moved = integral * (input + x1) + integrator
        if (hold_plus and moved > integrator) or (hold_minus and moved < integrator):
            moved = integrator
        low = -span if limit_minus < -span else limit_minus + 0.0
        if moved < low:
            moved = low
        high = span if limit_plus > span else -span if limit_plus < -span else limit_plus + 0.0
        if moved > high:
            moved = high
        integrator = moved
        total = integrator + proportional * input
        output = floor(total + 0.5) if total >= 0.0 else -floor(0.5 - total)
        if output < limit_minus:
            output = limit_minus
        if output > limit_plus:
            output = limit_plus
    x1 = input
    saturated_plus = output >= limit_plus
    saturated_minus = output <= limit_minus
    return saturated_plus, saturated_minus, output, x1, integrator


PROP_INT = Block(
    name="PROP_INT",
    section="49",
    title="Proportional + integral",
    function="KP (s + WLD) / s",
    inputs=(
        Input.integer("INPUT", "I", "signal input"),
        Input.real("KP", "KP", "proportional gain"),
        Input.real("WLD", "WLD", "lead frequency in rad/s"),
        WM,
        Input.integer("INITIAL_VALUE", "IV", "output and integrator while RESET is TRUE", 0),
        Input.integer("LIMIT_PLUS", "LP", "upper limit of integrator and output", INT16_MAX),
        Input.integer("LIMIT_MINUS", "LM", "lower limit of integrator and output", INT16_MIN),
        RESET,
        Input.boolean("HOLD_PLUS", "HP", "TRUE keeps the integrator from becoming more positive", default=False),
        Input.boolean("HOLD_MINUS", "HM", "TRUE keeps the integrator from becoming more negative", default=False),
    ),
    outputs=(*SATURATED, Output("OUTPUT", DataType.INTEGER, "O", "integrator plus KP times INPUT")),
    states=(State("x1", DataType.INTEGER, 0), State("integrator", DataType.REAL, 0.0)),
    coefficients=Coefficients(
        parameters=("KP", "WLD", "WM"),
        names=("proportional", "integral", "span"),
        limits=(
            Limit("WM", per_period(2.0**-17), per_period(0.9 * math.pi), "2**-17 / T", "0.9 pi / T"),
            Limit("KP", constant(0.001), constant(128.0), "0.001", "128.0"),
            Limit(
                "WLD",
                lambda period_s, values: TWO_TO_MINUS_18 * mapping_constant(values["WM"], period_s) / values["KP"],
                per_period(0.9 * math.pi),
                "C x 2**-18 / KP",
                "0.9 pi / T",
                uses=("WM", "KP"),
            ),
        ),
        defaults=mapping_default,
        compute=prop_int_coefficients,
        dynamics=Dynamics(
            transfer=prop_int_transfer,
            laplace="{KP:.6g} (s + {WLD:.6g}) / s".format_map,
            equation="y = i + proportional x,  i = integral (x + x1) + i1".format_map,
            corners=corners_at("WLD"),
            integrator=Integrator("integrator", lambda values: values["KP"] * values["WLD"], "KP x WLD / C"),
        ),
    ),
    times=BlockTimes(Time(40.32), Time(193.0), Time(70.85), Time(28.24)),
    notes=(
        "With Kx = KP x WLD / C below 0.125 the integrator is limited to +-8191, below 0.25 to +-16383 (section 51).",
        "The holds act on the integrator alone: OUTPUT still follows KP times INPUT.",
        "A limit wins over a hold; SATURATED compares OUTPUT as shown.",
    ),
    step=prop_int_step,
)
