"""The pacer: makes a scheduler's time follow the wall clock; the one place below ROS that reads a clock.

A periodic event that the loop misses because of the host is skipped and counted, and the next stays on the grid
(``Scheduler.run_due``); a drive's interrupts are all executed, late ones in order. Actions of other threads fall
between two events: they hold the same lock as ``turn``. ``halt`` stops time until ``resume``; no event is late because
of it. A program that steps a halted rack advances the scheduler's time itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.runtime.time.scheduler import Scheduler

Wait = Callable[[float], object]
"""Spends at most a time in s, 0 or more; it may return early."""
Turn = AbstractContextManager[object]
"""A lock that keeps other threads from the rack while it is held."""
BREATH_S, BREATH_PERIOD_NS = 0.0001, 2 * NS_PER_MS
"""How long (s), and how often (ns of the wall clock), a pacer that never waits gives other threads time."""
LONGEST_WAIT_NS = 50 * NS_PER_MS
"""The loop wakes at least this often, so that it responds to signals at once."""
START_LEAD_NS = 50 * NS_PER_MS
"""The start is this far ahead of ``begin``, so that no scan misses its deadline because of presets and start-up."""
CHORE_PERIOD_NS = 100 * NS_PER_MS
"""How often the loop calls ``on_idle``."""
CHORE_ROOM_NS = 2 * NS_PER_MS
"""``on_idle`` is delayed, by another period at most, while the next event is nearer than this."""
WALL_CLOCK: Callable[[], int] = time.monotonic_ns
WALL_WAIT: Wait = time.sleep


class Pace(Protocol):
    """Advances the time of one scheduler."""

    @property
    def now_ns(self) -> int:
        """The time that the scheduler should have, ns; negative before it begins."""

    def begin(self, start_delay_ns: int = 0) -> int:
        """Map the scheduler's present to now, or to ``start_delay_ns`` from now; return its stamp (ns)."""

    def catch_up(self) -> None:
        """Advance the scheduler's time to the present, before an action from outside."""

    def step(self) -> float:
        """Execute due events, and return how long (s) the caller may spend before the next call."""

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Keep pace until the scheduler's time is ``until_ns`` (events due then are left), or until asked to stop.

        ``on_idle`` gets the time, about every 100 ms of the wall clock.
        """


class LoopedPacer:
    """The parts of a pacer's loop: scheduler, clock (ns, monotonic), how to wait, and the lock held as it acts."""

    def __init__(
        self,
        scheduler: Scheduler,
        *,
        clock: Callable[[], int] = WALL_CLOCK,
        wait: Wait = WALL_WAIT,
        turn: Turn | None = None,
    ) -> None:
        """Create it; time does not pass yet."""
        self._scheduler, self._clock, self._wait = scheduler, clock, wait
        self._turn: Turn = nullcontext() if turn is None else turn


class SteppedPacer(LoopedPacer, Pace):
    """A pacer of time that is not the wall clock's: its present is the last instant that was executed."""

    _until_ns: int | None = None

    @property
    def now_ns(self) -> int:
        """The scheduler's time."""
        return self._scheduler.now_ns

    def catch_up(self) -> None:
        """Do nothing: the present is the last instant that was executed."""

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Advance time until it is ``until_ns``, or until asked to stop (``Pace.run``)."""
        self._until_ns = until_ns
        next_chore = next_breath = self._clock()
        while not (self._is_over() or should_stop()):
            with self._turn:
                pause_s = self.step()
            now = self._clock()
            if on_idle is not None and now >= next_chore:
                next_chore = now + CHORE_PERIOD_NS
                with self._turn:
                    on_idle(self.now_ns)
            if pause_s > 0 or now >= next_breath:
                self._wait(max(pause_s, BREATH_S))
                next_breath = self._clock() + BREATH_PERIOD_NS

    def _advance(self, target_ns: int) -> bool:
        if self._until_ns is not None and target_ns >= self._until_ns:
            self._scheduler.run_until(self._until_ns)
            return False
        self._scheduler.run_through(target_ns)
        return True

    def _is_over(self) -> bool:
        return self._until_ns is not None and self._scheduler.now_ns >= self._until_ns


class Pacer(LoopedPacer):
    """Keeps a scheduler on the wall clock: time passes from ``begin`` on."""

    halted = False
    while_halted: Callable[[], object] = staticmethod(lambda: None)
    _zero_ns: int | None = None

    def begin(self, start_delay_ns: int = 0) -> int:
        """Map the scheduler's present to ``start_delay_ns`` from now on the wall clock; return that time of day, ns."""
        self._zero_ns = self._clock() + start_delay_ns - self._scheduler.now_ns
        if not self.halted:
            self._scheduler.zero_ns = self._zero_ns
        return time.time_ns() + start_delay_ns

    def halt(self) -> None:
        """Stop time; ``while_halted`` is called about 20 times per second."""
        self.catch_up()
        self.halted, self._scheduler.zero_ns = True, None

    def resume(self) -> None:
        """Continue time from where it stopped."""
        self.halted = False
        self.begin()

    @property
    def now_ns(self) -> int:
        """The time that the scheduler should have by the wall clock, ns; negative during the lead."""
        if self.halted:
            return self._scheduler.now_ns
        if self._zero_ns is None:
            self.begin()
        assert self._zero_ns is not None
        return self._clock() - self._zero_ns

    def catch_up(self) -> None:
        """Advance the scheduler's time to the present, if it has begun, before an action from outside."""
        if self._zero_ns is not None:
            self._scheduler.pass_until(self.now_ns)

    def step(self) -> float:
        """Execute due events, and return how long (s) the caller may spend before the next call."""
        self._carry_out(self.now_ns)
        return self._idle_s(None)

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Keep pace (``Pace.run``); ``on_idle`` is called if there is time before the next event."""
        next_chore = self._clock() + max(0, -self.now_ns)
        while not should_stop():
            now = self.now_ns
            if until_ns is not None and now >= until_ns:
                with self._turn:
                    self._scheduler.run_due(until_ns - 1)
                    self._scheduler.pass_until(until_ns)
                return
            with self._turn:  # also for the queue: reading it removes cancelled events
                self._carry_out(now)
                is_chore_time = self._is_chore_time(next_chore)
                idle_s = self._idle_s(until_ns)
            if on_idle is not None and is_chore_time:
                next_chore = self._clock() + CHORE_PERIOD_NS
                with self._turn:
                    on_idle(now)
                    idle_s = self._idle_s(until_ns)
            self._wait(idle_s)

    def _carry_out(self, now_ns: int) -> None:
        if self.halted:
            self.while_halted()
        else:
            self._scheduler.run_due(now_ns)

    def _is_chore_time(self, since_ns: int) -> bool:
        waited = self._clock() - since_ns
        if waited < 0 or self.halted or waited >= CHORE_PERIOD_NS:
            return waited >= 0
        due = self._scheduler.next_ns
        return due is None or due - self.now_ns >= CHORE_ROOM_NS

    def _idle_s(self, until_ns: int | None) -> float:
        if self.halted:
            return LONGEST_WAIT_NS / NS_PER_S
        now = self.now_ns
        ends = (now + LONGEST_WAIT_NS, self._scheduler.next_ns, until_ns)
        return max(0, min(end for end in ends if end is not None) - now) / NS_PER_S
