"""Messages decoded in part: what is decoded is what the whole decoder gives, and what is left out is not asked for."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.messages.cdr.cdr import CdrError, decode, encode
from automax_ros.messages.cdr.message_parts import decode_errors, decode_writes_of
from automax_ros.messages.types.messages import NAMES, CommonWrite, Scan, ScanError, Values

ERRORS = st.lists(st.builds(ScanError, st.integers(0, 32767), st.integers(1, 9999)), max_size=3).map(tuple)
NUMBERS = st.lists(st.integers(0, 9), max_size=6)


@given(ERRORS, st.lists(st.integers(0, 9), max_size=4), st.text("ABC", min_size=1, max_size=8))
def test_a_scan_has_its_errors_and_its_head(errors, numbers, task):
    values = Values(numbers, [0] * len(numbers), [1.0] * len(numbers), ())
    scan = Scan(5, 2, task, 17, latched=values, errors=errors)
    data = encode(scan)
    found = decode_errors(data)
    assert (found.stamp, found.slot, found.task, found.scan) == (5, 2, task, 17)
    assert tuple(found.errors) == errors
    if errors:
        assert found == decode(NAMES[Scan], data)


@given(NUMBERS, st.sets(st.integers(0, 9)), st.integers(1, 3))
def test_a_write_is_whole_where_somebody_wants_it(numbers, wanted, writer):
    values = Values(numbers, [0] * len(numbers), [float(item) for item in numbers], ())
    write = CommonWrite(5, 7, writer, 1, 3, 11, values)
    found = decode_writes_of(wanted, range(9), [2])(encode(write))
    assert found[:6] == write[:6]
    if wanted & set(numbers) or writer == 2 or 9 in numbers:
        assert found == decode(NAMES[CommonWrite], encode(write))
    else:
        assert not any(found.values)


def test_a_long_write_is_decoded():
    numbers = [3] * 100
    data = encode(CommonWrite(5, 7, 1, 1, 3, 11, Values(numbers, [0] * 100, [1.0] * 100, ())))
    assert len(decode_writes_of([8], range(9), [])(data).values.variable) == 100


@pytest.mark.parametrize("size", [0, 3, 20, 38, 41])
def test_what_is_cut_is_malformed(size):
    data = encode(CommonWrite(5, 7, 1, 1, 3, 11, Values((1, 2), (0, 0), (1.0, 2.0), ())))[:size]
    with pytest.raises(CdrError):
        decode_writes_of([8], range(9), [])(data)
    with pytest.raises(CdrError):
        decode_errors(encode(Scan(5, 1, "T", 1))[: min(size, 14)])
