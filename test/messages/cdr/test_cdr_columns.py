"""Messages decoded as columns are those that the scalar decoder reads; what that refuses is odd."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.messages.cdr.cdr import CdrError, decode, encode
from automax_ros.messages.cdr.columns import FEWEST, decode_columns
from automax_ros.messages.types.messages import NAMES, NO_VALUES, CommonWrite, Scan, ScanError, Values

SCAN, WRITE = NAMES[Scan], NAMES[CommonWrite]


def values(count: int, seed: int) -> Values:
    numbers = [float((seed * 31 + place * 7) % 999 - 300) for place in range(count)]
    return (
        Values(tuple(range(count)), tuple(place % 3 for place in range(count)), tuple(numbers)) if count else NO_VALUES
    )


def scan(number: int, counts: tuple[int, int, int, int], errors: int, task: str) -> Scan:
    parts = [values(count, number + place) for place, count in enumerate(counts)]
    found = tuple(ScanError(number % 60_000, 7000 + place) for place in range(errors))
    return Scan(number * 5_500_000, 1, task, number, number * 3, number % 2, number % 5 == 0, *parts, found)


shapes = st.tuples(
    st.tuples(*[st.integers(0, 3)] * 4), st.integers(0, 2), st.sampled_from(("SPEED", "LINE", "DANCER00"))
)


def as_columns(type_name: str, messages: list[bytes]) -> tuple[dict[int, dict[str, object]], list[int]]:
    """Each message that columns tell, by its number, and the odd ones; between messages stand other bytes."""
    data = np.frombuffer(b"xyz".join([b"", *messages, b""]), np.uint8)
    lengths = np.array([len(item) for item in messages], np.int64)
    starts = np.cumsum([3, *(lengths[:-1] + 3)]).astype(np.int64)
    groups, odd = decode_columns(type_name, data, starts, lengths)
    told = {
        int(row): {name: column[place].tolist() for name, column in group.fields.items()}
        for group in groups
        for place, row in enumerate(group.rows)
    }
    return told, odd.tolist()


def flat(message: Scan) -> dict[str, object]:
    """The fields of a scan as columns tell them."""
    found: dict[str, object] = {
        "stamp": message.stamp,
        "slot": message.slot,
        "task": list(message.task.encode()),
        "scan": message.scan,
        "duration_ns": message.duration_ns,
        "skipped": message.skipped,
        "full": int(message.full),
        "errors.line": [error.line for error in message.errors],
        "errors.code": [error.code for error in message.errors],
    }
    for name in ("latched", "read", "written", "committed"):
        part = getattr(message, name)
        found |= {f"{name}.{field}": list(getattr(part, field)) for field in ("variable", "element", "value")}
    return found


@given(st.lists(shapes, min_size=1, max_size=4), st.integers(1, 4 * FEWEST))
def test_scans_of_many_sizes_are_told_as_the_scalar_decoder_reads_them(kinds, repeats):
    scans = [scan(number, *kinds[number % len(kinds)]) for number in range(repeats * len(kinds))]
    told, odd = as_columns(SCAN, [encode(item) for item in scans])
    assert sorted([*told, *odd]) == list(range(len(scans)))
    if repeats >= FEWEST:
        assert not odd
    for row, fields in told.items():
        assert fields == flat(scans[row])


@given(st.data())
def test_what_the_scalar_decoder_refuses_is_never_told(data):
    kind = data.draw(shapes)
    messages = [bytearray(encode(scan(number, *kind))) for number in range(FEWEST + 4)]
    size = len(messages[0])
    for _ in range(data.draw(st.integers(1, 6))):
        item = messages[data.draw(st.integers(0, len(messages) - 1))]
        place = data.draw(st.integers(0, size - 1))
        item[place] = data.draw(st.sampled_from((0, 1, 2, 0x7F, 0xFF)))
    told, odd = as_columns(SCAN, [bytes(item) for item in messages])
    assert sorted([*told, *odd]) == list(range(len(messages)))
    for row, fields in told.items():
        expected = flat(decode(SCAN, bytes(messages[row])))  # a CdrError here is a message that was to be odd
        fields["full"] = int(bool(fields["full"]))
        assert np.array_equal([repr(fields[name]) for name in expected], [repr(expected[name]) for name in expected])


def test_texts_in_sequences_and_messages_that_end_early_are_odd():
    plain = [encode(scan(number, (1, 0, 0, 1), 0, "SPEED")) for number in range(FEWEST)]
    with_text = encode(scan(1, (1, 0, 0, 1), 0, "SPEED")._replace(written=Values((3,), (0,), (0.0,), ("ready",))))
    told, odd = as_columns(SCAN, [*plain, *[with_text] * FEWEST, *[plain[0][:60]] * FEWEST])
    assert sorted(told) == list(range(FEWEST))
    assert odd == list(range(FEWEST, 3 * FEWEST))


def test_a_message_may_be_followed_by_as_many_bytes_as_the_scalar_decoder_takes():
    message = encode(scan(7, (1, 0, 0, 1), 0, "SPEED"))
    for trailing in (0, 64, 65):
        longer = message + bytes(trailing)
        _, odd = as_columns(SCAN, [longer] * FEWEST)
        try:
            decode(SCAN, longer)
        except CdrError:
            assert odd
        else:
            assert not odd


def test_writes_are_told_with_numbers_of_64_bits():
    writes = [CommonWrite(5, (1 << 64) - 1, 9, 1, 2, (1 << 63) + number, values(2, number)) for number in range(FEWEST)]
    told, odd = as_columns(WRITE, [encode(item) for item in writes])
    assert not odd
    assert [told[row]["sequence"] for row in range(FEWEST)] == [item.sequence for item in writes]
    assert {fields["run_id"] for fields in told.values()} == {(1 << 64) - 1}
