"""Numbers of a signal against NumPy, and the times of an alarm by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.replay.drive_report.numbers import AlarmRun, Measured, Numbers

VALUES = st.floats(-1e6, 1e6)
STEPS = st.lists(st.tuples(st.floats(0.0, 5.0), VALUES), min_size=1, max_size=40)


@given(STEPS, st.floats(0.0, 5.0))
def test_they_are_those_of_numpy(steps, more):
    times = np.cumsum([step for step, _ in steps])
    values = np.array([value for _, value in steps])
    end = times[-1] + more
    numbers = Numbers()
    for time, value in zip(times, values, strict=True):
        numbers.take(time, value)
    numbers.finish(end)
    lengths = np.diff(np.append(times, end))
    assert (numbers.least, numbers.greatest, numbers.last) == (values.min(), values.max(), values[-1])
    if lengths.sum() > 1e-9:
        expected = (values * lengths).sum() / lengths.sum()
        assert numbers.mean == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(values).max())
    elif lengths.sum() == 0:
        assert numbers.mean == values[-1]


def test_without_a_value_there_are_none():
    numbers = Numbers()
    numbers.finish(5.0)
    assert numbers.values == 0
    assert all(np.isnan([numbers.least, numbers.greatest, numbers.mean, numbers.last]))


def test_an_alarm_comes_goes_and_may_stay():
    alarm = AlarmRun("BREAK@", "the web broke")
    told = [alarm.take(time, on=on) for time, on in [(0.0, False), (1.0, True), (1.5, True), (3.5, False), (9.0, True)]]
    assert told == [
        "", "alarm: the web broke (BREAK@)", "", "alarm gone after 2.500 s: the web broke (BREAK@)",
        "alarm: the web broke (BREAK@)",
    ]  # fmt: skip
    alarm.finish(10.0)
    assert (alarm.times, alarm.on_s, alarm.first_s, alarm.is_on) == (2, 3.5, 1.0, True)


def test_one_without_description_is_told_by_its_name():
    assert AlarmRun("BREAK@", "BREAK@").take(0.0, on=True) == "alarm: BREAK@"


def test_what_is_paused_does_not_count():
    """1 for a second, nothing for eight, then 3 for a second."""
    measured = Measured()
    measured.pause(0.0)  # nothing begins with a gap
    for time, value in ((1.0, 1.0), (2.0, None), (3.0, None), (10.0, 3.0)):
        if value is None:
            measured.pause(time)
        else:
            measured.take(time, value)
    measured.numbers.finish(11.0)
    assert measured.numbers.mean == pytest.approx(2.0)
    times, values = measured.line()
    assert (times[0], values[0], values[-1]) == (1.0, 1.0, 3.0)
    assert np.isnan(values[1:-1]).all()


def numbers_of(*course, of_memory=True):
    measured = Measured(of_memory=of_memory)
    for time, value in course:
        measured.take(time, value)
    measured.numbers.finish(10.0)
    return measured


def test_the_zero_of_memory_that_no_task_had_written_hides_no_course():
    """A diameter that grows from 1000 to 1017: its least value is 1000, and a picture begins there."""
    measured = numbers_of((0.0, 0.0), (0.01, 1000.0), (5.0, 1017.0))
    numbers = measured.numbers
    assert (numbers.least, numbers.greatest, numbers.is_empty_first) == (1000.0, 1017.0, True)
    assert numbers.mean == pytest.approx((1000.0 * 4.99 + 1017.0 * 5.0) / 9.99)
    assert measured.line()[0].tolist() == [0.01, 5.0]


@pytest.mark.parametrize(
    "course",
    [
        [(0.0, 0.0), (0.01, 10.0), (5.0, 1017.0)],  # it comes from near 0
        [(0.0, 0.0), (0.01, 1000.0), (5.0, 0.0)],  # it is 0 again
        [(0.0, 0.0), (1.0, 1000.0)],  # somebody set it later
        [(2.0, 0.0), (2.01, 1000.0)],  # not the start of the run
        [(0.0, 0.0)],
    ],
)
def test_any_other_zero_counts(course):
    measured = numbers_of(*course)
    assert (measured.numbers.least, measured.numbers.is_empty_first) == (0.0, False)
    assert len(measured.line()[0]) == len(course)
    assert numbers_of((0.0, 0.0), (0.01, 1000.0), of_memory=False).numbers.least == 0.0
