"""The shapes of stimuli as functions of time: limits, ends, and an independent model in exact numbers."""

import math
from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType
from automax_ros.scenario.stimuli.waves import Ramp, Sine, Square

PROPERTY = settings(deadline=None, derandomize=True, database=None, max_examples=200)
WHOLE = st.integers(-(2**31), 2**31 - 1)
TIMES = st.integers(1, 10**13)
REALS = st.floats(-1e6, 1e6, width=32).map(lambda value: stored_real(value)[0])
HZ = st.fractions(min_value=Fraction(1, 1000), max_value=500, max_denominator=10**6)


@given(start=WHOLE, to=WHOLE, for_ns=TIMES, data=st.data())
@PROPERTY
def test_a_ramp_of_whole_numbers_is_the_nearest_to_the_line(start, to, for_ns, data):
    elapsed = data.draw(st.integers(0, for_ns))
    value = Ramp(DataType.DOUBLE, to, for_ns).value(elapsed, start)
    line = start + Fraction(to - start) * elapsed / for_ns
    assert abs(value - line) <= Fraction(1, 2)
    assert min(start, to) <= value <= max(start, to)


@given(start=REALS, to=REALS, for_ns=TIMES, late=st.integers(0, 10**9))
@PROPERTY
def test_a_ramp_begins_and_ends_exactly(start, to, for_ns, late):
    ramp = Ramp(DataType.REAL, to, for_ns)
    assert ramp.value(0, start) == start
    assert ramp.value(for_ns + late, start) == ramp.last() == to


@given(mean=st.integers(-10000, 10000), amplitude=st.integers(0, 20000), hz=HZ, elapsed=TIMES)
@PROPERTY
def test_a_sine_stays_in_its_band_and_has_the_phase_of_its_time(mean, amplitude, hz, elapsed):
    value = Sine(DataType.INTEGER, mean, amplitude, hz, None).value(elapsed, 0)
    assert mean - amplitude <= value <= mean + amplitude
    turns = hz * elapsed / 10**9
    exact = mean + amplitude * math.sin(2 * math.pi * float(turns - math.floor(turns)))
    assert abs(value - exact) <= 0.5 + 1e-6


@given(hz=HZ, elapsed=TIMES)
@PROPERTY
def test_a_square_is_high_in_the_first_half_of_each_period(hz, elapsed):
    square = Square(-1, 1, hz, None)
    phase = hz * elapsed / 10**9 % 1
    assert square.value(elapsed, 0) == (1 if phase < Fraction(1, 2) else -1)
    assert square.value(0, 0) == 1
