"""AND, OR, LATCH and TRANSITION: boolean logic (sections 8, 15, 19 and 37)."""

from __future__ import annotations

from automax_ros.blocks.declare.channels import MOST_CHANNELS, input_channels
from automax_ros.blocks.declare.declaration import Block, BlockTimes, Form, Input, Output, State, Time
from automax_ros.blocks.declare.rules import AtLeast, Contiguous
from automax_ros.core.types import DataType


def and_step(
    input1: bool, input2: bool, input3: bool, input4: bool, input5: bool, input6: bool, input7: bool, input8: bool
) -> tuple[bool]:
    """Return TRUE if all inputs are; one that is not programmed is given as TRUE (8)."""
    output = input1 and input2 and input3 and input4 and input5 and input6 and input7 and input8
    return (output,)


AND = Block(
    name="AND",
    section="8",
    title="And",
    function="OUTPUT = INPUT1 AND ... INPUTn",
    inputs=input_channels("INPUT", MOST_CHANNELS, DataType.BOOLEAN, "I", "signal input", required=1, unused=True),
    outputs=(Output("OUTPUT", DataType.BOOLEAN, "O", "TRUE if all inputs programmed are TRUE"),),
    rules=(Contiguous(("INPUT",), MOST_CHANNELS),),
    times=BlockTimes(Time(10.80, j=1.88), Time(41.0, j=8.3), Time(10.60, j=1.45), Time(7.56, j=1.32)),
    step=and_step,
)


def or_step(
    input1: bool, input2: bool, input3: bool, input4: bool, input5: bool, input6: bool, input7: bool, input8: bool
) -> tuple[bool]:
    """Return TRUE if any input is; one that is not programmed is given as FALSE (19)."""
    output = input1 or input2 or input3 or input4 or input5 or input6 or input7 or input8
    return (output,)


OR = Block(
    name="OR",
    section="19",
    title="Or",
    function="OUTPUT = INPUT1 OR ... INPUTn",
    inputs=input_channels("INPUT", MOST_CHANNELS, DataType.BOOLEAN, "I", "signal input", required=1, unused=False),
    outputs=(Output("OUTPUT", DataType.BOOLEAN, "O", "TRUE if any of the inputs programmed is TRUE"),),
    rules=(Contiguous(("INPUT",), MOST_CHANNELS),),
    times=BlockTimes(Time(10.24, j=1.88), Time(41.0, j=8.3), Time(8.90, j=1.45), Time(7.16, j=1.32)),
    step=or_step,
)


def latch_step(reset: bool, set: bool, clock: bool, input: bool) -> tuple[bool, bool]:
    """Reset before set before clock; otherwise the output variable keeps its value, whatever wrote it (15)."""
    output = not reset and (set or input)
    writes = reset or set or clock
    return output, writes


LATCH = Block(
    name="LATCH",
    section="15",
    title="Latch",
    function=("OUTPUT = FALSE if RESET, else TRUE if SET, else INPUT if CLOCK, else unchanged"),
    inputs=(
        Input.boolean("RESET", "R", "TRUE sets OUTPUT FALSE", default=False),
        Input.boolean("SET", "S", "TRUE sets OUTPUT TRUE while RESET is FALSE", default=False),
        Input.boolean("CLOCK", "CLK", "TRUE sets OUTPUT to INPUT while RESET and SET are FALSE", default=False),
        Input.boolean("INPUT", "I", "data input, read while CLOCK is TRUE", default=False),
    ),
    outputs=(Output("OUTPUT", DataType.BOOLEAN, "O", "data output", holds=True),),
    rules=(AtLeast(2, ("RESET", "SET", "CLOCK", "INPUT"), "inputs"),),
    times=BlockTimes(Time(15.04), Time(68.0), Time(14.85), Time(10.52)),
    notes=("CLOCK is a level, not an edge. The latch has no copy of its own: an unchanged OUTPUT is not written.",),
    step=latch_step,
)


def transition_step(input: bool, last: bool) -> tuple[bool, bool]:
    """Set OUTPUT for the scan in which INPUT becomes TRUE; before the first scan it counts as FALSE (37, decision)."""
    output = input and not last
    last = input
    return output, last


TRANSITION = Block(
    name="TRANSITION",
    section="37",
    title="Transition",
    function="OUTPUT = TRUE when INPUT goes from off to on",
    inputs=(Input.boolean("INPUT", "I", "signal input", form=Form.VARIABLE),),
    outputs=(Output("OUTPUT", DataType.BOOLEAN, "O", "TRUE for one scan"),),
    states=(State("last", DataType.BOOLEAN, False),),
    times=BlockTimes(Time(11.36), Time(48.0), Time(11.90), Time(7.96)),
    notes=("INPUT counts as FALSE before the first scan: one that is on then gives TRUE on the first scan.",),
    step=transition_step,
)
