"""Ctrl-C, SIGTERM and SIGHUP as a flag that a loop looks at: a run ends cleanly, however often they come."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass
class StopRequest:
    """Whether a signal has asked for the end."""

    requested: bool = False


@contextmanager
def stop_signals() -> Iterator[StopRequest]:
    """Note SIGINT, SIGTERM and SIGHUP while the block lasts.

    Once one has come, all stay without effect: a second Ctrl-C must not turn the clean end into another.
    """
    stop = StopRequest()

    def note(_: int, __: FrameType | None) -> None:
        stop.requested = True

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if stop.requested else handler)
