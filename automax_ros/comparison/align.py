"""What makes two recordings lie on one axis of time: the start of their runs, or an event that each of them has."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from automax_ros.comparison.courses import Course, RecordedCourses
from automax_ros.core.text import quoted
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import number, value_of

_EVENT = re.compile(r"(?P<name>[^<>=]+?)\s*(?:(?P<relation><=|>=|<>|[<>=])\s*(?P<value>[^<>=]+))?")
_RELATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "=": np.equal,
    "<>": np.not_equal,
}
_HINT = "such as RUN@, RUN@=FALSE, 'CUR_REF%>500'"


@dataclass(frozen=True)
class Event:
    """The instant at which a condition on a variable becomes true, having been false before.

    Before the start of the run every variable was 0 (decision), so RUN@ may rise in the first scan. With ``relation``
    "" the variable is a BOOLEAN, and the condition is that it is TRUE.
    """

    variable: str
    relation: str = ""
    value: float = 1.0
    text: str = ""

    def first(self, recorded: RecordedCourses, from_ns: int) -> int:
        """Return when it first happens, in ns of the run, from a time of the run on.

        Raises:
            UsageError: it does not happen, or says nothing of a number.
        """
        course = recorded.named(self.variable)
        kind, label = course.variable.kind, course.variable.label
        if not self.relation and kind is not DataType.BOOLEAN:
            hint = f"say what happens, such as '{label}>500'"
            raise UsageError(f"--align {label}: only of a BOOLEAN it is clear what happens", hint)
        begins_at_once = bool(len(course.times)) and course.times[0] == 0
        values = np.concatenate(([0.0], course.values)) if begins_at_once else course.values
        true = _RELATIONS[self.relation or "="](values, self.value) & ~np.isnan(values)
        begins = course.times[np.flatnonzero(true[1:] & ~true[:-1]) + (0 if begins_at_once else 1)]
        after = begins[begins >= from_ns]
        if not len(after):
            raise self._never(
                recorded, course, bool(true[-len(course.times) :][course.times >= from_ns].any()), from_ns
            )
        return int(after[0])

    def _never(self, recorded: RecordedCourses, course: Course, holds: bool, from_ns: int) -> UsageError:
        what = f"{course.variable.label}{self.text}" if self.relation else f"{course.variable.label}=TRUE"
        since = f" from {seconds_text(from_ns)} s on" if from_ns else ""
        finite = course.values[np.isfinite(course.values)]
        if holds:
            hint = "an event begins after the condition was false; take another event, or --shift"
        elif not len(finite):
            hint = "it has no value there"
        elif course.variable.kind is DataType.BOOLEAN:
            hint = f"it is {'TRUE' if finite[0] else 'FALSE'} {'' if len(finite) == 1 else 'at first '}there"
        else:
            hint = f"it goes from {finite.min():g} to {finite.max():g} there"
        return UsageError(f"--align: {what} never begins in {recorded.bag}{since}", hint)


def read_event(text: str) -> Event:
    """Return the event in a text: ``RUN@``, ``RUN@=FALSE``, ``CUR_REF%>500``.

    Raises:
        UsageError: it is not of that form.
    """
    match = _EVENT.fullmatch(text.strip())
    if match is None:
        raise UsageError(f"--align: {quoted(text)} is not an event", _HINT)
    relation, given = match["relation"] or "", (match["value"] or "").strip()
    if not relation:
        return Event(match["name"])
    truth = value_of(given, DataType.BOOLEAN)
    try:
        value = float(truth) if isinstance(truth, bool) else number(given)
    except ValueError as error:
        raise UsageError(f"--align: {error}", _HINT) from None
    return Event(match["name"], relation, value, f"{relation}{given}")


@dataclass(frozen=True)
class Alignment:
    """Where the common axis has its 0, in ns of both runs; ``event`` is "" where that is the start of the runs.

    ``shift_ns`` is how much later the second recording is placed besides.
    """

    event: str = ""
    before_ns: int = 0
    after_ns: int = 0
    shift_ns: int = 0

    @property
    def move_before_ns(self) -> int:
        """What is added to the first recording's times."""
        return -self.before_ns

    @property
    def move_after_ns(self) -> int:
        """What is added to the second recording's times."""
        return self.shift_ns - self.after_ns

    @property
    def axis(self) -> str:
        """What the times count from, in words."""
        return self.event or "the start of the run"


def aligned(
    before: RecordedCourses, after: RecordedCourses, event: Event | None, from_ns: int = 0, shift_ns: int = 0
) -> Alignment:
    """Return the alignment by an event of each run, or without one by the start of the runs.

    Raises:
        UsageError: the event does not happen in one of them.
    """
    if event is None:
        return Alignment(shift_ns=shift_ns)
    label = before.labels[event.variable] + event.text
    return Alignment(label, event.first(before, from_ns), event.first(after, from_ns), shift_ns)
