"""When a process that died is started again, and when that is given up."""

from __future__ import annotations

from collections import deque

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S

BACKOFFS_NS = (100 * NS_PER_MS, NS_PER_S)
"""How long after its death a process is started again: the first one in ``WINDOW_NS``, the second (decision)."""
MOST_DEATHS = 3
"""This many deaths within ``WINDOW_NS`` and a process is given up: it would die again (decision)."""
WINDOW_NS = 10 * NS_PER_S
"""The time in which deaths count together (decision)."""


class Restarts:
    """The deaths of one process; times are ns of any one clock.

    Attributes:
        count: how many there were.
        given_up: whether it is not started again.
    """

    def __init__(self) -> None:
        """Begin with a process that has never died."""
        self.count = 0
        self.given_up = False
        self._recent: deque[int] = deque(maxlen=MOST_DEATHS)

    def died(self, now_ns: int) -> int | None:
        """Count a death; return when to start the process again, None where it is given up."""
        self.count += 1
        self._recent.append(now_ns)
        recent = sum(now_ns - died_ns < WINDOW_NS for died_ns in self._recent)
        self.given_up = recent >= MOST_DEATHS
        return None if self.given_up else now_ns + BACKOFFS_NS[recent - 1]
