"""Responses to steps: against closed forms of first and second order, scipy, and definitions written out in numpy."""

from math import exp, log, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, signal

from automax_ros.comparison.courses import Course
from automax_ros.comparison.measures import Measures, Response, is_step_like, response, steady_before
from comparison.racks import S, course, sampled

STEP_S = 1e-4
"""Time between two samples: no measure of an instant is nearer to the closed form."""


def of(y: Course, reference: Course | float | None, end_s: float, start_s: float = 0.0, band: float = 2.0) -> Response:
    found = response(y, reference, round(start_s * S), round(end_s * S), band)
    assert found is not None
    return found


@pytest.mark.parametrize("tau_s", [0.05, 0.4])
@pytest.mark.parametrize("height", [1.0, -350.0])
def test_first_order(tau_s: float, height: float) -> None:
    """Y = h (1 - exp(-t / tau)): rise tau ln 9, no overshoot, settled to 2 % at tau ln 50, integral h tau."""
    t = np.arange(0.0, 12 * tau_s, STEP_S)
    found = of(sampled(height * (1 - np.exp(-t / tau_s)), STEP_S), height, float(t[-1])).measures
    assert found.rise_s == pytest.approx(tau_s * log(9), abs=2 * STEP_S)
    assert found.overshoot_percent == 0.0
    assert found.settling_s == pytest.approx(tau_s * log(50), abs=2 * STEP_S)
    assert found.error_integral == pytest.approx(abs(height) * tau_s, rel=2e-3)
    settled_to_5 = of(sampled(height * (1 - np.exp(-t / tau_s)), STEP_S), height, float(t[-1]), band=5.0).measures
    assert settled_to_5.settling_s == pytest.approx(tau_s * log(20), abs=2 * STEP_S)


@pytest.mark.parametrize("z", [0.2, 0.4, 0.7])
def test_second_order(z: float) -> None:
    """Overshoot exp(-pi z / sqrt(1 - z²)); rise, settling and integral from scipy's own solution."""
    omega, target = 9.0, 1500.0
    t = np.arange(0.0, 12.0 / (z * omega), STEP_S)
    _, y = signal.step(signal.lti([omega**2], [1, 2 * z * omega, omega**2]), T=t)
    found = of(sampled(target * y, STEP_S), target, float(t[-1])).measures
    assert found.overshoot_percent == pytest.approx(100 * exp(-pi * z / sqrt(1 - z * z)), abs=0.01)
    rise_s = t[np.argmax(y >= 0.9)] - t[np.argmax(y >= 0.1)]
    assert found.rise_s == pytest.approx(rise_s, abs=2 * STEP_S)
    settled_s = t[np.flatnonzero(np.abs(y - 1) > 0.02)[-1] + 1]
    assert found.settling_s == pytest.approx(settled_s, abs=2 * STEP_S)
    damped = omega * sqrt(1 - z * z)

    def error(time_s: float) -> float:
        wave = np.cos(damped * time_s) + z / sqrt(1 - z * z) * np.sin(damped * time_s)
        return abs(exp(-z * omega * time_s) * wave)

    integral, _ = integrate.quad(error, 0.0, float(t[-1]), limit=500)
    assert found.error_integral == pytest.approx(target * integral, rel=1e-3)


def test_a_step_of_the_reference_is_where_the_response_begins() -> None:
    reference = course([(0.0, 100.0), (2.0, 300.0)])
    t = np.arange(0.0, 8.0, STEP_S)
    y = 100 + 200 * np.where(t < 2.0, 0.0, 1 - np.exp(-(t - 2.0) / 0.5))
    found = of(sampled(y, STEP_S), reference, 8.0)
    assert (found.step_s, found.start, found.target) == (2.0, 100.0, 300.0)
    assert found.measures.settling_s == pytest.approx(0.5 * log(50), abs=2 * STEP_S)
    assert found.measures.error_integral == pytest.approx(200 * 0.5, rel=2e-3)


def test_a_ramp_of_the_reference_ends_at_its_last_value() -> None:
    """What follows a ramp of 10 units/s with a lag of 0.1 s: its error is 1 on the ramp, 50 units long."""
    ramp = sampled(np.minimum(np.arange(0, 60000) * 1e-3, 50.0), 1e-4)
    t = np.arange(60000) * 1e-4
    lagged = np.where(t < 5.0, 10 * (t - 0.1 * (1 - np.exp(-t / 0.1))), 50 - np.exp(-(t - 5.0) / 0.1))
    found = of(sampled(lagged, 1e-4), ramp, 6.0)
    assert found.target == 50.0
    assert found.measures.error_integral == pytest.approx(1.0 * 5.0 - 0.1 + 0.1, rel=5e-3)
    assert found.measures.settling_s == pytest.approx(5.0, abs=2e-3)  # 1 below the end is the band's edge
    assert found.measures.rise_s == pytest.approx(4.0, abs=2e-3)


def test_a_response_that_is_still_away_at_the_end_is_not_settled_and_has_no_rise() -> None:
    found = of(course([(0.0, 0.0), (1.0, 50.0), (2.0, 80.0)]), 100.0, 3.0).measures
    assert found == Measures(None, 0.0, None, 100.0 + 50.0 + 20.0)


def test_without_a_step_there_is_only_the_integral() -> None:
    found = of(course([(0.0, 100.0), (1.0, 90.0), (2.0, 100.0)]), 100.0, 3.0)
    assert found.measures == Measures(None, None, None, 10.0)


def test_without_a_reference_the_own_end_is_the_target() -> None:
    found = of(course([(0.0, 0.0), (1.0, 12.0), (2.0, 10.0)]), None, 30.0)
    assert (found.start, found.target) == (0.0, 10.0)
    assert found.measures.overshoot_percent == pytest.approx(20.0)
    assert (found.measures.settling_s, found.measures.rise_s, found.measures.error_integral) == (2.0, 0.0, None)


def test_step_like_is_what_has_settled_long_before_the_end() -> None:
    settled = of(course([(0.0, 0.0), (1.0, 10.0)]), None, 20.0)
    ramp = of(sampled(np.arange(2000.0), 0.01), None, 20.0)
    still = of(course([(0.0, 5.0)]), None, 20.0)
    late = of(course([(0.0, 0.0), (19.5, 10.0)]), None, 20.0)
    assert [is_step_like(item, 20 * S) for item in (settled, ramp, still, late)] == [True, False, False, False]


def test_what_goes_beyond_its_end_by_more_than_the_step_is_a_disturbance() -> None:
    """12: an error that went out and came back had an overshoot of 250 %."""
    disturbed = of(course([(0.0, 1.0), (1.0, 6.0), (2.0, 3.0)]), None, 20.0)
    undamped = of(course([(0.0, 1.0), (1.0, 5.0), (2.0, 3.0)]), None, 20.0)
    assert [is_step_like(item, 20 * S) for item in (disturbed, undamped)] == [False, True]


def test_steady_is_looked_for_in_a_tenth_of_the_time_before_the_step() -> None:
    ramp = course([*((0.5 * step, 10.0 * step) for step in range(20)), (10.0, 200.0), (11.0, 300.0)])
    held = course([(0.0, 0.0), (8.9, 100.0), (9.2, 101.0), (10.0, 100.0), (11.0, 200.0)])
    for item, expected in ((ramp, False), (held, True)):
        found = response(item, None, 10 * S, 20 * S)
        assert found is not None
        assert steady_before(item, found, 0, 10 * S) is expected
        assert steady_before(item, found, 10 * S, 10 * S) is None  # a rerun's recording begins with the edit


def test_nothing_is_measured_where_a_value_or_the_reference_is_not_known() -> None:
    y = course([(1.0, 0.0), (2.0, 10.0)])
    assert response(y, 10.0, 0, 3 * S) is None
    assert response(y, course([(1.5, 10.0)]), S, 3 * S) is None
    assert response(course([(0.0, 0.0), (1.0, float("nan"))]), 10.0, 0, 3 * S) is None
    assert response(y, 10.0, 3 * S, 3 * S) is None


@given(
    st.lists(st.tuples(st.integers(1, 9), st.integers(-20, 20)), min_size=2, max_size=30),
    st.lists(st.tuples(st.integers(1, 9), st.integers(-20, 20)), min_size=1, max_size=30),
)
def test_the_integral_is_that_of_every_nanosecond(y: list[tuple[int, int]], reference: list[tuple[int, int]]) -> None:
    """Against a plain sum over each nanosecond, from the first change of the reference on."""
    lengths = [np.array([length for length, _ in part]) for part in (y, reference)]
    values = [np.array([value for _, value in part], float) for part in (y, reference)]
    end = int(min(part.sum() for part in lengths))
    courses = [
        Course(course([(0, 0)]).variable, np.concatenate(([0], np.cumsum(part)[:-1])).astype(np.int64), value)
        for part, value in zip(lengths, values, strict=True)
    ]
    found = response(courses[0], courses[1], 0, end)
    each = [np.repeat(value, part)[:end] for part, value in zip(lengths, values, strict=True)]
    changed = np.flatnonzero(each[1] != each[1][0])
    begin = int(changed[0]) if len(changed) else 0
    if found is None:  # the reference changes at the very end
        assert np.all(each[1] == each[1][0])
        return
    total = np.abs(each[0] - each[1])[begin:].sum() / S
    assert found.step_s == begin / S
    assert found.measures.error_integral == pytest.approx(total, rel=1e-12, abs=1e-18)
