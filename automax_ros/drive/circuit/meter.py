"""Measurements over a time: the exact integrals that a controller samples, and the energies."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import TYPE_CHECKING, Final

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.base.totals import add_up
from automax_ros.drive.circuit.waves import Moments, Wave, WavePiece, bound

if TYPE_CHECKING:
    from automax_ros.drive.circuit.ac_line import AcLine
    from automax_ros.drive.circuit.network import Impedances, Network
    from automax_ros.drive.circuit.wiring import Wiring


_STEEPEST: Final = 3.0
"""Largest ratio of a current's peak to its mean while it flows that is looked for (decision)."""


class Sample:
    """Exact integrals since the previous sample.

    Attributes:
        duration_s: the time since then, s.
        charge_c: integral of the armature current, A s.
        volt_s: integral of the voltage over the armature's terminals, V s; the EMF counts while no current flows.
        zero_current_s: time without armature current, s (DC_TIME).
        overlap_s: time in which a rail had two or three phases, s.
    """

    __slots__ = ("_highest", "_pieces", "_square", "charge_c", "duration_s", "overlap_s", "volt_s", "zero_current_s")

    def __init__(
        self,
        duration_s: float,
        charge_c: float,
        volt_s: float,
        zero_current_s: float,
        overlap_s: float,
        square: float,
        pieces: list[WavePiece],
        highest_a: float = inf,
    ) -> None:
        self.duration_s = duration_s
        self.charge_c = charge_c
        self.volt_s = volt_s
        self.zero_current_s = zero_current_s
        self.overlap_s = overlap_s
        self._square = square
        self._pieces = pieces
        self._highest = highest_a

    @property
    def mean_current_a(self) -> float:
        """Mean armature current, A."""
        return self.charge_c / self.duration_s if self.duration_s else 0.0

    @property
    def mean_voltage_v(self) -> float:
        """Mean voltage over the armature's terminals, V."""
        return self.volt_s / self.duration_s if self.duration_s else 0.0

    def exceeds(self, level_a: float) -> bool:
        """Return whether the magnitude of the current was above a level (A) at some instant.

        Only the last 64 intervals are checked (those that the circuit keeps).
        """
        if self._highest < level_a:
            return False
        conducting_s = self.duration_s - self.zero_current_s
        # No pulse of a bridge has a larger ratio of peak to mean than this: most samples need no search.
        if conducting_s <= 0.0 or abs(self.charge_c) * _STEEPEST < level_a * conducting_s:
            return False
        return any(bound(piece) > level_a and max(map(abs, piece.extremes())) > level_a for piece in self._pieces)

    @property
    def rms_current_a(self) -> float:
        """Root mean square of the armature current, A; computed on demand."""
        return sqrt(max(self.square_a2s, 0.0) / self.duration_s) if self.duration_s else 0.0

    @property
    def square_a2s(self) -> float:
        """Integral of the square of the armature current, A2 s; computed on demand."""
        return self._square + add_up([piece.square() for piece in self._pieces])


@dataclass
class EnergyMeter(Stateful):
    """Energies since the start, J: ``source_j = loss_j + stored_j + shaft_j``.

    Attributes:
        source_j: from the three phase voltages.
        resistance_j: lost in the armature's and the source's resistance.
        drop_j: lost in the drop of SCRs.
        arc_j: lost in arcs of opening phases and of the contactor.
        emf_j: delivered to the EMF, as the circuit computes it.
        stored_j: in the inductances, above the value at the start.
    """

    source_j: float = 0.0
    resistance_j: float = 0.0
    drop_j: float = 0.0
    arc_j: float = 0.0
    emf_j: float = 0.0
    stored_j: float = 0.0

    @property
    def loss_j(self) -> float:
        """The total heat, J."""
        return self.resistance_j + self.drop_j + self.arc_j

    def add(
        self,
        net: Network,
        line: AcLine,
        z: Impedances,
        wiring: Wiring,
        emf_v: float,
        interval: tuple[float, float, float, float],
        modes: tuple[float, float, float],
    ) -> None:
        """Add one interval.

        Args:
            net: the circuit of the interval.
            line: the line in this segment.
            z: the circuit's constants.
            wiring: the circuit's faults.
            emf_v: the EMF, V.
            interval: angle of the line at the start, duration (s), k and a of the armature current.
            modes: decaying parts of the three phases' source modes at the start, A.
        """
        theta, duration, k, a = interval
        if not net.modes:
            if net.active:
                moments = Moments(theta, line.omega, net.decay, inf, duration)
                self._add_one(net, line, z, wiring, emf_v, (net.c, net.d, k, a, 0.0), moments)
            return
        if not net.active:
            k = a = 0.0
        moments = Moments(theta, line.omega, net.decay, net.decay_s, duration)
        current: Wave = (net.c, net.d, k, a, 0.0) if net.active else (0.0, 0.0, 0.0, 0.0, 0.0)
        charge = moments.single(current)
        heat = z.r * moments.square(current)
        drop = -net.rail_offset * charge
        for x in range(3):
            share = net.share[x]
            wave: Wave = (share * net.c + net.phase_c[x], share * net.d + net.phase_d[x],
                          share * k + net.phase_k[x], share * a, modes[x])  # fmt: skip
            cosine, sine = line.unit_wave(x)
            self.source_j += moments.with_voltage(wave, line.amplitude_v * cosine, line.amplitude_v * sine)
            heat += z.rs * moments.square(wave)
            through = moments.single(wave)
            drop += (net.offsets[x] - wiring.phase_arc_v[x]) * through
            self.arc_j += wiring.phase_arc_v[x] * through
        self._count(heat, drop, charge, emf_v, wiring)

    def _add_one(
        self, net: Network, line: AcLine, z: Impedances, wiring: Wiring, emf_v: float, current: Wave, moments: Moments
    ) -> None:
        """Add an interval in which one current flows, through the armature and a phase of each rail: most of them."""
        charge, square = moments.single(current), moments.square(current)
        heat = z.r * square
        drop = -net.rail_offset * charge
        volts_c = volts_d = 0.0
        share_a, share_b, share_c = net.share
        offset_a, offset_b, offset_c = net.offsets
        arc_a, arc_b, arc_c = wiring.phase_arc_v
        for x in range(3):
            # Written out: compiled, a tuple's numbers are quick to read only at constant indexes.
            if x == 0:
                share, offset, arc_v = share_a, offset_a, arc_a
            elif x == 1:
                share, offset, arc_v = share_b, offset_b, arc_b
            else:
                share, offset, arc_v = share_c, offset_c, arc_c
            if share:
                cosine, sine = line.unit_wave(x)
                volts_c += share * cosine
                volts_d += share * sine
                heat += z.rs * share * share * square
                drop += (offset - arc_v) * share * charge
                self.arc_j += arc_v * share * charge
        self.source_j += moments.with_voltage(current, line.amplitude_v * volts_c, line.amplitude_v * volts_d)
        self._count(heat, drop, charge, emf_v, wiring)

    def _count(self, heat: float, drop: float, charge: float, emf_v: float, wiring: Wiring) -> None:
        """Add the energies of a charge through the armature, given the heat and the loss in SCR drops, J."""
        self.arc_j += wiring.armature_arc_v * charge
        self.resistance_j += heat
        self.drop_j += drop
        self.emf_j += emf_v * charge


EnergyMeter._kept = ("source_j", "resistance_j", "drop_j", "arc_j", "emf_j", "stored_j")
