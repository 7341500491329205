"""The senders of one topic, told apart by their GID: which of their messages has come, and which has not."""

from __future__ import annotations

from automax_ros.nodes.taking import Taken

MOST_SENDERS = 64
"""Most senders of a topic that are remembered (decision: a bound); the one known longest is forgotten first."""
MOST_MISSING = 1_000_000
"""A sender whose numbers leap further is not counted: numbers are what a stranger says."""


class Senders:
    """The number of the last message of each sender."""

    def __init__(self) -> None:
        """None has sent yet."""
        self._last: dict[bytes, int] = {}

    def missing(self, taken: Taken) -> int | None:
        """Return how many messages of its sender did not come before this one; None where it has come already."""
        last = self._last.get(taken.sender)
        if last is None and len(self._last) >= MOST_SENDERS:
            del self._last[next(iter(self._last))]
        if last is not None and taken.number <= last:
            return None
        self._last[taken.sender] = taken.number
        missing = 0 if last is None else taken.number - last - 1
        return missing if missing <= MOST_MISSING else 0
