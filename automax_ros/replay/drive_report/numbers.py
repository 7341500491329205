"""Numbers of signals over a recorded run: least, greatest, mean and last value; alarms with their times."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan

import numpy as np

from automax_ros.core.types import DataType
from automax_ros.recordings.tables.traces import Course, Floats

BEGINNING_S = 0.2
"""Within this time a task has written what it computes (decision)."""


@dataclass
class Numbers:
    """The numbers of one signal; values are added in the order of time, each holds until the next, or a pause.

    Attributes:
        values: how many there were.
        least, greatest, last: NaN before the first value.
        of_memory: whether it is a common, which is 0 until a task writes it.
        is_empty_first: whether the first value was the 0 of memory that no task had written yet, which does not count:
            it was there at the start of the run and was replaced within ``BEGINNING_S``, by values that all stay
            farther from 0 than from each other (decision). ``finish`` decides.
    """

    values: int = 0
    least: float = nan
    greatest: float = nan
    last: float = nan
    of_memory: bool = False
    is_empty_first: bool = False
    _area: float = 0.0
    _seconds: float = 0.0
    _since_s: float = 0.0
    _holds: bool = False
    _first: tuple[float, float] = (nan, nan)
    _first_until_s: float = nan
    _rest: tuple[float, float] = (nan, nan)

    def take(self, time_s: float, value: float) -> None:
        """Add a value, s of the run."""
        if not self.values:
            self.least = self.greatest = value
            self._first = time_s, value
        else:
            self._pass_to(time_s)
            if value < self.least:
                self.least = value
            elif value > self.greatest:
                self.greatest = value
            if self.values == 1:
                self._first_until_s, self._rest = time_s, (value, value)
            elif self._first[1] == 0.0:
                self._rest = min(self._rest[0], value), max(self._rest[1], value)
        self.values += 1
        self.last, self._since_s, self._holds = value, max(time_s, self._since_s), True

    def pause(self, time_s: float) -> None:
        """Let the last value end, s of the run: what follows does not count until the next one."""
        if self._holds:
            self._pass_to(time_s)
            self._since_s, self._holds = max(time_s, self._since_s), False

    def finish(self, end_s: float) -> None:
        """Let the last value hold to the end of the run, s."""
        if self.values:
            self._pass_to(end_s)
            self._since_s = max(end_s, self._since_s)
        begins_with_0 = self.of_memory and self._first == (0.0, 0.0) and self._first_until_s <= BEGINNING_S
        if begins_with_0 and not self.is_empty_first:
            least, greatest = self._rest
            nearest = max(least, -greatest)
            if nearest > greatest - least:
                self.is_empty_first = True
                self.least, self.greatest = least, greatest
                self._seconds -= self._first_until_s

    def _pass_to(self, time_s: float) -> None:
        if self._holds and time_s > self._since_s:
            self._area += self.last * (time_s - self._since_s)
            self._seconds += time_s - self._since_s

    @property
    def mean(self) -> float:
        """Mean over the time of values (decision: each counts as long as it holds); NaN without any."""
        return self._area / self._seconds if self._seconds > 0 else self.last


class Measured:
    """A signal's course, for a picture, and its numbers."""

    __slots__ = ("course", "numbers")

    def __init__(self, *, of_memory: bool = False) -> None:
        self.course, self.numbers = Course(), Numbers(of_memory=of_memory)

    def take(self, time_s: float, value: float) -> None:
        """Add a finite value, s of the run."""
        self.course.append(time_s, value)
        self.numbers.take(time_s, value)

    def pause(self, time_s: float) -> None:
        """Let the last value end, s of the run: a gap until the next one."""
        if self.numbers.values:
            self.course.append(time_s, nan)
            self.numbers.pause(time_s)

    def line(self) -> tuple[Floats, Floats]:
        """Return times and values for a picture, after ``finish``; gaps are NaN."""
        times, values = self.course.line()
        if self.numbers.is_empty_first:
            begun = int(np.argmax(values != 0.0))
            return times[begun:], values[begun:]
        return times, values


@dataclass(frozen=True)
class SignalNumbers:
    """The numbers of one signal that a report shows; ``unit`` and ``text`` may be empty."""

    label: str
    unit: str
    text: str
    numbers: Numbers
    kind: DataType = DataType.REAL


@dataclass
class AlarmRun:
    """An alarm over a run: how often it came, and how long it was there in all.

    Attributes:
        label: the boolean.
        text: its description, or its name.
        first_s: when it first came, s of the run, None if it never did.
        on_s: how long it was there, s, after ``finish``.
    """

    label: str
    text: str
    times: int = 0
    on_s: float = 0.0
    first_s: float | None = None
    _begun_s: float | None = field(default=None, repr=False)

    @property
    def is_on(self) -> bool:
        """Whether it is there now."""
        return self._begun_s is not None

    def take(self, time_s: float, *, on: bool) -> str:
        """Add the boolean's value, s of the run; return what happened in words, "" if nothing has."""
        name = f"{self.text} ({self.label})" if self.text != self.label else self.label
        if on and self._begun_s is None:
            self._begun_s = time_s
            self.first_s = time_s if self.first_s is None else self.first_s
            self.times += 1
            return f"alarm: {name}"
        if not on and self._begun_s is not None:
            seconds = time_s - self._begun_s
            self.on_s += seconds
            self._begun_s = None
            return f"alarm gone after {seconds:.3f} s: {name}"
        return ""

    def finish(self, end_s: float) -> None:
        """Let an alarm that is there last to the end of the run, s."""
        if self._begun_s is not None:
            self.on_s += max(0.0, end_s - self._begun_s)
