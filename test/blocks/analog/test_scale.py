from fractions import Fraction
from math import trunc

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run

MILLIAMPERES = {"input_max": 4095, "input_min": 819, "output_imax": 10000, "output_imin": 0}


@pytest.mark.parametrize(
    ("value", "output", "clamped"),
    [(819, 0, 0), (4095, 10000, 10000), (2457, 5000, 5000), (818, -3, 0), (0, -2500, 0), (4096, 10003, 10000)],
)
def test_4_to_20_ma_of_section_28_2(value, output, clamped):
    block = run("SCALE", **MILLIAMPERES)
    assert block.scan(input=value) == {"output": output}
    assert block.scan(input=value, clamp=True) == {"output": clamped}
    assert block.error == 0


def test_the_quotient_truncates_before_the_offset_is_added():
    """-1 * 1 / 2 truncates to 0, so the offset of 10 stays; truncating -0.5 + 10 would give 9."""
    assert run("SCALE").scan(input=-1, input_max=2, input_min=0, output_imax=11, output_imin=10)["output"] == 10


def test_a_falling_range_of_input():
    block = run("SCALE", input_max=0, input_min=100, output_imax=1000, output_imin=0)
    assert [block.scan(input=value)["output"] for value in (100, 75, 0, -1, 101)] == [0, 250, 1000, 1010, -10]


@pytest.mark.parametrize("value", [-5, 50, 500])
def test_clamp_takes_input_max_where_it_lies_below_input_min(value):
    block = run("SCALE", input_max=0, input_min=100, output_imax=1000, output_imin=0)
    assert block.scan(input=value, clamp=True) == {"output": 1000}


@pytest.mark.parametrize(("value", "output"), [(6, 32767), (4, -32768), (5, 0)])
def test_division_by_zero_gives_the_clamp_of_the_numerators_sign(value, output):
    block = run("SCALE", input_max=5, input_min=5, output_imax=200, output_imin=100)
    assert block.scan(input=value) == {"output": output}
    assert block.error == 7003


def test_products_are_held_wider_than_32_bit():
    """65535 * 65535 / 65535 leaves 32 bit before the division and comes back into range after it."""
    block = run("SCALE", input_max=32767, input_min=-32768, output_imax=32767, output_imin=-32768)
    assert block.scan(input=32767) == {"output": 32767}
    assert block.error == 0


@pytest.mark.parametrize(("value", "output"), [(200, 32767), (-200, -32768)])
def test_a_result_beyond_16_bit_is_clamped_and_logged(value, output):
    block = run("SCALE", input_max=100, input_min=0, output_imax=30000, output_imin=0)
    assert block.scan(input=value) == {"output": output}
    assert block.error == 7001


@repeatable
@given(int16, st.booleans(), int16, int16, int16, int16)
def test_against_exact_fractions(value, clamp, top, bottom, out_top, out_bottom):
    block = run("SCALE")
    output = block.scan(
        input=value, clamp=clamp, input_max=top, input_min=bottom, output_imax=out_top, output_imin=out_bottom
    )["output"]
    if top == bottom:
        assert block.error == 7003
        return
    if clamp:
        value = min(max(value, bottom), top)
    exact = trunc(Fraction((value - bottom) * (out_top - out_bottom), top - bottom)) + out_bottom
    assert output == min(max(exact, -32768), 32767)
    assert (block.error == 7001) == (output != exact)
