"""Times that a file gives in seconds, exact to the nanosecond."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.ticks import MOST_SECONDS, exact_ns, seconds_text


@pytest.mark.parametrize(
    ("text", "ns"),
    [
        ("0", 0),
        ("+0.00E-400", 0),
        ("0.1", 100_000_000),
        ("1e-9", 1),
        ("2.5E3", 2_500_000_000_000),
        ("1000000000", 10**18),
        ("999999999.999999999", 10**18 - 1),
        ("123456789.123456789", 123_456_789_123_456_789),
    ],
)
def test_exact(text, ns):
    assert exact_ns(text) == ns


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("-0.1", "negative"),
        ("1000000000.000000001", "too long"),
        ("1e13", "too large"),
        ("1.0000000001", "finer than 1 ns"),
        ("1e-13", "finer than 1 ns"),
        ("1e-4000", "finer than 1 ns"),
        ("soon", "not a number"),
        ("nan", "not a number"),
        ("", "not a number"),
        ("1_000", "not a number"),
    ],
)
def test_refused(text, reason):
    with pytest.raises(ValueError, match=reason):
        exact_ns(text)


@given(st.integers(0, MOST_SECONDS * 10**9))
@settings(deadline=None, derandomize=True, database=None)
def test_what_is_written_is_read(ns):
    assert exact_ns(seconds_text(ns)) == ns
