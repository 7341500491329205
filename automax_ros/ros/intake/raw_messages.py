"""The senders of one topic, told apart by their GID: which of their messages has come, and which has not.

Messages of a topic as bytes, with their size, their sender and their number, taken one by one where one looks.

rclpy's executors take a message as soon as it comes, whatever its size. Here it waits in DDS, as many as the quality of
service keeps, until somebody takes it; longer ones than wanted are never made bytes of Python's.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple, Protocol

from automax_ros.ros.intake.rcl import OK, TAKE_FAILED, Bytes, Library, MessageInfo, library


class RawMessage(NamedTuple):
    """A message: its bytes (none where it is longer than wanted), its size, when it was sent (ns, the sender's clock).

    ``number`` counts the sender's messages of the topic, 0 where that is not known; ``sender`` is the publisher's GID,
    as the graph tells it too (``endpoint_gid``), empty where it is not known.
    """

    payload: bytes | None
    size: int
    sent_ns: int
    number: int
    sender: bytes


class RawReader(Protocol):
    """Takes the messages of one subscription."""

    def take(self) -> RawMessage | None:
        """Return the next message, None where there is none.

        Raises:
            InvalidHandle: of rclpy's; the subscription was destroyed.
            RuntimeError: the middleware fails.
        """


def taker_of(subscription: Any, most_bytes: int) -> RawReader:
    """Return what takes the messages of a subscription of rclpy's; longer ones than ``most_bytes`` come without bytes.

    No executor may serve the subscription.
    """
    found = library()
    return _RclpyTaker(subscription, most_bytes) if found is None else _RclTaker(found, subscription, most_bytes)


class _RclTaker:
    """By rcl itself, without the interpreter."""

    def __init__(self, rcl: Library, subscription: Any, most_bytes: int) -> None:
        self._rcl, self._handle, self._most_bytes = rcl, subscription.handle, most_bytes
        self._buffer, self._info = rcl.buffer(), MessageInfo()
        self._into, self._about = ctypes.addressof(self._buffer), ctypes.addressof(self._info)

    def take(self) -> RawMessage | None:
        rcl, buffer, info = self._rcl, self._buffer, self._info
        with self._handle:
            result = rcl.take_serialized(self._handle.pointer, self._into, self._about, None)
        if result != OK:
            rcl.reset_error()
            if result in TAKE_FAILED:
                return None
            raise RuntimeError(f"rcl_take_serialized_message returns {result}")
        size = buffer.length
        payload = self._copied(buffer) if size <= self._most_bytes else None
        rcl.give_back(buffer)
        return RawMessage(payload, size, info.source_timestamp, info.publication_sequence_number, bytes(info.sender))

    @staticmethod
    def _copied(buffer: Bytes) -> bytes:
        return ctypes.string_at(buffer.buffer, buffer.length) if buffer.buffer else b""


class _RclpyTaker:
    """By rclpy, where rcl is not found: a long message holds up all threads while it is copied."""

    def __init__(self, subscription: Any, most_bytes: int) -> None:
        self._handle, self._class, self._most_bytes = subscription.handle, subscription.msg_type, most_bytes

    def take(self) -> RawMessage | None:
        with self._handle:
            found = self._handle.take_message(self._class, True)
        if found is None:
            return None
        payload, info = found
        kept = payload if len(payload) <= self._most_bytes else None
        return RawMessage(
            kept, len(payload), info["source_timestamp"], info.get("publication_sequence_number") or 0, b""
        )


MOST_SENDERS = 64
"""Most senders of a topic that are remembered (decision: a bound); the one known longest is forgotten first."""
MOST_MISSING = 1_000_000
"""A sender whose numbers leap further is not counted: numbers are what a stranger says."""


class SequenceTracker:
    """The number of the last message of each sender."""

    def __init__(self) -> None:
        """None has sent yet."""
        self._last: dict[bytes, int] = {}

    def missing(self, taken: RawMessage) -> int | None:
        """Return how many messages of its sender did not come before this one; None where it has come already."""
        last = self._last.get(taken.sender)
        if last is None and len(self._last) >= MOST_SENDERS:
            del self._last[next(iter(self._last))]
        if last is not None and taken.number <= last:
            return None
        self._last[taken.sender] = taken.number
        missing = 0 if last is None else taken.number - last - 1
        return missing if missing <= MOST_MISSING else 0
