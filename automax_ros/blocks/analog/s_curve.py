"""S_CURVE: a ramp whose rate changes at a limited jerk (section 26)."""

from __future__ import annotations

from automax_ros.blocks.declare.declaration import CLAMPED, Block, BlockTimes, Form, Input, Output, State, Time
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType


def s_curve_step(  # noqa: PLR0912, PLR0915 - a step function calls no other
    input: int,
    reset: bool,
    hold: bool,
    accel_rate: int,
    decel_rate: int,
    jerk_rate: int,
    scale: int,
    reverse: bool,
    initial_value: int,
    register: int,
    speed: int,
) -> tuple[int, int, int, int, int]:
    """Move the register of OUTPUT x SCALE toward INPUT x SCALE; its speed changes by at most JERK_RATE per scan (26).

    The speed is the largest that can still be reduced to 0, by JERK_RATE per scan, before INPUT is reached: k full
    steps of the jerk reduce it by k x JERK_RATE within JERK_RATE x k (k + 1) / 2 (decision). ACCEL_RATE applies upward
    and DECEL_RATE downward, exchanged by REVERSE (decision). With JERK_RATE at least both rates the block is RAMP with
    ABS_RAMP = FALSE, reversals included; JERK_RATE 0 keeps the present speed (decisions). At the end of the 16-bit
    range OUTPUT is clamped, which is logged, and the rate is set to 0 (note 5).
    """
    accel = accel_rate if accel_rate >= 0 else -accel_rate
    decel = decel_rate if decel_rate >= 0 else -decel_rate
    jerk = jerk_rate if jerk_rate >= 0 else -jerk_rate
    problem = 0
    if reset:
        register = initial_value * scale
        speed = 0
    else:
        distance = input * scale - register
        if jerk >= accel and jerk >= decel:
            up = decel if reverse else accel
            down = accel if reverse else decel
            speed = distance if distance <= up else up
            if speed < -down:
                speed = -down
            if hold:
                speed = 0
        elif jerk > 0 and hold:
            if speed > jerk:
                speed = speed - jerk
            elif speed < -jerk:
                speed = speed + jerk
            else:
                speed = 0
        elif jerk > 0:
            falls = distance < 0
            limit = accel if falls == reverse else decel
            if falls:
                distance = -distance
                speed = -speed
            slowest = speed - jerk
            speed = speed + jerk
            if speed > limit:
                speed = limit
            if speed > 0:
                steps = speed // jerk
                taken_back = jerk * (steps * (steps + 1) // 2)
                if speed * (steps + 1) - taken_back > distance:
                    if taken_back > distance:
                        steps = steps - 1
                        taken_back = jerk * (steps * (steps + 1) // 2)
                        if taken_back > distance:
                            steps = steps - 1
                            taken_back = jerk * (steps * (steps + 1) // 2)
                    speed = slowest
                    if taken_back <= distance:
                        speed = steps * jerk + (distance - taken_back) // (steps + 1)
            if speed < slowest:
                speed = slowest
            if falls:
                speed = -speed
        register = register + speed
        if register > INT16_MAX * scale:
            register = INT16_MAX * scale
            speed = 0
            problem = CLAMPED
        elif register < INT16_MIN * scale:
            register = INT16_MIN * scale
            speed = 0
            problem = CLAMPED
    if scale == 1:
        output = register
    elif register >= 0:
        output = register // scale
    else:
        output = -(-register // scale)
    rate = speed if speed <= INT16_MAX else INT16_MAX
    return output, rate, register, speed, problem


S_CURVE = Block(
    name="S_CURVE",
    section="26",
    title="S curve",
    function="OUTPUT moves toward INPUT as RAMP does, and its rate changes by at most JERK_RATE / SCALE a scan",
    inputs=(
        Input.integer("INPUT", "I", "signal input"),
        Input.boolean("RESET", "R", "TRUE holds OUTPUT at INITIAL_VALUE", default=False),
        Input.boolean("HOLD", "H", "TRUE brings the rate down to 0 at the jerk rate", default=False),
        Input.integer("ACCEL_RATE", "AR", "rate upward in counts/scan, its magnitude", INT16_MAX),
        Input.integer("DECEL_RATE", "DR", "rate downward in counts/scan, its magnitude", INT16_MAX),
        Input.integer("JERK_RATE", "JR", "change of rate in counts/scan**2, its magnitude", INT16_MAX),
        Input.integer(
            "SCALE",
            "SC",
            "divides the rates and the jerk rate: with scans per second here the rates are in counts/s",
            1,
            form=Form.LITERAL,
            low=1,
            high=INT16_MAX,
        ),
        Input.boolean("REVERSE", "REV", "TRUE exchanges ACCEL_RATE and DECEL_RATE", default=False),
        Input.integer("INITIAL_VALUE", "IV", "the output while RESET is TRUE", 0),
    ),
    outputs=(
        Output("OUTPUT", DataType.INTEGER, "O", "the curve"),
        Output("RATE", DataType.INTEGER, "RATE", "change of OUTPUT x SCALE in this scan", required=False),
    ),
    states=(State("register", DataType.INTEGER, 0), State("speed", DataType.INTEGER, 0)),
    logs=("AMX7001",),
    times=BlockTimes(Time(47.00), Time(282.0), Time(35.01), Time(32.92)),
    notes=(
        "A rate of 0 holds the curve in that direction.",
        "A move of D counts takes D / ACCEL + ACCEL / JERK scans, or 2 x sqrt(D / JERK) if ACCEL is not reached.",
        "With JERK_RATE at least both rates the block does what RAMP does with ABS_RAMP = FALSE.",
        "OUTPUT overshoots only if INPUT, a rate or JERK_RATE changes so late that the rate cannot come down in time.",
        "If it leaves the 16-bit range it is clamped, which is logged, and the rate is set to 0.",
        "JERK_RATE 0 keeps the rate there is.",
    ),
    step=s_curve_step,
)
