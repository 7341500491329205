"""PULSE_MULT: multiplies the counts of a pulse input without losing any (section 21)."""

from __future__ import annotations

from automax_ros.blocks.declare.declaration import OVERFLOW, Block, BlockTimes, Form, Input, Output, State, Time
from automax_ros.core.numbers import INT16_MAX, INT16_MIN, INT32_MAX, INT32_MIN
from automax_ros.core.types import DataType


def pulse_mult_step(
    input: int,
    reset: bool,
    word_size: int,
    initial_value: int,
    multiplier: int,
    previous: int,
    running: bool,
    was_reset: bool,
    remainder: int,
) -> tuple[int, int, bool, bool, int]:
    """Multiply counts by MULTIPLIER / 32768 and carry the remainder (21).

    ``remainder`` counts in 1/32768, exactly, with its sign; counts above 32767 that the output cannot show stay in it
    (none below -32768 can occur); it clamps at 32 bits. In relative mode the error is the low WORD_SIZE bits of
    INPUT - INPUT(n-1), sign extended; INPUT(n-1) is INITIAL_VALUE on the scan that RESET ends and INPUT on a first pass
    without RESET, which gives 0 (decision).
    """
    if reset:
        total = 0
        was_reset = True
    elif word_size > 0:
        if not running:
            previous = initial_value if was_reset else input
        total = (
            ((input - previous + (1 << (word_size - 1))) & ((1 << word_size) - 1)) - (1 << (word_size - 1))
        ) * multiplier + remainder
    else:
        total = input * multiplier + remainder
    if total >= 0:
        output = total >> 15
        remainder = total & 32767
        if output > INT16_MAX:
            output = INT16_MAX
            remainder = total - output * 32768
            if remainder > INT32_MAX:
                remainder = INT32_MAX
    else:
        output = -(-total >> 15)
        remainder = total - output * 32768
    previous = input
    running = not reset
    return output, previous, running, was_reset, remainder


PULSE_MULT = Block(
    name="PULSE_MULT",
    section="21",
    title="Pulse multiplier",
    function="OUTPUT = INT(counts * MULTIPLIER / 32768 + remainder of the last scan)",
    inputs=(
        Input.integer("INPUT", "I", "counts, or counts/scan where WORD_SIZE is 0", form=Form.VARIABLE),
        Input.boolean("RESET", "R", "TRUE holds OUTPUT at 0 and clears the remainder", default=False),
        Input.integer(
            "WORD_SIZE",
            "WS",
            "significant bits of INPUT for relative mode; 0: absolute mode, INPUT is in counts/scan",
            0,
            form=Form.LITERAL,
            low=0,
            high=16,
        ),
        Input.integer(
            "INITIAL_VALUE",
            "IV",
            "the last INPUT, right-justified, on the scan on which RESET goes FALSE; relative mode only",
            0,
        ),
        Input.integer("MULTIPLIER", "M", "gain x 32768", 32768),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "counts/scan times the gain"),),
    states=(
        State("previous", DataType.INTEGER, 0),
        State("running", DataType.BOOLEAN, False),
        State("was_reset", DataType.BOOLEAN, False),
        State("remainder", DataType.INTEGER, 0),
    ),
    times=BlockTimes(Time(18.32), Time(86.0), Time(18.96), Time(12.84)),
    notes=(
        "A gain of exactly 1 is reached only by not programming MULTIPLIER.",
        "Relative mode gives 0 on its first scan unless RESET was TRUE before.",
        "Counts that OUTPUT cannot show are given out on later scans.",
    ),
    step=pulse_mult_step,
)


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
    times=BlockTimes(Time(15.64), Time(61.0), Time(16.90), Time(10.96)),
    notes=("The count has 32 bits and stops at their limits, which is logged; the clamp of OUTPUT loses no counts.",),
    step=counter_step,
)
