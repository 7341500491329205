"""Calls of rcl, the C library below rclpy, that rclpy 7 (ROS 2 Jazzy) does not offer as a rack needs them.

rclpy takes a message while it holds the interpreter: 10 MB hold up all threads for 20 to 70 ms (measured on the two
cores of a virtual machine). It does not report the sender. Its wait set costs 2.7 us for each entity and wait. Called
by ctypes, rcl takes a message without holding the interpreter, reports its sender, and counts arrivals in an eventfd
that a thread can wait for. The structures are those of rcl's public headers, the same from Humble on. Where the library
is not found (``library`` returns None) rclpy is used.
"""

from __future__ import annotations

import ctypes
import functools
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

GID_BYTES = 16
OK = 0
TAKE_FAILED = {401, 601}
"""RCL_RET_SUBSCRIPTION_TAKE_FAILED, RCL_RET_SERVICE_TAKE_FAILED: nothing to take."""
_KEPT_BYTES = 1 << 20
"""A buffer that has grown beyond this is released."""
_MAPS = Path("/proc/self/maps")


class Allocator(ctypes.Structure):
    """rcutils_allocator_t."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("allocate", "deallocate", "reallocate", "zero", "state")]


class Bytes(ctypes.Structure):
    """rcutils_uint8_array_t."""

    _fields_ = [
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", Allocator),
    ]


class MessageInfo(ctypes.Structure):
    """rmw_message_info_t; ``implementation`` and ``sender`` are its rmw_gid_t."""

    _fields_ = [
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_sequence_number", ctypes.c_uint64),
        ("reception_sequence_number", ctypes.c_uint64),
        ("implementation", ctypes.c_void_p),
        ("sender", ctypes.c_uint8 * GID_BYTES),
        ("from_intra_process", ctypes.c_bool),
    ]


class RequestId(ctypes.Structure):
    """rmw_request_id_t."""

    _fields_ = [("writer_guid", ctypes.c_uint8 * GID_BYTES), ("sequence_number", ctypes.c_int64)]


class ServiceInfo(ctypes.Structure):
    """rmw_service_info_t."""

    _fields_ = [
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("request_id", RequestId),
    ]


class Library:
    """rcl as loaded into this process."""

    def __init__(self, rcl: ctypes.CDLL, rcutils: ctypes.CDLL) -> None:
        """Look up the functions.

        Raises:
            AttributeError: one is missing.
        """
        self.take_serialized = rcl.rcl_take_serialized_message
        self.take_serialized.argtypes = [ctypes.c_void_p] * 4
        self.take_request = rcl.rcl_take_request_with_info
        self.take_request.argtypes = [ctypes.c_void_p] * 3
        self.send_response = rcl.rcl_send_response
        self.send_response.argtypes = [ctypes.c_void_p] * 3
        self.on_message = rcl.rcl_subscription_set_on_new_message_callback
        self.on_message.argtypes = [ctypes.c_void_p] * 3
        self.on_request = rcl.rcl_service_set_on_new_request_callback
        self.on_request.argtypes = [ctypes.c_void_p] * 3
        # To be called on the thread that failed, right after: the error state is thread-local.
        self.reset_error = rcutils.rcutils_reset_error
        self._release = rcutils.rcutils_uint8_array_fini
        self._release.argtypes = [ctypes.c_void_p]
        default = rcutils.rcutils_get_default_allocator
        default.restype = Allocator
        self._allocator = default()
        # void eventfd_write(int, eventfd_t) has the signature of rcl's callback, void (const void *, size_t): the user
        # data is the descriptor, the number of messages is added to the counter. So no Python runs on a thread of DDS.
        self.count_in = ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p)

    def buffer(self) -> Bytes:
        """Return an empty buffer."""
        return Bytes(allocator=self._allocator)

    def give_back(self, buffer: Bytes) -> None:
        """Release a buffer's memory if it has grown large."""
        if buffer.capacity > _KEPT_BYTES:
            self._release(ctypes.byref(buffer))
            buffer.allocator = self._allocator


@functools.cache
def library() -> Library | None:
    """Return rcl as rclpy has loaded it into this process; None if it is not found or lacks a function."""
    if not sys.platform.startswith("linux") or not hasattr(os, "eventfd"):
        return None
    import rclpy.impl.implementation_singleton  # noqa: F401 loads it

    try:
        return Library(_open_library("rcl"), _open_library("rcutils"))
    except (OSError, AttributeError):
        return None


def _open_library(name: str) -> ctypes.CDLL:
    """Return a library that this process has loaded; wheels add a hash to its name.

    Raises:
        OSError: it is not loaded.
    """
    wanted = re.compile(rf"lib{name}(-[0-9a-f]+)?\.so[0-9.]*")
    for line in _MAPS.read_text(encoding="utf-8", errors="replace").splitlines():
        fields = line.split(maxsplit=5)
        if len(fields) == 6 and wanted.fullmatch(Path(fields[5]).name):
            return ctypes.CDLL(fields[5])
    raise OSError(f"lib{name} is not loaded")


def capsule_pointer(capsule: Any) -> int:
    """Return the address that a PyCapsule of generated message code holds."""
    api = ctypes.pythonapi
    api.PyCapsule_GetName.restype, api.PyCapsule_GetName.argtypes = ctypes.c_char_p, [ctypes.py_object]
    api.PyCapsule_GetPointer.restype = ctypes.c_void_p
    api.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    found = api.PyCapsule_GetPointer(capsule, api.PyCapsule_GetName(capsule))
    assert found is not None
    return int(found)


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
    """One subscription as ``MessageIntake`` reads it; ``receive`` is called with each message.

    rclpy's executors take a message as soon as it arrives, whatever its size. Here messages wait in DDS, as many as the
    quality of service keeps, until they are taken; those longer than wanted are never copied into Python bytes.
    """

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
    """The number of the last message of each sender, by GID: detects lost and duplicate messages."""

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
