"""Repeats the messages and outcomes that a recorded burst of a BASIC task got from channels."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from automax_ros.compile.base.scan_io import MUST_WAIT
from automax_ros.core.types import DataType, Value, same_bits
from automax_ros.recordings.read.common_log import Entry
from automax_ros.runtime.scan.channels import CHANNEL_VIEWS, Message, item_types

CHANNELS = frozenset(CHANNEL_VIEWS.values())
"""The views of values from channels."""


class RecordedChannels:
    """Channels on which each access has the outcome of the recorded burst's next access to that channel number.

    After the last of those an edited task must wait (decision: what it would have received nobody knows).
    """

    def __init__(self) -> None:
        """Create the channels, before the first burst."""
        self._entries: dict[int, deque[tuple[int, Value]]] = {}
        self.other: list[tuple[int, Message, Message]] = []

    def begin(self, entries: Iterable[Entry]) -> None:
        """Begin a burst with its recorded entries: view, number of the channel, value."""
        self._entries = {}
        self.other.clear()
        for view, number, value in entries:
            self._entries.setdefault(number, deque()).append((view, value))

    def open_reader(self, number: int, types: str, depth: int, reader: str, now_ns: int) -> int:  # noqa: ARG002
        """Return the recorded outcome."""
        return self._outcome(number)

    def open_writer(self, number: int, types: str) -> int:  # noqa: ARG002
        """Return the recorded outcome."""
        return self._outcome(number)

    def receive(self, number: int, types: str, reader: str, now_ns: int) -> tuple[Message, int]:  # noqa: ARG002
        """Return the recorded message and outcome."""
        outcome = self._outcome(number)
        if outcome:
            return (), outcome
        items = self._items(number, types)
        return (items, 0) if len(items) == len(types) else ((), MUST_WAIT)

    def send(self, number: int, types: str, message: Message, now_ns: int) -> int:  # noqa: ARG002
        """Return the recorded outcome; a message that differs from the recorded one is kept in ``other``."""
        outcome = self._outcome(number)
        if not outcome:
            recorded = self._items(number, types)
            if len(recorded) != len(message) or not all(map(same_bits, recorded, message)):
                self.other.append((number, recorded, message))
        return outcome

    def unsent(self, number: int) -> Message:
        """Return the items that the recorded burst sent to a channel and this one did not, as one message."""
        return tuple(value for _, value in self._entries.get(number, ()))

    def _items(self, number: int, types: str) -> Message:
        """Return the next items as far as they are of these types."""
        items: list[Value] = []
        for kind in item_types(types):
            item = self._next(number, CHANNEL_VIEWS[kind])
            if item is None:
                break
            items.append(item)
        return tuple(items)

    def _outcome(self, number: int) -> int:
        outcome = self._next(number, CHANNEL_VIEWS[DataType.INTEGER])
        return outcome if isinstance(outcome, int) else MUST_WAIT

    def _next(self, number: int, view: int) -> Value | None:
        entries = self._entries.get(number)
        if not entries or entries[0][0] != view:
            return None
        return entries.popleft()[1]
