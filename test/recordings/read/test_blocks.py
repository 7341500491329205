"""Blocks hold the messages that the reader tells one by one, whatever a file claims about its chunks."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.blocks import MessageBlock, message_blocks
from automax_ros.recordings.read.reader import BagMessage, BagReader
from recordings.mutations import CHANGES, table_of

GOLDEN = Path(__file__).parents[3] / "bags" / "section_drive"
TYPES = tuple(f"automax_msgs/msg/{name}" for name in ("Scan", "CommonWrite", "TaskState", "CommonImage"))


def in_blocks(bag: Path) -> Iterator[BagMessage]:
    for item in message_blocks(BagReader(bag), TYPES, table_of):
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
    assert all(isinstance(item, MessageBlock) for item in message_blocks(BagReader(GOLDEN), TYPES, table_of))


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
