"""WRITE_BITS and WRITE_WORDS (sections 39 and 40), and all blocks of one data structure together."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.instance import Instance
from blocks.discrete.test_shift_words import Shifter
from blocks.support import TICK, int16, repeatable

NO_SUCH_COLUMN = 7005
KINDS = ("BITS", "WORDS")


def on(shifter, name):
    """A block of the catalogue that uses the structure of a SHIFT block."""
    return Instance(CATALOGUE[name], TICK, shifter.block)


def sample(kind):
    """Something that is not zero."""
    return True if kind == "BITS" else -1234


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_moves_on_to_the_output(kind):
    """Into column 1 of 4: it is in the last one after two shifts."""
    value, zero = sample(kind), type(sample(kind))()
    shifter = Shifter(f"SHIFT_{kind}", 4)
    for _ in range(2):
        shifter.block.scan(shift=True, input1=zero)
    block = on(shifter, f"WRITE_{kind}")
    assert block.scan(column=1, enable=True, input1=value) == {"error": False}
    assert [shifter.block.scan(shift=True, input1=zero)["output1"] for _ in range(3)] == [zero, value, zero]


@pytest.mark.parametrize("kind", KINDS)
def test_a_write_into_the_last_column_never_reaches_the_output(kind):
    """The last column leaves with the shift that shows the one before it."""
    shifter = Shifter(f"SHIFT_{kind}", 2)
    zero = type(sample(kind))()
    for _ in range(2):
        shifter.block.scan(shift=True, input1=zero)
    on(shifter, f"WRITE_{kind}").scan(column=1, enable=True, input1=sample(kind))
    assert shifter.block.scan(shift=False, input1=zero)["output1"] == zero
    assert on(shifter, f"READ_{kind}").scan(column=1, enable=True)["output1"] == sample(kind)
    assert [shifter.block.scan(shift=True, input1=zero)["output1"] for _ in range(2)] == [zero, zero]


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_programmed_channels_are_written(kind):
    value = sample(kind)
    shifter = Shifter(f"SHIFT_{kind}", 2, 8)
    shifter.scan([value] * 8)
    changed = False if kind == "BITS" else 77
    on(shifter, f"WRITE_{kind}").scan(column=0, enable=True, input2=changed, input7=changed)
    result = on(shifter, f"READ_{kind}").scan(column=0, enable=True)
    expected = [changed if channel in (2, 7) else value for channel in range(1, 9)]
    assert [result[f"output{channel}"] for channel in range(1, 9)] == expected


@pytest.mark.parametrize("kind", KINDS)
def test_a_column_that_was_not_loaded_is_an_error_but_not_logged(kind):
    shifter = Shifter(f"SHIFT_{kind}", 3)
    write, read = on(shifter, f"WRITE_{kind}"), on(shifter, f"READ_{kind}")
    zero = type(sample(kind))()
    for shifts in range(4):
        for column in range(3):
            result = write.scan(column=column, enable=True, input1=sample(kind))
            assert result == {"error": column >= shifts}
            assert write.error == 0
            stored = read.scan(column=column, enable=True)["output1"]
            assert stored == (sample(kind) if column < shifts else zero)
        shifter.block.scan(shift=True, input1=zero)
    shifter.block.scan(shift=False, reset=True, input1=zero)
    assert write.scan(column=0, enable=True, input1=sample(kind)) == {"error": True}
    assert read.scan(column=0, enable=True)["output1"] == zero


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("column", [3, 32767, -1, -32768])
def test_a_non_existent_column_is_logged_and_stores_nothing(kind, column):
    shifter = Shifter(f"SHIFT_{kind}", 3)
    zero = type(sample(kind))()
    for _ in range(5):
        shifter.block.scan(shift=True, input1=zero)
    write, read = on(shifter, f"WRITE_{kind}"), on(shifter, f"READ_{kind}")
    for _ in range(2):
        assert write.scan(column=column, enable=True, input1=sample(kind)) == {"error": True}
        assert write.error == NO_SUCH_COLUMN
    assert [read.scan(column=number, enable=True)["output1"] for number in range(3)] == [zero] * 3


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("column", [0, 2, 3, -1])
def test_without_enable_nothing_is_stored_or_logged(kind, column):
    shifter = Shifter(f"SHIFT_{kind}", 3)
    zero = type(sample(kind))()
    shifter.block.scan(shift=True, input1=zero)
    write = on(shifter, f"WRITE_{kind}")
    write.scan(column=99, enable=True, input1=sample(kind))
    assert write.scan(column=column, enable=False, input1=sample(kind)) == {"error": False}
    assert write.error == 0
    assert on(shifter, f"READ_{kind}").scan(column=0, enable=True)["output1"] == zero


@st.composite
def steps(draw, kind, channels):
    value = st.booleans() if kind == "BITS" else int16
    values = draw(st.lists(value, min_size=channels, max_size=channels))
    programmed = draw(st.sets(st.integers(1, channels), min_size=1))
    action = draw(st.sampled_from(["shift", "shift", "zeros", "pass", "reset", "write", "write", "read", "idle"]))
    return action, values, programmed, draw(st.integers(-2, 7) | int16)


@repeatable
@given(st.sampled_from(KINDS), st.integers(1, 5), st.integers(1, 8), st.data())
def test_all_blocks_of_a_structure_against_a_list_of_columns(kind, columns, channels, data):
    shifter = Shifter(f"SHIFT_{kind}", columns, channels)
    model = shifter.model
    write, read = on(shifter, f"WRITE_{kind}"), on(shifter, f"READ_{kind}")
    for action, values, programmed, column in data.draw(st.lists(steps(kind, channels), max_size=40)):
        if action in ("write", "idle"):
            given = {channel: values[channel - 1] for channel in programmed}
            inputs = {f"input{channel}": value for channel, value in given.items()}
            result = write.scan(column=column, enable=action == "write", **inputs)
            assert result == {"error": action == "write" and not model.loaded(column)}
            assert write.error == (NO_SUCH_COLUMN if action == "write" and not model.exists(column) else 0)
            if action == "write" and model.loaded(column):
                model.write(column, given)
        elif action != "read":
            shifter.scan(values, shift=action in ("shift", "zeros"), enable=action != "zeros", reset=action == "reset")
        for number in range(columns):
            result = read.scan(column=number, enable=True)
            assert [result[f"output{channel}"] for channel in range(1, channels + 1)] == model.columns[number]
