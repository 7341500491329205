"""Channels: queues of messages from any number of tasks to one (J-3675 p. 6-20 to 6-22).

A number is one channel in the whole rack (decision: so tasks of several Processors can use it). The task that reads it
creates it; it lasts until STOP ALL or the end of power.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from automax_ros.compile.base.scan_io import MUST_WAIT, Suspension
from automax_ros.core.types import DataType, Value
from automax_ros.runtime.scan.events import Wake

NOT_OPEN, OTHER_READER, OTHER_TYPES, WRONG_DEPTH = 7050, 7051, 7052, 7053
MAX_DEPTH = 1000
"""Most messages that a channel holds (decision: a bound on memory)."""
Message = tuple[Value, ...]

CHANNEL_VIEWS = {kind: 0xFFFF - place for place, kind in enumerate(DataType)}
"""The view under which a record stores items received from a channel or sent to it, by their type; no rack has it.

The element is the channel's number. The outcome of each access precedes its items, as an INTEGER.
"""


def item_types(types: str) -> tuple[DataType, ...]:
    """Return the types that a channel's type characters mean, `.` for REAL."""
    return tuple(DataType(character.strip(".")) for character in types)


class ChannelAccess(Protocol):
    """The channels of a rack (``Channels``) or of a recording, as tasks use them."""

    def open_reader(self, number: int, types: str, depth: int, reader: str, now_ns: int) -> int: ...  # noqa: D102

    def open_writer(self, number: int, types: str) -> int: ...  # noqa: D102

    def receive(self, number: int, types: str, reader: str, now_ns: int) -> tuple[Message, int]: ...  # noqa: D102

    def send(self, number: int, types: str, message: Message, now_ns: int) -> int: ...  # noqa: D102


@dataclass
class Channel:
    """One channel: messages of items of ``types`` (type characters, `.` for REAL), at most ``depth`` of them."""

    types: str
    depth: int
    reader: str
    messages: deque[Message] = field(default_factory=deque)


class Channels:
    """The channels of a rack, and the tasks that wait for them."""

    def __init__(self) -> None:
        self._all: dict[int, Channel] = {}
        self._waiting: list[tuple[Suspension, int, Wake]] = []

    def open_reader(self, number: int, types: str, depth: int, reader: str, now_ns: int) -> int:
        """Make a task the reader; return the problem or 0.

        Opened again with the same types and depth, a channel keeps its messages; otherwise they are lost (decision).
        """
        if not 1 <= depth <= MAX_DEPTH:
            return WRONG_DEPTH
        known = self._all.get(number)
        if known is not None and known.reader != reader:
            return OTHER_READER
        if known is None or (known.types, known.depth) != (types, depth):
            self._all[number] = Channel(types, depth, reader)
            self._wake(Suspension.ABSENT, number, now_ns)
            self._wake(Suspension.FULL, number, now_ns)
        return 0

    def open_writer(self, number: int, types: str) -> int:
        """Return 0, MUST_WAIT while no task reads the channel, or the problem."""
        known = self._all.get(number)
        if known is None:
            return MUST_WAIT
        return 0 if known.types == types else OTHER_TYPES

    def receive(self, number: int, types: str, reader: str, now_ns: int) -> tuple[Message, int]:
        """Return the oldest message and 0, or nothing and MUST_WAIT or the problem."""
        known = self._all.get(number)
        if known is None or known.reader != reader:
            return (), NOT_OPEN
        if known.types != types:
            return (), OTHER_TYPES
        if not known.messages:
            return (), MUST_WAIT
        message = known.messages.popleft()
        self._wake(Suspension.FULL, number, now_ns)
        return message, 0

    def send(self, number: int, types: str, message: Message, now_ns: int) -> int:
        """Add a message; return 0, MUST_WAIT if the channel is full, or the problem."""
        known = self._all.get(number)
        if known is None:
            return MUST_WAIT
        if known.types != types:
            return OTHER_TYPES
        if len(known.messages) >= known.depth:
            return MUST_WAIT
        known.messages.append(message)
        self._wake(Suspension.EMPTY, number, now_ns)
        return 0

    def wait(self, why: Suspension, number: int, wake: Wake) -> None:
        """Call ``wake`` when the cause of a task's wait may have changed."""
        self._waiting.append((why, number, wake))

    def forget(self, wake: Wake) -> None:
        """Cancel a wait."""
        self._waiting = [entry for entry in self._waiting if entry[2] != wake]

    def clear(self) -> None:
        """Remove all channels: STOP ALL and the end of power (decision)."""
        self._all.clear()

    def state(self) -> tuple[Any, ...]:
        """Return number, types, depth, reader and messages of each channel."""
        return tuple(
            (number, known.types, known.depth, known.reader, tuple(known.messages))
            for number, known in sorted(self._all.items())
        )

    def load(self, state: Sequence[Any]) -> None:
        """Restore a state."""
        self._all = {
            number: Channel(types, depth, reader, deque(map(tuple, messages)))
            for number, types, depth, reader, messages in state
        }

    def _wake(self, why: Suspension, number: int, now_ns: int) -> None:
        woken = [entry for entry in self._waiting if entry[:2] == (why, number)]
        self._waiting = [entry for entry in self._waiting if entry[:2] != (why, number)]
        for _, _, wake in woken:
            wake(now_ns)
