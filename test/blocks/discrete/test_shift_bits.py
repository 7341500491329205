"""SHIFT_BITS (section 30)."""

import pytest

from blocks.discrete.test_shift_words import Shifter
from blocks.support import run


def test_what_enters_leaves_max_columns_less_one_shifts_later():
    block = run("SHIFT_BITS", max_columns=3, channels=1)
    outputs = [block.scan(shift=True, input1=state) for state in (True, False, True, True, False)]
    assert [result["output1"] for result in outputs] == [False, False, True, False, True]
    assert [result["data_valid"] for result in outputs] == [False, False, True, True, True]


def test_a_single_column_passes_its_input_through():
    block = run("SHIFT_BITS", max_columns=1, channels=1)
    for state in (True, False, True):
        result = block.scan(shift=True, input1=state)
        assert (result["output1"], result["data_valid"]) == (state, True)


@pytest.mark.parametrize("channel", range(1, 9))
def test_each_of_eight_channels_is_its_own(channel):
    block = run("SHIFT_BITS", max_columns=2)
    for scan in range(3):
        result = block.scan(shift=True, **{f"input{number}": scan == 0 and number == channel for number in range(1, 9)})
        shown = [number for number in range(1, 9) if result[f"output{number}"]]
        assert shown == ([channel] if scan == 1 else [])


def test_enable_false_shifts_false_in():
    shifter = Shifter("SHIFT_BITS", 2, 3)
    entered = [([True, True, False], True), ([True, True, True], False), ([False, False, True], True)]
    assert [shifter.scan(column, enable=enable) for column, enable in entered] == [
        [False, False, False],
        [True, True, False],
        [False, False, False],
    ]
    assert shifter.scan([False, False, False]) == [False, False, True]


def test_reset_empties_the_structure_and_the_outputs():
    shifter = Shifter("SHIFT_BITS", 2, 2)
    for _ in range(3):
        shifter.scan([True, True])
    assert shifter.scan([True, True], reset=True) == [False, False]
    assert shifter.scan([False, True]) == [False, False]
    assert shifter.scan([False, False]) == [False, True]


def test_another_writer_keeps_what_it_wrote_until_a_shift():
    block = run("SHIFT_BITS", max_columns=1, channels=1)
    block.outputs["output1"] = True
    assert block.scan(shift=False, input1=False)["output1"] is True
    assert block.scan(shift=True, input1=False)["output1"] is False


def test_32767_columns_of_eight_channels():
    """A column takes a byte, whatever the channels (note 3)."""
    block = run("SHIFT_BITS", max_columns=32767)
    pattern = [True, False, True, True, False, False, True, False]
    inputs = {f"input{channel}": state for channel, state in enumerate(pattern, 1)}
    opposite = {name: not state for name, state in inputs.items()}
    block.scan(shift=True, **inputs)
    for _ in range(32765):
        block.scan(shift=True, **opposite)
        assert not any(block.outputs.values())
    assert list(block.scan(shift=True, **opposite).values()) == [True, *pattern]
    assert list(block.scan(shift=True, **opposite).values()) == [True, *(not state for state in pattern)]
