import numpy as np
import pytest
from compile.support import ran
from hypothesis import given

from blocks.support import int16, repeatable, run

LIMITS = {"low_low_limit": -200, "low_limit": -100, "high_limit": 100, "high_high_limit": 200}


def alarms(block, value, **inputs):
    """The alarms that are TRUE."""
    return {name.removeprefix("alarm_") for name, state in block.scan(input=value, **inputs).items() if state}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (-201, {"low", "low_low"}),
        (-200, {"low", "low_low"}),
        (-199, {"low"}),
        (-100, {"low"}),
        (-99, set()),
        (0, set()),
        (99, set()),
        (100, {"high"}),
        (199, {"high"}),
        (200, {"high", "high_high"}),
        (32767, {"high", "high_high"}),
        (-32768, {"low", "low_low"}),
    ],
)
def test_an_alarm_comes_at_its_limit_and_beyond(value, expected):
    assert alarms(run("ALARM", **LIMITS), value) == expected


def test_alarms_go_as_they_come():
    """No latch and no hysteresis: each scan stands for itself."""
    block = run("ALARM", **LIMITS)
    assert [alarms(block, value) for value in (200, 99, -200, 0)] == [
        {"high", "high_high"},
        set(),
        {"low", "low_low"},
        set(),
    ]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (32767, {"high", "high_high"}),
        (32766, set()),
        (-32767, set()),
        (-32768, {"low", "low_low"}),
    ],
)
def test_the_default_limits_are_the_ends_of_the_range(value, expected):
    """Equal to a limit is an alarm, and the defaults are limits."""
    assert alarms(run("ALARM"), value) == expected


def test_the_four_limits_know_nothing_of_each_other():
    """High-high below high, low above high: each output follows its own comparison."""
    block = run("ALARM", high_limit=100, high_high_limit=50, low_limit=120, low_low_limit=-5)
    assert alarms(block, 60) == {"high_high", "low"}
    assert alarms(block, 110) == {"high", "high_high", "low"}
    assert alarms(block, -5) == {"low", "low_low"}


def test_limits_may_be_variables():
    block = run("ALARM")
    assert alarms(block, 10, high_limit=11) == set()
    assert alarms(block, 10, high_limit=10) == {"high"}


@repeatable
@given(int16, int16, int16, int16, int16)
def test_against_numpy(value, low_low, low, high, high_high):
    """A level v is low where it is not above the limit, high where it is not below."""
    result = run("ALARM").scan(
        input=value, low_low_limit=low_low, low_limit=low, high_limit=high, high_high_limit=high_high
    )
    assert result["alarm_low"] is bool(np.less_equal(value, low))
    assert result["alarm_low_low"] is bool(np.less_equal(value, low_low))
    assert result["alarm_high"] is bool(np.greater_equal(value, high))
    assert result["alarm_high_high"] is bool(np.greater_equal(value, high_high))


def test_one_output_is_enough():
    task = ran("A% = 100", "CALL ALARM(INPUT=A%, HIGH_HIGH_LIMIT=50, HIGH_LIMIT=200, ALARM_HIGH_HIGH=X@)")
    assert (task.value("X@"), task.value("Y@")) == (True, False)
