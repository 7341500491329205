"""Differences of two courses, against both written out nanosecond by nanosecond."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.comparison.comparison import Compared
from automax_ros.comparison.courses import Course
from automax_ros.comparison.differences import Apart, Difference, difference
from automax_ros.comparison.report import _variable
from comparison.racks import S, course

STEPS = st.lists(st.tuples(st.integers(1, 7), st.integers(-5, 5)), min_size=1, max_size=20)


def built(steps: list[tuple[int, int]], start: int) -> tuple[Course, np.ndarray]:
    """A course that begins at a time in ns, and its value in each nanosecond, NaN before it begins."""
    lengths = np.array([length for length, _ in steps])
    values = np.array([value for _, value in steps], float)
    times = (start + np.concatenate(([0], np.cumsum(lengths)[:-1]))).astype(np.int64)
    each = np.concatenate((np.full(start, np.nan), np.repeat(values, lengths)))
    return Course(course([(0, 0)]).variable, times, values), np.concatenate((each, np.full(300, values[-1])))


@given(STEPS, STEPS, st.integers(0, 20), st.integers(0, 20), st.integers(0, 3))
def test_every_nanosecond(one, other, start, its_start, tolerance) -> None:
    end = 160
    (before, b), (after, a) = built(one, start), built(other, its_start)
    found = difference(before, after, 0, end, tolerance)
    apart = np.abs(a[: end + 1] - b[: end + 1])
    differs = np.where(np.isnan(apart), 0, apart) > tolerance
    assert found is not None
    if not differs.any():
        assert found == Difference(None, None, 0.0)
        return
    first, worst = int(np.argmax(differs)), int(np.nanargmax(np.where(differs, apart, -1.0)))
    assert found.first == Apart(first / S, b[first], a[first])
    assert found.greatest is not None
    assert abs(found.greatest.difference) == apart[worst]
    assert found.greatest.time_s == worst / S
    assert found.apart_s == pytest.approx(differs[:end].sum() / S, abs=1e-15)


def test_a_value_of_both_is_needed() -> None:
    assert difference(course([(5.0, 1.0)]), course([(0.0, 1.0)]), 0, 4 * S, 0.0) is None


def test_a_range_begins_with_what_holds() -> None:
    found = difference(course([(0.0, 1.0)]), course([(0.0, 4.0), (2.0, 1.0)]), S, 3 * S, 0.0)
    assert found == Difference(Apart(1.0, 1.0, 4.0), Apart(1.0, 1.0, 4.0), 1.0)


def test_what_is_not_a_number_differs_from_numbers_alone() -> None:
    nan = float("nan")
    same = difference(course([(0.0, nan), (1.0, 2.0)]), course([(0.0, nan), (1.0, 2.0)]), 0, 3 * S, 0.0)
    assert same == Difference(None, None, 0.0)
    one, other = course([(0.0, 5.0), (1.0, nan), (2.0, 5.0)]), course([(0.0, 5.0)])
    found = difference(one, other, 0, 3 * S, 1e9)
    assert found is not None
    assert found.first is not None
    assert (found.first.time_s, found.apart_s) == (1.0, 1.0)
    data = _variable(Compared(one, other, found))
    assert data["greatest"] == {"time_s": 1.0, "before": None, "after": 5.0, "difference": None}


def test_infinite_values_are_equal_to_themselves() -> None:
    infinite = course([(0.0, float("inf"))])
    assert difference(infinite, infinite, 0, S, 0.0) == Difference(None, None, 0.0)
    found = difference(infinite, course([(0.0, float("-inf"))]), 0, S, 0.0)
    assert found is not None
    assert found.greatest is not None
