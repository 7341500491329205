from fractions import Fraction
from math import trunc

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.declare.instance import InstanceError
from blocks.support import int16, repeatable, run


def outputs(block, values, **inputs):
    return [block.scan(input=value, **inputs)["output"] for value in values]


@pytest.mark.parametrize(
    ("literals", "values", "given"),
    [
        # Gain 3/4: 0.75, 1.5, 1.25, 1.0.
        pytest.param({"multiplier": 24576}, [1] * 4, [0, 1, 1, 1], id="absolute mode carries the remainder"),
        pytest.param({"word_size": 12}, [4000, 4010, 4005], [0, 10, -5], id="relative mode gives 0 first"),
        pytest.param({"word_size": 12}, [4090, 4095, 0, 6], [0, 5, 1, 6], id="relative mode wraps with the word"),
        pytest.param({"word_size": 12}, [6, 4090, 2042, 4090], [0, -12, -2048, -2048], id="and wraps back"),
        pytest.param({"word_size": 16}, [32767, -32768, 32767], [0, 1, -1], id="16 bits wrap through the sign"),
        # 0x3FF against -1 in 10 bits.
        pytest.param({"word_size": 10}, [0x3FF, -1, 1024 + 4], [0, 0, 5], id="only the low bits of INPUT count"),
        pytest.param({"word_size": 1}, [0, 1, 1, 0], [0, -1, 0, -1], id="words of one bit"),
    ],
)
def test_outputs_of_absolute_and_relative_mode(literals, values, given):
    assert outputs(run("PULSE_MULT", **literals), values) == given


def test_the_remainder_keeps_its_sign():
    block = run("PULSE_MULT", multiplier=24576)
    assert outputs(block, [-1, -1, -1, -1]) == [0, -1, -1, -1]
    assert block.scan(input=-1) == {"output": 0}
    assert block.state["remainder"] == -24576
    assert block.scan(input=1) == {"output": 0}
    assert block.state["remainder"] == 0


@pytest.mark.parametrize("value", [-32768, -1, 0, 1, 32767])
def test_the_default_multiplier_is_a_gain_of_exactly_one(value):
    block = run("PULSE_MULT")
    assert block.scan(input=value) == {"output": value}
    assert block.state["remainder"] == 0


def test_the_largest_programmed_multiplier_comes_short_of_one():
    """32767 / 32768: 32768 counts in, 32767 out."""
    assert sum(outputs(run("PULSE_MULT", multiplier=32767), [16384, 16384])) == 32767


def test_initial_value_is_the_last_input_when_reset_ends():
    block = run("PULSE_MULT", word_size=12, multiplier=16384)
    assert outputs(block, [100, 101], initial_value=50) == [0, 0]
    assert block.state["remainder"] == 16384
    assert block.scan(input=150, reset=True, initial_value=50) == {"output": 0}
    assert block.state["remainder"] == 0
    assert block.scan(input=200, initial_value=100) == {"output": 50}
    assert block.scan(input=210, initial_value=100) == {"output": 5}


def test_initial_value_counts_after_a_reset_on_the_first_scan_too():
    block = run("PULSE_MULT", word_size=12)
    assert block.scan(input=7, reset=True, initial_value=3) == {"output": 0}
    assert block.scan(input=7, initial_value=3) == {"output": 4}
    assert block.scan(input=9, reset=True, initial_value=3) == {"output": 0}
    assert block.scan(input=9, initial_value=9) == {"output": 0}


def test_reset_in_absolute_mode_clears_the_remainder():
    block = run("PULSE_MULT", multiplier=16384)
    assert outputs(block, [1, 1, 1]) == [0, 1, 0]
    assert block.scan(input=1000, reset=True) == {"output": 0}
    assert outputs(block, [1, 1], initial_value=500) == [0, 1]


def test_counts_that_the_output_cannot_show_come_later():
    """-32768 * -32768 is 32768 counts: one more than an INTEGER holds."""
    block = run("PULSE_MULT")
    assert block.scan(input=-32768, multiplier=-32768) == {"output": 32767}
    assert block.scan(input=0, multiplier=-32768) == {"output": 1}
    assert block.state["remainder"] == 0


@pytest.mark.parametrize("word_size", [-1, 17])
def test_word_size_lies_between_0_and_16(word_size):
    with pytest.raises(InstanceError, match="WORD_SIZE must lie between 0 and 16"):
        run("PULSE_MULT", word_size=word_size)


def test_the_remainder_clamps_at_32_bits():
    """-32768 * -32768 leaves a count more on each scan: past 2**31 - 1 there is no room for it (decision)."""
    block = run("PULSE_MULT")
    block.state["remainder"] = 2**31 - 1 - 32768
    assert block.scan(input=-32768, multiplier=-32768) == {"output": 32767}
    assert block.state["remainder"] == 2**31 - 1
    assert block.scan(input=-32768, multiplier=-32768) == {"output": 32767}
    assert block.state["remainder"] == 2**31 - 1


@repeatable
@given(st.lists(st.tuples(int16, int16), max_size=60))
def test_absolute_mode_loses_no_counts(rows):
    block = run("PULSE_MULT")
    given_out = sum(block.scan(input=value, multiplier=factor)["output"] for value, factor in rows)
    assert given_out * 32768 + block.state["remainder"] == sum(value * factor for value, factor in rows)


@repeatable
@given(st.integers(1, 16), st.lists(st.tuples(st.floats(-1, 1, exclude_max=True), int16), min_size=1, max_size=60))
def test_relative_mode_loses_no_counts_of_a_shaft_that_turns(word_size, rows):
    """A counter of WORD_SIZE bits follows a position; the block must see every move of it."""
    block = run("PULSE_MULT", word_size=word_size)
    position = given_out = expected = 0
    block.scan(input=0, multiplier=1)
    for turn, factor in rows:
        move = round(turn * (2 ** (word_size - 1) - 0.5) - 0.25)
        position += move
        counter = position % 2**word_size
        word = counter - 65536 if counter >= 32768 else counter
        expected += move * factor
        given_out += block.scan(input=word, multiplier=factor)["output"]
    assert given_out * 32768 + block.state["remainder"] == expected


@repeatable
@given(st.lists(st.tuples(int16, st.integers(-32767, 32767)), max_size=60))
def test_against_exact_fractions(rows):
    block = run("PULSE_MULT")
    remainder = Fraction(0)
    for value, factor in rows:
        answer = Fraction(value * factor, 32768) + remainder
        output = block.scan(input=value, multiplier=factor)["output"]
        assert output == trunc(answer)
        remainder = answer - output
        assert Fraction(block.state["remainder"], 32768) == remainder
        assert abs(remainder) < 1
