"""Sums over a drive's recorded run: rms current, energies, greatest values; from its plant, or from counts."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan, pi, sqrt

from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.messages.types.messages import PlantState

J_PER_KWH = 3.6e6


@dataclass
class PlantTotals:
    """The totals of a plant's messages. Energies are those from the first message to the last.

    Attributes:
        time_s: the time over which means are taken.
        greatest_a: greatest mean of a sample, A, as a magnitude.
        greatest_rpm: greatest speed, rpm, as a magnitude.
    """

    messages: int = 0
    time_s: float = 0.0
    greatest_a: float = 0.0
    greatest_rpm: float = 0.0
    _square: float = 0.0
    _first: PlantState | None = None
    _last: PlantState | None = None

    def take(self, message: PlantState) -> None:
        """Add a message; the time before the first one is not counted."""
        self.messages += 1
        self.greatest_rpm = max(self.greatest_rpm, abs(message.speed_rpm))
        self._last = message
        if self._first is None:
            self._first = message
            return
        self.time_s += message.duration_s
        self._square += message.current_rms_a**2 * message.duration_s
        self.greatest_a = max(self.greatest_a, abs(message.current_a))

    @property
    def rms_a(self) -> float:
        """Rms of the armature current, A; 0 without time."""
        return sqrt(self._square / self.time_s) if self.time_s > 0 else 0.0

    def energy_j(self, name: str) -> float:
        """Return the increase of an energy, J, by its field's name such as ``line_j``; NaN if it is not metered."""
        if self._first is None or self._last is None:
            return nan
        return float(getattr(self._last, name) - getattr(self._first, name))

    @property
    def metered(self) -> bool:
        """Whether energies are known."""
        return not isnan(self.energy_j("line_j"))


@dataclass
class CountTotals:
    """The totals of the counts of current and speed: each holds until it changes, the current is 0 in standby.

    Attributes:
        parameters: motor and line, None if they are unknown: then there are no energies.
        time_s: the time since the first count of current.
        run_s: the part of it in which the drive ran.
        greatest: greatest current, % of rated, as a magnitude.
        greatest_speed: greatest speed, % of full speed, as a magnitude.
        heat_j: I^2 R of the armature.
        shaft_j: torque of the motor times speed, 100 % speed being base speed.
    """

    parameters: DriveParameters | None = None
    time_s: float = 0.0
    run_s: float = 0.0
    greatest: float = 0.0
    greatest_speed: float = 0.0
    heat_j: float = 0.0
    shaft_j: float = 0.0
    _square: float = 0.0

    def pass_time(self, seconds: float, current: float | None, speed: float | None, *, running: bool) -> None:
        """Add a time with a current in % of rated and a speed in % of full speed, None if they are unknown."""
        if speed is not None:
            self.greatest_speed = max(self.greatest_speed, abs(speed))
        if current is None:
            return
        self.time_s += seconds
        if not running:
            return
        self.run_s += seconds
        self.greatest = max(self.greatest, abs(current))
        self._square += current**2 * seconds
        if self.parameters is not None:
            motor = self.parameters.motor
            amps = current / 100 * self.parameters.amps
            self.heat_j += motor.resistance_ohm * amps**2 * seconds
            if speed is not None:
                base = self.parameters.values["base_speed_rad_s"].value
                self.shaft_j += motor.k_v_s * amps * base * speed / 100 * seconds

    @property
    def rms(self) -> float:
        """Rms of the current over the whole time, % of rated."""
        return sqrt(self._square / self.time_s) if self.time_s > 0 else 0.0

    @property
    def rms_in_run(self) -> float:
        """Rms of the current while the drive ran, % of rated."""
        return sqrt(self._square / self.run_s) if self.run_s > 0 else 0.0


def rpm_of(rad_s: float) -> float:
    """Return a speed in rpm."""
    return rad_s * 30 / pi
