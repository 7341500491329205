"""SUMMER and DIFFERENCE: sums clamped to 16 bits (sections 12 and 33)."""

from __future__ import annotations

from automax_ros.blocks.declaration import CLAMPED, Block, Input, Output, Time, Times
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType


def difference_step(input1: int, input2: int) -> tuple[int, int]:
    """Subtract in 32 bit and clamp to 16, logging the clamp (12)."""
    output = input1 - input2
    error = 0
    if output > INT16_MAX:
        output = INT16_MAX
        error = CLAMPED
    elif output < INT16_MIN:
        output = INT16_MIN
        error = CLAMPED
    return output, error


DIFFERENCE = Block(
    name="DIFFERENCE",
    section="12",
    title="Difference",
    function="OUTPUT = INPUT1 - INPUT2",
    inputs=(
        Input("INPUT1", DataType.INTEGER, "I1", "signal input 1", required=True),
        Input("INPUT2", DataType.INTEGER, "I2", "signal input 2", required=True),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the difference, limited to -32768 to +32767"),),
    logs=("AMX7001",),
    times=Times(Time(10.80), Time(44.0), Time(7.97), Time(7.56)),
    step=difference_step,
)


def summer_step(input1: int, input2: int) -> tuple[int, int]:
    """Add in 32 bit and clamp to 16, logging the clamp (33)."""
    output = input1 + input2
    error = 0
    if output > INT16_MAX:
        output = INT16_MAX
        error = CLAMPED
    elif output < INT16_MIN:
        output = INT16_MIN
        error = CLAMPED
    return output, error


SUMMER = Block(
    name="SUMMER",
    section="33",
    title="Summer",
    function="OUTPUT = INPUT1 + INPUT2",
    inputs=(
        Input("INPUT1", DataType.INTEGER, "I1", "signal input 1", required=True),
        Input("INPUT2", DataType.INTEGER, "I2", "signal input 2", required=True),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the sum, limited to -32768 to +32767"),),
    logs=("AMX7001",),
    times=Times(Time(11.28), Time(44.0), Time(10.00), Time(7.88)),
    step=summer_step,
)
