"""TACHLOSS_OVERSPEED and THERMAL_OVERLOAD: protection of a drive on a UDC (sections 35 and 36)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from math import floor

from automax_ros.blocks.declare.coefficients import constant
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
from automax_ros.blocks.declare.dynamics import Dynamics, Transfer, mapped
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.types import DataType

FULL_SCALE = 4095.0
"""Counts of I_FDBK at LIM_BAR percent of the motor's current."""
RATED_RISE = 1000.0
"""Rise at 100 % of the motor's current, in tenths of N**2 / 100; an overload ends there."""
LIM_BAR, THRESHOLD, TRIP_TIME = 150, 114, 60
"""Defaults in percent, percent and seconds."""


def tachloss_overspeed_step(
    speed_fdbk: int,
    arm_voltage_fdbk: int,
    overspeed_lim: int,
    tl_spd_llim: int,
    av_spd_llim: int,
    tl_vfb_llim: int,
    arm_vfb_llim: int,
) -> tuple[bool, bool, bool, bool]:
    """Compare the magnitudes of speed and armature voltage, in 32 bit, with the limits (35.1)."""
    speed = speed_fdbk if speed_fdbk >= 0 else -speed_fdbk
    voltage = arm_voltage_fdbk if arm_voltage_fdbk >= 0 else -arm_voltage_fdbk
    overspeed = speed > overspeed_lim
    tach_loss = speed < tl_spd_llim and voltage > tl_vfb_llim
    arm_vfb_loss = speed > av_spd_llim and voltage < arm_vfb_llim
    speed_fault = (
        speed > overspeed_lim
        or (speed < tl_spd_llim and voltage > tl_vfb_llim)
        or (speed > av_spd_llim and voltage < arm_vfb_llim)
    )
    return speed_fault, overspeed, tach_loss, arm_vfb_loss


TACHLOSS_OVERSPEED = Block(
    name="TACHLOSS_OVERSPEED",
    section="35",
    title="Tach loss and overspeed",
    function="SPEED_FAULT = OVERSPEED or TACH_LOSS or ARM_VFB_LOSS",
    inputs=(
        Input.integer("SPEED_FDBK", "SPEED_FDBK", "speed, typically 4095 = gear-in speed"),
        Input.integer("ARM_VOLTAGE_FDBK", "ARM_VOLTAGE_FDBK", "armature voltage, typically 3000 = rated voltage"),
        Input.integer("OVERSPEED_LIM", "OVERSPEED_LIM", "speed above it is overspeed", 4505),
        Input.integer("TL_SPD_LLIM", "TL_SPD_LLIM", "tach loss: speed below it ...", 205),
        Input.integer("AV_SPD_LLIM", "AV_SPD_LLIM", "voltage loss: speed above it ...", 1638),
        Input.integer("TL_VFB_LLIM", "TL_VFB_LLIM", "... while voltage lies above it", 1200),
        Input.integer("ARM_VFB_LLIM", "ARM_VFB_LLIM", "... while voltage lies below it", 150),
    ),
    outputs=(
        Output("SPEED_FAULT", DataType.BOOLEAN, "SPEED_FAULT", "TRUE while any of the three is"),
        Output("OVERSPEED", DataType.BOOLEAN, "OVERSPEED", "|speed| > OVERSPEED_LIM", required=False),
        Output(
            "TACH_LOSS",
            DataType.BOOLEAN,
            "TACH_LOSS",
            "|speed| < TL_SPD_LLIM and |voltage| > TL_VFB_LLIM",
            required=False,
        ),
        Output(
            "ARM_VFB_LOSS",
            DataType.BOOLEAN,
            "ARM_VFB_LOSS",
            "|speed| > AV_SPD_LLIM and |voltage| < ARM_VFB_LLIM",
            required=False,
        ),
    ),
    times=BlockTimes(None, None, Time(22.00), None),
    runs_on=UDC_ONLY,
    notes=("The voltage limits are in the units of the voltage feedback.",),
    step=tachloss_overspeed_step,
)


SLACK = 1e-9
"""Amount by which the rise may exceed its limit, for the rounding of I_FDBK**2 / SCALE: exactly THRESHOLD % never
trips."""


def thermal_lag(values: Mapping[str, float]) -> float:
    """Return the frequency wlg of the filter in rad/s (36.1)."""
    bar, threshold = values["LIM_BAR"], values["THRESHOLD"]
    return math.log((bar**2 - 100.0**2) / (bar**2 - threshold**2)) / values["TRIP_TIME"]


def thermal_transfer(period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return the transfer function from the scaled square of the current to CALC_RISE; it maps with C = 2/T."""
    return mapped((1.0,), (1.0 / thermal_lag(values), 1.0), 2.0 / period_s, period_s)


def _laplace(values: Mapping[str, float]) -> str:
    return f"1 / (1 + s/{thermal_lag(values):.6g}) of I_FDBK**2, in counts of CALC_RISE"


def thermal_coefficients(_period_s: float, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return scale of the squared current, gain of the filter, and the rise that trips (36.1).

    The filter maps with C = 2/T, plain bilinear, so that TRIP_TIME holds (decision).
    """
    bar, threshold = values["LIM_BAR"], values["THRESHOLD"]
    kx = thermal_lag(values) * _period_s / 2.0
    scale = 1.0 / ((FULL_SCALE / bar) ** 2 * 10.0)
    return scale, kx / (1.0 + kx), threshold**2 / 10.0 + SLACK


def thermal_overload_step(
    i_fdbk: int, reset: bool, scale: float, gain: float, trip: float, x1: float, y1: float, tripped: bool
) -> tuple[bool, int, float, float, bool]:
    """Filter the square of the current; the rise trips above the threshold, the rounded one ends at 100 % (36.1).

    The low pass moves by its distance from the input, so that rounding never carries a steady current's rise beyond it.
    """
    squared = i_fdbk * i_fdbk * scale
    y1 = 0.0 if reset else y1 + gain * (squared - y1 + (x1 - y1))
    x1 = squared
    rise = floor(y1 + 0.5)
    tripped = rise > RATED_RISE if tripped else y1 > trip
    overload = tripped
    calc_rise = rise if rise <= INT16_MAX else INT16_MAX
    return overload, calc_rise, x1, y1, tripped


def _defaults(_period_s: float) -> dict[str, float]:
    return {"LIM_BAR": LIM_BAR, "THRESHOLD": THRESHOLD, "TRIP_TIME": TRIP_TIME}


def _highest_threshold(_period_s: float, values: Mapping[str, float]) -> float:
    """Return the high limit of THRESHOLD, which has to lie below LIM_BAR (decision: by one)."""
    return min(124.0, values["LIM_BAR"] - 1.0)


THERMAL_OVERLOAD = Block(
    name="THERMAL_OVERLOAD",
    section="36",
    title="Thermal overload",
    function="CALC_RISE = I_FDBK**2 / ((4095 / LIM_BAR)**2 * 10) * 1 / (1 + s/wlg); OVERLOAD above THRESHOLD**2 / 10",
    inputs=(
        Input.integer(
            "I_FDBK",
            "I_FDBK",
            "current feedback, 4095 counts = LIM_BAR % of the motor's current; a COMMON variable",
            form=Form.VARIABLE,
            wants_common=True,
        ),
        Input.integer(
            "LIM_BAR", "LIM_BAR", "maximum current limit in %", LIM_BAR, drive_parameter="motor_overload_ratio"
        ),
        Input.integer("THRESHOLD", "THRESHOLD", "current in % above which it trips", THRESHOLD),
        Input.integer(
            "TRIP_TIME", "TRIP_TIME", "seconds from a step of 100 % to LIM_BAR % of current to OVERLOAD", TRIP_TIME
        ),
        Input.boolean("RESET", "RESET", "TRUE clears OVERLOAD and the rise; for tests only", default=False),
    ),
    outputs=(
        Output("OVERLOAD", DataType.BOOLEAN, "OVERLOAD", "TRUE on overload; a COMMON variable", wants_common=True),
        Output("CALC_RISE", DataType.INTEGER, "CALC_RISE", "calculated rise, 1000 at 100 % of current", required=False),
    ),
    states=(
        State("x1", DataType.REAL, 0.0),
        State("y1", DataType.REAL, 0.0),
        State("tripped", DataType.BOOLEAN, False),
    ),
    coefficients=Coefficients(
        parameters=("LIM_BAR", "THRESHOLD", "TRIP_TIME"),
        names=("scale", "gain", "trip"),
        limits=(
            Limit("LIM_BAR", constant(115.0), constant(400.0), "115", "400"),
            Limit(
                "THRESHOLD", constant(110.0), _highest_threshold, "110", "124, at most LIM_BAR - 1", uses=("LIM_BAR",)
            ),
            Limit("TRIP_TIME", constant(10.0), constant(120.0), "10", "120"),
        ),
        defaults=_defaults,
        compute=thermal_coefficients,
        dynamics=Dynamics(
            transfer=thermal_transfer,
            laplace=_laplace,
            equation="y = y1 + gain (x + x1 - 2 y1),  x = scale I_FDBK**2; OVERLOAD above trip".format_map,
            corners=lambda values: [("wlg", thermal_lag(values))],
            exact_at="",
            signals=("I_FDBK",),
            output="OVERLOAD",
            not_measured="it squares its input and has no frequency response",
        ),
        limits_literals=True,
    ),
    times=BlockTimes(None, None, Time(46.10), None),
    runs_on=UDC_ONLY,
    notes=(
        "wlg = ln((LIM_BAR**2 - 100**2) / (LIM_BAR**2 - THRESHOLD**2)) / TRIP_TIME.",
        "Parameters beyond their limits are limited and logged, constants too.",
        "A THRESHOLD that is not below LIM_BAR becomes LIM_BAR - 1 and is logged; LIM_BAR stays in force.",
        "OVERLOAD trips on the rise before it is rounded; it ends when CALC_RISE is back at 1000, its value at 100 %.",
        "Every UDC task needs this block unless hardware protects the motor.",
    ),
    expected_on=UDC_ONLY,
    expected_since="it protects the motor, unless a hardware device does",
    step=thermal_overload_step,
)
