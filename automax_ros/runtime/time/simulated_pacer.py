"""Simulated time that others follow: every event at its own instant, none skipped, and a clock that says how far it is.

As fast as the machine can, or at ``rate`` times the wall clock. What comes from outside falls between two instants.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.runtime.time.pacer import CHORE_PERIOD_NS, LONGEST_WAIT_NS, WALL_CLOCK, WALL_WAIT, Turn, Wait, by_steps
from automax_ros.runtime.time.scheduler import Scheduler

LEAST_TICK_NS = 1 * NS_PER_MS
"""The clock is told at most once in so much rack time (decision: what Gazebo's users have)."""
MOST_TICK_NS = 10 * NS_PER_MS
"""The clock is told at least once in so much rack time (decision: ``automax play`` and rosbag2 do as often or less)."""
MOST_LATE_NS = 100 * NS_PER_MS
"""What a slow host loses beyond this on the wall clock is not made up for by running faster (decision)."""


@dataclass(frozen=True)
class SimulatedTime:
    """Simulated time at ``rate`` times the wall clock, None as fast as it goes."""

    rate: float | None = None


class SimulatedPacer:
    """Lets a scheduler's time pass by itself, and tells it."""

    def __init__(
        self,
        scheduler: Scheduler,
        tell: Callable[[int], object],
        *,
        rate: float | None = None,
        clock: Callable[[], int] = WALL_CLOCK,
        wait: Wait = WALL_WAIT,
        turn: Turn | None = None,
    ) -> None:
        """Take a scheduler.

        Args:
            scheduler: whose events are carried out.
            tell: gets the time once all is done that happens up to and at it.
            rate: how many times faster than the wall clock, above 0; None is as fast as it goes.
            clock: the wall clock in ns, monotonic; only for ``rate`` and ``on_idle``.
            wait: spends at most a time in s.
            turn: held while the scheduler's time passes.
        """
        self._scheduler, self._tell, self._rate = scheduler, tell, rate
        self._clock, self._wait = clock, wait
        self._turn: Turn = nullcontext() if turn is None else turn
        self._zero_ns: int | None = None
        self._told_ns: int | None = None
        self._until_ns: int | None = None
        self.halted = False
        self.while_halted: Callable[[], object] = lambda: None

    @property
    def now_ns(self) -> int:
        """The scheduler's time: nothing else keeps it."""
        return self._scheduler.now_ns

    def begin(self, start_delay_ns: int = 0) -> int:  # noqa: ARG002
        """Let time pass from now on; stamps are rack time, so that of the present is 0 at the start."""
        self._zero_ns = None
        return self._scheduler.now_ns

    def catch_up(self) -> None:
        """Nothing: the present is the last instant that was carried out."""

    def halt(self) -> None:
        """Let time stand still; ``while_halted`` is called every now and then, and the clock says what is stepped."""
        self.halted = True

    def resume(self) -> None:
        """Let time go on from where it stands."""
        self.halted, self._zero_ns = False, None

    def step(self) -> float:
        """Carry out the next instant if it is due; return how long (s) it is to the next."""
        if self.halted:
            self.while_halted()
            self._tell_at(self._scheduler.now_ns)
            return LONGEST_WAIT_NS / NS_PER_S
        pause_ns = self._pause_ns()
        if pause_ns > 0:
            return min(pause_ns, LONGEST_WAIT_NS) / NS_PER_S
        target = self._target_ns()
        if self._until_ns is not None and target >= self._until_ns:
            self._scheduler.run_until(self._until_ns)
        else:
            self._scheduler.run_through(target)
            self._tell_at(self._scheduler.now_ns)
        return max(0, min(self._pause_ns(), LONGEST_WAIT_NS)) / NS_PER_S

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Let time pass until it is ``until_ns``, or asked to stop (``Pace.run``)."""
        self._until_ns = until_ns
        by_steps(
            self,
            lambda: self._is_over() or should_stop(),
            self._clock,
            self._wait,
            self._turn,
            (on_idle, CHORE_PERIOD_NS),
        )

    def _tell_at(self, now_ns: int) -> None:
        if self._told_ns is None or now_ns - self._told_ns >= LEAST_TICK_NS:
            self._told_ns = now_ns
            self._tell(now_ns)

    def _is_over(self) -> bool:
        return self._until_ns is not None and self._scheduler.now_ns >= self._until_ns

    def _target_ns(self) -> int:
        """Return the next instant at which something happens, or the clock must be told."""
        tick = self._scheduler.now_ns if self._told_ns is None else self._told_ns + MOST_TICK_NS
        due = self._scheduler.next_ns
        return max(self._scheduler.now_ns, tick if due is None else min(tick, due))

    def _pause_ns(self) -> int:
        """Return how long it is on the wall clock to the next instant, negative if it is late."""
        if self._rate is None:
            return 0
        wall, target = self._clock(), round(self._target_ns() / self._rate)
        if self._zero_ns is None or wall - self._zero_ns - target > MOST_LATE_NS:
            self._zero_ns = wall - target
        return self._zero_ns + target - wall
