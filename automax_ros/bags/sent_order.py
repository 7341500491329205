"""Puts the messages of other recorders into the order in which they were sent.

`ros2 bag record` stores messages topic by topic as it gets round to them, latched ones in the order of discovery. What
a rack sends comes from one thread, so the times of sending are its order; in our own recordings that is the file's.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from typing import TypeVar

from automax_ros.bags.errors import BagError
from automax_ros.bags.mcap_file import RawMessage
from automax_ros.core.ticks import NS_PER_S

HOLD_NS = NS_PER_S
"""A message is waited for until one is read that was sent so much later (decision)."""
MOST_HELD = 20_000
MOST_HELD_BYTES = 64 << 20
"""What waits at most, in messages and in bytes (decision)."""

Source = TypeVar("Source")


def in_sent_order(records: Iterator[tuple[Source, RawMessage]]) -> Iterator[tuple[Source, RawMessage]]:
    """Return the messages by their times of sending; those of one time in the order in which they stand.

    Raises:
        BagError: ``records`` has raised it; everything before has been handed out.
    """
    waiting: list[tuple[int, int, Source, RawMessage]] = []
    held = newest = 0
    failure: BagError | None = None
    try:
        for number, (source, taken) in enumerate(records):
            heapq.heappush(waiting, (taken.publish_time, number, source, taken))
            held += len(taken.data)
            newest = max(newest, taken.publish_time)
            while waiting and (waiting[0][0] <= newest - HOLD_NS or len(waiting) > MOST_HELD or held > MOST_HELD_BYTES):
                *_, its_source, record = heapq.heappop(waiting)
                held -= len(record.data)
                yield its_source, record
    except BagError as error:  # what was read before the damage is handed out first
        failure = error
    while waiting:
        *_, its_source, record = heapq.heappop(waiting)
        yield its_source, record
    if failure is not None:
        raise failure
