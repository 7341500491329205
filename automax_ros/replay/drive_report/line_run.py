"""A rack's recorded run: the signals that are watched with their numbers, its plants, alarms, errors and operations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.drive.base.errors import LARGEST
from automax_ros.messages.types.messages import NAMES, Operation, PlantState, RollState, Scan, WebState
from automax_ros.messages.types.webs_followed import WebsFollowed
from automax_ros.rackfile.model.plant_signals import ALL_UNITS
from automax_ros.rackfile.model.plants import PlantConfig
from automax_ros.recordings.read.common_log import Cell, Watched
from automax_ros.recordings.tables.traces import MAX_LINES, ErrorMarks, Line, TraceRole
from automax_ros.replay.drive_report.drive_signals import RecordedSignal
from automax_ros.replay.drive_report.happenings import Happenings, error_text, operation_text
from automax_ros.replay.drive_report.line_signals import LineSignal, is_followed
from automax_ros.replay.drive_report.numbers import AlarmRun, Measured, SignalNumbers

_SHOWN = {
    PlantState: ("speed_rpm", "current_a"),
    RollState: ("web_mps", "diameter_m"),
    WebState: ("tension_n",),
}
"""What is shown of each plant, of its roll or roller, and of each web."""
_OF_THE_WEB = ("tension_n", "diameter_m")
"""What is drawn whether or not something else has its unit."""
_LENGTHS = {"mm": 1000.0, "cm": 100.0, "in": 1 / 0.0254}
"""Units of a watched signal in which diameters are drawn, and how many of them are 1 m."""

MOST_OF_PLANTS = 512
"""Most signals of plants, rolls and webs that are followed (decision: a bound, above what a rack can have)."""


class LineRun:
    """Takes what a recording has of a rack: the signals and alarms that are asked for, and all else by itself."""

    def __init__(
        self,
        signals: Sequence[LineSignal],
        alarms: Sequence[LineSignal],
        held: Mapping[str, RecordedSignal] | None = None,
        plants: Iterable[PlantConfig] = (),
    ) -> None:
        """Prepare to take a run of a rack with these plants.

        ``held`` are the commons with the states of loops by those with their currents.
        """
        self.happened, self.marks = Happenings(), ErrorMarks()
        self.scans: Counter[str] = Counter()
        self.errors: Counter[str] = Counter()
        self._signals = signals
        self._watched = {
            signal.label: (signal, Measured(of_memory=signal.kind is not DataType.BOOLEAN)) for signal in signals
        }
        self._held = {label: state for label, state in (held or {}).items() if label in self._watched}
        self._values: dict[str, float] = {}
        self._alarms = {signal.label: (AlarmRun(signal.label, signal.text), Measured()) for signal in alarms}
        self._plants: dict[tuple[str, str], Measured] = {}
        self._webs = WebsFollowed(plants)

    @property
    def names(self) -> Sequence[str]:
        """The signals, the alarms, and the states of loops whose currents are watched."""
        states = (state.variable for state in self._held.values())
        return list(dict.fromkeys((*self._watched, *self._alarms, *states)))

    @property
    def held(self) -> Sequence[str]:
        """The signals that are currents of a loop: they count while it runs."""
        return list(self._held)

    @property
    def types(self) -> Sequence[str]:
        """The types of the messages of plants, rolls and webs."""
        return [NAMES[kind] for kind in _SHOWN]

    def take_values(self, time_ns: int, changed: Mapping[str, Cell]) -> None:
        """Add values that changed; those that are not finite numbers are ignored."""
        time_s = time_ns / NS_PER_S
        values = {label: value for label, value in changed.items() if not isinstance(value, str) and isfinite(value)}
        self._values |= {label: values[label] for label in self._of_loops if label in values}
        for label, state in self._held.items():  # what starts or stops them
            if state.variable in changed and label in self._values:
                values.setdefault(label, self._values[label])
        for label, value in values.items():
            if label in self._alarms:
                alarm, course = self._alarms[label]
                text = alarm.take(time_s, on=value != 0)
                course.take(time_s, float(value))
                if text:
                    self.happened.add_event(time_s, "alarm", text, is_end=not alarm.is_on)
            if label in self._watched:
                signal, course = self._watched[label]
                if self._counts(label):
                    course.take(time_s, signal.value_of(value))
                else:
                    course.pause(time_s)

    @property
    def _of_loops(self) -> Iterable[str]:
        return (*self._held, *(state.variable for state in self._held.values()))

    def _counts(self, label: str) -> bool:
        """Whether a signal counts now: a current of a loop does not in standby (52.2.1)."""
        state = self._held.get(label)
        value = None if state is None else self._values.get(state.variable)
        return state is None or value is None or bool(value) is not state.inverted

    def take_scan(self, time_ns: int, scan: Scan) -> None:
        """Count a scan, and add its errors; number 0 is how the task stood before its first one."""
        self.scans[scan.task] += scan.scan > 0
        if scan.errors:
            self.errors[scan.task] += len(scan.errors)
            self.marks.take(time_ns, scan)
            for error in scan.errors:
                text = f"{scan.task}: {error_text(error.code, error.line)}"
                self.happened.add_event(time_ns / NS_PER_S, "error", text)

    def take_message(self, time_ns: int, message: Any) -> None:
        """Add how a plant or a web stands, or an operation on the rack."""
        time_s = time_ns / NS_PER_S
        if isinstance(message, Operation):
            if text := operation_text(message):
                self.happened.add_event(time_s, "operation", text)
            return
        owner = message.web if isinstance(message, WebState) else message.plant
        for signal in _SHOWN[type(message)]:
            value = getattr(message, signal)
            course = self._plants.get((owner, signal))
            if course is None and len(self._plants) < MOST_OF_PLANTS:
                course = self._plants[owner, signal] = Measured()
            if course is not None and abs(value) <= LARGEST:
                course.take(time_s, value)
        if isinstance(message, PlantState) or not any((owner, signal) in self._plants for signal in _OF_THE_WEB):
            return
        if text := self._webs.take(message):
            self.happened.add_event(time_s, "web", text)

    def finish(self, end_s: float) -> None:
        """End the run: the last values hold to the end."""
        for alarm, course in self._alarms.values():
            alarm.finish(end_s)
            course.numbers.finish(end_s)
        for course in (*(course for _, course in self._watched.values()), *self._plants.values()):
            course.numbers.finish(end_s)

    @property
    def has_webs(self) -> bool:
        """Whether there are webs, or plants with a roll or roller."""
        return any(signal in _OF_THE_WEB for _, signal in self._plants)

    @property
    def alarms(self) -> tuple[AlarmRun, ...]:
        """The alarms in the order of the rack file."""
        return tuple(alarm for alarm, _ in self._alarms.values())

    @property
    def numbers(self) -> tuple[SignalNumbers, ...]:
        """The numbers of the watched signals, then those of plants, rolls and webs."""
        found = [
            SignalNumbers(signal.label, signal.unit, signal.text, course.numbers, signal.kind)
            for signal, course in self._watched.values()
        ]
        found += [
            SignalNumbers(f"{owner}/{signal}", ALL_UNITS[signal], "", course.numbers)
            for (owner, signal), course in self._of_plants
        ]
        return tuple(found)

    @property
    def _of_plants(self) -> list[tuple[tuple[str, str], Measured]]:
        """What plants, rolls and webs have, in this order, unless it is watched."""
        order = [signal for signals in _SHOWN.values() for signal in signals]
        found = [item for item in self._plants.items() if "/".join(item[0]) not in self._watched]
        return sorted(found, key=lambda item: order.index(item[0][1]))

    @property
    def lines(self) -> tuple[Line, ...]:
        """The lines for a picture: watched signals, plants in the background of their unit, then the alarms that came.

        A reference is in front where it has other signals to follow it. What a plant has is left out where no watched
        signal has its unit (decision: the sections of the drives show it), but for the tensions of webs and for
        diameters that change. Tensions come first where there are webs.
        """
        numbers = [signal for signal in self._signals if signal.kind is not DataType.BOOLEAN]
        units = {signal.unit for signal in numbers}
        length = next((signal.unit for signal in numbers if signal.unit in _LENGTHS), "m")
        found: list[Line] = []
        for signal, course in self._watched.values():
            in_front = signal.is_reference and is_followed(signal, numbers)
            role = TraceRole.REFERENCE if in_front else TraceRole.OTHER
            found.append(_line(len(found), signal.label, signal.kind, signal.unit, course, role))
        for (owner, name), course in self._of_plants:
            unit, numbers_of = ALL_UNITS[name], course.numbers
            moves = numbers_of.least < numbers_of.greatest
            if name == "diameter_m" and "m" not in units and length != "m" and moves:
                label = f"{owner}/{name}, in {length}"
                line = _line(len(found), label, DataType.REAL, length, course, TraceRole.BACKGROUND)
                found.append(replace(line, values=line.values * _LENGTHS[length]))
            elif unit in units or (name in _OF_THE_WEB and (moves or name != "diameter_m")):
                role = TraceRole.BACKGROUND if unit in units else TraceRole.OTHER
                found.append(_line(len(found), f"{owner}/{name}", DataType.REAL, unit, course, role))
        for alarm, course in self._alarms.values():
            if alarm.times and alarm.label not in self._watched:
                found.append(_line(len(found), alarm.label, DataType.BOOLEAN, "", course, TraceRole.OTHER))
        if self.has_webs:
            found.sort(key=lambda line: line.variable.unit != ALL_UNITS["tension_n"])
        return tuple(found[:MAX_LINES])


def _line(number: int, label: str, kind: DataType, unit: str, course: Measured, role: TraceRole) -> Line:
    return Line(Watched(label, number, 0, kind, unit), *course.line(), role)
