"""Sequences of equal length read at once: the same as one by one, wherever they start, and no other errors."""

from __future__ import annotations

import pytest
from compile.support import repeatable
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.messages.cdr.cdr import HEADER, CdrError, decoder, encode
from automax_ros.messages.cdr.parts import MOST_TOGETHER, read_numbers, together
from automax_ros.messages.types.messages import Scan, Values

ENTRIES = st.tuples(st.integers(0, 2**16 - 1), st.integers(0, 2**32 - 1), st.floats(allow_nan=False))


def one_by_one(data: bytes, position: int) -> tuple[int, list[object]]:
    fields: list[object] = []
    for code, size in (("H", 2), ("I", 4), ("d", 8)):
        values, position = read_numbers(data, position, code, size)
        fields.append(values)
    return position, fields


@given(st.lists(ENTRIES, max_size=70), st.integers(0, 7))
@repeatable(150)
def test_equal_lengths_decode_as_one_by_one(entries, offset):
    data = encode(Values(*(tuple(column) for column in zip(*entries, strict=True)))) if entries else encode(Values())
    shifted = bytes(offset * 8) + data
    start = len(HEADER) + offset * 8
    end, fields = one_by_one(shifted, start)
    count, numbers, position = together("HId")(shifted, start)
    if 0 < len(entries) <= MOST_TOGETHER:
        assert (count, position) == (len(entries), end)
        assert list(numbers) == [number for values in fields for number in (count, *values)]
    else:
        assert (count, numbers, position) == (0, (), start)
    assert decoder("automax_msgs/msg/Values")(data)[:3] == tuple(fields)


@given(
    st.lists(st.integers(0, 9), max_size=5),
    st.lists(st.integers(0, 9), max_size=5),
    st.lists(st.floats(0, 1), max_size=5),
)
@repeatable(100)
def test_any_lengths_decode(one, two, three):
    values = Values(tuple(one), tuple(two), tuple(three))
    assert decoder("automax_msgs/msg/Values")(encode(values)) == values


@given(st.lists(ENTRIES, min_size=1, max_size=5), st.data())
@repeatable(100)
def test_cut_data_is_an_error_of_the_format(entries, data):
    whole = encode(Values(*(tuple(column) for column in zip(*entries, strict=True))))
    end = data.draw(st.integers(len(HEADER), len(whole) - 5))
    with pytest.raises(CdrError):
        decoder("automax_msgs/msg/Values")(whole[:end])


@given(st.text("AB", max_size=9), st.lists(st.integers(0, 66), min_size=4, max_size=4))
@repeatable(100)
def test_wherever_they_start(name, counts):
    """In a Scan four Values stand after a text, so each at any place."""
    parts = [Values(tuple(range(count)), (0,) * count, (0.5,) * count) for count in counts]
    scan = Scan(5, 1, name, 7, 0, 0, True, *parts)
    assert decoder("automax_msgs/msg/Scan")(encode(scan)) == scan
