"""BIT_SELECT, PACK_BITS and UNPACK_BITS: sixteen booleans and a number (sections 9, 20 and 38)."""

from __future__ import annotations

from automax_ros.blocks.declare.channels import input_channels, names, output_channels
from automax_ros.blocks.declare.declaration import NOT_ON_UDC, Block, BlockTimes, Input, Output, Time
from automax_ros.blocks.declare.rules import AtLeast
from automax_ros.core.types import DataType

BITS = 16
"""Bits of an INTEGER, numbered from 0; bit 15 is the sign."""


def bit_select_step(
    input: int, offset: int
) -> tuple[bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool]:
    """Set the output of number INPUT - OFFSET, computed in 32 bit, and clear the others (9)."""
    index = input - offset
    output0 = index == 0
    output1 = index == 1
    output2 = index == 2
    output3 = index == 3
    output4 = index == 4
    output5 = index == 5
    output6 = index == 6
    output7 = index == 7
    output8 = index == 8
    output9 = index == 9
    output10 = index == 10
    output11 = index == 11
    output12 = index == 12
    output13 = index == 13
    output14 = index == 14
    output15 = index == 15
    return (
        output0,
        output1,
        output2,
        output3,
        output4,
        output5,
        output6,
        output7,
        output8,
        output9,
        output10,
        output11,
        output12,
        output13,
        output14,
        output15,
    )


BIT_SELECT = Block(
    name="BIT_SELECT",
    section="9",
    title="Bit select",
    function="OUTPUT(INPUT - OFFSET) is TRUE, all other outputs are FALSE; all are FALSE if there is no such output",
    inputs=(
        Input.integer("INPUT", "I", "signal input"),
        Input.integer("OFFSET", "OFFSET", "subtracted from INPUT to give the number of the output", 0),
    ),
    outputs=output_channels("OUTPUT", BITS, DataType.BOOLEAN, "O", "data output", required=0, first=0),
    rules=(AtLeast(1, names("OUTPUT", BITS, 0), "outputs"),),
    times=BlockTimes(Time(26.04, n=1.20), Time(118.0, n=6.5), None, Time(18.24, n=0.84)),
    runs_on=NOT_ON_UDC,
    notes=("Only the outputs that are needed are programmed, in any order.",),
    step=bit_select_step,
)


def pack_bits_step(
    input0: bool,
    input1: bool,
    input2: bool,
    input3: bool,
    input4: bool,
    input5: bool,
    input6: bool,
    input7: bool,
    input8: bool,
    input9: bool,
    input10: bool,
    input11: bool,
    input12: bool,
    input13: bool,
    input14: bool,
    input15: bool,
) -> tuple[int]:
    """Build the number bit by bit; bit 15 counts as -32768 (20)."""
    output = 0
    if input0:
        output = output + 1
    if input1:
        output = output + 2
    if input2:
        output = output + 4
    if input3:
        output = output + 8
    if input4:
        output = output + 16
    if input5:
        output = output + 32
    if input6:
        output = output + 64
    if input7:
        output = output + 128
    if input8:
        output = output + 256
    if input9:
        output = output + 512
    if input10:
        output = output + 1024
    if input11:
        output = output + 2048
    if input12:
        output = output + 4096
    if input13:
        output = output + 8192
    if input14:
        output = output + 16384
    if input15:
        output = output - 32768
    return (output,)


PACK_BITS = Block(
    name="PACK_BITS",
    section="20",
    title="Pack bits",
    function="Bit n of OUTPUT is INPUTn; an input that is not programmed counts as FALSE",
    inputs=input_channels(
        "INPUT", BITS, DataType.BOOLEAN, "I", "signal input for bit", required=0, unused=False, first=0
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "the number; bit 15 makes it negative"),),
    rules=(AtLeast(1, names("INPUT", BITS, 0), "inputs"),),
    times=BlockTimes(Time(24.28, j=1.44), Time(110.0, j=5.0), Time(16.16, j=1.25), Time(17.00, j=1.00)),
    notes=("Only the inputs that are needed are programmed, in any order.",),
    step=pack_bits_step,
)


def unpack_bits_step(
    input: int,
) -> tuple[bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, bool]:
    """Take the number apart; bit 15 is its sign (38)."""
    output0 = input & 1 != 0
    output1 = input & 2 != 0
    output2 = input & 4 != 0
    output3 = input & 8 != 0
    output4 = input & 16 != 0
    output5 = input & 32 != 0
    output6 = input & 64 != 0
    output7 = input & 128 != 0
    output8 = input & 256 != 0
    output9 = input & 512 != 0
    output10 = input & 1024 != 0
    output11 = input & 2048 != 0
    output12 = input & 4096 != 0
    output13 = input & 8192 != 0
    output14 = input & 16384 != 0
    output15 = input < 0
    return (
        output0,
        output1,
        output2,
        output3,
        output4,
        output5,
        output6,
        output7,
        output8,
        output9,
        output10,
        output11,
        output12,
        output13,
        output14,
        output15,
    )


UNPACK_BITS = Block(
    name="UNPACK_BITS",
    section="38",
    title="Unpack bits",
    function="OUTPUTn is bit n of INPUT",
    inputs=(Input.integer("INPUT", "I", "signal input"),),
    outputs=output_channels("OUTPUT", BITS, DataType.BOOLEAN, "O", "data output for bit", required=0, first=0),
    rules=(AtLeast(1, names("OUTPUT", BITS, 0), "outputs"),),
    times=BlockTimes(Time(23.40, n=1.44), Time(106.0, n=7.3), Time(14.40, n=1.90), Time(16.40, n=1.00)),
    notes=("Only the outputs that are needed are programmed, in any order.",),
    step=unpack_bits_step,
)
