"""SHIFT_BITS and SHIFT_WORDS: they make a data structure and shift data through it (sections 30 and 31).

A data structure is a ring of columns: ``head`` is the place of column 0, a shift moves the head and not the data;
``loaded`` counts the shifts since RESET, up to the number of columns. Columns beyond the loaded ones hold old data and
count as 0. A column of booleans is one number with a bit for each channel, a column of words is a row of numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from automax_ros.blocks.declare.channels import MOST_CHANNELS, input_channels, output_channels
from automax_ros.blocks.declare.declaration import (
    NOT_ON_UDC,
    Access,
    Block,
    BlockTimes,
    Form,
    Input,
    Output,
    Special,
    State,
    Time,
)
from automax_ros.blocks.declare.rules import Contiguous, Storage
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.types import DataType, Value

STRUCTURE_STATES = ("data", "head", "loaded")
"""The states that make up a data structure."""


def shift_bits_step(
    max_columns: int,
    reset: bool,
    shift: bool,
    enable: bool,
    input1: bool,
    input2: bool,
    input3: bool,
    input4: bool,
    input5: bool,
    input6: bool,
    input7: bool,
    input8: bool,
    data: list[int],
    head: int,
    loaded: int,
) -> tuple[bool, bool, bool, bool, bool, bool, bool, bool, bool, list[int], int, int, bool]:
    """Shift a column in and the last one out; RESET zeroes structure and outputs; no shift, no new outputs (30)."""
    column = 0
    if reset:
        loaded = 0
    elif shift:
        if enable:
            if input1:
                column = column + 1
            if input2:
                column = column + 2
            if input3:
                column = column + 4
            if input4:
                column = column + 8
            if input5:
                column = column + 16
            if input6:
                column = column + 32
            if input7:
                column = column + 64
            if input8:
                column = column + 128
        head = head - 1 if head > 0 else max_columns - 1
        data[head] = column
        if loaded < max_columns:
            loaded = loaded + 1
    writes = reset or shift
    data_valid = loaded == max_columns
    leaving = 0
    if writes and loaded == max_columns:
        leaving = data[head - 1 if head > 0 else max_columns - 1]
    output1 = leaving & 1 != 0
    output2 = leaving & 2 != 0
    output3 = leaving & 4 != 0
    output4 = leaving & 8 != 0
    output5 = leaving & 16 != 0
    output6 = leaving & 32 != 0
    output7 = leaving & 64 != 0
    output8 = leaving & 128 != 0
    return (
        data_valid,
        output1,
        output2,
        output3,
        output4,
        output5,
        output6,
        output7,
        output8,
        data,
        head,
        loaded,
        writes,
    )


def _inputs(kind: DataType, structure: Special) -> tuple[Input, ...]:
    return (
        Input("STRUCTURE_NAME", structure, "SN", "name of the data structure, which the block makes", required=True),
        Input.integer(
            "MAX_COLUMNS",
            "MCOL",
            "number of columns, from 0 (input) to MCOL - 1 (output)",
            form=Form.LITERAL,
            low=1,
            high=INT16_MAX,
        ),
        Input.boolean("RESET", "R", "TRUE zeroes all data and the outputs", default=False),
        Input.boolean("SHIFT", "SH", "TRUE shifts while RESET is FALSE"),
        Input.boolean("ENABLE", "EN", "TRUE shifts the inputs into column 0, FALSE zeroes", default=True),
        *input_channels("INPUT", MOST_CHANNELS, kind, "I", "data input", required=1, unused=kind.zero),
    )


def _outputs(kind: DataType) -> tuple[Output, ...]:
    return (
        Output("DATA_VALID", DataType.BOOLEAN, "DV", "TRUE after MCOL shifts since RESET", required=False),
        *output_channels("OUTPUT", MOST_CHANNELS, kind, "O", "data output", required=1, holds=True),
    )


def _states(size: Callable[[Mapping[str, Value]], int]) -> tuple[State, ...]:
    data, head, loaded = STRUCTURE_STATES
    return (
        State(data, DataType.INTEGER, 0, size),
        State(head, DataType.INTEGER, 0, below=_columns),
        State(loaded, DataType.INTEGER, 0, below=lambda facts: _columns(facts) + 1),
    )


def _columns(facts: Mapping[str, Value]) -> int:
    return int(facts["max_columns"])


def _words(facts: Mapping[str, Value]) -> int:
    return int(facts["max_columns"]) * int(facts["channels"])


_NOTES = (
    "What enters on one shift leaves MCOL - 1 shifts later.",
    "Without a shift the outputs are not written.",
    "READ and WRITE blocks of the same task, before or after it, work on the same data structure.",
)

SHIFT_BITS = Block(
    name="SHIFT_BITS",
    section="30",
    title="Shift bits",
    function=(
        "If SHIFT: columns move on by one, column 0 = INPUTn if ENABLE, else FALSE, then OUTPUTn = column MCOL - 1"
    ),
    inputs=_inputs(DataType.BOOLEAN, Special.BITS),
    outputs=_outputs(DataType.BOOLEAN),
    states=_states(_columns),
    rules=(Contiguous(("INPUT", "OUTPUT"), MOST_CHANNELS),),
    structure=Access.MAKES,
    runs_on=NOT_ON_UDC,
    times=BlockTimes(Time(18.28, p=2.04), Time(92.0, p=19.7), None, Time(12.80, p=1.44)),
    notes=(*_NOTES, "The data structure takes MAX_COLUMNS bytes."),
    step=shift_bits_step,
)


def shift_words_step(
    max_columns: int,
    reset: bool,
    shift: bool,
    enable: bool,
    input1: int,
    input2: int,
    input3: int,
    input4: int,
    input5: int,
    input6: int,
    input7: int,
    input8: int,
    channels: int,
    data: list[int],
    head: int,
    loaded: int,
) -> tuple[bool, int, int, int, int, int, int, int, int, list[int], int, int, bool]:
    """Shift a column in and the last one out; RESET zeroes structure and outputs; no shift, no new outputs (31)."""
    if reset:
        loaded = 0
    elif shift:
        head = head - 1 if head > 0 else max_columns - 1
        place = head * channels
        data[place] = input1 if enable else 0
        if channels > 1:
            data[place + 1] = input2 if enable else 0
        if channels > 2:
            data[place + 2] = input3 if enable else 0
        if channels > 3:
            data[place + 3] = input4 if enable else 0
        if channels > 4:
            data[place + 4] = input5 if enable else 0
        if channels > 5:
            data[place + 5] = input6 if enable else 0
        if channels > 6:
            data[place + 6] = input7 if enable else 0
        if channels > 7:
            data[place + 7] = input8 if enable else 0
        if loaded < max_columns:
            loaded = loaded + 1
    writes = reset or shift
    full = writes and loaded == max_columns
    last = (head - 1 if head > 0 else max_columns - 1) * channels
    data_valid = loaded == max_columns
    output1 = data[last] if full else 0
    output2 = data[last + 1] if full and channels > 1 else 0
    output3 = data[last + 2] if full and channels > 2 else 0
    output4 = data[last + 3] if full and channels > 3 else 0
    output5 = data[last + 4] if full and channels > 4 else 0
    output6 = data[last + 5] if full and channels > 5 else 0
    output7 = data[last + 6] if full and channels > 6 else 0
    output8 = data[last + 7] if full and channels > 7 else 0
    return (
        data_valid,
        output1,
        output2,
        output3,
        output4,
        output5,
        output6,
        output7,
        output8,
        data,
        head,
        loaded,
        writes,
    )


SHIFT_WORDS = Block(
    name="SHIFT_WORDS",
    section="31",
    title="Shift words",
    function="If SHIFT: columns move on by one, column 0 = INPUTn if ENABLE, else 0, then OUTPUTn = column MCOL - 1",
    inputs=_inputs(DataType.INTEGER, Special.WORDS),
    outputs=_outputs(DataType.INTEGER),
    states=_states(_words),
    rules=(Contiguous(("INPUT", "OUTPUT"), MOST_CHANNELS), Storage("MAX_COLUMNS", per="INPUT")),
    structure=Access.MAKES,
    runs_on=NOT_ON_UDC,
    times=BlockTimes(Time(17.80, p=1.72), Time(89.0, p=13.3), None, Time(12.48, p=1.20)),
    notes=(*_NOTES, "The data structure takes 2 bytes x number of inputs x MAX_COLUMNS."),
    step=shift_words_step,
)
