"""ABSOLUTE_VALUE, INVERTER, DIFFERENCE, SUMMER and MULTIPLY_DIVIDE (sections 5, 12, 14, 18 and 33)."""

from __future__ import annotations

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
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType


def absolute_value_step(input: int) -> tuple[int]:
    """Return the magnitude; that of -32768 clamps to 32767, which is not logged (5, decision)."""
    output = input if input >= 0 else -input
    if output > INT16_MAX:
        output = INT16_MAX
    return (output,)


ABSOLUTE_VALUE = Block(
    name="ABSOLUTE_VALUE",
    section="5",
    title="Absolute value",
    function="OUTPUT = |INPUT|",
    inputs=(Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the magnitude; of -32768 it is 32767"),),
    times=BlockTimes(Time(9.16), Time(41.0), Time(8.30), Time(6.44)),
    step=absolute_value_step,
)


def inverter_step(enable: bool, input: int) -> tuple[int]:
    """Return INPUT, with the other sign while enabled; -32768 clamps to 32767, which is not logged (14, decision)."""
    output = input
    if enable:
        output = -input
        if output > INT16_MAX:
            output = INT16_MAX
    return (output,)


INVERTER = Block(
    name="INVERTER",
    section="14",
    title="Inverter",
    function="OUTPUT = -INPUT if ENABLE, else INPUT",
    inputs=(
        Input.boolean("ENABLE", "EN", "TRUE changes the sign", default=True),
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "INPUT, with the other sign while ENABLE; -(-32768) is 32767"),),
    times=BlockTimes(Time(10.84), Time(48.0), Time(9.40), Time(7.60)),
    step=inverter_step,
)


def difference_step(input1: int, input2: int) -> tuple[int, int]:
    """Subtract in 32 bit and clamp to 16, logging the clamp (12)."""
    output = input1 - input2
    problem = 0
    if output > INT16_MAX:
        output = INT16_MAX
        problem = CLAMPED
    elif output < INT16_MIN:
        output = INT16_MIN
        problem = CLAMPED
    return output, problem


DIFFERENCE = Block(
    name="DIFFERENCE",
    section="12",
    title="Difference",
    function="OUTPUT = INPUT1 - INPUT2",
    inputs=(Input.integer("INPUT1", "I1", "signal input 1"), Input.integer("INPUT2", "I2", "signal input 2")),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the difference, limited to -32768 to +32767"),),
    logs=("AMX7001",),
    times=BlockTimes(Time(10.80), Time(44.0), Time(7.97), Time(7.56)),
    step=difference_step,
)


def summer_step(input1: int, input2: int) -> tuple[int, int]:
    """Add in 32 bit and clamp to 16, logging the clamp (33)."""
    output = input1 + input2
    problem = 0
    if output > INT16_MAX:
        output = INT16_MAX
        problem = CLAMPED
    elif output < INT16_MIN:
        output = INT16_MIN
        problem = CLAMPED
    return output, problem


SUMMER = Block(
    name="SUMMER",
    section="33",
    title="Summer",
    function="OUTPUT = INPUT1 + INPUT2",
    inputs=(Input.integer("INPUT1", "I1", "signal input 1"), Input.integer("INPUT2", "I2", "signal input 2")),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the sum, limited to -32768 to +32767"),),
    logs=("AMX7001",),
    times=BlockTimes(Time(11.28), Time(44.0), Time(10.00), Time(7.88)),
    step=summer_step,
)


def multiply_divide_step(input1: int, input2: int, input3: int) -> tuple[int, int]:
    """Divide the 32-bit product, truncating toward zero, and clamp to 16 bit; only a division by zero is logged (18).

    Division by zero gives the clamp of the product's sign, 0/0 gives 0 (decision).
    """
    product = input1 * input2
    problem = 0
    if input3 > 0:
        output = product // input3 if product >= 0 else -(-product // input3)
    elif input3 < 0:
        output = -(product // -input3) if product >= 0 else product // input3
    else:
        output = product
        problem = DIVIDED_BY_ZERO
        if product > 0:
            output = INT16_MAX
        elif product < 0:
            output = INT16_MIN
    if output > INT16_MAX:
        output = INT16_MAX
    elif output < INT16_MIN:
        output = INT16_MIN
    return output, problem


MULTIPLY_DIVIDE = Block(
    name="MULTIPLY_DIVIDE",
    also_called=("MULDIV",),
    section="18",
    title="Multiply and divide",
    function="OUTPUT = INPUT1 * INPUT2 / INPUT3",
    inputs=(
        Input.integer("INPUT1", "I1", "signal input 1"),
        Input.integer("INPUT2", "I2", "signal input 2"),
        Input.integer("INPUT3", "I3", "signal input 3, the divisor"),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the quotient, limited to -32768 to +32767"),),
    logs=("AMX7003",),
    times=BlockTimes(Time(13.76), Time(71.0), Time(13.80), Time(9.64)),
    notes=(
        "The quotient truncates toward zero. The clamp is not logged.",
        "Division by zero is logged and gives the clamp of the product's sign, 0/0 gives 0.",
    ),
    step=multiply_divide_step,
)
