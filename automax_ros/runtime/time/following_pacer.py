"""Time that another's clock gives, message by message: a simulator's, or a recording's.

Rack time 0 is the first time that is heard. At each later one every event up to and at it has happened at its own
instant: none is skipped, and no wall clock is asked, so the same sequence of times and writes gives the same scans.
What comes from outside happens at the last time that was heard.

A rack cannot go back. Where the clock does (a recording that begins again, a simulator that is reset), rack time goes
on from where it is, and so do stamps, which are ahead of the clock from then on (decision: a recording's messages stay
in order; who wants a fresh run starts the rack again). Where the clock goes ahead by more than ``LONGEST_JUMP_NS`` at
once, the time between is left out, and stamps are the clock's (decision: a clock that begins at 0 and then tells the
time of day would have the rack scan for 50 years). Both are told. A time of 0 says nothing, as everywhere in ROS.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext

from automax_ros.core.ticks import NS_PER_S
from automax_ros.runtime.time.pacer import CHORE_PERIOD_NS, LONGEST_WAIT_NS, WALL_CLOCK, WALL_WAIT, Turn, Wait, by_steps
from automax_ros.runtime.time.scheduler import Scheduler

LONGEST_JUMP_NS = 10 * NS_PER_S


class FollowingPacer:
    """Lets a scheduler's time follow a clock; whoever hears the clock calls ``heard`` while it has its ``turn``."""

    def __init__(
        self,
        scheduler: Scheduler,
        jumped: Callable[[int], object],
        *,
        wait: Wait = WALL_WAIT,
        turn: Turn | None = None,
    ) -> None:
        """Take a scheduler.

        Args:
            scheduler: whose events are carried out.
            jumped: gets by how much (ns) the clock has jumped where the rack does not follow it; negative is back.
            wait: spends at most a time in s.
            turn: held while ``run`` calls ``on_idle``.
        """
        self._scheduler, self._jumped, self._wait = scheduler, jumped, wait
        self._turn: Turn = nullcontext() if turn is None else turn
        self._heard_ns: int | None = None
        self._zero_ns: int | None = None
        self._until_ns: int | None = None
        self._opens = False

    @property
    def has_clock(self) -> bool:
        """Whether a time has been heard, so that the rack can begin."""
        return self._heard_ns is not None

    @property
    def now_ns(self) -> int:
        """The scheduler's time: that of the clock, less where it began."""
        return self._scheduler.now_ns

    def begin(self, start_delay_ns: int = 0) -> int:  # noqa: ARG002
        """Let the scheduler's present be the last time that was heard, which is returned."""
        heard = self._heard_ns or 0
        self._zero_ns, self._opens = heard - self._scheduler.now_ns, True
        return heard

    def catch_up(self) -> None:
        """Nothing: the present is the last time that was heard."""

    def heard(self, clock_ns: int) -> None:
        """Take a time of the clock, and carry out all that happens up to it once the rack has begun."""
        if clock_ns <= 0:
            return
        self._heard_ns = clock_ns
        if self._zero_ns is None or self._is_over():
            return
        ahead = self.ahead_ns(clock_ns)
        if ahead < 0 or ahead > LONGEST_JUMP_NS:
            self._zero_ns += ahead
            self._jumped(ahead)
        else:
            self._pass(self._scheduler.now_ns + ahead)

    def ahead_ns(self, clock_ns: int) -> int:
        """Return how far a time of the clock is ahead of the last one, 0 before the rack has begun."""
        return 0 if self._zero_ns is None else clock_ns - self._zero_ns - self._scheduler.now_ns

    def _pass(self, target_ns: int) -> None:
        if self._until_ns is not None and target_ns >= self._until_ns:
            self._scheduler.run_until(self._until_ns)
        else:
            self._scheduler.run_through(target_ns)

    def step(self) -> float:
        """Carry out what happens at the instant of ``begin``; later nothing is due but when the clock is heard."""
        if self._opens:
            self._opens = False
            self._pass(self._scheduler.now_ns)
        return LONGEST_WAIT_NS / NS_PER_S

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Wait while ``heard`` lets time pass, until it is ``until_ns``, or asked to stop (``Pace.run``)."""
        self._until_ns = until_ns
        by_steps(
            self,
            lambda: self._is_over() or should_stop(),
            WALL_CLOCK,
            self._wait,
            self._turn,
            (on_idle, CHORE_PERIOD_NS),
        )

    def _is_over(self) -> bool:
        return self._until_ns is not None and self._scheduler.now_ns >= self._until_ns
