"""Who may touch a rack: one thread at a time, and the one that scans goes first.

A plain lock is not handed over: a thread that takes message after message releases and takes it again before the one
that scans, awake since then, has run.
"""

from __future__ import annotations

import threading
import time
from types import TracebackType

_YIELD_S = 0.0001
"""How long a visitor stands aside for a scan that is due, s, before it looks again."""


class RackLock:
    """The rack's lock: ``with turns`` for a visitor, also within itself; ``with turns.scanner`` to scan."""

    def __init__(self) -> None:
        """Nobody is in."""
        self._lock = threading.RLock()
        self._owner = 0
        self._depth = 0
        self._due = False
        self.for_scan = _Scanner(self)

    def __enter__(self) -> None:
        """Come in as a visitor: not while a scan waits."""
        if self._owner != threading.get_ident():
            while self._due:
                time.sleep(_YIELD_S)
        self._enter()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Go out."""
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
    """The turn of the thread that scans."""

    def __init__(self, turns: RackLock) -> None:
        self._turns = turns

    def __enter__(self) -> None:
        """Come in before all visitors that wait."""
        self._turns._enter_first()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Go out."""
        self._turns._leave()
