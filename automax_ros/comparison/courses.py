"""The values of a recording's variables over time, in arrays: a value holds until the next one."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from automax_ros.comparison.signals import plain_name, recorded_signals
from automax_ros.core.text import printable
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Watched
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.series import Progress, Series
from automax_ros.recordings.write.recorder import EDITED
from automax_ros.replay.scans.scales import recorded_scales, values_in_unit

MOST_VALUES = 20_000_000
"""Most values that are read of each recording (decision: a bound on memory, 320 MB; 800 MB for a moment where one
variable has them all)."""
_LONGEST = 500
"""Longest text of what was edited (decision)."""
Times = NDArray[np.int64]
Values = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """One variable over time: each value holds from its time, in ns, to the next; the times increase.

    ``counts`` are what memory held where the values are in a unit by a scale, None where memory held the values.
    """

    variable: Watched
    times: Times
    values: Values
    counts: Values | None = None

    @property
    def in_memory(self) -> Course:
        """The course of what memory held."""
        return self if self.counts is None else Course(self.variable, self.times, self.counts)

    def moved(self, by_ns: int) -> Course:
        """Return the course later by a time."""
        return Course(self.variable, self.times + by_ns, self.values, self.counts)

    def at(self, times: Times) -> Values:
        """Return the values that hold at times; NaN before the first one."""
        if not len(self.times):
            return np.full(len(times), np.nan)
        places = np.searchsorted(self.times, times, "right") - 1
        return np.where(places >= 0, self.values[np.maximum(places, 0)], np.nan)

    def value_at(self, time_ns: int) -> float:
        """Return the value that holds at a time; NaN before the first one."""
        return float(self.at(np.array([time_ns], np.int64))[0])

    def between(self, start_ns: int, end_ns: int) -> Course:
        """Return the part of a range of time, its end included; it begins with the value that holds at its start."""
        held = self.times[: int(np.searchsorted(self.times, start_ns, "right"))][-1:]
        inside = (self.times > start_ns) & (self.times <= end_ns)
        first = np.full(len(held), start_ns, np.int64)
        values = np.concatenate((self.at(held), self.values[inside]))
        return Course(self.variable, np.concatenate((first, self.times[inside])), values)


@dataclass(frozen=True)
class RecordedCourses:
    """What was read of one recording; times are ns of its run.

    Attributes:
        labels: the full name of each variable, by the name that was asked for.
        courses: the courses by their variables' full names; one may be empty.
        start_ns: the time of the first value, ``end_ns`` the end of the recording.
        scales: by which courses are in their unit, by their variables' full names.
        edited: what was edited and when, if it is a rerun, in words.
    """

    bag: Path
    rack: str
    labels: Mapping[str, str]
    courses: Mapping[str, Course]
    start_ns: int
    end_ns: int
    scales: Mapping[str, Scale] = field(default_factory=dict)
    edited: str = ""

    def named(self, name: str) -> Course:
        """Return the course of a variable by the name that was asked for."""
        return self.courses[self.labels[name]]


def all_names(bag: Path) -> list[str]:
    """Return what is compared unless variables are named: simple numeric and boolean commons, signals.

    Raises:
        BagError: the recording cannot be read or has no common memory.
    """
    return [*(item.label for item in Series(bag).columns), *recorded_signals(BagReader(bag))]


def read_courses(bag: Path, names: Sequence[str], progress: Progress | None = None) -> RecordedCourses:
    """Read variables such as ``REF%``, ``TABLE%(3)``, ``SPEED.RATIO%``, and ``UNWIND/speed_rpm`` or with a period.

    A period before a signal that the recording has means that signal (decision: a task's own variables come second).
    Commons with a scale are in its unit.

    Raises:
        BagError: the recording cannot be read, holds no value or more than ``MOST_VALUES``, or a name is unknown or
            that of a text.
        UsageError: two names mean one variable.
    """
    reader = BagReader(bag)
    edited = printable(reader.custom_data.get(EDITED, ""))[:_LONGEST]
    signals = {plain_name(name): name for name in recorded_signals(reader)}
    asked = [signals.get(plain_name(name), name) for name in names]
    series = Series(bag, asked, progress=progress)
    if len(series.columns) < len(names):
        raise UsageError(f"of {', '.join(names)[:200]} two are the same variable", "name each once")
    text = next((item.label for item in series.columns if item.kind is DataType.STRING), None)
    if text is not None:
        raise BagError("AMX6828", bag, f"{text} holds texts, and numbers are compared", "leave it out")
    taken = [(array("q"), array("d")) for _ in series.columns]
    count = 0
    for time_ns, changed in series.changes():
        for column, value in changed.items():
            times, values = taken[column]
            times.append(time_ns)
            values.append(float(value))
        count += len(changed)
        if count > MOST_VALUES:
            hint = "name the variables, or take one file of a split recording"
            raise BagError("AMX6814", bag, f"holds more than {MOST_VALUES} values of what is compared", hint)
    labels = {name: item.label for name, item in zip(names, series.columns, strict=True)}
    read = {item.label for item in series.columns}
    scales = {label: scale for label, scale in recorded_scales(bag).items() if label in read}
    courses = {
        item.label: _course(item, *pair, scales.get(item.label))
        for item, pair in zip(series.columns, taken, strict=True)
    }
    first = [int(course.times[0]) for course in courses.values() if len(course.times)]
    return RecordedCourses(bag, series.rack, labels, courses, min(first, default=0), series.end_ns, scales, edited)


def _course(variable: Watched, times: array[int], values: array[float], scale: Scale | None) -> Course:
    """Return a course whose times increase: of what was taken at one instant the last value (decision)."""
    at = np.maximum.accumulate(np.array(times, np.int64)) if len(times) else np.empty(0, np.int64)
    last = np.append(at[1:] != at[:-1], True)[: len(at)]
    held = np.array(values, np.float64)[last]
    if scale is None:
        return Course(variable, at[last], held)
    return Course(variable, at[last], values_in_unit(held, scale), held)
