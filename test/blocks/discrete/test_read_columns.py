"""READ_BITS and READ_WORDS (sections 23 and 24)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.instance import Instance, InstanceError
from blocks.discrete.test_shift_words import Shifter
from blocks.support import TICK, int16, repeatable

NO_SUCH_COLUMN = 7005
KINDS = ("BITS", "WORDS")


def reader(shifter, kind):
    """A READ block of the structure that a SHIFT block makes."""
    return Instance(CATALOGUE[f"READ_{kind}"], TICK, shifter.block)


def values_of(kind, *numbers):
    """Numbers as the structure holds them."""
    return [bool(number) for number in numbers] if kind == "BITS" else list(numbers)


def filled(kind, columns, channels, shifts):
    """A SHIFT block after some shifts: odd ones brought 1, 2 ... in, even ones zeros."""
    shifter = Shifter(f"SHIFT_{kind}", columns, channels)
    for number in range(1, shifts + 1):
        shifter.scan(values_of(kind, *(number % 2 * channel for channel in range(1, channels + 1))))
    return shifter


@pytest.mark.parametrize("kind", KINDS)
def test_reads_any_channel_of_any_column(kind):
    shifter = filled(kind, 4, 8, 3)
    block = reader(shifter, kind)
    for column, full in ((0, True), (1, False), (2, True), (3, False)):
        result = block.scan(column=column, enable=True)
        shown = [result[f"output{channel}"] for channel in range(1, 9)]
        assert shown == values_of(kind, *(channel if full else 0 for channel in range(1, 9)))
        assert result["error"] is False
        assert block.error == 0


@pytest.mark.parametrize("kind", KINDS)
def test_a_column_that_is_not_loaded_yet_is_empty_and_no_error(kind):
    block = reader(Shifter(f"SHIFT_{kind}", 3, 1), kind)
    block.outputs["output1"] = values_of(kind, 1)[0]
    result = block.scan(column=2, enable=True)
    assert (result["output1"], result["error"], block.error) == (0, False, 0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("column", [3, 4, 32767, -1, -3, -32768])
def test_a_non_existent_column_gives_zeros_error_and_a_log_entry_every_time(kind, column):
    block = reader(filled(kind, 3, 2, 5), kind)
    block.scan(column=0, enable=True)
    assert block.outputs["output2"]
    for _ in range(2):
        result = block.scan(column=column, enable=True)
        assert (result["output1"], result["output2"]) == tuple(values_of(kind, 0, 0))
        assert result["error"] is True
        assert block.error == NO_SUCH_COLUMN
    assert block.scan(column=2, enable=True)["error"] is False
    assert block.error == 0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("column", [0, 3, -1])
def test_without_enable_the_outputs_stay_and_nothing_is_logged(kind, column):
    block = reader(filled(kind, 3, 2, 1), kind)
    block.scan(column=0, enable=True)
    block.outputs["output1"] = values_of(kind, 0)[0]
    result = block.scan(column=column, enable=False)
    assert (result["output1"], result["output2"]) == tuple(values_of(kind, 0, 2))
    assert result["error"] is False
    assert block.error == 0
    block.scan(column=99, enable=True)
    assert block.scan(column=99, enable=False)["error"] is False


@pytest.mark.parametrize("kind", KINDS)
def test_sees_shift_and_reset_at_once(kind):
    shifter = filled(kind, 2, 1, 1)
    block = reader(shifter, kind)
    assert block.scan(column=0, enable=True)["output1"] == 1
    shifter.scan(values_of(kind, 0))
    assert [block.scan(column=column, enable=True)["output1"] for column in (0, 1)] == [0, 1]
    shifter.scan(values_of(kind, 1), reset=True)
    assert [block.scan(column=column, enable=True)["output1"] for column in (0, 1)] == [0, 0]


@pytest.mark.parametrize("name", ["READ_BITS", "READ_WORDS", "WRITE_BITS", "WRITE_WORDS"])
def test_needs_a_structure(name):
    with pytest.raises(InstanceError):
        Instance(CATALOGUE[name], TICK)


@pytest.mark.parametrize("kind", KINDS)
def test_the_last_column_of_the_largest_structure(kind):
    columns = 32767 if kind == "BITS" else 16383
    shifter = filled(kind, columns, 1, 1)
    block = reader(shifter, kind)
    for shifts in (1, 2):
        assert block.scan(column=shifts - 1, enable=True)["output1"] == 1
        shifter.scan(values_of(kind, 0))
    for _ in range(columns - 3):
        shifter.block.scan(shift=True, input1=values_of(kind, 0)[0])
    assert block.scan(column=columns - 1, enable=True)["output1"] == 1
    assert block.scan(column=columns - 2, enable=True)["output1"] == 0
    result = block.scan(column=columns, enable=True)
    assert (result["error"], result["output1"]) == (True, 0)


@repeatable
@given(st.sampled_from(KINDS), st.integers(1, 5), st.integers(1, 8), st.data())
def test_against_a_list_of_columns(kind, columns, channels, data):
    shifter = Shifter(f"SHIFT_{kind}", columns, channels)
    block = reader(shifter, kind)
    value = st.booleans() if kind == "BITS" else int16
    steps = st.tuples(
        st.sampled_from(["shift", "shift", "read", "read", "read", "disabled", "other", "reset"]),
        st.lists(value, min_size=channels, max_size=channels),
        st.integers(-2, 6) | int16,
    )
    shown = list(shifter.model.empty)
    for step, values, column in data.draw(st.lists(steps, max_size=40)):
        if step in ("shift", "reset"):
            shifter.scan(values, reset=step == "reset")
            continue
        if step == "other":
            shown = list(values)
            block.outputs.update({f"output{channel}": item for channel, item in enumerate(values, 1)})
            continue
        result = block.scan(column=column, enable=step == "read")
        missing = step == "read" and not shifter.model.exists(column)
        if step == "read":
            shown = shifter.model.empty if missing else shifter.model.columns[column]
        assert [result[f"output{channel}"] for channel in range(1, channels + 1)] == list(shown)
        assert result["error"] is missing
        assert block.error == (NO_SUCH_COLUMN if missing else 0)
