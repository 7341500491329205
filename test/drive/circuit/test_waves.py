"""Closed forms of one interval: first zeros, integrals, extremes."""

from math import cos, exp, inf, pi, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from automax_ros.drive.circuit.waves import Moments, WavePiece, bound, first_zero
from drive.support import repeatable

OMEGA = 2 * pi * 60


def value(wave, theta, decay, decay_b, t):
    c, d, k, a, b = wave
    angle = theta + OMEGA * t
    return c * np.cos(angle) + d * np.sin(angle) + k + a * np.exp(-decay * t) + b * np.exp(-decay_b * t)


factor = st.floats(-500, 500)
waves = st.tuples(factor, factor, factor, factor, factor)
decays = st.tuples(st.floats(0.01, 500), st.floats(1, 1e5))


@settings(repeatable, max_examples=300)
@given(waves, st.floats(0, 2 * pi), decays, st.floats(0, 20e-3))
def test_first_zero_is_the_first(wave, theta, rates, limit):
    grid = np.linspace(0.0, limit, 4001)
    values = value(wave, theta, *rates, grid)
    assume(values[0] > 1e-6)
    found = first_zero(*wave, theta, OMEGA, *rates, limit)
    below = np.nonzero(values < 0)[0]
    if found == inf:
        assert not len(below)
        return
    assert 0 < found <= limit
    # Nothing before it is below zero, it is a zero, and just after the wave is below.
    assert not len(below) or found <= grid[below[0]] + 1e-12
    assert (values[grid < found - 1e-9] >= -1e-9).all()
    slope_scale = sum(map(abs, wave)) * max(OMEGA, *rates)
    assert abs(value(wave, theta, *rates, found)) < 1e-15 * slope_scale + 1e-9


def test_two_zeros_close_to_each_other_are_not_missed():
    """A dip of 0.1 us below zero, in an interval 100,000 times as long."""
    theta = -OMEGA * 5e-3
    for half_width in (1e-6, 1e-7):
        k = -cos(pi - OMEGA * half_width)
        wave = (1.0, 0.0, k, 0.0, 0.0)
        found = first_zero(*wave, theta, OMEGA, 1.0, 1.0, 20e-3)
        assert found == pytest.approx(5e-3 + pi / OMEGA - half_width, abs=1e-9)


def test_a_wave_that_grazes_zero_is_passed_by_or_ends_but_never_holds_up():
    for clearance in (1e-3, 1e-6, 1e-9, 1e-12, 0.0, -1e-12, -1e-9):
        found = first_zero(1.0, 0.0, 1.0 + clearance, 0.0, 0.0, 0.0, OMEGA, 1.0, 1.0, 20e-3)
        assert found == inf or found == pytest.approx(pi / OMEGA, abs=1e-6)
        if clearance >= 1e-6:
            assert found == inf


def test_the_zero_of_a_decaying_current_is_precise():
    wave, theta = (300.0, 150.0, -200.0, 90.0, -40.0), 0.3
    expected = brentq(lambda t: value(wave, theta, 40.0, 3000.0, t), 1e-4, 4e-3, xtol=1e-16)
    assert first_zero(*wave, theta, OMEGA, 40.0, 3000.0, 8e-3) == pytest.approx(expected, abs=1e-14)


def test_a_current_that_begins_at_zero():
    assert first_zero(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, OMEGA, 1.0, 1.0, 20e-3) == pytest.approx(pi / OMEGA, abs=1e-12)
    assert first_zero(0.0, -1.0, 0.0, 0.0, 0.0, 0.0, OMEGA, 1.0, 1.0, 20e-3) == 0.0
    assert first_zero(-1.0, 0.0, 1.0, 0.0, 0.0, 0.0, OMEGA, 1.0, 1.0, 10e-3) == inf
    assert first_zero(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, OMEGA, 1.0, 1.0, 10e-3) == inf


@settings(repeatable, max_examples=40)
@given(waves, st.tuples(factor, factor), st.floats(0, 6), decays, st.floats(1e-5, 5e-3))
def test_integrals_of_squares_and_of_power(one, volts, theta, rates, duration):
    moments = Moments(theta, OMEGA, *rates, duration)
    two = (*volts, 0.0, 0.0, 0.0)
    scale = duration * max(map(abs, one)) * max(1.0, *map(abs, one), *map(abs, two)) * 25 + 1e-9
    points = [duration * part for part in (0.001, 0.01, 0.1)]

    def integral(function):
        return quad(function, 0.0, duration, epsabs=1e-10 * scale, epsrel=1e-10, limit=400, points=points)[0]

    expected = integral(lambda t: value(one, theta, *rates, t) * value(two, theta, *rates, t))
    assert moments.with_voltage(one, *volts) == pytest.approx(expected, abs=1e-7 * scale)
    expected = integral(lambda t: value(one, theta, *rates, t) ** 2)
    assert moments.square(one) == pytest.approx(expected, abs=1e-7 * scale)
    assert moments.single(one) == pytest.approx(integral(lambda t: value(one, theta, *rates, t)), abs=1e-7 * scale)


@settings(repeatable, max_examples=60)
@given(factor, factor, factor, factor, st.floats(0, 6), st.floats(0.01, 500), st.floats(1e-5, 17e-3))
def test_extremes(c, d, k, a, theta, decay, duration):
    piece = WavePiece(duration, theta, OMEGA, c, d, k, a, decay)
    values = value((c, d, k, a, 0.0), theta, decay, 0.0, np.linspace(0, duration, 5001))
    least, most = piece.extremes()
    swing = 1e-4 * (values.max() - values.min()) + 1e-6
    assert values.min() - swing <= least <= values.min() + 1e-9 * (1 + abs(least))
    assert values.max() - 1e-9 * (1 + abs(most)) <= most <= values.max() + swing


def test_piece_knows_its_values():
    piece = WavePiece(2e-3, 0.5, OMEGA, 3.0, 4.0, 5.0, 6.0, 70.0)
    t = 1.3e-3
    assert piece.value(t) == pytest.approx(
        3 * cos(0.5 + OMEGA * t) + 4 * sin(0.5 + OMEGA * t) + 5 + 6 * exp(-70 * t), rel=1e-12
    )


@repeatable
@given(
    st.floats(1e-7, 4e-3), st.floats(0.0, 7.0), st.floats(300.0, 390.0), st.floats(-1e4, 1e4), st.floats(-1e4, 1e4),
    st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(0.01, 2000.0),
)  # fmt: skip
def test_bound_is_never_below_the_extremes(duration, theta, omega, c, d, k, a, decay):
    piece = WavePiece(duration, theta, omega, c, d, k, a, decay)
    assert WavePiece(*piece.numbers()).numbers() == piece.numbers() == [duration, theta, omega, c, d, k, a, decay]
    times = [duration * index / 200 for index in range(201)]
    largest = max(abs(piece.value(t)) for t in times)
    assert bound(piece) >= largest * (1 - 1e-12)
    # It is a bound that says something: in short pieces hardly more than the ends.
    if duration < 1e-6:
        assert bound(piece) <= largest + 1e-2
