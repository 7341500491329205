"""What is packed from what messages have in common has the bytes of the codec."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings.live_racks import build

from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import CdrError, encode
from automax_ros.messages.stream import templates as patterns
from automax_ros.messages.stream.rack_messages import value_encoder
from automax_ros.messages.stream.task_messages import TaskMessages
from automax_ros.messages.stream.templates import prepared
from automax_ros.messages.stream.write_messages import WriteMessages
from automax_ros.messages.types.messages import NO_VALUES, CommonWrite, Int16, Scan, TaskState, Values
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.scan.scan_record import ScanRecord

STAMPS = st.integers(0, (2**31 - 1) * NS_PER_S)
NUMBERS = st.one_of(st.booleans(), st.integers(-(2**31), 2**31 - 1), st.floats(width=32, allow_nan=False))
VALUES_OF_SCANS = (("latched.value",), ("read.value",), ("written.value",), ("committed.value",))
CLASSIC = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@st.composite
def values(draw: st.DrawFn) -> Values:
    numbers = draw(st.lists(NUMBERS, max_size=5))
    if not numbers:
        return NO_VALUES
    ids = st.lists(st.integers(0, 0xFFFF), min_size=len(numbers), max_size=len(numbers))
    return Values(draw(ids), draw(ids), numbers, ())


@CLASSIC
@given(STAMPS, st.text(max_size=9), values(), values(), values(), values(), st.data())
def test_a_scan_s_bytes(
    stamp: int, task: str, latched: Values, read: Values, written: Values, committed: Values, data: Any
) -> None:
    message = Scan(0, 3, task, 1, 2, 3, False, latched, read, written, committed)
    made = prepared(message, ("stamp",), ("scan", "duration_ns", "skipped"), *VALUES_OF_SCANS)
    head = [data.draw(st.integers(0, 2**32 - 1)) for _ in range(3)]
    given_values = [
        tuple(data.draw(st.lists(NUMBERS, min_size=len(part.value), max_size=len(part.value))))
        for part in (latched, read, written, committed)
    ]
    before = latched, read, written, committed
    parts = [part._replace(value=new) for part, new in zip(before, given_values, strict=True)]
    groups = [divmod(stamp, NS_PER_S), head, *given_values]
    pairs = zip(made.constants, [*groups, ()], strict=True)
    arguments = [item for constant, group in pairs for item in (constant, *group)]
    assert made.pack(*arguments) == encode(Scan(stamp, 3, task, *head, False, *parts))


@pytest.mark.parametrize("groups", [(("scan",), ("stamp",)), (("stamp", "scan"),), (("wrong",),)])
def test_what_is_no_group_in_order_is_refused(groups: tuple[tuple[str, ...], ...]) -> None:
    with pytest.raises(ValueError, match=r"in order|not all"):
        prepared(TaskState(0, 1, "A", 1, "", ""), *groups)


def test_texts_and_messages_inside_are_constants() -> None:
    state = TaskState(7, 1, "SPEED", 5, "ab", "cdef", ["a", "", "bcd"], [1, 2, 3], [1.0, 2.0], ["x", "yz"])
    made = prepared(state, ("stamp",), ("value",))
    first, second, third = made.constants
    assert made.pack(first, 3, 9, second, 0.5, -0.0, third) == encode(
        state._replace(stamp=3 * NS_PER_S + 9, value=[0.5, -0.0])
    )


def records(chance: random.Random, width: int) -> Iterator[ScanRecord]:
    """Scans that have patterns in common, and some that do not."""
    few = (0, 1, -5, 2.5, True)
    for number in range(60):
        record = ScanRecord(chance.randrange(2**60), number, chance.choice((0, 0, 2**33)))
        record.latched = tuple(chance.choice((0, number)) for _ in range(width))
        record.duration_ns = chance.choice((0, 5, 2**40))
        record.commits = chance.choice(([], [(1, 4)], [(1, 7.5), (2, True)], [(0, "text")]))
        for accesses in (record.reads, record.writes):
            for _ in range(chance.choice((0, 0, 0, 0, 0, 1, 2))):
                accesses.append((chance.randrange(2), 0, chance.choice(few)))
        record.errors.extend(chance.choice(([], [], [], [(10, 7001)])))
        yield record


@pytest.mark.parametrize("seed", range(20))
def test_scans_of_a_task(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Whether a pattern is known or not: the same bytes as those of the message."""
    monkeypatch.setattr(patterns, "ENOUGH_TIMES", 1 + seed % 3)
    chance, task = random.Random(seed), build(tmp_path).task("SPEED")
    one, other = TaskMessages(task), TaskMessages(task)
    for record in records(chance, len(task.compiled.latched)):
        full = chance.random() < 0.1
        assert one.scan_bytes(record, record.time_ns, full=full) == encode(
            other.scan(record, record.time_ns, full=full)
        )
    assert one._scans.known or one._scans_by_length.known, "some pattern recurs"


def test_recurring_scans_do_not_go_through_the_codec(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Proves that the tests above try the prepared form."""
    task = build(tmp_path).task("SPEED")
    made = TaskMessages(task)
    width = len(task.compiled.latched)
    for number in range(2 * patterns.ENOUGH_TIMES):
        record = ScanRecord(number, number)
        record.latched = (number,) * width
        record.commits = [(1, number)]
        if number == patterns.ENOUGH_TIMES + 2:
            monkeypatch.setattr(made, "_encode_scan", None)
        made.scan_bytes(record, number, full=False)


def test_scans_with_as_many_accesses_do_not_go_through_the_codec(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drive's loop writes another record of its diagnosis each time; a text among them is the codec's business."""
    task = build(tmp_path).task("SPEED")
    made, other = TaskMessages(task), TaskMessages(task)
    encode_scan, width = made._encode_scan, len(task.compiled.latched)
    for number in range(4 * patterns.ENOUGH_TIMES):
        record = ScanRecord(number, number)
        record.latched = (number, *[number % 2] * (width - 1))
        record.reads.extend([(number % 7, number, 0.5 * number), (3, 0, True)])
        record.writes.append((2, 5 * number, -number))
        record.commits = [(1 + number % 3, number)]
        by_codec = number < 2 * patterns.ENOUGH_TIMES + 2
        if not by_codec and number % 5 == 0:
            record.reads[0], by_codec = (6, 0, "text"), True
        monkeypatch.setattr(made, "_encode_scan", encode_scan if by_codec else None)
        assert made.scan_bytes(record, number, full=False) == encode(other.scan(record, number, full=False))
    record.reads[:] = [(0x10000, 0, 1), (3, 0, 1)]
    monkeypatch.setattr(made, "_encode_scan", encode_scan)
    with pytest.raises(CdrError):
        made.scan_bytes(record, 1, full=False)


def test_the_numbers_of_a_quiet_scan_reach_as_far_as_their_fields(tmp_path: Any) -> None:
    task = build(tmp_path).task("SPEED")
    one, other = TaskMessages(task), TaskMessages(task)
    latched = (0,) * len(task.compiled.latched)

    def both(stamp: int, scan: int, number: int) -> tuple[bytes, bytes]:
        record = ScanRecord(0, scan, number)
        record.latched, record.duration_ns = latched, number
        return one.scan_bytes(record, stamp, full=False), encode(other.scan(record, stamp, full=False))

    both(0, 1, 0)  # a full one
    for stamp in (0, NS_PER_S - 1, NS_PER_S, (2**31 - 1) * NS_PER_S + 999_999_999):
        for scan in (1, 2**62, 2**63 - 1, 2**63, 2**64 - 1):
            for number in (0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**40):
                made, expected = both(stamp, scan, number)
                assert made == expected
    for stamp, scan in ((2**31 * NS_PER_S, 1), (0, 2**64), (0, -1)):
        with pytest.raises(CdrError, match="scan of task SPEED"):
            both(stamp, scan, 0)


def test_states_of_a_task(tmp_path: Any) -> None:
    rack = build(tmp_path)
    rack.start()
    made = TaskMessages(rack.task("SPEED"))
    for seconds in range(4):
        assert made.state_bytes(seconds) == encode(made.state(seconds))
        rack.run(0.05)


@CLASSIC
@given(st.lists(st.tuples(STAMPS, st.sampled_from([((1, 5),), ((1, 5), (2, -0.5)), ((3, "text"),)])), max_size=40))
def test_the_write_log(items: list[tuple[int, Any]]) -> None:
    made = WriteMessages({4: 2})
    for number, (stamp, changes) in enumerate(items, 1):
        group = WriteGroup(number, stamp, 4, WriteKind.COMMIT, 0, changes)
        texts = [value for _, value in changes if isinstance(value, str)]
        numbers = [0.0 if isinstance(value, str) else value for _, value in changes]
        held = Values([view for view, _ in changes], [0] * len(changes), numbers, texts)
        message = CommonWrite(stamp, 77, 4, 2, 1, number, held)
        assert made.packed([group], 0, 77) == [(stamp, encode(message))]
    assert made.sequence == len(items)


def test_groups_that_travel_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the values are, once as many were seen often enough; a text still goes through the codec."""
    made = WriteMessages({4: 2})
    encode_write = made._encode
    for number in range(1, 4 * patterns.ENOUGH_TIMES):
        text = "text" if number % 11 == 10 else None
        changes = [(number % 5, 2 * number), (7, -0.0 if text is None else text)]
        groups = [
            WriteGroup(1, number, 4, WriteKind.COMMIT, 0, changes),
            WriteGroup(3, number, 4, WriteKind.COMMIT, number, [(9, True)]),
        ]
        values = Values(
            (number % 5, 7, 9), (0, 0, number), (2 * number, -0.0 if text is None else 0.0, 1), [text] * bool(text)
        )
        by_codec = number <= patterns.ENOUGH_TIMES or text is not None
        monkeypatch.setattr(made, "_encode", encode_write if by_codec else None)
        wanted = encode(CommonWrite(number, 77, 4, 2, WriteKind.COMMIT, number, values))
        assert made.packed(groups, 0, 77) == [(number, wanted)]


def test_neighbours_of_one_key_travel_together() -> None:
    groups = [
        WriteGroup(1, 5, 4, WriteKind.COMMIT, 0, [(1, 5), (2, 6)]),
        WriteGroup(3, 5, 4, WriteKind.COMMIT, 0, [(3, 7)]),
        WriteGroup(4, 5, 4, WriteKind.BASIC, 9, [(3, 8)]),
    ]
    values = Values((1, 2, 3), (0, 0, 0), (5, 6, 7)), Values((3,), (9,), (8,))
    wanted = [CommonWrite(105, 77, 4, 2, 1, 1, values[0]), CommonWrite(105, 77, 4, 2, 2, 2, values[1])]
    assert WriteMessages({4: 2}).packed(groups, 100, 77) == [(105, encode(message)) for message in wanted]


def test_values_of_commons(tmp_path: Any) -> None:
    for variable in build(tmp_path).config.variables:
        if variable.name == "REF%":
            encoding = value_encoder(variable)
            assert encoding(-300) == encode(Int16(-300))
            with pytest.raises(CdrError):
                encoding(40_000)
            return
    pytest.fail("the rack has no such variable")


def test_patterns_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patterns, "MOST_PATTERNS", 10)
    made = patterns.TemplateCache()
    alike = prepared(Int16(5), ("data",))
    for key in range(100):
        for _ in range(patterns.ENOUGH_TIMES):
            made.learn(key, lambda: alike)
        made.learn(1000 + key, lambda: alike)
    assert 0 < len(made.known) <= 10
    assert len(made._seen) <= 10
