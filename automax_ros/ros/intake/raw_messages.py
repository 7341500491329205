"""Messages of a topic as bytes, with their size, sender and number, taken one by one on demand.

rclpy's executors take a message as soon as it arrives, whatever its size. Here messages wait in DDS, as many as the
quality of service keeps, until they are taken; those longer than wanted are never copied into Python bytes.

``SequenceTracker`` detects lost and duplicate messages of each sender, distinguished by GID.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, NamedTuple

from automax_ros.ros.intake.rcl import OK, TAKE_FAILED, Library, MessageInfo, library

MOST_SENDERS = 64
"""Most senders of a topic that are remembered (decision: a bound); the one known longest is forgotten first."""
MOST_MISSING = 1_000_000
"""A larger gap in a sender's numbers is not counted: any program can send any number."""


class RawMessage(NamedTuple):
    """A message: its bytes (None if it is longer than wanted), its size, when it was sent (ns, the sender's clock).

    ``number`` counts the sender's messages of the topic, 0 if unknown; ``sender`` is the publisher's GID, as in the
    graph (``endpoint_gid``), empty if unknown.
    """

    payload: bytes | None
    size: int
    sent_ns: int
    number: int
    sender: bytes


def reader_of(subscription: Any, most_bytes: int) -> _RclReader | _RclpyReader:
    """Return the reader of an rclpy subscription; messages longer than ``most_bytes`` have no payload.

    Its ``take`` returns the next message, None if there is none. It raises rclpy's InvalidHandle if the subscription
    was destroyed, RuntimeError if the middleware fails. No executor may serve the subscription.
    """
    found = library()
    return _RclpyReader(subscription, most_bytes) if found is None else _RclReader(found, subscription, most_bytes)


class _RclReader:
    """Reads with rcl itself, without holding the interpreter."""

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
        payload = None
        if size <= self._most_bytes:
            payload = ctypes.string_at(buffer.buffer, size) if buffer.buffer else b""
        rcl.give_back(buffer)
        return RawMessage(payload, size, info.source_timestamp, info.publication_sequence_number, bytes(info.sender))


class _RclpyReader:
    """Reads with rclpy, where rcl is not found: a long message holds up all threads while it is copied."""

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


class TopicReader:
    """One subscription as ``MessageIntake`` reads it; ``receive`` is called with each message."""

    def __init__(self, subscription: Any, most_bytes: int, receive: Callable[[RawMessage], None]) -> None:
        self.name, self.handle = subscription.topic_name, subscription.handle
        self._reader, self._receive = reader_of(subscription, most_bytes), receive

    def take(self) -> bool:
        """Take the next message; return False if there is none."""
        taken = self._reader.take()
        if taken is not None:
            self._receive(taken)
        return taken is not None

    def wake(self, pointer: int, callback: Any, data: int | None) -> int:
        """Set the C function that rcl calls for each message."""
        rcl = library()
        assert rcl is not None
        return int(rcl.on_message(pointer, callback, data))


class SequenceTracker:
    """The number of the last message of each sender."""

    def __init__(self) -> None:
        self._last: dict[bytes, int] = {}

    def missing(self, taken: RawMessage) -> int | None:
        """Return how many messages of the sender are missing before this one; None if it has arrived already."""
        last = self._last.get(taken.sender)
        if last is None and len(self._last) >= MOST_SENDERS:
            del self._last[next(iter(self._last))]
        if last is not None and taken.number <= last:
            return None
        self._last[taken.sender] = taken.number
        missing = 0 if last is None else taken.number - last - 1
        return missing if missing <= MOST_MISSING else 0
