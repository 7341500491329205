"""READ_BITS, READ_WORDS, WRITE_BITS and WRITE_WORDS: single columns of a data structure (sections 23, 24, 39, 40).

The data structure is made by a SHIFT block of the same task; ``blocks/discrete/shift`` describes it.
"""

from __future__ import annotations

from automax_ros.blocks.declare.channels import MOST_CHANNELS, input_channels, names, output_channels
from automax_ros.blocks.declare.declaration import (
    NO_SUCH_COLUMN,
    NOT_ON_UDC,
    Access,
    Block,
    BlockTimes,
    Input,
    Output,
    Special,
    Step,
    Time,
)
from automax_ros.blocks.declare.rules import AtLeast
from automax_ros.core.types import DataType


def read_bits_step(
    column: int, enable: bool, max_columns: int, data: list[int], head: int, loaded: int
) -> tuple[bool, bool, bool, bool, bool, bool, bool, bool, bool, bool, int]:
    """Show a column while enabled; a column that does not exist gives FALSE and is logged (23)."""
    error = enable and (column < 0 or column >= max_columns)
    bits = 0
    if enable and column >= 0 and column < loaded:
        place = head + column
        bits = data[place if place < max_columns else place - max_columns]
    problem = 0
    if enable and (column < 0 or column >= max_columns):
        problem = NO_SUCH_COLUMN
    output1 = bits & 1 != 0
    output2 = bits & 2 != 0
    output3 = bits & 4 != 0
    output4 = bits & 8 != 0
    output5 = bits & 16 != 0
    output6 = bits & 32 != 0
    output7 = bits & 64 != 0
    output8 = bits & 128 != 0
    writes = enable
    return (error, output1, output2, output3, output4, output5, output6, output7, output8, writes, problem)


def read_words_step(
    column: int, enable: bool, max_columns: int, channels: int, data: list[int], head: int, loaded: int
) -> tuple[bool, int, int, int, int, int, int, int, int, bool, int]:
    """Show a column while enabled; a column that does not exist gives 0 and is logged (24)."""
    error = enable and (column < 0 or column >= max_columns)
    there = enable and column >= 0 and column < loaded
    place = head + column if head + column < max_columns else head + column - max_columns
    cell = place * channels
    problem = 0
    if enable and (column < 0 or column >= max_columns):
        problem = NO_SUCH_COLUMN
    output1 = data[cell] if there else 0
    output2 = data[cell + 1] if there and channels > 1 else 0
    output3 = data[cell + 2] if there and channels > 2 else 0
    output4 = data[cell + 3] if there and channels > 3 else 0
    output5 = data[cell + 4] if there and channels > 4 else 0
    output6 = data[cell + 5] if there and channels > 5 else 0
    output7 = data[cell + 6] if there and channels > 6 else 0
    output8 = data[cell + 7] if there and channels > 7 else 0
    writes = enable
    return (error, output1, output2, output3, output4, output5, output6, output7, output8, writes, problem)


def write_bits_step(
    column: int,
    enable: bool,
    input1: bool,
    input2: bool,
    input3: bool,
    input4: bool,
    input5: bool,
    input6: bool,
    input7: bool,
    input8: bool,
    programmed: int,
    max_columns: int,
    data: list[int],
    head: int,
    loaded: int,
) -> tuple[bool, int]:
    """Store the inputs in a loaded column while enabled; a column that does not exist is logged (39)."""
    error = enable and (column < 0 or column >= loaded)
    problem = 0
    if enable:
        if column >= 0 and column < loaded:
            place = head + column if head + column < max_columns else head + column - max_columns
            bits = data[place]
            bits = bits - (bits & programmed)
            if input1:
                bits = bits + 1
            if input2:
                bits = bits + 2
            if input3:
                bits = bits + 4
            if input4:
                bits = bits + 8
            if input5:
                bits = bits + 16
            if input6:
                bits = bits + 32
            if input7:
                bits = bits + 64
            if input8:
                bits = bits + 128
            data[place] = bits
        elif column < 0 or column >= max_columns:
            problem = NO_SUCH_COLUMN
    return error, problem


def write_words_step(
    column: int,
    enable: bool,
    input1: int,
    input2: int,
    input3: int,
    input4: int,
    input5: int,
    input6: int,
    input7: int,
    input8: int,
    programmed: int,
    max_columns: int,
    channels: int,
    data: list[int],
    head: int,
    loaded: int,
) -> tuple[bool, int]:
    """Store the inputs in a loaded column while enabled; a column that does not exist is logged (40)."""
    error = enable and (column < 0 or column >= loaded)
    problem = 0
    if enable:
        if column >= 0 and column < loaded:
            place = head + column if head + column < max_columns else head + column - max_columns
            cell = place * channels
            if programmed & 1:
                data[cell] = input1
            if programmed & 2:
                data[cell + 1] = input2
            if programmed & 4:
                data[cell + 2] = input3
            if programmed & 8:
                data[cell + 3] = input4
            if programmed & 16:
                data[cell + 4] = input5
            if programmed & 32:
                data[cell + 5] = input6
            if programmed & 64:
                data[cell + 6] = input7
            if programmed & 128:
                data[cell + 7] = input8
        elif column < 0 or column >= max_columns:
            problem = NO_SUCH_COLUMN
    return error, problem


_SHIFTED = "Only channels that the SHIFT block programs may be programmed, in any order."


def _block(name: str, section: str, step: Step, times: BlockTimes) -> Block:
    """Return the block that reads or writes columns of booleans or of words, as its name says."""
    kind, structure = (DataType.BOOLEAN, Special.BITS) if name.endswith("BITS") else (DataType.INTEGER, Special.WORDS)
    reads = name.startswith("READ")
    enable = "TRUE shows the column, FALSE leaves the outputs as they are" if reads else "TRUE stores the inputs"
    inputs: tuple[Input, ...] = (
        Input("STRUCTURE_NAME", structure, "SN", "name of the data structure, made by a SHIFT block", required=True),
        Input.integer("COLUMN", "COL", "number of the column, 0 to MCOL - 1"),
        Input.boolean("ENABLE", "EN", enable),
    )
    error = "TRUE if the column does not exist"
    if reads:
        channels = output_channels("OUTPUT", MOST_CHANNELS, kind, "O", "data output", required=0, holds=True)
        function = "OUTPUTn = channel n of column COLUMN of the data structure if ENABLE, else unchanged"
        notes = (
            "While ENABLE is FALSE the outputs are not written, and ERROR is FALSE.",
            "A column that is not loaded yet holds zeroes.",
        )
    else:
        channels = ()
        inputs += input_channels("INPUT", MOST_CHANNELS, kind, "I", "data input", required=0, unused=None)
        function = "Channel n of column COLUMN of the data structure = INPUTn if ENABLE"
        error += ", or was not yet loaded by the SHIFT block"
        notes = (
            "Channels that are not programmed keep their data. While ENABLE is FALSE, ERROR is FALSE.",
            "A column that is not loaded yet is refused without being logged.",
        )
    data = "OUTPUT" if reads else "INPUT"
    return Block(
        name=name,
        section=section,
        title=name.replace("_", " ").capitalize(),
        function=function,
        inputs=inputs,
        outputs=(Output("ERROR", DataType.BOOLEAN, "E", error, required=False), *channels),
        rules=(AtLeast(1, names(data, MOST_CHANNELS), f"{data.lower()}s"),),
        logs=("AMX7005",),
        structure=Access.USES,
        runs_on=NOT_ON_UDC,
        times=times,
        notes=(*notes, _SHIFTED),
        step=step,
    )


READ_BITS = _block(
    "READ_BITS", "23", read_bits_step, BlockTimes(Time(24.32, n=1.12), Time(106.0, n=7.3), None, Time(17.04, n=0.80))
)
READ_WORDS = _block(
    "READ_WORDS", "24", read_words_step, BlockTimes(Time(25.76, n=1.28), Time(111.0, n=5.6), None, Time(18.04, n=0.92))
)
WRITE_BITS = _block(
    "WRITE_BITS", "39", write_bits_step, BlockTimes(Time(25.56, j=1.36), Time(103.0, j=6.0), None, Time(17.88, j=0.96))
)
WRITE_WORDS = _block(
    "WRITE_WORDS",
    "40",
    write_words_step,
    BlockTimes(Time(25.52, j=0.36), Time(110.0, j=1.9), None, Time(17.88, j=0.28)),
)
