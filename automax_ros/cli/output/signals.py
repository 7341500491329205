"""Ctrl-C, SIGTERM and SIGHUP as a flag that a loop looks at, or as an exception: a command ends cleanly with both."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

from automax_ros.cli.early import EARLY

_SIGNALLED = 128
"""Exit code of a command that a signal has ended, less the signal's number: what the shell adds."""


class WorkInterrupted(BaseException):
    """A signal came during work that is not worth its end: not an error, so that nobody takes it for one."""


@dataclass
class StopRequest:
    """Whether a signal has asked for the end, and the first one's number."""

    requested: bool = False
    number: int = 0
    _cuts: bool = False

    @property
    def code(self) -> int:
        """The exit code of a command that a signal has kept from its work."""
        return _SIGNALLED + self.number

    @contextmanager
    def cut_short(self) -> Iterator[None]:
        """Let a signal end the block at once, by CutShort: for long work whose result alone matters.

        Raises:
            CutShort: a signal has come, in the block or before.
        """
        before = sys.unraisablehook

        def quiet(what: Any) -> None:
            # Raised where nobody can take it, as while an object is deleted, the request is still noted.
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
        """Take notice of a signal.

        Raises:
            CutShort: in a ``cut_short`` block, once.
        """
        if not self.requested:
            self.requested, self.number = True, number
        if self._cuts:
            self._cuts = False
            raise WorkInterrupted


@contextmanager
def stop_signals() -> Iterator[StopRequest]:
    """Note SIGINT, SIGTERM and SIGHUP while the block lasts.

    Once one has come, all stay without effect: a second Ctrl-C must not turn the clean end into another.
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
    """Let SIGTERM and SIGHUP end the block by SystemExit, as Ctrl-C does by KeyboardInterrupt, so that it cleans up.

    A signal that is ignored stays so; outside of the main thread, which alone takes signals, nothing is changed.
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
