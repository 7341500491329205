"""UPDN: the three cases of its algorithm, REAL arithmetic, EnableIn and prescan."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.logix.updn import UpDownAccumulator
from logix.support import repeatable

real = st.floats(width=32, allow_nan=False, allow_infinity=False)


def scanned(tag, **inputs):
    for name, value in inputs.items():
        setattr(tag, name, value)
    tag.scan()
    return tag.Out


def test_sums_up_plus_less_minus():
    tag = UpDownAccumulator()
    assert [scanned(tag, InPlus=5.0, InMinus=2.0), scanned(tag), scanned(tag, InPlus=0.0)] == [3.0, 6.0, 4.0]
    assert tag.EnableOut


def test_initialize_sets_initial_value_and_is_stronger_than_hold():
    tag = UpDownAccumulator(InPlus=1.0, InitialValue=-7.5)
    assert scanned(tag, Initialize=True, Hold=True) == -7.5
    assert scanned(tag, Initialize=False, Hold=False) == -6.5


def test_hold_keeps_out():
    tag = UpDownAccumulator(InPlus=4.0)
    assert [scanned(tag), scanned(tag, Hold=True), scanned(tag), scanned(tag, Hold=False)] == [4.0, 4.0, 4.0, 8.0]


def test_without_enable_nothing_is_executed():
    tag = UpDownAccumulator(InPlus=4.0)
    scanned(tag)
    assert scanned(tag, EnableIn=False, Initialize=True, InitialValue=9.0) == 4.0
    assert not tag.EnableOut
    assert scanned(tag, EnableIn=True, Initialize=False) == 8.0


def test_prescan_clears_the_enables_and_the_next_scan_starts_from_0():
    tag = UpDownAccumulator(InPlus=4.0)
    scanned(tag)
    tag.prescan()
    assert (tag.EnableIn, tag.EnableOut, tag.Out) == (False, False, 4.0)
    assert scanned(tag, EnableIn=True, InPlus=3.0) == 3.0


def test_postscan_clears_the_enables_only():
    tag = UpDownAccumulator(InPlus=4.0)
    scanned(tag)
    tag.postscan()
    assert (tag.EnableIn, tag.EnableOut) == (False, False)
    assert scanned(tag, EnableIn=True) == 8.0


def test_counts_get_lost_beyond_two_to_the_24th():
    tag = UpDownAccumulator(Initialize=True, InitialValue=2.0**24 - 1)
    scanned(tag)
    assert scanned(tag, Initialize=False, InPlus=1.0) == 2.0**24
    assert scanned(tag) == 2.0**24


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_overflow_is_infinite_and_clears_enable_out(sign):
    tag = UpDownAccumulator(InPlus=sign * 3e38)
    assert math.isfinite(scanned(tag))
    assert tag.EnableOut
    assert scanned(tag) == sign * math.inf
    assert not tag.EnableOut
    assert scanned(tag, Initialize=True) == 0.0
    assert tag.EnableOut


def test_inputs_are_reals():
    assert scanned(UpDownAccumulator(InPlus=0.1)) == np.float32(0.1)
    assert scanned(UpDownAccumulator(Initialize=True, InitialValue=0.1)) == np.float32(0.1)
    assert scanned(UpDownAccumulator(InMinus=1e300)) == -math.inf
    assert scanned(UpDownAccumulator(InPlus=10**400)) == math.inf


@pytest.mark.parametrize("member", ["InitialValue", "InPlus", "InMinus"])
@pytest.mark.parametrize("value", ["1", None])
def test_what_is_no_number_is_refused_and_nothing_executed(member, value):
    tag = UpDownAccumulator(InPlus=4.0)
    scanned(tag)
    with pytest.raises(ValueError, match=f"^{member} is a REAL, a number, not "):
        scanned(tag, **{member: value})
    assert (tag.Out, tag.accumulator) == (4.0, 4.0)


@repeatable
@given(st.lists(st.tuples(real, real), max_size=30))
def test_against_single_precision_arithmetic(rows):
    tag, total = UpDownAccumulator(), np.float32(0)
    with np.errstate(over="ignore", invalid="ignore"):
        for tag.InPlus, tag.InMinus in rows:
            tag.scan()
            total = total + np.float32(tag.InPlus) - np.float32(tag.InMinus)
            assert total.dtype == np.float32
            assert tag.Out == total or (math.isnan(tag.Out) and np.isnan(total))
            assert tag.EnableOut == bool(np.isfinite(total))


@repeatable
@given(st.lists(st.tuples(st.integers(-(2**15), 2**15), st.integers(-(2**15), 2**15)), max_size=100))
def test_whole_counts_are_summed_exactly(rows):
    tag = UpDownAccumulator()
    for plus, minus in rows:
        tag.InPlus, tag.InMinus = float(plus), float(minus)
        tag.scan()
    assert tag.Out == sum(plus - minus for plus, minus in rows)
