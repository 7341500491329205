"""Shapes of signals over time: ramp, sine, square, course. Pure functions of the time since their start.

All are sampled at their start and each ms after it (decision: the contract says 1 ms for ramps). A ramp also has a
sample at its end; a sine and a square end before theirs, so that a square of whole periods leaves its low value.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Protocol

from automax_ros.core.numbers import nearest, stored_real
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.core.types import DataType, Value

SAMPLE_NS = NS_PER_MS
"""Time between two samples."""
MOST_HZ = 500
"""Highest frequency: two samples per period (decision)."""


class Wave(Protocol):
    """A shape. ``for_ns`` is its duration, None if it has no end."""

    @property
    def for_ns(self) -> int | None: ...  # noqa: D102

    def value(self, elapsed_ns: int, start: Value, /) -> Value:
        """Return the value at ``elapsed_ns`` after the start, at which the signal had the value ``start``."""
        ...

    def last(self) -> Value | None:
        """Return the value at the very end, None if the last sample stays."""
        ...


@dataclass(frozen=True)
class Ramp:
    """A straight line from the present value to ``to``; whole numbers are rounded to the nearest (decision)."""

    type: DataType
    to: float
    for_ns: int

    def value(self, elapsed_ns: int, start: Value) -> Value:
        """Return the point of the line; whole numbers are computed as such."""
        assert not isinstance(start, str)
        if elapsed_ns >= self.for_ns:
            return self.last()
        if self.type.is_integer:
            moved = (int(self.to) - int(start)) * elapsed_ns
            return int(start) + (2 * moved + self.for_ns) // (2 * self.for_ns)
        return stored_real(start + (self.to - start) * (elapsed_ns / self.for_ns))[0]

    def last(self) -> Value:
        """Return the end of the line."""
        return int(self.to) if self.type.is_integer else self.to


@dataclass(frozen=True)
class Sine:
    """``mean + amplitude * sin(2 pi hz t)``; whole numbers are rounded to the nearest (decision)."""

    type: DataType
    mean: float
    amplitude: float
    hz: Fraction
    for_ns: int | None

    @cached_property
    def _cycle(self) -> int:
        """One period, in ns times the numerator of ``hz``: whole numbers are computed much faster than fractions."""
        return self.hz.denominator * NS_PER_S

    def value(self, elapsed_ns: int, _: Value) -> Value:
        """Return the sample; the phase is exact however long the wave lasts."""
        phase = self.hz.numerator * elapsed_ns % self._cycle
        exact = self.mean + self.amplitude * math.sin(2.0 * math.pi * (phase / self._cycle))
        return nearest(exact) if self.type.is_integer else stored_real(exact)[0]

    def last(self) -> Value | None:
        """Return None: the last sample stays."""
        return None


@dataclass(frozen=True)
class Square:
    """Half a period ``high``, half a period ``low``, starting with ``high``."""

    low: Value
    high: Value
    hz: Fraction
    for_ns: int | None

    def value(self, elapsed_ns: int, _: Value) -> Value:
        """Return the level of this half period."""
        half_periods = 2 * self.hz.numerator * elapsed_ns // (self.hz.denominator * NS_PER_S)
        return self.low if half_periods % 2 else self.high

    def last(self) -> Value | None:
        """Return None: the last sample stays."""
        return None


@dataclass(frozen=True)
class Course:
    """Straight lines between points: ``values`` at ``times_ns``, which ascend; whole numbers are rounded as a ramp's.

    Before the first point it is the value at the start. Of points of one time the last counts, so they are a step.
    """

    type: DataType
    times_ns: Sequence[int]
    values: Sequence[float]

    @property
    def for_ns(self) -> int | None:
        """The time of the last point."""
        return self.times_ns[-1]

    def value(self, elapsed_ns: int, start: Value) -> Value:
        """Return the point of the line."""
        after = bisect_right(self.times_ns, elapsed_ns)
        if after == 0:
            return start
        if after == len(self.times_ns):
            return self.last()
        since_ns, span_ns = elapsed_ns - self.times_ns[after - 1], self.times_ns[after] - self.times_ns[after - 1]
        return Ramp(self.type, self.values[after], span_ns).value(since_ns, self.values[after - 1])

    def last(self) -> Value:
        """Return the last point."""
        return int(self.values[-1]) if self.type.is_integer else self.values[-1]
