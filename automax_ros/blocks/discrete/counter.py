"""COUNTER: a 32-bit up and down counter (section 11)."""

from __future__ import annotations

from automax_ros.blocks.declare.declaration import OVERFLOW, Block, Form, Input, Output, State, Time, Times
from automax_ros.core.numbers import INT16_MAX, INT16_MIN, INT32_MAX, INT32_MIN
from automax_ros.core.types import DataType


def counter_step(preset: int, input_plus: int, input_minus: int, reset: bool, count: int) -> tuple[int, int, int]:
    """Count in 32 bit, where the count saturates, which is logged; OUTPUT is its 16-bit clamp, which is not (11)."""
    problem = 0
    if reset:
        count = preset
    else:
        count = count + input_plus - input_minus
        if count > INT32_MAX:
            count = INT32_MAX
            problem = OVERFLOW
        elif count < INT32_MIN:
            count = INT32_MIN
            problem = OVERFLOW
    output = INT16_MAX if count > INT16_MAX else INT16_MIN if count < INT16_MIN else count
    return output, count, problem


COUNTER = Block(
    name="COUNTER",
    section="11",
    title="Counter",
    function="OUTPUT = OUTPUT(n-1) + INPUT_PLUS - INPUT_MINUS",
    inputs=(
        Input.boolean("RESET", "R", "TRUE sets the count to PRESET", default=False),
        Input(
            "PRESET",
            DataType.DOUBLE,
            "PR",
            "the count while RESET is TRUE",
            default=0,
            form=Form.VARIABLE,
            also=DataType.INTEGER,
        ),
        Input.integer("INPUT_PLUS", "IP", "added to the count in each scan", 0),
        Input.integer("INPUT_MINUS", "IM", "subtracted from the count in each scan", 0),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the count, limited to -32768 to +32767"),),
    states=(State("count", DataType.DOUBLE, 0),),
    logs=("AMX7002",),
    times=Times(Time(15.64), Time(61.0), Time(16.90), Time(10.96)),
    notes=("The count has 32 bits and stops at their limits, which is logged; the clamp of OUTPUT loses no counts.",),
    step=counter_step,
)
