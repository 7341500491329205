"""The functions of measures: each computes a number from a signal during a run.

A signal holds a value until it is written again; what is written twice at one instant counts once, with the value that
holds after that instant, and what happens at the very end of a window lies outside of it, as that of a run does
(decision). So every measure is exact in time, and none depends on a sampling rate. Times are in ns from the start of
the measure's window.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_left

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UserError

MOST_STEPS = 200_000
"""Most values that a measure of an unknown target keeps (decision): a signal of 16 bits has 65536 at most."""
_RISE = (0.1, 0.9)
"""Shares of the step between which the rise time is measured."""
_PERCENT = 100.0


class Accumulator(ABC):
    """Receives a signal piece by piece and returns one number.

    ``begin`` receives the value of the signal just before the window, which most functions ignore; ``hold`` a value
    that held from one time to a later one, where the next piece starts; ``result`` returns the number from the last
    value and the window's length, None if the signal has none.
    """

    def begin(self, before: float) -> None:  # noqa: B027
        pass

    @abstractmethod
    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:
        pass

    @abstractmethod
    def result(self, last: float, end_ns: int) -> float | None:
        pass


class Mean(Accumulator):
    """The average over time."""

    def __init__(self) -> None:
        self._sum: float = 0

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:
        """Add value times time; sums of whole numbers are exact."""
        self._sum += value * (end_ns - begin_ns)

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return self._sum / end_ns


class Rms(Accumulator):
    """The root of the average square over time."""

    def __init__(self) -> None:
        self._sum: float = 0

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:
        """Add square times time; sums of whole numbers are exact."""
        self._sum += value * value * (end_ns - begin_ns)

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return math.sqrt(self._sum / end_ns)


class SignalRange(Accumulator):
    """The least and the greatest value."""

    def __init__(self) -> None:
        self.least, self.most = math.inf, -math.inf

    def hold(self, value: float, begin_ns: int = 0, end_ns: int = 0) -> None:  # noqa: ARG002
        self.least = min(self.least, value)
        self.most = max(self.most, value)


class Least(SignalRange):
    """The least value."""

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return self.least


class Most(SignalRange):
    """The greatest value."""

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return self.most


class MostAbsolute(SignalRange):
    """The greatest distance from 0."""

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return max(self.most, -self.least)


class Final(Accumulator):
    """The value at the end."""

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:
        pass

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return last


class TimeTrue(Accumulator):
    """The time for which a BOOLEAN is TRUE, s."""

    def __init__(self) -> None:
        self._ns = 0

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:
        if value:
            self._ns += end_ns - begin_ns

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return self._ns / NS_PER_S


class Count(Accumulator):
    """The number of times a BOOLEAN becomes TRUE."""

    def __init__(self) -> None:
        self._count, self._before = 0, False

    def begin(self, before: float) -> None:
        """Store the value with which the first one is compared."""
        self._before = bool(before)

    def hold(self, value: float, begin_ns: int = 0, end_ns: int = 0) -> None:  # noqa: ARG002
        self._count += bool(value) > self._before
        self._before = bool(value)

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return self._count


class Itae(Accumulator):
    """The integral of time times distance from a target, by default 0."""

    def __init__(self, target: float = 0) -> None:
        self._target, self._sum = target, 0.0

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:
        """Add the integral over a constant piece: (end² - begin²) / 2."""
        self._sum += abs(value - self._target) * (end_ns * end_ns - begin_ns * begin_ns)

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        return self._sum / 2 / NS_PER_S**2


class Settle(Accumulator):
    """The time at which a signal enters a band around its target for good, s; None if it ends outside.

    The target is the last value unless it is given. A band in % is one of the target (decision), so that a disturbance
    has a band too.
    """

    def __init__(self, band: float, target: float | None = None, *, percent: bool) -> None:
        self._band, self._percent, self._target = band, percent, target
        self._high: list[tuple[float, int]] = []
        self._low: list[tuple[float, int]] = []
        self._outside_ns = 0

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:  # noqa: ARG002
        """Store until when values were exceeded, without those that later values exceed."""
        if self._target is not None:
            if abs(value - self._target) > self._width(self._target):
                self._outside_ns = end_ns
            return
        _push(self._high, -value, end_ns)
        _push(self._low, value, end_ns)

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        target = last if self._target is None else self._target
        width = self._width(target)
        if abs(last - target) > width:
            return None
        if self._target is not None:
            return self._outside_ns / NS_PER_S
        above, below = _last_below(self._high, -(target + width)), _last_below(self._low, target - width)
        return max(above, below) / NS_PER_S

    def _width(self, target: float) -> float:
        return abs(target) * self._band / _PERCENT if self._percent else self._band


def _push(stack: list[tuple[float, int]], value: float, end_ns: int) -> None:
    """Push a value on an ascending stack; the greater ones before it ended before it, and are removed."""
    while stack and stack[-1][0] >= value:
        stack.pop()
    stack.append((value, end_ns))
    if len(stack) > MOST_STEPS:
        raise UserError(
            f"a measure without a target would have to keep more than {MOST_STEPS} values",
            "give the target: settle(X, 2 %, 1500)",
        )


def _last_below(stack: list[tuple[float, int]], level: float) -> int:
    """Return when the last value below a level ended, 0 if there was none."""
    place = bisect_left(stack, level, key=lambda item: item[0])
    return stack[place - 1][1] if place else 0


class Overshoot(SignalRange):
    """How far a signal exceeds its target, % of the step from its value before the window; None without a step."""

    def __init__(self, target: float | None = None) -> None:
        super().__init__()
        self._target, self._start = target, 0.0

    def begin(self, before: float) -> None:
        """Store the value at which the step starts."""
        self._start = before

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        target = last if self._target is None else self._target
        step = target - self._start
        if step == 0:
            return None
        beyond = self.most - target if step > 0 else target - self.least
        return max(0.0, beyond / abs(step) * _PERCENT)


class Rise(Accumulator):
    """The time of a signal from 10 % to 90 % of the step from its value before the window, s; None without one."""

    def __init__(self, target: float | None = None) -> None:
        self._target, self._start = target, 0.0
        self._highs: list[tuple[float, int]] = []
        self._lows: list[tuple[float, int]] = []

    def begin(self, before: float) -> None:
        """Store the value at which the step starts."""
        self._start = before

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:  # noqa: ARG002
        """Store when each new extreme was reached."""
        for records, item in ((self._highs, value), (self._lows, -value)):
            if not records or item > records[-1][0]:
                records.append((item, begin_ns))
                if len(records) > MOST_STEPS:
                    raise UserError(
                        f"rise would have to keep more than {MOST_STEPS} values", "measure a shorter window"
                    )

    def result(self, last: float, end_ns: int) -> float | None:  # noqa: ARG002
        target, start = last if self._target is None else self._target, self._start
        step = target - start
        if step == 0:
            return None
        records, sign = (self._highs, 1) if step > 0 else (self._lows, -1)
        times = [_first_at(records, sign * (start + share * step)) for share in _RISE]
        first, second = times
        return None if first is None or second is None else (second - first) / NS_PER_S


def _first_at(records: list[tuple[float, int]], level: float) -> int | None:
    """Return when a level was first reached, None if it never was."""
    place = bisect_left(records, level, key=lambda item: item[0])
    return records[place][1] if place < len(records) else None
