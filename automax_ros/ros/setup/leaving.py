"""Ends a program that cannot leave the ROS graph.

Fast DDS 2.14 waits forever where another node leaves, or an own endpoint is removed, at the instant at which it checks
whether a participant still lives (https://github.com/eProsima/Fast-DDS/issues/6502): seen in one of 55 ends of
racks with processes that were killed. rclpy holds the interpreter meanwhile, so that no code of Python runs any more.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

LEAVE_S = 10.0
"""How long a program that has finished its work may take to leave the graph, s (decision: usual are 0.1 to 2)."""
_MONOTONIC, _BY_THREAD = 1, 2  # CLOCK_MONOTONIC, SIGEV_THREAD of Linux


class _Event(ctypes.Structure):
    """sigevent of 64-bit Linux."""

    _fields_ = [
        ("value", ctypes.c_void_p),
        ("number", ctypes.c_int),
        ("notify", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("attributes", ctypes.c_void_p),
        ("rest", ctypes.c_char * 32),
    ]


class _Times(ctypes.Structure):
    """itimerspec of 64-bit Linux."""

    _fields_ = [(name, ctypes.c_long) for name in ("period_s", "period_ns", "due_s", "due_ns")]


@contextmanager
def ended_within(code: int, limit_s: float = LEAVE_S) -> Iterator[None]:
    """End this program if the block takes longer than ``limit_s``, whatever its threads wait for.

    The exit code is ``code``, 1 while an exception is handled. What was printed is written before; nothing else is
    closed. Where the system has no such timers there is no limit.
    """
    with suppress(OSError, ValueError):  # of a reader that has gone
        sys.stdout.flush()
        sys.stderr.flush()
    timer = _timer(code if sys.exc_info()[0] is None else 1, limit_s)
    try:
        yield
    finally:
        if timer is not None:
            ctypes.CDLL(None).timer_delete(timer)


def _timer(code: int, limit_s: float) -> ctypes.c_void_p | None:
    """Start a timer of the kernel that calls the C library's ``_exit``: it needs no thread of Python."""
    if not sys.platform.startswith("linux") or ctypes.sizeof(ctypes.c_void_p) != 8:
        return None
    library: Any = ctypes.CDLL(None)
    timer = ctypes.c_void_p()
    event = _Event(code, 0, _BY_THREAD, ctypes.cast(library._exit, ctypes.c_void_p), None)
    due_s, part = divmod(limit_s, 1)
    times = _Times(0, 0, int(due_s), int(part * 1e9))
    try:
        if library.timer_create(_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)):
            return None
        library.timer_settime(timer, 0, ctypes.byref(times), None)
    except AttributeError:  # glibc before 2.34 has them in a library of its own
        return None
    return timer
