"""Turns of a thread that scans as fast as it can and of others that want to look at the rack; without ROS."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Turns:
    """Lets one thread at a time have the rack, in the order in which they asked: nobody starves, nobody overtakes.

    The scanning thread takes a turn for each slice of rack time. It is what halts a simulated rack, too (``Haltable``):
    while ``halted``, that thread leaves rack time as it is, and calls ``while_halted``.
    """

    def __init__(self) -> None:
        self.halted = False
        self.while_halted: Callable[[], object] = lambda: None
        self._changed = threading.Condition()
        self._given = self._served = 0

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Have the rack while the block lasts, which must not ask for another turn."""
        with self._changed:
            own = self._given
            self._given += 1
            self._changed.wait_for(lambda: self._served == own)
        try:
            yield
        finally:
            with self._changed:
                self._served += 1
                self._changed.notify_all()

    @property
    def waiting(self) -> int:
        """How many threads wait for their turn."""
        return max(0, self._given - self._served - 1)

    def halt(self) -> None:
        """Freeze rack time from the next slice on."""
        self.halted = True

    def resume(self) -> None:
        """Let rack time go on."""
        self.halted = False
