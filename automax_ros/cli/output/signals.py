"""Ctrl-C, SIGTERM and SIGHUP as a flag that a loop checks, or as an exception: a command ends cleanly with both."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

from automax_ros.cli.startup_signals import EARLY

_SIGNALLED = 128
"""The shell's offset: the exit code of a command ended by a signal is this plus the signal's number."""


class WorkInterrupted(BaseException):
    """Raised when a signal interrupts work that may be abandoned. Not an Exception, so handlers do not catch it."""


@dataclass
class StopRequest:
    """Whether a signal has requested the end, and the number of the first one."""

    requested: bool = False
    number: int = 0
    _cuts: bool = False

    @property
    def code(self) -> int:
        """The exit code of a command that a signal ended before its work."""
        return _SIGNALLED + self.number

    @contextmanager
    def cut_short(self) -> Iterator[None]:
        """Interrupt the block at once when a signal comes: for long work of which only the result matters.

        Raises:
            WorkInterrupted: a signal has come, in the block or before.
        """
        before = sys.unraisablehook

        def quiet(what: Any) -> None:
            # Raised where it cannot be caught, such as while an object is deleted; the request is still recorded.
            if not isinstance(what.exc_value, WorkInterrupted):
                before(what)

        sys.unraisablehook = quiet
        self._cuts = True
        try:
            if self.requested:
                raise WorkInterrupted
            yield
        finally:
            self._cuts = False
            sys.unraisablehook = before

    def note(self, number: int) -> None:
        """Record a signal.

        Raises:
            WorkInterrupted: in a ``cut_short`` block, once.
        """
        if not self.requested:
            self.requested, self.number = True, number
        if self._cuts:
            self._cuts = False
            raise WorkInterrupted


@contextmanager
def stop_signals() -> Iterator[StopRequest]:
    """Record SIGINT, SIGTERM and SIGHUP while the block lasts.

    After one has come, all are ignored even after the block: a second Ctrl-C must not interrupt the clean end.
    """
    stop = StopRequest()

    def note(number: int, _: FrameType | None) -> None:
        stop.note(number)

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if stop.requested else handler)


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Make SIGTERM and SIGHUP raise SystemExit in the block, as Ctrl-C raises KeyboardInterrupt, so that it cleans up.

    A signal that is ignored stays ignored; outside of the main thread, the only one with handlers, nothing is changed.
    """

    def end(number: int, _: FrameType | None) -> None:
        raise SystemExit(_SIGNALLED + number)

    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) in (signal.SIG_DFL, *EARLY):
                before[number] = signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
