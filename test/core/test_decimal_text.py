"""Values as texts: exact times, and REALs that come back the same from the fewest digits."""

import struct
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.numbers import stored_real
from automax_ros.core.ticks import seconds_text, time_text
from automax_ros.core.values import real_text


@pytest.mark.parametrize(
    ("time_ns", "text"),
    [(0, "0"), (1, "0.000000001"), (5_500_000, "0.0055"), (10_000_000_000, "10"), (16_500_000 * 2, "0.033")],
)
def test_seconds(time_ns, text):
    assert seconds_text(time_ns) == text
    assert (time_text(time_ns), time_text(-time_ns)) == (text, f"-{text}" if time_ns else "0")


@settings(deadline=None, derandomize=True)
@given(time_ns=st.integers(0, 10**20))
def test_seconds_are_exact(time_ns):
    assert Fraction(seconds_text(time_ns)) * 10**9 == time_ns


@settings(deadline=None, derandomize=True, max_examples=1000)
@given(
    value=st.floats(width=32, allow_nan=False, allow_infinity=False).filter(
        lambda value: stored_real(value)[0] == value
    )
)
def test_real_comes_back_and_is_as_short_as_numpy_makes_it(value):
    text = real_text(value)
    assert struct.unpack("<f", struct.pack("<f", float(text)))[0] == value
    digits = np.format_float_scientific(np.float32(value), unique=True)
    assert float(text) == float(digits)


def test_number_that_is_no_single_keeps_its_digits():
    assert real_text(0.1234567890123) == "0.1234567890123"
    assert real_text(1e300) == "1e+300"
