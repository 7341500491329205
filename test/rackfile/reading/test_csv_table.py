"""Times of the rows of a table, exact and in order; and what a table may be read from."""

import os
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.reading.csv_table import CsvTable, RowTimes

SECONDS = st.integers(0, 10**12).map(lambda number: f"{number // 1000}.{number % 1000:03d}")


@settings(deadline=None, derandomize=True, database=None, max_examples=200)
@given(first=SECONDS, steps=st.lists(st.integers(0, 10**9), max_size=6))
def test_times_count_from_the_first_row_exactly(first, steps):
    times, total, start = RowTimes(), 0, Fraction(first)
    assert times.since_first(first) == 0
    for step in steps:
        total += step
        at = start + Fraction(total, 10**9)
        whole, rest = divmod(at * 10**9, 10**9)
        assert times.since_first(f"{int(whole)}.{int(rest):09d}") == total


@pytest.mark.parametrize("cell", ["5,25", " 5.25 ", "5.25E0"])
def test_spellings(cell):
    times = RowTimes()
    times.since_first("5")
    assert times.since_first(cell) == 250_000_000


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        (["x"], "when = x, it must be a time in s, 0 or more"),
        (["-1"], "it must be a time in s"),
        (["1e999"], "it must be a time in s"),
        (["nan"], "it must be a time in s"),
        (["2", "1"], "1 s is earlier than the row before"),
        (["0", "5", "3"], "3 s is earlier than the row before"),
        (["0", "1000001"], "1000001 s is days after the first row"),
    ],
)
def test_faults(cells, message):
    times = RowTimes("when")
    for cell in cells[:-1]:
        times.since_first(cell)
    with pytest.raises(ValueError, match=message):
        times.since_first(cells[-1])


def test_a_row_that_was_refused_does_not_count(tmp_path):
    times = RowTimes()
    times.since_first("1")
    with pytest.raises(ValueError, match="days after"):
        times.since_first("5000000")
    assert times.since_first("2") == 10**9


def test_a_regular_table_is_no_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(UsageError, match="is not a regular file"):
        CsvTable(tmp_path / "pipe.csv", regular=True)
    with pytest.raises(UsageError, match="No such file"):
        CsvTable(tmp_path / "none.csv", regular=True)
