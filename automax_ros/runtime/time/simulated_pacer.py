"""Simulated time that others can follow: every event at its own instant, none skipped, and a published clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.runtime.time.pacer import LONGEST_WAIT_NS, WALL_CLOCK, WALL_WAIT, SteppedPacer, Turn, Wait
from automax_ros.runtime.time.scheduler import Scheduler

LEAST_TICK_NS = 1 * NS_PER_MS
"""The clock is published at most once in this rack time (decision: what Gazebo's users have)."""
MOST_TICK_NS = 10 * NS_PER_MS
"""The clock is published at least once in this time (decision: ``automax play`` and rosbag2 do as often or less)."""
MOST_LATE_NS = 100 * NS_PER_MS
"""Delays of a slow host beyond this on the wall clock are not made up for by running faster (decision)."""


@dataclass(frozen=True)
class SimulatedTime:
    """Simulated time at ``rate`` times the wall clock, as fast as possible if None."""

    rate: float | None = None


class SimulatedPacer(SteppedPacer):
    """Advances a scheduler's time without a clock, and publishes it."""

    def __init__(
        self,
        scheduler: Scheduler,
        publish: Callable[[int], object],
        *,
        rate: float | None = None,
        clock: Callable[[], int] = WALL_CLOCK,
        wait: Wait = WALL_WAIT,
        turn: Turn | None = None,
    ) -> None:
        """Create it; ``publish`` gets the time once all events up to and at it are executed.

        Time passes at ``rate`` times that of ``clock`` (the wall clock, ns), as fast as possible if None.
        """
        super().__init__(scheduler, clock=clock, wait=wait, turn=turn)
        self._publish, self._rate = publish, rate
        self._zero_ns: int | None = None
        self._published_ns: int | None = None
        self.halted = False
        self.while_halted: Callable[[], object] = lambda: None

    def begin(self, start_delay_ns: int = 0) -> int:  # noqa: ARG002
        """Advance time from now on; stamps are rack time, so that of the present is 0 at the start."""
        self._zero_ns = None
        return self._scheduler.now_ns

    def halt(self) -> None:
        """Stop time; ``while_halted`` is called at intervals, and the clock shows the time of steps."""
        self.halted = True

    def resume(self) -> None:
        """Continue time from where it stopped."""
        self.halted, self._zero_ns = False, None

    def step(self) -> float:
        """Execute the next instant if it is due; return the time (s) to the next."""
        if self.halted:
            self.while_halted()
            self._publish_now()
            return LONGEST_WAIT_NS / NS_PER_S
        pause_ns = self._pause_ns()
        if pause_ns > 0:
            return min(pause_ns, LONGEST_WAIT_NS) / NS_PER_S
        if self._advance(self._target_ns()):
            self._publish_now()
        return max(0, min(self._pause_ns(), LONGEST_WAIT_NS)) / NS_PER_S

    def _publish_now(self) -> None:
        now_ns = self._scheduler.now_ns
        if self._published_ns is None or now_ns - self._published_ns >= LEAST_TICK_NS:
            self._published_ns = now_ns
            self._publish(now_ns)

    def _target_ns(self) -> int:
        tick = self._scheduler.now_ns if self._published_ns is None else self._published_ns + MOST_TICK_NS
        due = self._scheduler.next_ns
        return max(self._scheduler.now_ns, tick if due is None else min(tick, due))

    def _pause_ns(self) -> int:
        """Return the time on the wall clock to the next instant, ns; negative if it is late."""
        if self._rate is None:
            return 0
        wall, target = self._clock(), round(self._target_ns() / self._rate)
        if self._zero_ns is None or wall - self._zero_ns - target > MOST_LATE_NS:
            self._zero_ns = wall - target
        return self._zero_ns + target - wall
