"""RAMP: a signal that moves at a limited rate (section 22)."""

from __future__ import annotations

from automax_ros.blocks.declare.declaration import Block, BlockTimes, Form, Input, Output, State, Time
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.types import DataType


def ramp_step(
    input: int,
    abs_ramp: bool,
    reset: bool,
    initial_value: int,
    hold: bool,
    accel_rate: int,
    decel_rate: int,
    scale: int,
    register: int,
) -> tuple[int, int, int]:
    """Move the register of OUTPUT x SCALE toward INPUT x SCALE by at most a rate (22).

    In the absolute-value ramp DECEL_RATE applies toward zero, and a move that would cross zero stops there for a scan.
    OUTPUT truncates toward zero. A rate of -32768 counts as 32768; RATE, the register's move, clamps to 16 bit and is 0
    while HOLD or RESET (decisions).
    """
    move = 0
    if reset:
        register = initial_value * scale
    elif not hold:
        move = input * scale - register
        if move > 0:
            if abs_ramp and register < 0:
                most = decel_rate if decel_rate >= 0 else -decel_rate
                if most > -register:
                    most = -register
            else:
                most = accel_rate if accel_rate >= 0 else -accel_rate
            if move > most:
                move = most
            register = register + move
        elif move < 0:
            if abs_ramp and register <= 0:
                most = -accel_rate if accel_rate >= 0 else accel_rate
            else:
                most = -decel_rate if decel_rate >= 0 else decel_rate
                if abs_ramp and most < -register:
                    most = -register
            if move < most:
                move = most
            register = register + move
    if scale == 1:
        output = register
    elif register >= 0:
        output = register // scale
    else:
        output = -(-register // scale)
    rate = move if move <= INT16_MAX else INT16_MAX
    return output, rate, register


RAMP = Block(
    name="RAMP",
    section="22",
    title="Ramp",
    function="OUTPUT moves toward INPUT by at most ACCEL_RATE / SCALE or DECEL_RATE / SCALE counts per scan",
    inputs=(
        Input.integer("INPUT", "I", "signal input"),
        Input.boolean(
            "ABS_RAMP",
            "ABS",
            "TRUE: accel leads away from zero, decel toward it; FALSE: accel leads up, decel down",
            default=True,
            form=Form.LITERAL,
        ),
        Input.boolean("RESET", "R", "TRUE holds OUTPUT at INITIAL_VALUE", default=False),
        Input.integer("INITIAL_VALUE", "IV", "the output while RESET is TRUE", 0),
        Input.boolean("HOLD", "H", "TRUE holds OUTPUT where it is", default=False),
        Input.integer("ACCEL_RATE", "AR", "acceleration in counts/scan, its magnitude", INT16_MAX),
        Input.integer("DECEL_RATE", "DR", "deceleration in counts/scan, its magnitude", INT16_MAX),
        Input.integer(
            "SCALE",
            "SC",
            "divides both rates: with scans per second here they are in counts/s",
            1,
            form=Form.LITERAL,
            low=1,
            high=INT16_MAX,
        ),
    ),
    outputs=(
        Output("OUTPUT", DataType.INTEGER, "O", "the ramp"),
        Output("RATE", DataType.INTEGER, "RATE", "change of OUTPUT x SCALE in this scan", required=False),
    ),
    states=(State("register", DataType.INTEGER, 0),),
    times=BlockTimes(Time(27.72), Time(122.0), Time(24.96), Time(19.40)),
    notes=(
        "A rate of 0 holds the ramp in that direction.",
        "The rate in counts/s is rate / SCALE / T: at 5.5 ms from 0.00554882 to 5957636.4.",
        "An absolute-value ramp that would cross zero stops at zero for one scan.",
    ),
    step=ramp_step,
)
