"""What an observer measures of a plant: means over a time of its own, and energies. Measuring changes nothing."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from automax_ros.drive.circuit import Circuit
from automax_ros.drive.meter import EnergyMeter, Sample


@dataclass(frozen=True)
class Means:
    """Means of a time that has passed.

    Attributes:
        duration_s: how long it was, s; all is 0 where it is 0.
        current_a: mean armature current, A; positive from bridge 1.
        current_rms_a: rms of the armature current, A.
        voltage_v: mean voltage over the armature's terminals, V; the EMF counts while no current flows.
    """

    duration_s: float = 0.0
    current_a: float = 0.0
    current_rms_a: float = 0.0
    voltage_v: float = 0.0


class PlantMeter:
    """Means over the times between one look and the next, whoever takes samples of the circuit meanwhile; energies."""

    def __init__(self, circuit: Circuit) -> None:
        """Begin at the circuit's present, with metering its energies too, unless it does already."""
        self._circuit = circuit
        if circuit.energy is None:
            circuit.energy = EnergyMeter()
        self._sums = (0.0, 0.0, 0.0, 0.0)
        self._told = _sums(circuit.present_sample())

    def add(self, sample: Sample) -> None:
        """Count a sample that somebody has taken."""
        one, two, three, four = _sums(sample)
        sums = self._sums
        self._sums = sums[0] + one, sums[1] + two, sums[2] + three, sums[3] + four

    def look(self) -> Means:
        """Return the means since the look before."""
        present = _sums(self._circuit.present_sample())
        duration, charge, square, volt_s = (
            sums + now - told for sums, now, told in zip(self._sums, present, self._told, strict=True)
        )
        self._sums, self._told = (0.0, 0.0, 0.0, 0.0), present
        if duration <= 0.0:
            return Means()
        return Means(duration, charge / duration, sqrt(max(square, 0.0) / duration), volt_s / duration)


_Sums = tuple[float, float, float, float]


def _sums(sample: Sample) -> _Sums:
    return sample.duration_s, sample.charge_c, sample.square_a2s, sample.volt_s
