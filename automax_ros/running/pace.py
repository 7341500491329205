"""What lets a scheduler's time pass: on the wall clock, simulated, or after another's clock."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol

from automax_ros.core.ticks import NS_PER_MS

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

    def begin(self, lead_ns: int = 0) -> int:
        """Let the scheduler's present be now, or ``lead_ns`` from now; return the stamp (ns) that it has."""

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
