"""The lock of a rack: one thread at a time, and the scanning thread goes first.

A plain lock is not handed over: a thread that takes message after message releases it and acquires it again before
the scanning thread, which this wakes, has run.
"""

from __future__ import annotations

import threading
import time
from types import TracebackType

_YIELD_S = 0.0001
"""Seconds that another thread waits before it checks again whether a scan is due."""


class RackLock:
    """The reentrant lock of a rack: ``with lock`` to access it, ``with lock.for_scan`` to scan."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._owner = 0
        self._depth = 0
        self._due = False
        self.for_scan = _Scanner(self)

    def __enter__(self) -> None:
        """Acquire the lock, but not while a scan waits for it."""
        if self._owner != threading.get_ident():
            while self._due:
                time.sleep(_YIELD_S)
        self._enter()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._leave()

    def _enter(self) -> None:
        self._lock.acquire()
        self._owner = threading.get_ident()
        self._depth += 1

    def _leave(self) -> None:
        self._depth -= 1
        if not self._depth:
            self._owner = 0
        self._lock.release()

    def _enter_first(self) -> None:
        self._due = True
        self._enter()
        self._due = False


class _Scanner:
    """The lock as the scanning thread uses it."""

    def __init__(self, turns: RackLock) -> None:
        self._turns = turns

    def __enter__(self) -> None:
        """Acquire the lock ahead of all waiting threads."""
        self._turns._enter_first()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._turns._leave()
