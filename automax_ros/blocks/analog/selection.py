"""LIMIT, MOVE, SCALE and SWITCH: blocks that limit, pass, scale and select signals (sections 16, 17, 28 and 34)."""

from __future__ import annotations

from automax_ros.blocks.declare.channels import MOST_CHANNELS, input_channels, output_channels
from automax_ros.blocks.declare.declaration import (
    CLAMPED,
    DIVIDED_BY_ZERO,
    Block,
    BlockTimes,
    Form,
    Input,
    Output,
    Time,
)
from automax_ros.blocks.declare.rules import Contiguous
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType


def limit_step(input: int, limit_plus: int, limit_minus: int) -> tuple[bool, bool, int]:
    """Limit a signal; LIMIT_PLUS wins where it lies below LIMIT_MINUS, then both SATURATED are TRUE (16, decision)."""
    output = limit_minus if input < limit_minus else input
    if output > limit_plus:
        output = limit_plus
    saturated_plus = output >= limit_plus
    saturated_minus = output <= limit_minus
    return saturated_plus, saturated_minus, output


LIMIT = Block(
    name="LIMIT",
    section="16",
    title="Limit",
    function="OUTPUT = INPUT, held between LIMIT_MINUS and LIMIT_PLUS",
    inputs=(
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
        Input.integer("LIMIT_PLUS", "LP", "upper limit", INT16_MAX),
        Input.integer("LIMIT_MINUS", "LM", "lower limit", INT16_MIN),
    ),
    outputs=(
        Output("SATURATED_PLUS", DataType.BOOLEAN, "SP", "TRUE if OUTPUT reaches LIMIT_PLUS", required=False),
        Output("SATURATED_MINUS", DataType.BOOLEAN, "SM", "TRUE if OUTPUT reaches LIMIT_MINUS", required=False),
        Output("OUTPUT", DataType.INTEGER, "O", "the limited signal"),
    ),
    times=BlockTimes(Time(18.20), Time(69.0), Time(15.05), Time(12.76)),
    notes=("Where LIMIT_PLUS lies below LIMIT_MINUS, OUTPUT is LIMIT_PLUS.",),
    step=limit_step,
)


def scale_step(
    input: int, clamp: bool, input_max: int, input_min: int, output_imax: int, output_imin: int
) -> tuple[int, int]:
    """Map a range onto another (28).

    The product is held exact, the division truncates toward zero, OUTPUT_IMIN is added to the truncated quotient and
    only the result clamps. INPUT_MAX equal to INPUT_MIN gives the clamp of the product's sign, 0 for 0, without
    OUTPUT_IMIN. Where INPUT_MAX lies below INPUT_MIN, CLAMP takes INPUT_MAX, as LIMIT does (decisions).
    """
    value = input
    if clamp:
        if value < input_min:
            value = input_min
        if value > input_max:
            value = input_max
    product = (value - input_min) * (output_imax - output_imin)
    problem = 0
    if input_max > input_min:
        if product >= 0:
            output = product // (input_max - input_min) + output_imin
        else:
            output = output_imin - -product // (input_max - input_min)
    elif input_max < input_min:
        if product <= 0:
            output = -product // (input_min - input_max) + output_imin
        else:
            output = output_imin - product // (input_min - input_max)
    else:
        problem = DIVIDED_BY_ZERO
        output = INT16_MAX if product > 0 else INT16_MIN if product < 0 else 0
    if output > INT16_MAX:
        output = INT16_MAX
        problem = CLAMPED
    elif output < INT16_MIN:
        output = INT16_MIN
        problem = CLAMPED
    return output, problem


SCALE = Block(
    name="SCALE",
    section="28",
    title="Scale",
    function="OUTPUT = (INPUT - INPUT_MIN) * (OUTPUT_IMAX - OUTPUT_IMIN) / (INPUT_MAX - INPUT_MIN) + OUTPUT_IMIN",
    inputs=(
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
        Input.boolean("CLAMP", "CL", "TRUE clamps the value of INPUT to INPUT_MIN and INPUT_MAX", default=False),
        Input.integer("INPUT_MAX", "IMX", "input at which OUTPUT is OUTPUT_IMAX"),
        Input.integer("INPUT_MIN", "IMN", "input at which OUTPUT is OUTPUT_IMIN"),
        Input.integer("OUTPUT_IMAX", "OIMX", "output when INPUT equals INPUT_MAX"),
        Input.integer("OUTPUT_IMIN", "OIMN", "output when INPUT equals INPUT_MIN"),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the scaled signal, limited to -32768 to +32767"),),
    logs=("AMX7001", "AMX7003"),
    times=BlockTimes(Time(22.48), Time(98.0), Time(18.30), Time(15.72)),
    notes=(
        "The quotient truncates toward zero before OUTPUT_IMIN is added.",
        "INPUT_MAX equal to INPUT_MIN logs a division by zero; OUTPUT is then 32767, -32768 or 0.",
    ),
    step=scale_step,
)


def switch_step(input1: int, input2: int, select: bool) -> tuple[int]:
    """Choose one of two signals (34)."""
    output = input1 if select else input2
    return (output,)


SWITCH = Block(
    name="SWITCH",
    section="34",
    title="Switch",
    function="OUTPUT = INPUT1 if SELECT, else INPUT2",
    inputs=(
        Input.integer("INPUT1", "I1", "signal passed while SELECT is TRUE"),
        Input.integer("INPUT2", "I2", "signal passed while SELECT is FALSE"),
        Input.boolean("SELECT", "SE", "signal select"),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the selected signal"),),
    times=BlockTimes(Time(11.52), Time(47.0), Time(12.55), Time(8.08)),
    step=switch_step,
)


def move_step(
    enable: bool, input1: int, input2: int, input3: int, input4: int, input5: int, input6: int, input7: int, input8: int
) -> tuple[int, int, int, int, int, int, int, int, bool]:
    """Pass the inputs on while enabled; otherwise the output variables keep their values, whatever wrote them (17)."""
    output1 = input1
    output2 = input2
    output3 = input3
    output4 = input4
    output5 = input5
    output6 = input6
    output7 = input7
    output8 = input8
    writes = enable
    return output1, output2, output3, output4, output5, output6, output7, output8, writes


MOVE = Block(
    name="MOVE",
    section="17",
    title="Move",
    function="OUTPUT1 = INPUT1, ... OUTPUTn = INPUTn if ENABLE, else unchanged",
    inputs=(
        Input.boolean("ENABLE", "EN", "FALSE leaves all outputs as they are", default=True),
        *input_channels("INPUT", MOST_CHANNELS, DataType.INTEGER, "I", "signal input", required=1, unused=0),
    ),
    outputs=output_channels("OUTPUT", MOST_CHANNELS, DataType.INTEGER, "O", "data output", required=1, holds=True),
    rules=(Contiguous(("INPUT", "OUTPUT"), MOST_CHANNELS),),
    times=BlockTimes(Time(10.40, p=2.32), Time(39.0, p=11.0), Time(10.40, p=1.80), Time(7.28, p=1.64)),
    notes=(
        "The block has no copy of its own: an output forced and released while ENABLE is FALSE keeps the forced value.",
        "The order in which the pairs are written does not matter.",
    ),
    step=move_step,
    for_booleans="OR with INPUT1 alone passes a BOOLEAN on; or assign it: B@ = A@",
)
