"""Lets a repeated message through from time to time."""

from __future__ import annotations

import time


class Throttle:
    """Passes at most once in ``interval_s`` seconds of the wall clock.

    rclpy's own throttle goes by the place in the code: one variable's or task's messages would hide another's.
    """

    def __init__(self, interval_s: float) -> None:
        """Begin ready to pass."""
        self._interval_s = interval_s
        self._next_s = 0.0

    def passes(self) -> bool:
        """Return whether it is time again."""
        now = time.monotonic()
        if now < self._next_s:
            return False
        self._next_s = now + self._interval_s
        return True
