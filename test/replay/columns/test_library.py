"""What ``columns.c`` does is what the scalar decoder does, on any bytes."""

from __future__ import annotations

import functools
import gc
import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings.mutations import CHANGES, table_of

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import DataType
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import NAMES, CommonWrite, Scan, ScanError, Values
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.recordings.mcap.chunk_table import WholeChunk
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_file import McapFile
from automax_ros.recordings.read.blocks import MessageBlock, message_blocks
from automax_ros.recordings.read.reader import BagMessage, BagReader, ChannelReader, DataSource
from automax_ros.replay.columns.entries import Entries, ValueRules
from automax_ros.replay.columns.library import ColumnLibrary
from automax_ros.replay.columns.scans import SCAN, WRITE, scans_by_task, write_columns
from automax_ros.replay.columns.stretch import LatchedColumns
from automax_ros.runtime.tasks.task import EVENT_TIMEOUT, OVERLAP
from replay.replays import recorded

GOLDEN = Path(__file__).parents[3] / "bags" / "section_drive"
TASKS = ("DRIVE", "LINE", "SPEED")
RUN = (1 << 64) - 7
VARIABLES = [
    CommonVariable("A%", DataType.INTEGER),
    CommonVariable("B@", DataType.BOOLEAN),
    CommonVariable("C", DataType.REAL),
    CommonVariable("D!", DataType.DOUBLE, dimensions=(3,)),
    CommonVariable("E$", DataType.STRING),
]
RULES = ValueRules(VARIABLES)
numbers = st.sampled_from((0.0, -0.0, 1.0, -1.0, 0.5, 32767.0, 32768.0, 1e9, 1e300, float("nan"), float("inf")))


@pytest.fixture
def library(column_library):
    if column_library is None:
        pytest.skip("there is no C compiler")
    return column_library


@st.composite
def values(draw) -> Values:
    count = draw(st.sampled_from((0, 0, 1, 1, 2, 4)))
    sizes = [count + (draw(st.integers(0, 60)) == 0) for _ in range(3)]
    texts = draw(st.sampled_from(((),) * 20 + (("ready",), ("Grüße", ""))))
    return Values(
        *(tuple(draw(st.integers(0, most)) for _ in range(size)) for most, size in zip((5, 4), sizes, strict=False)),
        tuple(draw(numbers) for _ in range(sizes[2])),
        texts,
    )


@st.composite
def messages(draw) -> Scan | CommonWrite:
    sequence = draw(st.sampled_from((3, 4, 5, (1 << 63) - 1, (1 << 63) + 9)))
    stamp = draw(st.integers(0, 10**12))
    if draw(st.booleans()):
        run = draw(st.sampled_from((RUN, RUN, RUN, 5)))
        return CommonWrite(stamp, run, 1, 2, draw(st.integers(0, 6)), sequence, draw(values()))
    task = draw(st.sampled_from((*TASKS, "SPEED", "SPEE", "SPEEDY", "", "Größe")))
    code = st.sampled_from((7001, OVERLAP))
    errors = tuple(ScanError(number, draw(code)) for number in range(draw(st.sampled_from((0, 0, 0, 1, 3)))))
    parts = [draw(values()) for _ in range(4)]
    return Scan(stamp, 1, task, sequence, draw(st.integers(0, 9)), 0, draw(st.booleans()), *parts, errors)


@st.composite
def blocks(draw) -> MessageBlock:
    """Scans and writes, some of them many times, some damaged, with other bytes between them."""
    items: list[tuple[int, bytes]] = []
    for message in draw(st.lists(messages(), min_size=1, max_size=5)):
        data = encode(message)
        items += [(int(isinstance(message, CommonWrite)), data)] * draw(st.sampled_from((1, 2, 12)))
    for _ in range(draw(st.sampled_from((0, 0, 0, 1, 3)))):
        place = draw(st.integers(0, len(items) - 1))
        kind, data = items[place]
        at = draw(st.integers(0, max(0, len(data) - 1)))
        other = bytes([draw(st.sampled_from((0, 1, 2, 0x7F, 0xFF)))])
        items[place] = kind, draw(st.sampled_from((data[:at], data[:at] + other + data[at + 1 :], data + bytes(at))))
    return block_of(items)


@functools.cache
def source() -> DataSource:
    """The channels of a recording: 0 that of scans, 1 that of writes."""
    file = McapFile(next(GOLDEN.glob("*.mcap")))
    all(file.records())
    made = DataSource(file.path)
    kinds = (NAMES[Scan], NAMES[CommonWrite])
    for channel in file.channels.values():
        schema = file.schemas[channel.schema_id]
        if schema.name in kinds:
            made.channels[kinds.index(schema.name)] = ChannelReader(file.path, channel, schema, wanted=True)
    return made


def block_of(items: list[tuple[int, bytes]]) -> MessageBlock:
    lengths = np.array([len(data) for _, data in items], np.int64)
    starts = np.cumsum([3, *(lengths[:-1] + 3)]).astype(np.int64)
    data = np.frombuffer(b"xyz".join([b"", *(data for _, data in items), b""]), np.uint8)
    which = np.array([kind for kind, _ in items], np.int64)
    times = np.arange(len(items), dtype=np.uint64)
    return MessageBlock(source(), data, which, which, starts, lengths, times, times)


def decoded(block: MessageBlock, places: np.ndarray) -> list[tuple[int, Any]]:
    """The places and messages up to the first one that is malformed."""
    found = []
    for place in places.tolist():
        try:
            found.append((place, block.message(place).message))
        except BagError:
            break
    return found


def is_odd(scan: Scan) -> bool:
    """Whether a scan must be replayed by itself."""
    parts = scan.latched, scan.read, scan.written, scan.committed
    timed = any(error.code in (OVERLAP, EVENT_TIMEOUT) for error in scan.errors)
    return timed or scan.scan >= 1 << 63 or not all(map(is_possible, parts))


def is_possible(values: Values) -> bool:
    """Whether the variables of the rack can have the values."""
    if values.text or not len(values.variable) == len(values.element) == len(values.value):
        return False
    return all(map(can_hold, values.variable, values.element, values.value))


def can_hold(view: int, element: int, value: float) -> bool:
    if view >= len(VARIABLES) or VARIABLES[view].type is DataType.STRING or element >= VARIABLES[view].elements:
        return False
    low, high = VARIABLES[view].type.range
    return low <= value <= high and (VARIABLES[view].type is DataType.REAL or value == int(value))


def entries_of(part: Values) -> list[str]:
    """Numbers, elements and values in the types of their variables, with the sign of a zero."""
    values = [value if view == 2 else value + 0.0 for view, value in zip(part.variable, part.value, strict=True)]
    return [repr(list(column)) for column in (part.variable, part.element, values)]


def shown(entries: Entries) -> list[str]:
    return [repr(column.tolist()) for column in (entries.views, entries.elements, entries.values)]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(block=blocks())
def test_scans_are_taken_as_the_scalar_decoder_takes_them(library, block):
    places = np.flatnonzero(block.kinds == 0)
    expected = decoded(block, places)
    end = expected[-1][0] + 1 if expected else 0
    if len(expected) == len(places):
        end = len(block)
    found, strays = scans_by_task(library, block, places, TASKS, RULES)
    assert [place for place in strays.tolist() if place < end] == [
        place for place, scan in expected if scan.task not in TASKS
    ]
    for task in TASKS:
        scans = [(place, scan) for place, scan in expected if scan.task == task]
        own = found.get(task)
        if own is None:
            assert not scans
            continue
        assert own.places[own.places < end].tolist() == [place for place, _ in scans]
        assert own.odd[len(scans) :].all()
        assert own.odd[: len(scans)].tolist() == [is_odd(scan) for _, scan in scans]
        for row, (_, scan) in enumerate(scans):
            if own.odd[row]:
                continue
            one = own.part(row, row + 1)
            numbers = [column.tolist() for column in (one.stamps, one.scans, one.durations, one.full)]
            assert numbers == [[scan.stamp], [scan.scan], [scan.duration_ns], [scan.full]]
            for entries, part in zip(
                (one.latched, one.read, one.written, one.committed),
                (scan.latched, scan.read, scan.written, scan.committed),
                strict=True,
            ):
                assert shown(entries) == entries_of(part)
            errors = list(zip(one.errors.views.tolist(), one.errors.elements.tolist(), strict=True))
            assert errors == [(error.line, error.code) for error in scan.errors]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(block=blocks())
def test_writes_are_taken_as_the_scalar_decoder_takes_them(library, block):
    places = np.flatnonzero(block.kinds == 1)
    expected = decoded(block, places)
    found, forcing = write_columns(library, block, places, RUN, RULES)
    end = len(block) if len(expected) == len(places) else (expected[-1][0] + 1 if expected else 0)
    forces = [place for place, write in expected if write.kind in (WriteKind.FORCE, WriteKind.RELEASE)]
    assert [place for place in forcing.tolist() if place < end] == forces
    before = None
    for row, (place, write) in enumerate(expected):
        follows = before is None or write.sequence == before + 1
        own = write.run_id == RUN and write.sequence < (1 << 63) - 1
        assert found.good[row] == (own and follows and place not in forces and is_possible(write.values))
        before = write.sequence
        if found.good[row]:
            one = found.part(row, row + 1)
            assert one.sequences.tolist() == [write.sequence]
            assert shown(one.entries) == entries_of(write.values)


@st.composite
def lists(draw, count: int) -> Entries:
    sizes = [draw(st.sampled_from((0, 0, 1, 2))) for _ in range(count)]
    offsets = np.cumsum([0, *sizes])
    total = int(offsets[-1])
    views = np.array([draw(st.integers(0, 4)) for _ in range(total)], np.int64)
    found = np.array([draw(st.integers(-3, 3)) for _ in range(total)], np.float64)
    return Entries(offsets, views, np.zeros(total, np.int64), found)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(data=st.data(), views=st.permutations((0, 2, 3)), count=st.integers(1, 30))
def test_latched_values_hold_until_the_next_ones(library, data, views, count):
    entries = data.draw(lists(count))
    now, expected = dict(zip(views, (7, -8, 9), strict=True)), []
    for scan in range(count):
        part = entries.part(scan, scan + 1)
        now.update((view, int(value)) for view, value in zip(part.views.tolist(), part.values, strict=True))
        expected.append([now[view] for view in views])
    assert LatchedColumns(views, 5, library).columns(entries, [7, -8, 9]).T.tolist() == expected


def committed(entries: Entries, scan: int) -> list[list[float]]:
    part = entries.part(scan, scan + 1)
    return [part.views.tolist(), part.values.tolist()]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(data=st.data(), count=st.integers(1, 20))
def test_the_first_other_commit_is_found(library, data, count):
    views = np.array([3, 1], np.int64)
    column = st.lists(st.integers(0, 2), min_size=count, max_size=count)
    latched, outputs = ([np.array(data.draw(column), np.int64) for _ in views] for _ in range(2))
    changed = (np.array(outputs) != np.array(latched)).T
    own = Entries(
        np.concatenate(([0], np.cumsum(changed.sum(axis=1)))),
        views[np.nonzero(changed)[1]],
        np.zeros(int(changed.sum()), np.int64),
        np.array(outputs, np.float64).T[changed],
    )
    recorded = data.draw(lists(count)) if data.draw(st.booleans()) else own
    if data.draw(st.booleans()) and len(own.views):
        values = own.values.copy()
        values[data.draw(st.integers(0, len(values) - 1))] += data.draw(st.sampled_from((0.0, 0.5, 1.0)))
        recorded = Entries(own.offsets, own.views, own.elements, values)
    same = library.same_commits(recorded, outputs, latched, views)
    assert same == next((k for k in range(count) if committed(recorded, k) != committed(own, k)), count)
    assert recorded is not own or same == count


def test_chunks_are_taken_apart_record_by_record(library):
    chunks = [item for item in McapFile(next(GOLDEN.glob("*.mcap"))).pieces() if isinstance(item, WholeChunk)]
    for chunk in chunks:
        ends = [len(chunk.data)]
        expected, found = table_of(chunk.data, ends), library.table(chunk.data, ends)
        assert expected is not None
        assert found.definitions == expected.definitions
        for name in ("numbers", "places", "starts", "lengths", "log_times", "stamps"):
            column, its = getattr(found, name), getattr(expected, name)
            assert (column.dtype, column.tolist()) == (its.dtype, its.tolist()), name
    assert chunks


def test_chunks_that_follow_each_other_are_taken_apart_at_once(library):
    chunks = [item for item in McapFile(next(GOLDEN.glob("*.mcap"))).pieces() if isinstance(item, WholeChunk)][:5]
    data = b"".join(chunk.data for chunk in chunks)
    ends = np.cumsum([len(chunk.data) for chunk in chunks]).tolist()
    tables = [library.table(chunk.data, [len(chunk.data)]) for chunk in chunks]
    found = library.table(data, ends)
    begins = [0, *ends]
    assert found.places.tolist() == [
        place + begin for table, begin in zip(tables, begins, strict=False) for place in table.places.tolist()
    ]
    assert found.log_times.tolist() == [time for table in tables for time in table.log_times.tolist()]
    first = tables[0].places.tolist()
    assert library.table(data, [first[-1], *ends]).places.tolist() == found.places.tolist()
    assert library.table(data, [ends[0] - 1, *ends]) is None  # a record over the end of its chunk
    assert library.table(data, [ends[1], ends[0], *ends[1:]]) is None
    with pytest.raises(ValueError, match="do not end"):
        library.table(data, [len(data) + 1])


def test_many_chunks_are_taken_apart_whatever_memory_is_given_back_meanwhile(library, monkeypatch):
    """The ends of 128 chunks and more stand in memory of malloc's, which gives it to the next who asks."""
    whole = (item for item in McapFile(next(GOLDEN.glob("*.mcap"))).pieces() if isinstance(item, WholeChunk))
    chunk = min(whole, key=lambda item: len(item.data))
    data = bytes(chunk.data) * 300
    ends = [len(chunk.data) * number for number in range(1, 301)]
    taken = []
    count = ColumnLibrary._count

    def counted(self, name, *arguments):
        gc.collect()
        taken.append([np.full(len(ends), -1, np.int64) for _ in range(64)])
        return count(self, name, *arguments)

    monkeypatch.setattr(ColumnLibrary, "_count", counted)
    found = library.table(data, ends)
    assert found is not None
    assert len(found.places) == 300 * len(table_of(chunk.data, [len(chunk.data)]).places)


def test_other_records_and_cut_off_ones_are_left_to_the_reader(library):
    chunks = [item for item in McapFile(next(GOLDEN.glob("*.mcap"))).pieces() if isinstance(item, WholeChunk)]
    data = bytes(chunks[0].data)

    def table(part: bytes):
        return library.table(part, [len(part)])

    places = table(data).places.tolist()
    for cut in (1, 8, 9, 30, len(data) - places[-1] - 1):
        assert table(data[: places[-1] + cut]) is None
    assert len(table(data[: places[-1]]).places) == len(places) - 1
    for opcode in (0, 1, 6, 0x0F, 0x80, 0xFF):
        assert table(data[: places[9]] + bytes([opcode]) + data[places[9] + 1 :]) is None
    assert table(b"") is None


def test_damaged_recordings_tell_the_same_messages_and_the_same_error(library, tmp_path: Path):
    bag, changed = recorded(tmp_path), tmp_path / "changed"
    data = (bag / "scans_0.mcap").read_bytes()
    shutil.copytree(bag, changed)
    types = (SCAN, WRITE)

    def outcome(items) -> tuple[list[BagMessage], str]:
        found: list[BagMessage] = []
        try:
            for item in items:
                found += [item] if isinstance(item, BagMessage) else map(item.message, range(len(item)))
        except BagError as error:
            return found, str(error)
        return found, ""

    for number in range(len(CHANGES)):
        chance = random.Random(f"library {number}")
        (changed / "scans_0.mcap").write_bytes(CHANGES[number % len(CHANGES)](bytearray(data), chance))
        expected = outcome(BagReader(changed).messages(types=types))
        found = outcome(message_blocks(BagReader(changed), types, library.table))
        assert repr(found) == repr(expected), number
