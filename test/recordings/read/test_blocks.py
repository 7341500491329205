"""Blocks hold the messages that the reader tells one by one, whatever a file claims about its chunks."""

from __future__ import annotations

import random
import struct
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import pytest

from automax_ros.recordings.mcap.chunk_builder import ChunkBuilder
from automax_ros.recordings.mcap.chunk_table import WholeChunk
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.blocks import MessageBlock, message_blocks
from automax_ros.recordings.read.reader import BagMessage, BagReader
from recordings.mutations import CHANGES

GOLDEN = Path(__file__).parents[3] / "bags" / "section_drive"
TYPES = tuple(f"automax_msgs/msg/{name}" for name in ("Scan", "CommonWrite", "TaskState", "CommonImage"))


def in_blocks(bag: Path) -> Iterator[BagMessage]:
    for item in message_blocks(BagReader(bag), TYPES):
        if isinstance(item, BagMessage):
            yield item
        else:
            yield from map(item.message, range(len(item)))


def told(messages: Iterator[BagMessage]) -> tuple[list[BagMessage], str]:
    """The messages up to the first error, and the error."""
    found: list[BagMessage] = []
    try:
        found.extend(messages)
    except BagError as error:
        return found, f"{error.code} {error}"
    return found, ""


def test_a_recording_in_blocks_has_the_messages_of_a_recording_in_order():
    assert list(in_blocks(GOLDEN)) == list(BagReader(GOLDEN).messages(types=TYPES))
    assert all(isinstance(item, MessageBlock) for item in message_blocks(BagReader(GOLDEN), TYPES))


def test_damaged_recordings_tell_the_same_messages_and_the_same_error(tmp_path: Path):
    data = (GOLDEN / "scans_0.mcap").read_bytes()
    outcomes = set()
    for number in range(2 * len(CHANGES)):
        (tmp_path / "bag").mkdir(exist_ok=True)
        (tmp_path / "bag" / "metadata.yaml").write_bytes((GOLDEN / "metadata.yaml").read_bytes())
        changed = CHANGES[number % len(CHANGES)](bytearray(data), random.Random(f"blocks {number}"))
        (tmp_path / "bag" / "scans_0.mcap").write_bytes(changed)
        expected = told(BagReader(tmp_path / "bag").messages(types=TYPES))
        found = told(in_blocks(tmp_path / "bag"))
        assert found == expected or repr(found) == repr(expected), number  # a NaN is not equal to itself
        outcomes.add(expected[1][:7])
    assert len(outcomes) > 2


@pytest.fixture
def chunk() -> ChunkBuilder:
    builder = ChunkBuilder()
    for number in range(20):
        builder.add_message(1 + number % 2, number, 1000 + number, 2000 + number, bytes(range(number + 4)))
    return builder


def index_of(chunk: ChunkBuilder) -> dict[int, list[int]]:
    return {channel: list(struct.unpack(f"<{len(data) // 8}Q", data)) for channel, data in chunk.index.items()}


def indexed(chunk: ChunkBuilder, entries: dict[int, list[int]]) -> WholeChunk:
    whole = WholeChunk(bytes(chunk.data))
    for channel, numbers in entries.items():
        whole.add_index(struct.pack(f"<HI{len(numbers)}Q", channel, len(numbers) * 8, *numbers))
    return whole


def test_an_index_that_fills_its_chunk_tells_where_messages_stand(chunk: ChunkBuilder):
    table = indexed(chunk, index_of(chunk)).table()
    assert table is not None
    assert table.lengths.tolist() == [number + 4 for number in range(20)]
    assert table.log_times.tolist() == [1000 + number for number in range(20)]
    assert table.stamps.tolist() == [2000 + number for number in range(20)]
    assert table.numbers.tolist() == [1 + number % 2 for number in range(20)]
    data = bytes(chunk.data)
    assert [data[start : start + length] for start, length in zip(table.starts, table.lengths, strict=True)] == [
        bytes(range(number + 4)) for number in range(20)
    ]


@pytest.mark.parametrize("place", [-1, 0, 5, 10_000, (1 << 64) - 1], ids=str)
def test_an_index_that_lies_counts_nothing(chunk: ChunkBuilder, place: int):
    entries = index_of(chunk)
    if place < 0:
        del entries[2][-2:]  # a message that no index tells of
    else:
        entries[2][-1] = place
    assert indexed(chunk, entries).table() is None


def test_more_entries_than_a_chunk_can_hold_count_nothing(chunk: ChunkBuilder):
    entries = index_of(chunk)
    for channel in range(3, 40):
        entries[channel] = list(entries[1])
    assert indexed(chunk, entries).table() is None


def test_a_chunk_with_a_lying_index_takes_no_memory():
    """Messages that no index tells are not collected before the chunk is given up."""
    builder = ChunkBuilder()
    for number in range(50_000):
        builder.add_message(1, number, number, number, b"")
    whole = indexed(builder, {1: index_of(builder)[1][:2]})
    tracemalloc.start()
    assert whole.table() is None
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2 * len(whole.data)


def test_a_chunk_without_index_is_read_one_by_one(chunk: ChunkBuilder):
    assert WholeChunk(bytes(chunk.data)).table() is None
