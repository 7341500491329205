"""The sync signal of a drive: the line at the sync transformer of its 57C406, with disturbances (52.5).

A comparator detects in the signal the instants at which phase T1 is at its maximum: where the voltage of the two other
phases rises through zero. Per unit of its peak, theta counted from that instant, the signal is::

    sin theta + sum p_k sin(k theta + phi_k) - d sign(sin theta) in each notch

The first rise through zero counts; after it the comparator is blocked for three quarters of a cycle. Noise moves each
instant by its ratio to the slope (decision: of the transformer and its comparator nothing is published).

Effect on the bridge: a notch reduces its voltage in proportion to the area of the notch, so the bridge gives less than
the firing angle promises (52.4); its wave stays a sinusoid, or the circuit would have no closed solution. Harmonics and
noise have no effect on it: their mean over an SCR's conduction is small (decision).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, copysign, inf, pi, radians, sin, sqrt
from typing import Final

from automax_ros.drive.base.state import SavedState, Stateful

TURN: Final = 2 * pi
SHORTEST_RISE: Final = radians(0.25)
"""Zeros nearer than this to each other may be passed over, rad (decision)."""
_QUARTER: Final = pi / 2
_MASK: Final = (1 << 64) - 1


class SyncSignal(Stateful):
    """The sync signal of one plant's line.

    Attributes:
        notches: depth over the peak, width over a cycle, how many in a cycle, where the first begins (rad); a depth of
            0 is none.
        noise: standard deviation over the peak, and the seed.
        harmonics: order, amplitude over the peak, phase (rad) of each.
    """

    _kept = ("notches", "noise", "harmonics", "_cycle", "_turn")

    def __init__(self) -> None:
        self.notches: tuple[float, float, int, float] = (0.0, 0.0, 0, 0.0)
        self.noise: tuple[float, int] = (0.0, 0)
        self.harmonics: list[tuple[int, float, float]] = []
        self._cycle = 0
        self._turn = 0.0
        self._rise = 0.0
        """Angle at which the signal rises through zero without noise, rad; infinite where it never does."""

    def clear(self) -> None:
        """Remove all disturbances."""
        self.__init__()  # type: ignore[misc]

    def set_notches(self, depth: float, width: float, count: int, first: float) -> None:
        """Set the notches, with the values of ``notches``."""
        self.notches = (depth, width, count, first)
        self._look_for_rise()

    def set_noise(self, part: float, seed: int) -> None:
        """Set the noise, with the values of ``noise``; its sequence of numbers restarts."""
        self.noise = (part, seed)
        self._cycle = 0

    def set_harmonic(self, order: int, part: float, phase: float) -> None:
        """Set a harmonic in place of one of the same order; a ``part`` of 0 removes it."""
        others = [item for item in self.harmonics if item[0] != order]
        self.harmonics = sorted([*others, (order, part, phase)] if part else others)
        self._look_for_rise()

    @property
    def lost_part(self) -> float:
        """The part of the bridge's voltage that is lost by the notches."""
        depth, width, count, _ = self.notches
        return min(depth, 1.0) * min(width * count, 1.0)

    @property
    def is_there(self) -> bool:
        """Whether the signal rises through zero in each cycle."""
        return self._rise < inf

    def since(self, turn: float) -> float:
        """Return the angle since the comparator's instant, rad, 0 to 2 pi.

        It is that of the instant nearest to the present, also where noise lets it come a little later: the 57C406
        compares each with the interrupt next to it (decision).

        Args:
            turn: angle since phase T1 was at its maximum, 0 to 2 pi.
        """
        part = self.noise[0]
        if not part and not self._rise:
            return turn
        if turn < self._turn:
            self._cycle += 1
        self._turn = turn
        passed = turn - self._instant(self._cycle + (turn > pi))
        return passed if 0.0 <= passed < TURN else passed % TURN

    def restore(self, state: SavedState) -> None:
        """Restore a state; raises ParameterError if it is not the state of a sync signal."""
        super().restore(state)
        self._look_for_rise()

    def _instant(self, cycle: int) -> float:
        """Return the comparator's instant in a cycle, rad after T1's maximum."""
        part, seed = self.noise
        moved = self._rise + part * random_number(seed, cycle) if part else self._rise
        return max(-_QUARTER, min(_QUARTER, moved))

    def _look_for_rise(self) -> None:
        self._rise = first_rise(self.notches, self.harmonics)


def random_number(seed: int, place: int) -> float:
    """Return a number of a sequence with mean 0 and standard deviation 1, at most 3.5: nearly normal (decision)."""
    bits = (seed * 0x9E3779B97F4A7C15 + place * 0xD1B54A32D192ED03) & _MASK
    bits = ((bits ^ bits >> 30) * 0xBF58476D1CE4E5B9) & _MASK
    bits = ((bits ^ bits >> 27) * 0x94D049BB133111EB) & _MASK
    bits ^= bits >> 31
    # Four uniformly distributed numbers of 16 bits: a variance of 1/12 each.
    whole = (bits & 0xFFFF) + (bits >> 16 & 0xFFFF) + (bits >> 32 & 0xFFFF) + (bits >> 48)
    return (whole / 65536.0 - 2.0) * sqrt(3.0)


def first_rise(notches: tuple[float, float, int, float], harmonics: Sequence[tuple[int, float, float]]) -> float:
    """Return where a signal first rises through zero within a quarter of a cycle of 0, rad; infinite if nowhere."""
    depth, width, count, first = notches
    if not depth and not harmonics:
        return 0.0
    windows = _windows(width * TURN, count, first) if depth else []
    edges = {edge for window in windows for edge in window if -_QUARTER < edge < _QUARTER}
    below = False
    for start, end in pairwise(sorted({-_QUARTER, 0.0, _QUARTER} | edges)):
        middle = (start + end) / 2
        inside = any(low <= middle < high for low, high in windows)
        shift = copysign(depth, middle) if inside else 0.0
        parts = max(1, ceil((end - start) / SHORTEST_RISE))
        for number in range(parts + 1):
            theta = start + (end - start) * number / parts
            if _wave(theta, harmonics) - shift >= 0.0:
                if below:
                    before = start + (end - start) * max(0, number - 1) / parts
                    return _zero(before, theta, shift, harmonics)
            else:
                below = True
    return inf


def _windows(width: float, count: int, first: float) -> list[tuple[float, float]]:
    """Return the begin and end of notches of a width (rad) from -pi to pi, with those that reach into this range."""
    begins = [(first + TURN * number / count + pi) % TURN - pi for number in range(count)]
    return [(begin + turn, begin + turn + width) for begin in begins for turn in (-TURN, 0.0, TURN)]


def _wave(theta: float, harmonics: Sequence[tuple[int, float, float]]) -> float:
    wave = sin(theta)
    for order, part, phase in harmonics:
        wave += part * sin(order * theta + phase)
    return wave


def _zero(low: float, high: float, shift: float, harmonics: Sequence[tuple[int, float, float]]) -> float:
    """Return the angle at which the wave reaches a level between two angles; the first where it already has there."""
    if _wave(low, harmonics) - shift >= 0.0:
        return low
    for _ in range(60):
        middle = (low + high) / 2
        if _wave(middle, harmonics) - shift >= 0.0:
            high = middle
        else:
            low = middle
    return high
