"""The three-phase line: variable voltage and frequency, rotation, source impedance, missing phases.

In every segment the phase voltages are sinusoids of constant amplitude and frequency, so the circuit has a closed
solution. A line at rest is one segment. While frequency or voltage changes, segments are short (``SEGMENT_NS``) and use
its mean over the segment: the angle at the end of each is exact and continuous. Within a segment the angle is off by at
most pi rate segment^2 / 4 (6e-6 rad at 28 Hz/s), and a voltage that settles with tau by segment / (2 tau) of its
remaining change.
"""

from __future__ import annotations

import enum
import heapq
from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, cos, exp, fmod, pi, sin, sqrt
from typing import Final

from automax_ros.drive.base.errors import LARGEST, ParameterError, require
from automax_ros.drive.base.state import SavedState, Stateful, check_names
from automax_ros.drive.circuit.scr import PHASES

SEGMENT_NS: Final = 500_000
"""Longest segment while voltage or frequency changes, ns."""
REBASE_NS: Final = 1_000_000_000
"""The angle is counted from an instant at most this long ago, so that no digits are lost over days, ns."""
LOWEST_HZ: Final = 48.0
HIGHEST_HZ: Final = 62.0


class Rotation(enum.Enum):
    """The order in which the phases pass their maximum."""

    ABC = 1
    CBA = -1


@dataclass
class _Course(Stateful):
    """A quantity that approaches a target at a constant rate (1/s) or with a time constant (s)."""

    value: float
    target: float
    rate: float = 0.0
    tau_s: float = 0.0

    @property
    def moving(self) -> bool:
        return self.value != self.target

    def move(self, target: float, rate: float = 0.0, tau_s: float = 0.0) -> None:
        self.target, self.rate, self.tau_s = target, rate, tau_s
        if not rate and not tau_s:
            self.value = target

    def longest_s(self) -> float:
        """The time for which the present law applies (s): a ramp ends at its target."""
        return abs(self.target - self.value) / self.rate if self.rate else 1e9

    def after(self, time_s: float) -> float:
        way = self.target - self.value
        if self.rate:
            moved = self.rate * time_s
            return self.target if moved >= abs(way) else self.value + (moved if way > 0 else -moved)
        return self.target - way * exp(-time_s / self.tau_s)

    def mean(self, time_s: float) -> float:
        """The mean over the next ``time_s``, within which a ramp does not end."""
        if self.rate:
            return (self.value + self.after(time_s)) / 2
        x = time_s / self.tau_s
        return self.target - (self.target - self.value) * (1 - exp(-x)) / x

    def advance(self, time_s: float) -> None:
        self.value = self.after(time_s)
        if abs(self.value - self.target) <= 1e-7 * abs(self.target):
            self.value = self.target


_Course._kept = ("value", "target", "rate", "tau_s")


Change = tuple[str, float, float, float]
"""A change: ``frequency`` or ``voltage`` with target, rate and time constant; ``lose`` or ``restore`` with a phase."""


class AcLine(Stateful):
    """A three-phase line with isolated neutral; belongs to one circuit, which advances it.

    Phase x has the voltage ``amplitude_v cos(angle + shift[x])`` to the neutral; A's shift is 0, B's -120 degrees on
    a line that rotates A, B, C.
    """

    _kept = ("start_ns", "start_angle", "omega", "amplitude_v", "next_change_ns", "_serial", "_pending")

    def __init__(
        self,
        v_ll_v: float,
        frequency_hz: float = 60.0,
        *,
        inductance_h: float = 0.0,
        resistance_ohm: float = 0.0,
        rotation: Rotation = Rotation.ABC,
        missing: Iterable[int] = (),
        angle_rad: float = 0.0,
    ) -> None:
        """Create the line at 0 ns.

        Args:
            v_ll_v: line-to-line voltage, V rms.
            frequency_hz: 48 to 62 Hz.
            inductance_h: source inductance of each phase, H, 0 for instantaneous commutation.
            resistance_ohm: source resistance of each phase, ohm.
            rotation: the order of the phases.
            missing: phases (0, 1, 2) that are missing from the start.
            angle_rad: the angle at 0 ns, rad: phase A is at its maximum where the angle is 0.

        Raises:
            ParameterError: a value outside its range.
        """
        self.inductance_h = require("source inductance in H", inductance_h, 0.0, LARGEST)
        self.resistance_ohm = require("source resistance in ohm", resistance_ohm, 0.0, LARGEST)
        self.rotation = rotation
        third = -2 * pi / 3 * rotation.value
        self.shift = (0.0, third, -third)
        self._frequency = _Course(_frequency(frequency_hz), frequency_hz)
        self._voltage = _Course(_voltage(v_ll_v), v_ll_v)
        self.missing = {_phase(phase) for phase in missing}
        self._pending: list[tuple[int, int, str, float, float, float]] = []
        self._serial = 0
        self.start_ns = 0
        self.start_angle = angle_rad
        self.omega = 0.0
        self.amplitude_v = 0.0
        self.next_change_ns = 0
        self._begin_segment()

    @property
    def frequency_hz(self) -> float:
        """The frequency at the start of the present segment, Hz."""
        return self._frequency.value

    @property
    def v_ll_v(self) -> float:
        """The line-to-line voltage at the start of the present segment, V rms."""
        return self._voltage.value

    def angle(self, time_ns: float) -> float:
        """Return the line's angle (rad) at an instant of the present segment, not reduced to one turn."""
        return self.start_angle + self.omega * ((time_ns - self.start_ns) * 1e-9)

    def phase_voltage(self, phase: int, time_ns: float) -> float:
        """Return the source voltage of a phase to the neutral (V) at an instant of the present segment."""
        return self.amplitude_v * cos(self.angle(time_ns) + self.shift[phase])

    def instant_of(self, angle_rad: float, after_ns: int) -> int:
        """Return the first instant at or after ``after_ns`` (ns) at which the line has an angle, if nothing changes."""
        ahead = fmod(angle_rad - self.angle(after_ns), 2 * pi)
        if ahead < -1e-9:
            ahead += 2 * pi
        return after_ns + max(0, round(ahead / self.omega * 1e9))

    def step_frequency(self, at_ns: int, frequency_hz: float) -> None:
        """Change the frequency at an instant; the angle stays continuous."""
        self._schedule(at_ns, ("frequency", _frequency(frequency_hz), 0.0, 0.0))

    def drift_frequency(self, at_ns: int, frequency_hz: float, rate_hz_s: float) -> None:
        """Ramp the frequency to another from an instant on, at a rate above 0 (Hz/s)."""
        require("rate of the frequency in Hz/s", rate_hz_s, 0.0, above=True)
        self._schedule(at_ns, ("frequency", _frequency(frequency_hz), rate_hz_s, 0.0))

    def settle_frequency(self, at_ns: int, frequency_hz: float, tau_s: float) -> None:
        """Settle the frequency to another from an instant on, with a time constant above 0 (s)."""
        require("time constant in s", tau_s, 0.0, above=True)
        self._schedule(at_ns, ("frequency", _frequency(frequency_hz), 0.0, tau_s))

    def step_voltage(self, at_ns: int, v_ll_v: float) -> None:
        """Change the line-to-line voltage (V rms) at an instant."""
        self._schedule(at_ns, ("voltage", _voltage(v_ll_v), 0.0, 0.0))

    def settle_voltage(self, at_ns: int, v_ll_v: float, tau_s: float) -> None:
        """Settle the line-to-line voltage (V rms) to another from an instant on, with a time constant above 0 (s)."""
        require("time constant in s", tau_s, 0.0, above=True)
        self._schedule(at_ns, ("voltage", _voltage(v_ll_v), 0.0, tau_s))

    @property
    def is_moving(self) -> bool:
        """Whether voltage or frequency is changing, or a change is pending."""
        return self._frequency.moving or self._voltage.moving or bool(self._pending)

    def generator_transient(
        self,
        at_ns: int,
        dip: float,
        frequency_dip_hz: float,
        fall_s: float,
        recovery_s: float,
        *,
        volts: float | None = None,
        hertz: float | None = None,
    ) -> None:
        """Imitate a load step on a generator: voltage and frequency sag with one time constant, then recover.

        Args:
            at_ns: instant of the load step, ns.
            dip: the part of the voltage that is lost, 0 to below 1.
            frequency_dip_hz: the sag of the frequency, Hz.
            fall_s: time constant of the sag, s; the recovery begins after three of them (decision).
            recovery_s: time constant of the recovery, s.
            volts: the voltage from which it sags and to which it recovers, V rms; None for its present target.
            hertz: the same for the frequency, Hz.
        """
        require("dip of the voltage", dip, 0.0, 0.99)
        volts = self._voltage.target if volts is None else volts
        hertz = self._frequency.target if hertz is None else hertz
        turn_ns = at_ns + round(3 * fall_s * 1e9)
        self.settle_voltage(at_ns, volts * (1 - dip), fall_s)
        self.settle_frequency(at_ns, hertz - frequency_dip_hz, fall_s)
        self.settle_voltage(turn_ns, volts, recovery_s)
        self.settle_frequency(turn_ns, hertz, recovery_s)

    def cancel(self, what: str) -> None:
        """Cancel the posted changes of ``frequency`` or ``voltage`` that have not begun."""
        self._pending = [change for change in self._pending if change[2] != what]
        heapq.heapify(self._pending)

    def lose_phase(self, at_ns: int, phase: int) -> None:
        """Open a phase (0, 1, 2) of the line at an instant; the circuit determines how its current ends."""
        self._schedule(at_ns, ("lose", _phase(phase), 0.0, 0.0))

    def restore_phase(self, at_ns: int, phase: int) -> None:
        """Close a phase (0, 1, 2) again."""
        self._schedule(at_ns, ("restore", _phase(phase), 0.0, 0.0))

    def advance(self, time_ns: int) -> None:
        """Advance to an instant that is not beyond ``next_change_ns``, and begin a segment there."""
        passed_s = (time_ns - self.start_ns) * 1e-9
        self.start_angle = fmod(self.start_angle + self.omega * passed_s, 2 * pi)
        self.start_ns = time_ns
        for course in (self._frequency, self._voltage):
            if course.moving:
                course.advance(passed_s)
        while self._pending and self._pending[0][0] <= time_ns:
            self._change(*heapq.heappop(self._pending)[2:])
        self._begin_segment()

    def _begin_segment(self) -> None:
        moving = [course for course in (self._frequency, self._voltage) if course.moving]
        length_ns = REBASE_NS
        if moving:
            longest_s = min(course.longest_s() for course in moving)
            length_ns = min(SEGMENT_NS, max(1, ceil(longest_s * 1e9)))
        end_ns = self.start_ns + length_ns
        if self._pending:
            end_ns = min(end_ns, self._pending[0][0])
        self.next_change_ns = max(end_ns, self.start_ns)
        time_s = max(end_ns - self.start_ns, 1) * 1e-9
        hertz, volts = self._frequency, self._voltage
        self.omega = 2 * pi * (hertz.mean(time_s) if hertz.moving else hertz.value)
        self.amplitude_v = sqrt(2 / 3) * (volts.mean(time_s) if volts.moving else volts.value)

    def state(self) -> SavedState:
        """Return the angle, the pending changes, the missing phases, and the courses of voltage and frequency."""
        courses = {"frequency": self._frequency.state(), "voltage": self._voltage.state()}
        return super().state() | courses | {"missing": sorted(self.missing)}

    def restore(self, state: SavedState) -> None:
        """Restore a state; raises ParameterError if it is not the state of a line."""
        check_names("line", state, (*self._kept, "frequency", "voltage", "missing"))
        super().restore({name: state[name] for name in self._kept})
        self._frequency.restore(state["frequency"])
        self._voltage.restore(state["voltage"])
        self.missing = {_phase(phase) for phase in state["missing"]}

    def _change(self, what: str, target: float, rate: float, tau_s: float) -> None:
        if what == "lose":
            self.missing.add(int(target))
        elif what == "restore":
            self.missing.discard(int(target))
        else:
            (self._frequency if what == "frequency" else self._voltage).move(target, rate, tau_s)

    def _schedule(self, at_ns: int, change: Change) -> None:
        if at_ns < self.start_ns:
            raise ParameterError(
                f"a change of the line at {at_ns} ns lies before its present segment, {self.start_ns} ns"
            )
        self._serial += 1
        heapq.heappush(self._pending, (at_ns, self._serial, *change))
        self.next_change_ns = min(self.next_change_ns, at_ns)

    def unit_wave(self, phase: int) -> tuple[float, float]:
        """Return a phase's voltage per volt of amplitude as factors of cos and sin of the line's angle."""
        return cos(self.shift[phase]), -sin(self.shift[phase])


def _frequency(hertz: float) -> float:
    return require("frequency in Hz", hertz, LOWEST_HZ, HIGHEST_HZ)


def _voltage(volts: float) -> float:
    return require("line-to-line voltage in V", volts, 0.0, LARGEST)


def _phase(phase: int) -> int:
    if phase not in range(3):
        raise ParameterError(f"there is no phase {phase}; 0, 1, 2 are {', '.join(PHASES)}")
    return phase
