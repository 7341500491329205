"""PID (section 50)."""

from __future__ import annotations

from collections.abc import Mapping
from math import floor

from automax_ros.blocks.declare.coefficients import SATURATED, constant
from automax_ros.blocks.declare.declaration import (
    NOT_ON_UDC,
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
from automax_ros.blocks.declare.dynamics import Dynamics, Integrator, Transfer
from automax_ros.core.numbers import INT16_MAX, INT16_MIN, REAL_LIMIT
from automax_ros.core.types import DataType, Value


def _gains(values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return the gains of the error, its integral in 1/s and its derivative in s; ISA multiplies the last two by KP."""
    scale = values["KP"] if values["ISA"] else 1.0
    return values["KP"], values["KI"] * scale, values["KD"] * scale


def pid_coefficients(_period_s: float, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return KP, the gain of ERROR + ERROR(n-1) and the gain of D_ERROR - D_ERROR(n-1)."""
    proportional, integral, derivative = _gains(values)
    return proportional, integral * values["LOOP_TIME"] / 2.0, derivative / values["LOOP_TIME"]


def pid_transfer(_period_s: float, values: Mapping[str, float]) -> Transfer:
    """Return the transfer function from ERROR to OUTPUT: trapezoids, backward differences, one step per LOOP_TIME."""
    proportional, integral, derivative = _gains(values)
    _, i, d = pid_coefficients(_period_s, values)
    return Transfer(
        numerator=(derivative, proportional, integral),
        denominator=(1.0, 0.0),
        b=(proportional + i + d, i - proportional - 2.0 * d, d),
        a=(1.0, -1.0),
        period_s=values["LOOP_TIME"],
        mapping=None,
    )


def _laplace(values: Mapping[str, float]) -> str:
    proportional = f"{values['KP']:.6g}"
    terms = [f"{values[name]:.6g}{power}" for name, power in (("KI", "/s"), ("KD", " s")) if values[name]]
    if values["ISA"]:
        return f"{proportional} ({' + '.join(['1', *terms])})" if terms else proportional
    return " + ".join([proportional, *terms] if values["KP"] else terms) or "0"


def _corners(values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Return where the P term exceeds the I term, and the D term the P term, as far as the gains are not 0."""
    proportional, integral, derivative = _gains(values)
    corners = []
    if integral > 0.0 and proportional > 0.0:
        corners.append(("KI" if values["ISA"] else "KI/KP", integral / proportional))
    elif integral > 0.0:
        corners.append(("unity gain, KI", integral))
    if derivative > 0.0 and proportional > 0.0:
        corners.append(("1/KD" if values["ISA"] else "KP/KD", proportional / derivative))
    return corners


def _carrier(inputs: Mapping[str, Value]) -> tuple[str, int]:
    """Return the input that drives ERROR: INPUT, but FEEDBACK where the D term uses it, as it acts on all terms."""
    if inputs["DERIVATIVE"]:
        return "FEEDBACK", 1 if inputs["ACTION"] else -1
    return "INPUT", -1 if inputs["ACTION"] else 1


def _remarks(inputs: Mapping[str, Value]) -> list[str]:
    found = ["from ERROR to OUTPUT: INPUT moves, FEEDBACK is 0"]
    if inputs.get("DERIVATIVE") is True:
        found = [
            "from ERROR to OUTPUT; DERIVATIVE is TRUE, so the D term sees only FEEDBACK: FEEDBACK moves, INPUT is 0"
        ]
    if inputs.get("ACTION") is True:
        found.append("ACTION is TRUE: ERROR is FEEDBACK - INPUT, so INPUT acts with the sign turned")
    if inputs.get("DEAD_BAND"):
        found.append(f"an |ERROR| below DEAD_BAND = {inputs['DEAD_BAND']} leaves the integrator: not linear")
    return found


def pid_step(
    action: bool,
    derivative: bool,
    manual: bool,
    initial_value: int,
    feed_forward: int,
    input: int,
    feedback: int,
    dead_band: int,
    max_change: int,
    limit_plus: int,
    limit_minus: int,
    hold_plus: bool,
    hold_minus: bool,
    p_gain: float,
    i_gain: float,
    d_gain: float,
    e1: int,
    d1: int,
    integrator: float,
    y1: int,
) -> tuple[bool, bool, int, int, int, int, float, int]:
    """The pseudo-code of section 50: INTEGRATOR plus P and D terms, limited in change and in range.

    INTEGRATOR keeps fractions of a count, OUTPUT(n-1) is the output as shown. ERROR has 32 bits inside.
    """
    if manual:
        deviation = 0
        d1 = 0
        integrator = float(initial_value)
        total = integrator
    else:
        deviation = feedback - input if action else input - feedback
        slope = (feedback if action else -feedback) if derivative else deviation
        i_term = (deviation + e1) * i_gain
        if (hold_plus and i_term > 0.0) or (hold_minus and i_term < 0.0):
            i_term = 0.0
        if deviation < dead_band and -deviation < dead_band:
            i_term = 0.0
        integrator = integrator + i_term
        if integrator < limit_minus:
            integrator = limit_minus + 0.0
        if integrator > limit_plus:
            integrator = limit_plus + 0.0
        total = integrator + deviation * p_gain + (slope - d1) * d_gain
        d1 = slope
    e1 = deviation
    total = total + feed_forward
    most = max_change if max_change > 0 else 0
    if total > y1 + most:
        output = y1 + most
    elif total < y1 - most:
        output = y1 - most
    else:
        output = floor(total + 0.5) if total >= 0.0 else -floor(0.5 - total)
    if output <= limit_minus:
        output = limit_minus
    if output >= limit_plus:
        output = limit_plus
    y1 = output
    saturated_plus = output >= limit_plus
    saturated_minus = output <= limit_minus
    error = INT16_MAX if deviation > INT16_MAX else INT16_MIN if deviation < INT16_MIN else deviation
    return saturated_plus, saturated_minus, error, output, e1, d1, integrator, y1


PID = Block(
    name="PID",
    section="50",
    title="Proportional + integral + derivative",
    function="KP + KI / s + KD s of INPUT - FEEDBACK; with ISA = TRUE KP (1 + KI / s + KD s)",
    inputs=(
        Input.boolean("ISA", "ISA", "TRUE multiplies KI and KD by KP", default=False, form=Form.LITERAL),
        Input.boolean("ACTION", "ACTION", "TRUE: ERROR is FEEDBACK - INPUT", default=False, form=Form.LITERAL),
        Input.boolean(
            "DERIVATIVE", "DRV", "TRUE: the D term takes FEEDBACK instead of ERROR", default=False, form=Form.LITERAL
        ),
        Input.boolean("MANUAL", "MAN", "TRUE: OUTPUT is INITIAL_VALUE + FEED_FORWARD", default=False),
        Input.real("KP", "KP", "proportional gain"),
        Input.real("KI", "KI", "integral gain in 1/s"),
        Input.real("KD", "KD", "derivative gain in s", 0.0),
        Input.real("LOOP_TIME", "LT", "seconds between executions of the block", form=Form.LITERAL),
        Input.integer("INITIAL_VALUE", "IV", "the integrator while MANUAL is TRUE", 0),
        Input.integer("FEED_FORWARD", "FF", "is added to OUTPUT", 0),
        Input.integer("INPUT", "I", "set point", form=Form.VARIABLE),
        Input.integer("FEEDBACK", "FB", "feedback", form=Form.VARIABLE),
        Input.integer("DEAD_BAND", "DB", "a smaller |ERROR| leaves the integrator", 0, low=0, high=INT16_MAX),
        Input.integer("MAX_CHANGE", "MC", "most that OUTPUT may change at once", INT16_MAX, low=1, high=INT16_MAX),
        Input.integer("LIMIT_PLUS", "LP", "upper limit of integrator and output", INT16_MAX),
        Input.integer("LIMIT_MINUS", "LM", "lower limit of integrator and output", -32767),
        Input.boolean(
            "HOLD_PLUS",
            "HP",
            "TRUE keeps the integrator from becoming more positive",
            default=False,
            form=Form.VARIABLE,
        ),
        Input.boolean(
            "HOLD_MINUS",
            "HM",
            "TRUE keeps the integrator from becoming more negative",
            default=False,
            form=Form.VARIABLE,
        ),
    ),
    outputs=(
        *SATURATED,
        Output("ERROR", DataType.INTEGER, "E", "INPUT - FEEDBACK, or with ACTION the reverse", required=False),
        Output("OUTPUT", DataType.INTEGER, "O", "the controller's output"),
    ),
    states=(
        State("e1", DataType.INTEGER, 0),
        State("d1", DataType.INTEGER, 0),
        State("integrator", DataType.REAL, 0.0),
        State("y1", DataType.INTEGER, 0),
    ),
    coefficients=Coefficients(
        parameters=("ISA", "KP", "KI", "KD", "LOOP_TIME"),
        names=("p_gain", "i_gain", "d_gain"),
        limits=(
            *(Limit(name, constant(0.0), constant(REAL_LIMIT), "0", "9.2233717E18") for name in ("KP", "KI", "KD")),
            Limit("LOOP_TIME", constant(0.01), constant(REAL_LIMIT), "0.01", "9.2233717E18"),
        ),
        defaults=lambda _period_s: {"ISA": 0.0, "KD": 0.0},
        compute=pid_coefficients,
        dynamics=Dynamics(
            transfer=pid_transfer,
            laplace=_laplace,
            equation="y = i + p_gain e + d_gain (d - d1),  i = i_gain (e + e1) + i1".format_map,
            corners=_corners,
            steps="trapezoids for the I term, differences for D",
            integrator=Integrator("integrator"),
            signals=("INPUT", "FEEDBACK"),
            carrier=_carrier,
            stopped_by=(("MANUAL", "OUTPUT is INITIAL_VALUE + FEED_FORWARD"),),
            remarks=_remarks,
        ),
        executed_every="LOOP_TIME",
    ),
    times=BlockTimes(Time(124.0), Time(515.0), None, Time(86.80)),
    runs_on=NOT_ON_UDC,
    notes=(
        "LOOP_TIME is TICKS x tick rate where the block runs in every scan.",
        "INTEGRATOR keeps fractions of a count, so that small errors add up.",
        "MANUAL clears the histories: automatic begins at INITIAL_VALUE plus the terms of ERROR, smoothly at 0.",
        "With DERIVATIVE = TRUE the D term then begins as if FEEDBACK had been 0 before.",
        "A limit wins over MAX_CHANGE, LIMIT_PLUS over LIMIT_MINUS; SATURATED compares OUTPUT as shown.",
    ),
    step=pid_step,
)
