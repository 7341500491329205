"""A pacer that follows the clock of another program, message by message: a simulator's, or a recording's.

Rack time 0 is the first time received. For each later one every event up to it is executed at its own instant: none is
skipped, and the same sequence of times and writes gives the same scans. Writes from outside take effect at the last
time received. A time of 0 is ignored, as everywhere in ROS.

If the clock goes back, rack time and stamps continue from where they are (decision: a recording's messages stay in
order; for a fresh run the rack is started again). If it goes ahead by more than ``LONGEST_JUMP_NS`` at once, the time
between is left out (decision: a clock that begins at 0 and then shows the time of day would have the rack scan for 50
years). Both are reported.
"""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.core.ticks import NS_PER_S
from automax_ros.runtime.time.pacer import LONGEST_WAIT_NS, WALL_WAIT, SteppedPacer, Turn, Wait
from automax_ros.runtime.time.scheduler import Scheduler

LONGEST_JUMP_NS = 10 * NS_PER_S


class FollowingPacer(SteppedPacer):
    """Makes a scheduler's time follow a clock; its receiver calls ``follow_to`` while it holds ``turn``."""

    def __init__(
        self,
        scheduler: Scheduler,
        jumped: Callable[[int], object],
        *,
        wait: Wait = WALL_WAIT,
        turn: Turn | None = None,
    ) -> None:
        """Create it; ``jumped`` is called with a jump of the clock (ns, negative is back) that is not followed."""
        super().__init__(scheduler, wait=wait, turn=turn)
        self._jumped = jumped
        self._received_ns: int | None = None
        self._zero_ns: int | None = None
        self._opens = False

    @property
    def has_clock(self) -> bool:
        """Whether a time was received, so that the rack can start."""
        return self._received_ns is not None

    def begin(self, start_delay_ns: int = 0) -> int:  # noqa: ARG002
        """Map the scheduler's present to the last time received, which is returned."""
        received = self._received_ns or 0
        self._zero_ns, self._opens = received - self._scheduler.now_ns, True
        return received

    def follow_to(self, clock_ns: int) -> None:
        """Follow the clock to a time, and execute all events up to it if the rack has started."""
        if clock_ns <= 0:
            return
        self._received_ns = clock_ns
        if self._zero_ns is None or self._is_over():
            return
        ahead = self.ahead_ns(clock_ns)
        if ahead < 0 or ahead > LONGEST_JUMP_NS:
            self._zero_ns += ahead
            self._jumped(ahead)
        else:
            self._advance(self._scheduler.now_ns + ahead)

    def ahead_ns(self, clock_ns: int) -> int:
        """Return how far a time of the clock is ahead of the last one, ns; 0 before the rack has started."""
        return 0 if self._zero_ns is None else clock_ns - self._zero_ns - self._scheduler.now_ns

    def step(self) -> float:
        """Execute the events at the instant of ``begin``; later ones are executed by ``follow_to``."""
        if self._opens:
            self._opens = False
            self._advance(self._scheduler.now_ns)
        return LONGEST_WAIT_NS / NS_PER_S
