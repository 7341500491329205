"""The plant of one drive: its line, bridge, contactor, motor and load, advanced together (docs/plants.md).

A controller commands gates and the contactor; all others read values, load the shaft, or cause faults. An observer
measures means over its own times, and energies; measuring changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import inf, pi, sqrt
from typing import Final

from automax_ros.drive.base.errors import LARGEST, require
from automax_ros.drive.base.motor import FieldWinding, Motor
from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.drive.base.state import SavedState, Stateful, check_names
from automax_ros.drive.circuit.ac_line import AcLine, Rotation
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.meter import EnergyMeter, Sample
from automax_ros.drive.plant.sync_signal import SyncSignal

_Sums = tuple[float, float, float, float]
PICK_UP_NS: Final = 25_000_000
DROP_OUT_NS: Final = 20_000_000
"""From the relay to closed and to open contacts of the M-contactor, ns (decision: of the 180 ms from a start to the run
that 52.3.1 tells of, the shorted SCR test leaves it 30)."""
SCR_DROP_V: Final = 1.5
"""Voltage over a conducting SCR, V (decision: 1.2 to 1.6 V are usual)."""
FIELD_TAU_S: Final = 0.5
FIELD_KNEE: Final = 0.5
"""Time constant of the field (s) and knee of its saturation (decision: 0.2 to 3 s by size and 0.5 are usual)."""
FIELD_AMPS: Final = 0.015
"""Rated field current over rated armature current (decision: a field of 1 to 2 % of the power is usual)."""
RAD_S_PER_RPM: Final = pi / 30


@dataclass(frozen=True)
class Means:
    """Means over a past time.

    Attributes:
        duration_s: its length, s; all values are 0 where it is 0.
        current_a: mean armature current, A; positive from bridge 1.
        current_rms_a: rms of the armature current, A.
        voltage_v: mean voltage over the armature's terminals, V; the EMF counts while no current flows.
    """

    duration_s: float = 0.0
    current_a: float = 0.0
    current_rms_a: float = 0.0
    voltage_v: float = 0.0


class PlantMeter:
    """Means from one reading to the next, whatever samples of the circuit are fetched meanwhile; energies."""

    def __init__(self, circuit: Circuit) -> None:
        """Create the meter at the circuit's present; meter its energies too, unless they are already."""
        self._circuit = circuit
        if circuit.energy is None:
            circuit.energy = EnergyMeter()
        self._sums = (0.0, 0.0, 0.0, 0.0)
        self._last = _sums(circuit.present_sample())

    def add(self, sample: Sample) -> None:
        """Add a sample that was fetched from the circuit."""
        one, two, three, four = _sums(sample)
        sums = self._sums
        self._sums = sums[0] + one, sums[1] + two, sums[2] + three, sums[3] + four

    def look(self) -> Means:
        """Return the means since the last reading."""
        present = _sums(self._circuit.present_sample())
        duration, charge, square, volt_s = (
            sums + now - last for sums, now, last in zip(self._sums, present, self._last, strict=True)
        )
        self._sums, self._last = (0.0, 0.0, 0.0, 0.0), present
        if duration <= 0.0:
            return Means()
        return Means(duration, charge / duration, sqrt(max(square, 0.0) / duration), volt_s / duration)


def _sums(sample: Sample) -> _Sums:
    return sample.duration_s, sample.charge_c, sample.square_a2s, sample.volt_s


@dataclass(frozen=True)
class LoadData:
    """The load of a motor.

    Attributes:
        torque_nm: a torque that keeps its direction at any speed, N m; positive brakes positive speed. A value set from
            outside replaces it.
        torque_per_rpm: pairs of rpm and N m, rpm ascending: straight lines between them, level beyond them. A table
            that begins at 0 or above counts for both directions: it brakes (decision).
        friction_nm: Coulomb friction, N m, which also holds the shaft at rest.
        held_rpm: the speed at which the shaft is held, 0 for a locked rotor; None for one that turns.
    """

    torque_nm: float = 0.0
    torque_per_rpm: tuple[tuple[float, float], ...] = ()
    friction_nm: float = 0.0
    held_rpm: float | None = None

    def torque_at(self, rpm: float) -> float:
        """Return the table's torque at a speed, N m."""
        table = self.torque_per_rpm
        if rpm < 0.0 <= table[0][0]:
            return -self.torque_at(-rpm)
        if rpm <= table[0][0]:
            return table[0][1]
        for (low, below), (high, above) in pairwise(table):
            if rpm <= high:
                return below + (above - below) * (rpm - low) / (high - low)
        return table[-1][1]


@dataclass(frozen=True)
class PlantData:
    """The data of a plant; SI units.

    Attributes:
        parameters: the motor, and its line's voltage, frequency and inductance.
        resistance_ohm: source resistance of a phase.
        inertia: inertia of motor and load over the motor's own.
        standard_rotation: whether the line's phases pass in the order C, B, A. Such a line is connected so that the
            drive's terminals T1, T2, T3 carry C, B, A; one of the other rotation is connected alike (decision).
        load: the motor's load.
    """

    parameters: DriveParameters
    resistance_ohm: float = 0.005
    inertia: float = 1.0
    standard_rotation: bool = True
    load: LoadData = field(default_factory=LoadData)


class DrivePlant(Stateful):
    """A plant that runs.

    Attributes:
        circuit: line, bridge and motor.
        rated_amps: rated armature current, A.
        rated_v: nominal line-to-line voltage, V rms.
        meter: the observer's meter, None while there is none.
        notes: the faults, as the verbs of ``plant/faults`` that caused them.
        sag: percentage of the line's voltage that a sag leaves.
        sag_end_ns: end of the sag of the line's voltage (ns), 0 where no end is known.
        usual_hz: the line's frequency apart from a generator's transient, Hz.
        sync: the sync signal of the line.
    """

    _kept = ("_contacts", "_relay", "_load_nm", "notes", "sag", "sag_end_ns", "usual_hz")

    def __init__(self, data: PlantData, *, energy: bool = False) -> None:
        parameters = data.parameters
        self.data = data
        self.rated_amps = parameters.amps
        self.rated_v = parameters.line_v
        self.line = AcLine(
            parameters.line_v,
            parameters.line_hz,
            inductance_h=parameters.source_h,
            resistance_ohm=data.resistance_ohm,
            rotation=Rotation.ABC if data.standard_rotation else Rotation.CBA,
        )
        self._load_nm = data.load.torque_nm
        self.motor = self._motor()
        self.bridge = Bridge(drop_v=SCR_DROP_V)
        self.circuit = Circuit(self.line, self.bridge, self.motor, energy=energy)
        self.circuit.open_contactor()
        self.meter: PlantMeter | None = None
        self._relay = False
        self._contacts: list[tuple[int, bool]] = []
        self.notes: list[str] = []
        self.sag = 100.0
        self.sag_end_ns = 0
        self.usual_hz = parameters.line_hz
        self.sync = SyncSignal()
        self._together: Callable[[int], None] | None = None

    def _motor(self) -> Motor:
        data, load = self.data.parameters.motor, self.data.load
        motor = Motor(
            replace(data, coulomb_n_m=data.coulomb_n_m + load.friction_nm),
            load=self._torque if load.torque_per_rpm else self._load_nm,
            speed_rad_s=(load.held_rpm or 0.0) * RAD_S_PER_RPM,
            held=load.held_rpm is not None,
            field=FieldWinding(tau_s=FIELD_TAU_S, knee=FIELD_KNEE),
        )
        motor.inertia_kg_m2 *= self.data.inertia
        return motor

    def _torque(self, speed_rad_s: float) -> float:
        return self._load_nm + self.data.load.torque_at(speed_rad_s / RAD_S_PER_RPM)

    @property
    def load_torque_nm(self) -> float:
        """The load torque that keeps its direction, N m: the configured one until another is set."""
        return self._load_nm

    @load_torque_nm.setter
    def load_torque_nm(self, torque_nm: float) -> None:
        self._load_nm = require("load torque in N m", torque_nm, -LARGEST, LARGEST)
        if not self.data.load.torque_per_rpm:
            self.motor.load = self._load_nm

    @property
    def now_ns(self) -> int:
        """The plant's present, ns."""
        return self.circuit.now_ns

    def advance(self, until_ns: int) -> None:
        """Advance to an instant, ns, coupled plants too; an instant in the past counts as the present."""
        if self._together is not None:
            self._together(until_ns)
        else:
            self.advance_alone(until_ns)

    def advance_alone(self, until_ns: int) -> None:
        """Advance to an instant, ns, without what it goes together with: for that alone."""
        circuit = self.circuit
        while self._contacts and self._contacts[0][0] <= until_ns:
            circuit.advance(max(self._contacts[0][0], circuit.now_ns))
            self.switch_contacts()
        if until_ns > circuit.now_ns:
            circuit.advance(until_ns)

    def go_together(self, advance: Callable[[int], None]) -> None:
        """Set the function that advances this plant together with others; see ``plant/coupling`` and ``web/chain``."""
        self._together = advance

    @property
    def contacts_ns(self) -> float:
        """Instant at which the contactor's contacts move next, ns; infinite while they rest."""
        return self._contacts[0][0] if self._contacts else inf

    def switch_contacts(self) -> None:
        """Move the contacts, now."""
        if self._contacts.pop(0)[1]:
            self.circuit.close_contactor()
        else:
            self.circuit.open_contactor()

    def relay(self, *, on: bool) -> None:
        """Turn the contactor's relay on or off, now: the contacts follow."""
        if on != self._relay:
            self._relay = on
            delay = PICK_UP_NS if on else DROP_OUT_NS
            self._contacts = [(self.now_ns + delay, on)]

    def sample(self) -> Sample:
        """Return the integrals since the last call."""
        sample = self.circuit.sample()
        if self.meter is not None:
            self.meter.add(sample)
        return sample

    @property
    def is_closed(self) -> bool:
        """Whether the contactor's contacts touch; an arc does not count."""
        wiring = self.bridge.wiring
        return wiring.armature_closed and not wiring.armature_arc_v

    def begin_metering(self) -> None:
        """Meter means and energies from now on; the plant's behavior stays the same, bit for bit."""
        self.meter = PlantMeter(self.circuit)

    def state(self) -> SavedState:
        """Return all that its future depends on."""
        return super().state() | {"circuit": self.circuit.state(), "sync": self.sync.state()}

    def restore(self, state: SavedState) -> None:
        """Restore a state; raises ParameterError if it is not the state of such a plant."""
        check_names("plant", state, (*self._kept, "circuit", "sync"))
        super().restore({name: state[name] for name in self._kept})
        # Whether energies are metered is up to the observer, and nothing else depends on it.
        self.circuit.energy = None if state["circuit"].get("energy") is None else EnergyMeter()
        self.circuit.restore(state["circuit"])
        self.sync.restore(state["sync"])
        if self.meter is not None:
            self.begin_metering()
