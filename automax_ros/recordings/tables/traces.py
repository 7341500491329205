"""Lines for pictures: a variable over time, with no more points than a picture can show and no peak lost."""

from __future__ import annotations

import enum
import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import Scan
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Watched
from automax_ros.recordings.tables.series import WHOLE_RUN, Progress, Series, TakeWrites, Window

MAX_POINTS = 1 << 16
"""Most points of a line; a longer one is thinned to four points per column."""
COLUMNS = 1 << 12
"""Number of columns that a line is thinned to; no picture is wider."""
MAX_LINES = 64
"""Most variables in one plot (decision: more cannot be told apart)."""
MAX_ERRORS = 1000
"""Number of errors that are marked, the first ones."""
Floats = npt.NDArray[np.float64]


class TraceRole(enum.IntEnum):
    """The role of a line in its lane: reference, lagged reference, feedback, the plant's value, or another.

    ``BACKGROUND`` is what a plant has next to other lines that are not meant to agree with it.
    """

    REFERENCE = 0
    LAGGED = 1
    FEEDBACK = 2
    PLANT = 3
    OTHER = 4
    BACKGROUND = 5


@dataclass(frozen=True)
class Line:
    """One variable over time: each value holds from its time, in s of the run, to the next."""

    variable: Watched
    times: Floats
    values: Floats
    role: TraceRole = TraceRole.OTHER


@dataclass(frozen=True)
class ErrorMark:
    """An error that a task logged: time in s of the run, task, BASIC line, number of the problem."""

    time_s: float
    task: str
    line: int
    code: int


@dataclass(frozen=True)
class Traces:
    """The contents of a picture: rack, range in s, a line for each variable, errors, the number of further errors."""

    rack: str
    start_s: float
    end_s: float
    lines: tuple[Line, ...]
    errors: tuple[ErrorMark, ...]
    unmarked: int


def traces(
    bag: Path,
    names: Sequence[str],
    window: Window = WHOLE_RUN,
    progress: Progress | None = None,
    take_scan: Callable[[int, Scan], None] | None = None,
    take_writes: TakeWrites | None = None,
) -> Traces:
    """Return the lines of variables such as ``REF%``, ``RUN@`` and ``TABLE%(3)``, in bounded memory.

    ``take_scan`` and ``take_writes`` are called as by ``Series``.

    Raises:
        BagError: the recording cannot be read, a name is unknown or a text, there are too many, or the window is empty.
    """
    errors = ErrorMarks()

    def scanned(time_ns: int, scan: Scan) -> None:
        errors.take(time_ns, scan)
        if take_scan is not None:
            take_scan(time_ns, scan)

    series = Series(bag, names, window, progress, scanned, take_writes)
    _check_names(bag, series.columns)
    courses = [Course() for _ in series.columns]
    for time, changed in series.changes():
        for index, value in changed.items():
            assert not isinstance(value, str)
            if math.isfinite(value):
                courses[index].append(time / NS_PER_S, value)
    lines = [Line(item, *course.line()) for item, course in zip(series.columns, courses, strict=True)]
    start_s, end_s = window.start_ns / NS_PER_S, series.end_ns / NS_PER_S
    first = [line.times[0] for line in lines if len(line.times)]
    start_s = max(start_s, float(min(first, default=start_s)))  # a file of a split recording begins later
    return Traces(series.rack, start_s, end_s, tuple(lines), tuple(errors.marks), errors.unmarked)


def thinned(times: Floats, values: Floats, columns: int) -> tuple[Floats, Floats]:
    """Return the first, last, least and greatest point of each of ``columns`` equal spans of time.

    The times must not decrease. A line that is short enough is returned unchanged.
    """
    if len(times) <= 4 * columns:
        return times, values
    span = (times[-1] - times[0]) / columns
    if span <= 0:
        numbers = np.zeros(len(times), np.int64)
    else:
        numbers = np.minimum(((times - times[0]) / span).astype(np.int64), columns - 1)
    starts = np.flatnonzero(np.diff(numbers, prepend=-1))
    ends = np.append(starts[1:], len(times)) - 1
    by_value = np.lexsort((values, numbers))  # within a column from the least to the greatest
    kept = np.unique(np.concatenate((starts, ends, by_value[starts], by_value[ends])))
    return times[kept], values[kept]


class Course:
    """Collects the points of one line, in bounded memory: times in s that do not decrease, finite numbers."""

    def __init__(self) -> None:
        self._times = array("d")
        self._values = array("d")

    def append(self, time_s: float, value: float) -> None:
        """Add a value; an earlier time than the last one is replaced by it."""
        if self._times and time_s < self._times[-1]:
            time_s = self._times[-1]
        self._times.append(time_s)
        self._values.append(value)
        if len(self._times) >= MAX_POINTS:
            times, values = thinned(*self.line(), COLUMNS)
            self._times, self._values = array("d", times.tobytes()), array("d", values.tobytes())

    def line(self) -> tuple[Floats, Floats]:
        """Return the times and the values."""
        return np.array(self._times, np.float64), np.array(self._values, np.float64)


class ErrorMarks:
    """Collects the errors of all tasks: the first ones with their places, and the number of further ones."""

    def __init__(self) -> None:
        self.marks: list[ErrorMark] = []
        self.unmarked = 0

    def take(self, time_ns: int, scan: Scan) -> None:
        """Add the errors of a scan; its time counts from the start of the run."""
        for error in scan.errors:
            if len(self.marks) < MAX_ERRORS:
                self.marks.append(ErrorMark(time_ns / NS_PER_S, scan.task, error.line, error.code))
            else:
                self.unmarked += 1


def _check_names(bag: Path, columns: Sequence[Watched]) -> None:
    text = next((item.label for item in columns if item.kind is DataType.STRING), None)
    if text is not None:
        raise BagError("AMX6828", bag, f"{text} holds texts, which have no place in a picture", "leave it out")
    if len(columns) > MAX_LINES:
        raise BagError("AMX6826", bag, f"{len(columns)} variables for one picture: {MAX_LINES} are the limit")
