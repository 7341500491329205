"""The events of a recorded run: states, faults, errors, operations, and values that were set."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from automax_ros.core.kinds import WriterKind
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.core.values import source_text
from automax_ros.messages.types.messages import Operation
from automax_ros.rack.operator.faults import meaning_of
from automax_ros.recordings.read.common_log import Cell

MOST_EVENTS = 2000
"""Most events of a kind, and most faults, of one drive; the first ones are kept (decision: a bound on memory)."""
LONGEST = 300
"""Longest text of an event."""
TOGETHER_NS = NS_PER_S // 10
"""Values that follow each other this closely are one course: the samples of a ramp or a sine (decision)."""
_SENT_LATER = ("plant", "web", "operation")
_WHO = {WriterKind.ROS: "ROS sets", WriterKind.OPERATOR: "set"}


@dataclass(frozen=True)
class DriveEvent:
    """An event, at s of the run.

    ``kind``: ``state``, ``fault``, ``alarm``, ``error``, ``plant``, ``web`` or ``operation``. ``is_end``: a fault or
    alarm is gone with it.
    """

    time_s: float
    kind: str
    text: str
    is_end: bool = False


@dataclass
class _Written:
    """A value that was written, and those that followed it closely."""

    begin_ns: int
    number: int
    writer: WriterKind
    first: Cell
    end_ns: int
    last: Cell
    more: int = 0


class ValuesSet:
    """The values that operators, stimuli and ROS have written; values that follow each other closely are one course."""

    def __init__(self) -> None:
        self._open: dict[str, _Written] = {}
        self._ended: list[tuple[int, int, str]] = []
        self._begun = 0
        self._values: dict[str, Cell] = {}
        self.omitted = 0

    def take(self, time_ns: int, writer: WriterKind, values: Sequence[tuple[str, Cell]]) -> None:
        """Add a write; a value that ROS repeats is added once."""
        for name, value in values:
            if writer is WriterKind.ROS and self._values.get(name) == value:
                continue
            self._values[name] = value
            before = self._open.get(name)
            if before is not None and before.writer is writer and time_ns - before.end_ns < TOGETHER_NS:
                before.end_ns, before.last, before.more = time_ns, value, before.more + 1
                continue
            self._end(name)
            self._begun += 1
            self._open[name] = _Written(time_ns, self._begun, writer, value, time_ns, value)

    def events(self) -> list[DriveEvent]:
        """Return all writes as events, in the order of time."""
        for name in list(self._open):
            self._end(name)
        return [DriveEvent(time_ns / NS_PER_S, "operation", cut(text)) for time_ns, _, text in sorted(self._ended)]

    def _end(self, name: str) -> None:
        written = self._open.pop(name, None)
        if written is None:
            return
        if len(self._ended) >= MOST_EVENTS:
            self.omitted += 1
            return
        text = f"{_WHO[written.writer]} {name} = {source_text(written.first)}"
        if written.more:
            end = seconds_text(written.end_ns)
            text += f", then {written.more} more values to {source_text(written.last)} at {end} s"
        self._ended.append((written.begin_ns, written.number, text))


@dataclass
class Happenings:
    """Collects the events of a run, at most ``MOST_EVENTS`` of a kind; ``omitted`` counts the rest."""

    events: list[DriveEvent] = field(default_factory=list)
    omitted: int = 0
    _counts: Counter[str] = field(default_factory=Counter)

    def add_event(self, time_s: float, kind: str, text: str, *, is_end: bool = False) -> None:
        """Add an event; ``is_end`` as of ``DriveEvent``."""
        self._counts[kind] += 1
        if self._counts[kind] <= MOST_EVENTS:
            self.events.append(DriveEvent(time_s, kind, cut(text), is_end))
        else:
            self.omitted += 1

    def finish(self, values_set: ValuesSet) -> None:
        """Sort the events by time; at one instant, values that were set come first, for the rest follows from them.

        What is told of plants and of other operations comes last: a rack sends it after its scans.
        """
        self.events.sort(key=lambda event: event.kind in _SENT_LATER)
        self.events[:0] = values_set.events()
        self.omitted += values_set.omitted
        self.events.sort(key=lambda event: event.time_s)


def cut(text: str) -> str:
    """Return a text, cut to the longest of an event."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def error_text(code: int, line: int) -> str:
    """Return an entry of a task's error log in words."""
    name = f"AMX{code:04d}"
    problem = PROBLEMS.get(name)
    title = f": {problem.title}" if problem is not None else ""
    hardware = f", code {problem.hardware}" if problem is not None and problem.hardware else ""
    return f"{name}{title} (line {line}{hardware})"


def operation_text(operation: Operation) -> str:
    """Return an operation in words, "" for a value that was set: the write log has it."""
    if operation.what == "set" and operation.ok:
        return ""
    words = " ".join(text for text in (operation.what, operation.task, operation.detail) if text)
    if operation.what == "stop_all" and operation.detail:
        words += f": code {operation.detail}, {meaning_of(operation.detail)}"
    return words if operation.ok else f"{words}: refused, {operation.reason}"
