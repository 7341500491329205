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
from pathlib import Path
from typing import Any

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
