"""AMPLIFIER and SELECT: sums of up to eight channels (sections 7 and 32)."""

from __future__ import annotations

from automax_ros.blocks.declare.channels import MOST_CHANNELS, input_channels, paired
from automax_ros.blocks.declare.declaration import (
    CLAMPED,
    DIVIDED_BY_ZERO,
    OVERFLOW,
    Block,
    BlockTimes,
    Input,
    Output,
    Time,
)
from automax_ros.blocks.declare.rules import Contiguous
from automax_ros.core.numbers import INT16_MAX, INT16_MIN, INT32_MAX, INT32_MIN
from automax_ros.core.types import DataType

DEFAULT_SCALE = 10000


def amplifier_step(
    input1: int,
    gain1: int,
    input2: int,
    gain2: int,
    input3: int,
    gain3: int,
    input4: int,
    gain4: int,
    input5: int,
    gain5: int,
    input6: int,
    gain6: int,
    input7: int,
    gain7: int,
    input8: int,
    gain8: int,
    scale: int,
) -> tuple[int, int]:
    """Sum the products in 32 bit and divide by SCALE, truncating toward zero (7).

    A sum that leaves 32 bit ignores the channels that follow, is logged and gives the clamp of its sign, whatever
    SCALE's sign; division by zero likewise, 0/0 gives 0 (decision).
    """
    total = input1 * gain1 + input2 * gain2
    if total >= INT32_MIN and total <= INT32_MAX:
        total = total + input3 * gain3
        if total >= INT32_MIN and total <= INT32_MAX:
            total = total + input4 * gain4
            if total >= INT32_MIN and total <= INT32_MAX:
                total = total + input5 * gain5
                if total >= INT32_MIN and total <= INT32_MAX:
                    total = total + input6 * gain6
                    if total >= INT32_MIN and total <= INT32_MAX:
                        total = total + input7 * gain7
                        if total >= INT32_MIN and total <= INT32_MAX:
                            total = total + input8 * gain8
    problem = 0
    if total > INT32_MAX:
        output = INT16_MAX
        problem = OVERFLOW
    elif total < INT32_MIN:
        output = INT16_MIN
        problem = OVERFLOW
    elif scale == 0:
        problem = DIVIDED_BY_ZERO
        output = INT16_MAX if total > 0 else total
        if total < 0:
            output = INT16_MIN
    else:
        if scale > 0:
            output = total // scale if total >= 0 else -(-total // scale)
        else:
            output = -(total // -scale) if total >= 0 else total // scale
        if output > INT16_MAX:
            output = INT16_MAX
            problem = CLAMPED
        elif output < INT16_MIN:
            output = INT16_MIN
            problem = CLAMPED
    return output, problem


AMPLIFIER = Block(
    name="AMPLIFIER",
    section="7",
    title="Amplifier",
    function="OUTPUT = (INPUT1 * GAIN1 + ... + INPUTn * GAINn) / SCALE",
    inputs=(
        *paired(
            input_channels("INPUT", MOST_CHANNELS, DataType.INTEGER, "I", "signal input", required=1, unused=0),
            input_channels("GAIN", MOST_CHANNELS, DataType.INTEGER, "G", "gain", required=1, unused=0),
        ),
        Input.integer("SCALE", "SC", "scale factor; below 0 it inverts the output", DEFAULT_SCALE),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the scaled sum, limited to -32768 to +32767"),),
    rules=(Contiguous(("INPUT", "GAIN"), MOST_CHANNELS),),
    logs=("AMX7001", "AMX7002", "AMX7003"),
    times=BlockTimes(Time(13.16, k=3.12), Time(62.0, k=13.8), Time(15.30, k=1.80), Time(9.2, k=2.20)),
    notes=(
        "The order in which the pairs are written does not matter.",
        "Once the sum leaves 32 bits the channels that follow are ignored, and OUTPUT is the clamp of the sum's sign.",
        "SCALE 0 is logged and gives the clamp of the sum's sign, 0 for a sum of 0.",
    ),
    step=amplifier_step,
)


def select_step(
    input1: int,
    select1: bool,
    input2: int,
    select2: bool,
    input3: int,
    select3: bool,
    input4: int,
    select4: bool,
    input5: int,
    select5: bool,
    input6: int,
    select6: bool,
    input7: int,
    select7: bool,
    input8: int,
    select8: bool,
) -> tuple[int, int]:
    """Sum the selected inputs in 32 bit, which they cannot leave, and clamp to 16, logging the clamp (32)."""
    output = input1 if select1 else 0
    if select2:
        output = output + input2
    if select3:
        output = output + input3
    if select4:
        output = output + input4
    if select5:
        output = output + input5
    if select6:
        output = output + input6
    if select7:
        output = output + input7
    if select8:
        output = output + input8
    problem = 0
    if output > INT16_MAX:
        output = INT16_MAX
        problem = CLAMPED
    elif output < INT16_MIN:
        output = INT16_MIN
        problem = CLAMPED
    return output, problem


SELECT = Block(
    name="SELECT",
    section="32",
    title="Select",
    function="OUTPUT = sum of the inputs whose SELECTn is TRUE",
    inputs=paired(
        input_channels("INPUT", MOST_CHANNELS, DataType.INTEGER, "I", "signal input", required=1, unused=0),
        input_channels(
            "SELECT", MOST_CHANNELS, DataType.BOOLEAN, "SE", "TRUE adds signal input", required=1, unused=False
        ),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the sum, limited to -32768 to +32767; 0 if none is selected"),),
    rules=(Contiguous(("INPUT", "SELECT"), MOST_CHANNELS),),
    logs=("AMX7001",),
    times=BlockTimes(Time(11.36, j=2.52), Time(44.0, j=12.2), Time(12.50, j=1.50), Time(7.96, j=1.76)),
    notes=("The order in which the pairs are written does not matter.",),
    step=select_step,
)
