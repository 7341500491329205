"""The pacer: lets a scheduler's time follow the wall clock; the one place below ROS that asks a clock.

rack.start()
Pacer(rack.scheduler).run(10 * NS_PER_S)      # ten seconds of the wall clock

Every event stands on an absolute deadline. A periodic one that the host made the loop miss is skipped and counted, and
the next stays on the grid (``Scheduler.run_due``); a drive's interrupts are all carried out, late ones in order. How
the time to the next deadline is spent is the caller's. What other threads bring from outside falls between two events:
they hold what ``turn`` holds.

``halt`` lets time stand still until ``resume``; nothing is late or skipped by that. Whoever steps a halted rack lets
the scheduler's time go on by itself.

What lets a scheduler's time pass: on the wall clock, simulated, or after another's clock.
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
"""What keeps other threads from the rack while it is held."""


BREATH_S, BREATH_PERIOD_NS = 0.0001, 2 * NS_PER_MS
"""A pace that never waits lets other threads have their turn: how long, and how often (ns of the wall clock)."""


class Pace(Protocol):
    """Keeps the time of one scheduler."""

    @property
    def now_ns(self) -> int:
        """The time that the scheduler should have, ns; negative before it begins."""

    def begin(self, start_delay_ns: int = 0) -> int:
        """Let the scheduler's present be now, or ``start_delay_ns`` from now; return the stamp (ns) that it has."""

    def catch_up(self) -> None:
        """Bring the scheduler's time to the present, before something comes from outside."""

    def step(self) -> float:
        """Carry out what is due, and return how long (s) the caller may spend before the next call."""

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Keep pace until the scheduler's time is ``until_ns`` (what is due then is left), or asked to stop.

        ``on_idle`` gets the time, about every 100 ms of the wall clock.
        """


def by_steps(
    pace: Pace,
    is_over: Callable[[], bool],
    wall: Callable[[], int],
    wait: Wait,
    turn: Turn,
    chore: tuple[Callable[[int], None] | None, int],
) -> None:
    """Step a pace until something is over; ``chore`` is what gets the time, and its period (ns of the wall clock)."""
    act, period_ns = chore
    next_chore = next_breath = wall()
    while not is_over():
        with turn:
            pause_s = pace.step()
        now = wall()
        if act is not None and now >= next_chore:
            next_chore = now + period_ns
            with turn:
                act(pace.now_ns)
        if pause_s > 0 or now >= next_breath:
            wait(max(pause_s, BREATH_S))
            next_breath = wall() + BREATH_PERIOD_NS


LONGEST_WAIT_NS = 50 * NS_PER_MS
"""The loop wakes at least this often, so that a signal is answered at once."""
START_LEAD_NS = 50 * NS_PER_MS
"""The start lies this far ahead of ``begin``, so that presets and start-up parts make no scan miss its deadline."""
CHORE_PERIOD_NS = 100 * NS_PER_MS
"""How often the loop calls ``on_idle``."""
CHORE_ROOM_NS = 2 * NS_PER_MS
"""``on_idle`` is put off, by another period at most, while the next event is nearer than this."""
WALL_CLOCK: Callable[[], int] = time.monotonic_ns
WALL_WAIT: Callable[[float], object] = time.sleep
"""The wall clock, for those who keep time otherwise and look after a person meanwhile."""


class Pacer:
    """Keeps a scheduler on the wall clock."""

    def __init__(
        self,
        scheduler: Scheduler,
        *,
        clock: Callable[[], int] = time.monotonic_ns,
        wait: Callable[[float], object] = time.sleep,
        turn: AbstractContextManager[object] | None = None,
    ) -> None:
        """Take a scheduler; its time passes from ``begin`` on.

        Args:
            scheduler: whose events are carried out.
            clock: the wall clock in ns, monotonic.
            wait: spends at most a time in s, 0 or more; it may return early, as when a message has come.
            turn: held, again and again, while ``run`` carries out events or calls ``on_idle``: what keeps other threads
                from the rack then.
        """
        self._scheduler, self._clock, self._wait = scheduler, clock, wait
        self._turn: AbstractContextManager[object] = nullcontext() if turn is None else turn
        self._zero_ns: int | None = None
        self.halted = False
        self.while_halted: Callable[[], object] = _nothing

    def begin(self, start_delay_ns: int = 0) -> int:
        """Let the scheduler's present be ``start_delay_ns`` from now on the wall clock; return that time of day, ns."""
        self._zero_ns = self._clock() + start_delay_ns - self._scheduler.now_ns
        if not self.halted:
            self._scheduler.zero_ns = self._zero_ns
        return time.time_ns() + start_delay_ns

    def halt(self) -> None:
        """Let time stand still from now on; ``while_halted`` is called every now and then, 20 times per second."""
        self.catch_up()
        self.halted, self._scheduler.zero_ns = True, None

    def resume(self) -> None:
        """Let time go on from where it stands."""
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
        """Bring the scheduler's time to the present, before something comes from outside; nothing is carried out.

        Before ``begin`` no time passes.
        """
        if self._zero_ns is not None:
            self._scheduler.pass_until(self.now_ns)

    def step(self) -> float:
        """Carry out what is due, and return how long (s) the caller may spend before the next call."""
        self._carry_out(self.now_ns)
        return self._idle_s(None)

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Keep pace until the scheduler's time is ``until_ns`` (what is due then is left), or asked to stop.

        ``on_idle`` gets the time, about every 100 ms, where there is time before the next event.
        """
        next_chore = self._clock() + max(0, -self.now_ns)
        while not should_stop():
            now = self.now_ns
            if until_ns is not None and now >= until_ns:
                with self._turn:
                    self._scheduler.run_due(until_ns - 1)
                    self._scheduler.pass_until(until_ns)
                return
            with self._turn:  # the queue, too, is looked at within it: a look takes out what was cancelled
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
        """Return whether a chore, due since a time of the wall clock, may be done: there is room, or it waits long."""
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


def _nothing() -> None:
    """Do nothing while time stands still."""
