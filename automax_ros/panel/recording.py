"""A recording as a source of the panel: all values at any time, scans executed again, another version next to it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.names import Element, NameFault
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UsageError
from automax_ros.diagram.placed import diagram_facts
from automax_ros.messages.types.messages import TaskState
from automax_ros.panel.rack_facts import explained, hello_of, uses_of
from automax_ros.panel.recorded_status import RecordedStatus
from automax_ros.panel.source import Asked, Facts, Frame, RequestRefused
from automax_ros.rackfile.model.plant_signals import ALL_KINDS
from automax_ros.rackfile.model.rack_names import LocalName, Meant, RackNames, SignalName
from automax_ros.recordings.tables.series import Progress
from automax_ros.recordings.tables.traces import Floats, thinned
from automax_ros.replay.engine import Replay, ReplayOptions
from automax_ros.replay.recorded.compared import FirstApart, first_apart
from automax_ros.replay.recorded.run import RecordedRun, TaskLog
from automax_ros.replay.recorded.task import RecordedTask, ScanRefused, run_edited
from automax_ros.replay.recorded.values import Course, typed
from automax_ros.replay.scans.state import recorded_fields

MOST_EXECUTED = 5_000
"""Most scans that are executed for the history of a task's own variables (decision: a second); of more the recorded
states are shown alone."""
MOST_NAMES = 32
MOST_POINTS = 20_000
_LOOK_ONLY = "a recording is only looked at"


@dataclass(frozen=True)
class _Version:
    """Tasks as they are executed on the scans of a recording, and their sources."""

    run: RecordedRun
    replay: Replay
    tasks: Mapping[str, RecordedTask]

    def diagram(self, task: str) -> Facts:
        """Return the drawing of a task."""
        found = {source.name: source for source in self.replay.sources}
        if task not in found:
            raise RequestRefused(f"there is no task {quoted(task)} here", near_or_listed(task, list(found)))
        programs = {name: source.compiled.program for name, source in found.items()}
        return diagram_facts(programs[task], found[task].source, *uses_of(programs))

    def lines(self, task: str, place: int) -> dict[str, Any]:
        """Return the values of a scan line by line.

        Raises:
            ScanRefused: it cannot be executed again so.
        """
        lines = self.tasks[task].lines(place)
        after = {str(line): written for line, written in lines.after.items() if written}
        return {"scan": self.run.tasks[task].numbers[place], "before": lines.before, "after": after}


class RecordingSource:
    """A recording; ``against`` is another one that is shown next to it, ``tasks`` are edited sources of its tasks.

    ``progress`` is called with the share of the reading that is done. Numbers that differ by at most ``tolerance``
    count as equal where the first difference is looked for.

    Raises:
        BagError: a recording cannot be read, or lacks what is needed to show it.
        SourceRefused: a source has errors.
        UsageError: both ``against`` and ``tasks`` are given.
    """

    is_over = True

    def __init__(
        self,
        bag: Path,
        against: Path | None = None,
        tasks: Mapping[str, SourceText] | None = None,
        tolerance: float = 0.0,
        progress: Progress | None = None,
    ) -> None:
        if against is not None and tasks:
            raise UsageError("a recording is compared with another one, or with edited tasks", "leave one of them out")
        edited = Replay(bag, tasks, ReplayOptions(tuple(tasks), tolerance)) if tasks else None
        passes = _passes(progress, 1 + bool(tasks) + 2 * (against is not None))
        self._own = _recorded(bag, next(passes))
        self._run = self._own.run
        programs = [source.compiled.program for source in self._own.replay.sources]
        self._names = RackNames(self._run.replay.rack.config, programs)
        self._status = RecordedStatus(self._run, self._names.programs)
        self._other: _Version | None = None
        self._next: Facts | None = None
        if edited is not None:
            first, kept = run_edited(self._run, edited, next(passes))
            own = {name: RecordedTask(self._run, name, edited, kept[name]) for name in kept}
            self._other = _Version(self._run, edited, own)
            label = ", ".join(f"{Path(source.source.name).name} (edited)" for source in edited.sources)
            self._next = {"label": label, "first": _facts(first)}
        if against is not None:
            self._other = _recorded(against, next(passes))
            first = first_apart(self._run, self._other.run, tolerance, next(passes))
            self._next = {"label": against.name, "first": _facts(first)}

    def hello(self) -> Facts:
        """Return what does not change while the panel is open."""
        return hello_of(
            self._names,
            "recording",
            title=f"{self._names.config.name}, recording {self._run.bag.name}",
            operate={"allowed": False, "why": _LOOK_ONLY},
            span={"from_ns": self._run.from_ns, "to_ns": self._run.to_ns},
            other=self._next,
        )

    def unknown(self, names: Sequence[str]) -> list[str]:
        """Return those of the names that mean nothing here."""
        return self._names.unknown(names)

    def frames(self, asked: Sequence[Asked]) -> list[Frame]:
        """Return the values for each browser, each at its time."""
        times = [self._run.to_ns if item.at_ns is None else item.at_ns for item in asked]
        return [
            Frame(at_ns, tuple(self._value(name, at_ns) for name in item.names))
            for at_ns, item in zip(times, asked, strict=True)
        ]

    def status(self, at_ns: int | None) -> Facts:
        """Return how the rack stood."""
        return self._status.facts(self._run.to_ns if at_ns is None else at_ns)

    def log(self, after: int) -> list[Facts]:
        """Return the errors and operations of the whole recording after entry ``after``."""
        return self._run.log.after(after)

    def answer(self, what: str, fields: Facts) -> Facts:
        """Answer ``diagram``, ``scan``, ``history``, ``seek`` or ``explain``.

        Raises:
            RequestRefused: it cannot be answered; the message says why.
        """
        if what == "explain":
            return explained(fields["code"])
        if what == "diagram":
            version = self._own if fields.get("which", "own") == "own" else self._other
            if version is None:
                raise RequestRefused("nothing is shown next to this recording", "give it with --against or --task")
            return version.diagram(fields["task"].strip().upper())
        if what == "scan":
            return self._scan(fields)
        if what == "seek":
            return {"t": self._time(fields)}
        return self._history(fields)

    def describe(self, verb: str, fields: Facts) -> str:  # noqa: ARG002
        """Refuse: a recording cannot be operated."""
        raise RequestRefused(_LOOK_ONLY)

    def operate(self, verb: str, fields: Facts) -> Facts:  # noqa: ARG002
        """Refuse: a recording cannot be operated."""
        raise RequestRefused(_LOOK_ONLY)

    def close(self) -> None:
        """Close the files."""
        self._run.close()
        if self._other is not None:
            self._other.run.close()

    # Values

    def _value(self, name: str, at_ns: int) -> Value | None:
        try:
            meant = self._names.find(name)
        except NameFault:
            return None
        if isinstance(meant, SignalName):
            log = self._run.drives.of(meant.plant, meant.signal)
            found: Value | None = getattr(log.at(at_ns) if log is not None else None, meant.signal, None)
            return found
        return self._local(meant, at_ns) if isinstance(meant, LocalName) else self._run.value(meant, at_ns)

    def _local(self, meant: LocalName, at_ns: int) -> Value | None:
        """Return a task's own variable, from a state after its last scan, or by executing that scan again."""
        log = self._run.tasks[meant.task]
        place, recorded = log.ended(at_ns), log.state_at(at_ns)
        if recorded is not None and (place < 0 or recorded.order > log.orders[place]):
            return self._in_state(meant, recorded.state)
        if place < 0:
            return None
        try:
            return self._own.tasks[meant.task].scan(place).own.get(meant.element.label)
        except ScanRefused:
            return None

    def _in_state(self, meant: LocalName, state: TaskState) -> Value | None:
        values = recorded_fields(self._run.bag, state).get(meant.element.name, ())
        value = values[meant.element.index] if meant.element.index < len(values) else None
        kind = meant.element.variable.type
        return value if value is None or isinstance(value, str) else typed(kind, value)

    # Scans

    def _log(self, fields: Facts) -> TaskLog:
        task = fields["task"]
        if task not in self._run.tasks:
            raise RequestRefused(f"there is no task {quoted(task)}", near_or_listed(task, list(self._run.tasks)))
        return self._run.tasks[task]

    def _place(self, fields: Facts) -> int:
        """Return the place of the scan that is asked for by its number, or by a time."""
        if "scan" not in fields and "t" not in fields:
            raise RequestRefused("a scan is asked for by its number or by a time")
        log, task = self._log(fields), fields["task"]
        if not log.numbers:
            raise RequestRefused(f"the recording holds no scan of task {task}")
        if "scan" in fields:
            place = log.numbered(fields["scan"])
            if place is None:
                held = f"it holds those from {log.numbers[0]} to {log.numbers[-1]}"
                raise RequestRefused(f"the recording holds no scan {fields['scan']} of task {task}", held)
            return place
        place = log.begun(fields["t"])
        if place < 0:
            first = seconds_text(log.times[0])
            raise RequestRefused(f"task {task} has not scanned by then", f"its first recorded scan is at {first} s")
        return place

    def _scan(self, fields: Facts) -> Facts:
        place, task = self._place(fields), fields["task"]
        try:
            found = self._own.lines(task, place)
        except ScanRefused as refused:
            raise RequestRefused(refused.message, refused.hint) from refused
        other = self._lines_of_other(task, place)
        return {"task": task, "t": self._run.tasks[task].times[place], **found, "other": other}

    def _time(self, fields: Facts) -> int:
        """Return the time that is asked for, or that of a scan."""
        if "task" not in fields and "t" not in fields:
            raise RequestRefused("a position is asked for by a time, or by a task and a scan")
        return self._log(fields).times[self._place(fields)] if "task" in fields else int(fields["t"])

    def _lines_of_other(self, task: str, place: int) -> Facts | None:
        other = self._other
        if other is None or task not in other.tasks:
            return None
        if other.run is not self._run:
            its_place = other.run.tasks[task].numbered(self._run.tasks[task].numbers[place])
            if its_place is None:
                return None
            place = its_place
        try:
            return other.lines(task, place)
        except ScanRefused:
            return None

    # History

    def _history(self, fields: Facts) -> Facts:
        names, begin, end = fields["names"], fields["from_ns"], fields["to_ns"]
        points = min(max(fields["points"], 4), MOST_POINTS)
        if len(names) > MOST_NAMES:
            raise RequestRefused(f"{len(names)} names: at most {MOST_NAMES} are shown over time")
        meant = [self._shown(name) for name in names]
        of_tasks = self._courses_of_tasks([item for item in meant if isinstance(item, LocalName)], begin, end)
        times, values = [], []
        for item in meant:
            kind, course = of_tasks[item.label] if isinstance(item, LocalName) else self._course(item)
            shown = thinned(*_cut(course, begin, end), points // 4)
            times.append([int(time) for time in shown[0]])
            values.append([typed(kind, float(value)) for value in shown[1]])
        return {"t": times, "v": values}

    def _shown(self, name: str) -> Meant:
        try:
            meant = self._names.find(name)
        except NameFault as fault:
            raise RequestRefused(fault.message, fault.hint) from fault
        named = meant.element if isinstance(meant, LocalName) else meant
        if not isinstance(named, SignalName) and named.variable.type is DataType.STRING:
            raise RequestRefused(f"{meant.label} holds texts, which have no course")
        return meant

    def _course(self, meant: Meant) -> tuple[DataType, Course]:
        if isinstance(meant, SignalName):
            log = self._run.drives.of(meant.plant, meant.signal)
            return ALL_KINDS[meant.signal], _NOTHING if log is None else log.course(meant.signal)
        assert isinstance(meant, Element)
        return meant.variable.type, self._run.commons.course((self._run.views[meant.name], meant.index))

    def _courses_of_tasks(self, meant: Sequence[LocalName], begin: int, end: int) -> dict[str, tuple[DataType, Course]]:
        """Return the courses of tasks' own variables: each scan is executed once for all of them."""
        found: dict[str, list[tuple[int, float]]] = {item.label: [] for item in meant}
        for task in dict.fromkeys(item.task for item in meant):
            log = self._run.tasks[task]
            first, last = max(0, log.ended(begin)), log.ended(end)
            times = sorted({begin, *log.ends[first : last + 1]}) if last - first < MOST_EXECUTED else log.state_times
            for time_ns in times:
                for item in meant:
                    value = self._local(item, time_ns) if item.task == task else None
                    if value is not None and not isinstance(value, str):
                        found[item.label].append((time_ns, float(value)))
        return {item.label: (item.element.variable.type, _as_course(found[item.label])) for item in meant}


def _facts(first: FirstApart | None) -> Facts | None:
    if first is None:
        return None
    return {"task": first.task, "scan": first.scan, "t": first.time_ns, "text": first.text}


def _as_course(points: Sequence[tuple[int, float]]) -> Course:
    return np.array([time for time, _ in points], np.int64), np.array([value for _, value in points], np.float64)


_NOTHING: Course = (np.empty(0, np.int64), np.empty(0, np.float64))


def _cut(course: Course, begin: int, end: int) -> tuple[Floats, Floats]:
    """Return the part of a course from the value that holds at its begin, with times as they are thinned."""
    times, values = course
    first = max(0, int(np.searchsorted(times, begin, "right")) - 1)
    last = int(np.searchsorted(times, end, "right"))
    return np.maximum(times[first:last], begin).astype(np.float64), values[first:last]


def _recorded(bag: Path, progress: Progress | None) -> _Version:
    replay = Replay(bag, {}, ReplayOptions())
    run = RecordedRun(replay, progress)
    return _Version(run, replay, {name: RecordedTask(run, name, replay) for name in run.tasks})


def _passes(progress: Progress | None, count: int) -> Iterator[Progress | None]:
    """Yield what is called with the share of each of ``count`` passes."""
    if progress is None:
        yield from [None] * count
        return
    for number in range(count):
        yield partial(_part_done, progress, number, count)


def _part_done(progress: Progress, number: int, count: int, share: float) -> None:
    progress((number + share) / count)
