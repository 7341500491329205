"""RUNNING_AVERAGE and SAMPLED_AVERAGE (sections 25 and 27)."""

from __future__ import annotations

from collections.abc import Mapping

from automax_ros.blocks.declare.declaration import Block, Form, Input, Output, State, Time, Times
from automax_ros.blocks.declare.rules import ForcedUp, Storage
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType, Value


def running_average_step(
    required_samples: int,
    reset: bool,
    input: int,
    samples: list[int],
    position: int,
    taken: int,
    total: int,
    highest: int,
    lowest: int,
) -> tuple[bool, int, int, int, list[int], int, int, int, int, int]:
    """Average the last samples; those not yet taken count as 0; the quotient truncates toward zero (25).

    The samples are kept in a ring, so that a scan takes the same time for any number of them.
    """
    if reset:
        position = 0
        taken = 0
        total = 0
        highest = INT16_MIN
        lowest = INT16_MAX
    else:
        if taken < required_samples:
            taken = taken + 1
            total = total + input
        else:
            total = total + input - samples[position]
        samples[position] = input
        position = position + 1
        if position == required_samples:
            position = 0
        if input > highest:
            highest = input
        if input < lowest:
            lowest = input
    data_valid = taken == required_samples
    max_value = highest
    min_value = lowest
    output = total // required_samples if total >= 0 else -(-total // required_samples)
    return data_valid, max_value, min_value, output, samples, position, taken, total, highest, lowest


def _required_samples(facts: Mapping[str, Value]) -> int:
    return int(facts["required_samples"])


RUNNING_AVERAGE = Block(
    name="RUNNING_AVERAGE",
    section="25",
    title="Running average",
    function="OUTPUT = (INPUT(n) + ... + INPUT(n - RS + 1)) / REQUIRED_SAMPLES, in every scan",
    inputs=(
        Input.integer(
            "REQUIRED_SAMPLES", "RS", "number of samples to average", form=Form.LITERAL, low=1, high=INT16_MAX
        ),
        Input.boolean("RESET", "R", "TRUE forgets all samples; OUTPUT is 0", default=False),
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
    ),
    outputs=(
        Output("DATA_VALID", DataType.BOOLEAN, "DV", "TRUE once the required samples were taken", required=False),
        Output("MAX_VALUE", DataType.INTEGER, "MX", "largest sample since RESET; -32768 while RESET", required=False),
        Output("MIN_VALUE", DataType.INTEGER, "MN", "smallest sample since RESET; 32767 while RESET", required=False),
        Output("OUTPUT", DataType.INTEGER, "O", "the average of the last samples"),
    ),
    states=(
        State("samples", DataType.INTEGER, 0, size=_required_samples),
        State("position", DataType.INTEGER, 0, below=_required_samples),
        State("taken", DataType.INTEGER, 0, below=lambda facts: _required_samples(facts) + 1),
        State("total", DataType.DOUBLE, 0),
        State("highest", DataType.INTEGER, INT16_MIN),
        State("lowest", DataType.INTEGER, INT16_MAX),
    ),
    rules=(Storage("REQUIRED_SAMPLES"),),
    times=Times(Time(28.64), Time(125.0), Time(26.94), Time(20.04)),
    notes=("Samples not yet taken count as 0, so OUTPUT rises to the average while DATA_VALID is FALSE.",),
    step=running_average_step,
)


def sampled_average_step(
    required_samples: int,
    input: int,
    reset: bool,
    total: int,
    taken: int,
    highest: int,
    lowest: int,
    average: int,
    shown_highest: int,
    shown_lowest: int,
) -> tuple[bool, int, int, int, int, int, int, int, int, int, int]:
    """Average REQUIRED_SAMPLES samples, output the result, start over; the quotient truncates toward zero (27).

    A REQUIRED_SAMPLES that changes meanwhile is compared with the samples taken so far, whose average is shown. Up to
    the first update the outputs are what RESET makes them (decisions).
    """
    data_valid = False
    if reset:
        total = 0
        taken = 0
        highest = INT16_MIN
        lowest = INT16_MAX
        average = 0
        shown_highest = INT16_MIN
        shown_lowest = INT16_MAX
    else:
        total = total + input
        taken = taken + 1
        if input > highest:
            highest = input
        if input < lowest:
            lowest = input
        if taken >= required_samples:
            average = total // taken if total >= 0 else -(-total // taken)
            shown_highest = highest
            shown_lowest = lowest
            data_valid = True
            total = 0
            taken = 0
            highest = INT16_MIN
            lowest = INT16_MAX
    max_value = shown_highest
    min_value = shown_lowest
    output = average
    return (
        data_valid,
        max_value,
        min_value,
        output,
        total,
        taken,
        highest,
        lowest,
        average,
        shown_highest,
        shown_lowest,
    )


SAMPLED_AVERAGE = Block(
    name="SAMPLED_AVERAGE",
    section="27",
    title="Sampled average",
    function="OUTPUT = (INPUT(1) + ... + INPUT(RS)) / REQUIRED_SAMPLES, once every REQUIRED_SAMPLES scans",
    inputs=(
        Input.integer(
            "REQUIRED_SAMPLES",
            "RS",
            "number of samples to average; 0 or less counts as 1",
            low=INT16_MIN,
            high=INT16_MAX,
        ),
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
        Input.boolean("RESET", "R", "TRUE forgets all samples; OUTPUT is 0", default=False),
    ),
    outputs=(
        Output("DATA_VALID", DataType.BOOLEAN, "DV", "TRUE in the scan that updates the others", required=False),
        Output("MAX_VALUE", DataType.INTEGER, "MX", "largest of the samples; -32768 while RESET", required=False),
        Output("MIN_VALUE", DataType.INTEGER, "MN", "smallest of the samples; 32767 while RESET", required=False),
        Output("OUTPUT", DataType.INTEGER, "O", "the average of the samples"),
    ),
    states=(
        State("total", DataType.DOUBLE, 0),
        State("taken", DataType.INTEGER, 0),
        State("highest", DataType.INTEGER, INT16_MIN),
        State("lowest", DataType.INTEGER, INT16_MAX),
        State("average", DataType.INTEGER, 0),
        State("shown_highest", DataType.INTEGER, INT16_MIN),
        State("shown_lowest", DataType.INTEGER, INT16_MAX),
    ),
    rules=(ForcedUp("REQUIRED_SAMPLES", 1),),
    times=Times(Time(29.00), Time(125.0), Time(25.94), Time(20.32)),
    notes=("The first update comes on scan REQUIRED_SAMPLES. Between updates the outputs keep their values.",),
    step=sampled_average_step,
)
