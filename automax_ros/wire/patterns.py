"""Keeps what packs the messages that recur, by what they have in common.

Preparing costs as much as thirty messages that go through the codec, so only what recurs is prepared (decision: after
eight times), and no more than a rack that works can need.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable

from automax_ros.wire.prepared import Prepared

ENOUGH_TIMES = 8
"""How often the codec packs messages of one pattern before one is prepared for them."""
MOST_PATTERNS = 2048
"""Most patterns that are known at a time: an array's elements in turn would make ever more."""


class Patterns:
    """The patterns of one kind of message. ``known`` has those that are prepared, by key."""

    def __init__(self) -> None:
        """Know none."""
        self.known: dict[Hashable, Prepared] = {}
        self._seen: dict[Hashable, int] = {}

    def learn(self, key: Hashable, prepare: Callable[[], Prepared]) -> None:
        """Note that a message with a key was packed by the codec."""
        times = self._seen.get(key, 0) + 1
        if times < ENOUGH_TIMES:
            if len(self._seen) >= MOST_PATTERNS:
                self._seen.clear()
            self._seen[key] = times
            return
        self._seen.pop(key, None)
        if len(self.known) >= MOST_PATTERNS:
            self.known.clear()
        self.known[key] = prepare()
