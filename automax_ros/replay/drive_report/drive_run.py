"""A drive's recorded run: its signals for a picture, its faults, the sequence of events, and its totals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite

from automax_ros.core.types import DataType
from automax_ros.drive.base.errors import LARGEST
from automax_ros.drive.circuit.scr import FORWARD, PARTNER
from automax_ros.drive.current_loop.faults import KINDS
from automax_ros.drive.current_loop.regulator import FULL
from automax_ros.messages.types.messages import PlantState
from automax_ros.recordings.read.common_log import Watched
from automax_ros.recordings.tables.traces import Line, TraceRole
from automax_ros.replay.drive_report.drive_signals import SPEED_REF, RecordedSignal, ReportDrive
from automax_ros.replay.drive_report.drive_totals import CountTotals, PlantTotals, rpm_of
from automax_ros.replay.drive_report.happenings import MOST_EVENTS, Happenings
from automax_ros.replay.drive_report.numbers import Measured, SignalNumbers

FAULTS = tuple(kind.output.upper() for kind in KINDS)
"""The fault outputs of DC_DRIVE_CML (52.2.2)."""
STATES = {
    "CML_RUN": ("start is requested", "stop is requested"),
    "CML_COAST_STOP": ("coast stop is requested", "coast stop is requested no longer"),
    "CML_TEST": ("test mode is selected", "test mode is selected no longer"),
    "FAULT_RESET": ("fault reset", ""),
    "SYNC_LOCKED": ("the loop is locked to the line", "the loop is not locked to the line"),
    "DC_CML_STATE": ("the drive runs", "the drive is in standby"),
    "BRIDGE_POL": ("bridge 2 is on", "bridge 1 is on"),
}
"""Booleans of a drive and the meanings of their edges, rising and falling."""
DRAWN_STATES = ("CML_RUN", "DC_CML_STATE", "BRIDGE_POL")
STATE = "DC_CML_STATE"
HELD = ("I_FDBK", "REF_LAG_OUT")
"""The currents of a loop, which keep their last values in standby (52.2.1): they count while it runs (decision)."""
SUSPECT = "BAD_SCR_NUM"
"""The output with the number of a suspected SCR: that one or its anti-parallel partner (52.3.1)."""
MOST_BROKEN = 40
"""Most faults of one plant that are followed."""
PERCENT_SPEED, PERCENT_CURRENT, DEGREES = "% of full speed", "% of rated current", "deg"


@dataclass(frozen=True)
class FaultSpan:
    """A fault output that was on from ``begin_s`` to ``end_s``, s of the run, None if it was still on at the end."""

    keyword: str
    variable: str
    text: str
    begin_s: float
    end_s: float | None


@dataclass
class DriveRun:
    """Collects the run of one drive; changes are added in the order of time.

    Attributes:
        drive: the drive.
        counts: totals from its commons.
        plant: totals from its plant's messages.
        faults: fault outputs that were on and are off again; ``finish`` adds the others. ``fault_count`` counts all.
        happened: the events, for the sequence of operations.
        starts, changes: how often it began to run, and how often the bridge changed while it ran.
    """

    drive: ReportDrive
    counts: CountTotals = field(init=False)
    plant: PlantTotals = field(default_factory=PlantTotals)
    faults: list[FaultSpan] = field(default_factory=list)
    happened: Happenings = field(default_factory=Happenings)
    fault_count: int = 0
    starts: int = 0
    changes: int = 0
    _values: dict[str, float] = field(default_factory=dict)
    _courses: dict[tuple[str, str, DataType, TraceRole], Measured] = field(default_factory=dict)
    _begun: dict[str, float] = field(default_factory=dict)
    _time_s: float | None = None
    _broken: tuple[str, ...] = ()
    _contactor: bool | None = None
    _base_rpm: float | None = field(init=False)

    def __post_init__(self) -> None:
        parameters = self.drive.parameters
        self.counts = CountTotals(parameters)
        self._base_rpm = rpm_of(parameters.values["base_speed_rad_s"].value) if parameters is not None else None

    def take(self, time_s: float, changed: Mapping[str, float]) -> None:
        """Add the new values of signals, by keyword, at an instant; a fault comes before its consequences.

        Numbers that no drive can have are ignored.
        """
        self._pass_to(time_s)
        seen = {
            keyword: float(not value) if self.drive.signals[keyword].inverted else float(value)
            for keyword, value in changed.items()
            if abs(value) <= LARGEST
        }
        for keyword, value in sorted(seen.items(), key=_cause_first):
            signal = self.drive.signals[keyword]
            before = self._values.get(keyword)
            self._values[keyword] = value
            self._note(time_s, signal, before, value)
        for keyword in seen:
            self._draw(time_s, self.drive.signals[keyword])
        if STATE in seen:  # what a loop's currents are does not change with it, whether they count does
            for keyword in HELD:
                if keyword in self._values and keyword not in seen:
                    self._draw(time_s, self.drive.signals[keyword])

    def _pass_to(self, time_s: float) -> None:
        if self._time_s is not None and time_s > self._time_s:
            speed = self._values.get("SPEED_FDBK")
            self.counts.pass_time(
                time_s - self._time_s,
                self._percent("I_FDBK"),
                None if speed is None else 100 * speed / FULL,
                running=self.is_running,
            )
        self._time_s = time_s

    @property
    def is_running(self) -> bool:
        """Whether the loop runs; TRUE where that is not recorded."""
        return self._values.get(STATE, 1.0) != 0.0

    def _percent(self, keyword: str) -> float | None:
        """Return a current, % of rated; None if it is unknown."""
        value, lim_bar = self._values.get(keyword), self.drive.lim_bar
        return None if value is None or lim_bar is None else value / FULL * lim_bar

    def _note(self, time_s: float, signal: RecordedSignal, before: float | None, value: float) -> None:
        """Add the event of an edge."""
        keyword, on = signal.keyword, value != 0.0
        if keyword in FAULTS:
            self._note_fault(time_s, signal, on=on)
        elif keyword == SUSPECT and value != before and on:
            number = int(value)
            suspects = f"{number} or {PARTNER[number]}" if number in FORWARD else f"{number}"
            self.happened.add_event(time_s, "fault", f"suspected shorted SCR: {suspects} ({signal.variable})")
            return
        if before is None or (before != 0.0) == on:
            return
        if keyword in STATES:
            text = STATES[keyword][0 if on else 1]
            if text:
                self.happened.add_event(time_s, "state", f"{text} ({signal.variable})")
        if keyword == STATE:
            self.starts += on
        elif keyword == "BRIDGE_POL":
            self.changes += self.is_running

    def _note_fault(self, time_s: float, signal: RecordedSignal, *, on: bool) -> None:
        keyword = signal.keyword
        what = signal.text.removeprefix("fault: ").partition(";")[0]
        if on and keyword not in self._begun:
            self._begun[keyword] = time_s
            self.fault_count += 1
            self.happened.add_event(time_s, "fault", f"fault: {what} ({keyword} {signal.variable})")
        elif not on and keyword in self._begun:
            span = FaultSpan(keyword, signal.variable, what, self._begun.pop(keyword), time_s)
            if len(self.faults) < MOST_EVENTS:
                self.faults.append(span)
            gone = f"no fault any more: {what} ({keyword} {signal.variable})"
            self.happened.add_event(time_s, "fault", gone, is_end=True)

    def _draw(self, time_s: float, signal: RecordedSignal) -> None:
        keyword = signal.keyword
        label = f"{keyword} {signal.variable}"
        if keyword in DRAWN_STATES or keyword in FAULTS:
            self._append(label, "", DataType.BOOLEAN, time_s, self._values[keyword])
        elif keyword in _CONVERSIONS:
            unit, convert = _CONVERSIONS[keyword]
            found = convert(self)
            shown = (unit, found) if found is not None else ("counts", self._values[keyword])
            role = _ROLES.get(keyword, TraceRole.OTHER)
            if keyword in HELD and not self.is_running:
                if (course := self._courses.get((label, shown[0], DataType.REAL, role))) is not None:
                    course.pause(time_s)
                return
            self._append(label, shown[0], DataType.REAL, time_s, shown[1], role)
        elif keyword == SPEED_REF:
            self._draw_reference(label, time_s, signal)
        elif keyword.startswith("register "):
            self._append(label, signal.text or "counts", DataType.REAL, time_s, self._values[keyword])

    def _append(
        self, label: str, unit: str, kind: DataType, time_s: float, value: float, role: TraceRole = TraceRole.OTHER
    ) -> None:
        if isfinite(value):
            key = label, unit, kind, role
            course = self._courses.get(key)
            if course is None:
                course = self._courses[key] = Measured()
            course.take(time_s, value)

    def _draw_reference(self, label: str, time_s: float, signal: RecordedSignal) -> None:
        value = self._values[signal.keyword]
        if signal.scale is not None:
            value = signal.scale.value_of(int(value))
        if signal.is_rpm:
            self._draw_speed(label, time_s, value, TraceRole.REFERENCE)
        else:
            self._append(label, PERCENT_SPEED, DataType.REAL, time_s, 100 * value / FULL, TraceRole.REFERENCE)

    def _draw_speed(self, label: str, time_s: float, rpm: float, role: TraceRole) -> None:
        """Add a speed to the lane of SPEED_FDBK if the motor's base speed is known, else to one in rpm."""
        if self._base_rpm is None:
            self._append(label, "rpm", DataType.REAL, time_s, rpm, role)
        else:
            self._append(label, PERCENT_SPEED, DataType.REAL, time_s, 100 * rpm / self._base_rpm, role)

    def degrees(self) -> float | None:
        """Return DELTA in degrees of the line's period, the measured one if it is recorded."""
        period_us = self._values.get("LINE_PERIOD") or 1e6 / self.drive.line_hz
        return 360 * self._values["DELTA"] / period_us

    def take_plant(self, time_s: float, message: PlantState) -> None:
        """Add a message of the plant; one with numbers that no drive can have is ignored."""
        numbers = (message.current_a, message.current_rms_a, message.speed_rpm, message.duration_s)
        if not all(abs(number) <= LARGEST for number in numbers):
            return
        self.plant.take(message)
        parameters = self.drive.parameters
        self._draw_speed("speed of the plant", time_s, message.speed_rpm, TraceRole.PLANT)
        label = "current of the plant"
        if parameters is None:
            self._append(label, "A", DataType.REAL, time_s, message.current_a, TraceRole.PLANT)
        else:
            current = 100 * message.current_a / parameters.amps
            self._append(label, PERCENT_CURRENT, DataType.REAL, time_s, current, TraceRole.PLANT)
        if "BRIDGE_POL" not in self.drive.signals:
            for number in (1, 2):
                conducts = float(message.bridge == number)
                self._append(f"bridge {number} conducts", "", DataType.BOOLEAN, time_s, conducts)
        self._note_plant(time_s, message)

    def _note_plant(self, time_s: float, message: PlantState) -> None:
        if self._contactor is not None and message.contactor != self._contactor:
            self.happened.add_event(
                time_s, "plant", "the contactor is closed" if message.contactor else "the contactor is open"
            )
        self._contactor = message.contactor
        broken = tuple(message.faults[:MOST_BROKEN])
        for name in broken:
            if name not in self._broken:
                self.happened.add_event(time_s, "plant", f"the plant has {name}")
        for name in self._broken:
            if name not in broken:
                self.happened.add_event(time_s, "plant", f"the plant has {name} no longer")
        self._broken = broken

    def finish(self, end_s: float) -> None:
        """End the run: the last values hold to the end."""
        self._pass_to(end_s)
        for keyword, begin_s in self._begun.items():
            signal = self.drive.signals[keyword]
            what = signal.text.removeprefix("fault: ").partition(";")[0]
            self.faults.append(FaultSpan(keyword, signal.variable, what, begin_s, None))
        self._begun.clear()
        for course in self._courses.values():
            course.numbers.finish(end_s)
        self.faults.sort(key=lambda span: (span.begin_s, FAULTS.index(span.keyword)))

    @property
    def lines(self) -> list[Line]:
        """The lines for a picture: speed, current, DELTA, counts, words of bits, then booleans; each group by role."""
        return [
            Line(Watched(label, number, 0, kind, unit), *self._courses[key].line(), role)
            for number, key in enumerate(self._in_order)
            for label, unit, kind, role in [key]
        ]

    @property
    def numbers(self) -> list[SignalNumbers]:
        """The numbers of what ``lines`` has, but for booleans."""
        return [
            SignalNumbers(label, unit, "", self._courses[key].numbers)
            for key in self._in_order
            for label, unit, kind, _ in [key]
            if kind is not DataType.BOOLEAN
        ]

    @property
    def _in_order(self) -> list[tuple[str, str, DataType, TraceRole]]:
        order = {
            unit: place for place, unit in enumerate((PERCENT_SPEED, "rpm", PERCENT_CURRENT, "A", DEGREES, "counts"))
        }
        return sorted(self._courses, key=lambda key: (not key[1], order.get(key[1], len(order)), key[3]))


def is_shown(keyword: str) -> bool:
    """Whether a report shows the signal of a drive with this keyword, or needs it for another one."""
    return keyword in _NEEDED or keyword in STATES or keyword in FAULTS or keyword.startswith("register ")


def _cause_first(item: tuple[str, float]) -> int:
    keyword, value = item
    return 1 if keyword not in FAULTS else 0 if value else 2


def _speed(run: DriveRun) -> float | None:
    return 100 * run._values["SPEED_FDBK"] / FULL


def _current(keyword: str) -> Callable[[DriveRun], float | None]:
    return lambda run: run._percent(keyword)


_CONVERSIONS: dict[str, tuple[str, Callable[[DriveRun], float | None]]] = {
    "SPEED_FDBK": (PERCENT_SPEED, _speed),
    "REFERENCE": (PERCENT_CURRENT, _current("REFERENCE")),
    "REF_LAG_OUT": (PERCENT_CURRENT, _current("REF_LAG_OUT")),
    "I_FDBK": (PERCENT_CURRENT, _current("I_FDBK")),
    "DELTA": (DEGREES, DriveRun.degrees),
}
"""Numbers that are drawn: unit and conversion; counts are drawn if the scale is unknown."""
_NEEDED = frozenset({*_CONVERSIONS, SPEED_REF, SUSPECT, "LINE_PERIOD"})
_ROLES = {
    "REFERENCE": TraceRole.REFERENCE,
    "REF_LAG_OUT": TraceRole.LAGGED,
    "I_FDBK": TraceRole.FEEDBACK,
    "SPEED_FDBK": TraceRole.FEEDBACK,
}
