"""The plant of one drive: its line, bridge, contactor, motor and load, as one thing that passes time (drive.md part C).

A controller commands gates and the contactor; everybody else looks, loads the shaft, or breaks something.
"""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.drive.ac_line import AcLine
from automax_ros.drive.bridge import Bridge
from automax_ros.drive.circuit import Circuit
from automax_ros.drive.meter import Sample
from automax_ros.drive.motor import Motor
from automax_ros.drive.nameplate import DriveParameters
from automax_ros.drive.state import SavedState, Stateful, check_names

PICK_UP_NS, DROP_OUT_NS = 60_000_000, 20_000_000
"""From the relay to closed and to open contacts of the M-contactor, ns (decision)."""
SCR_DROP_V = 1.5
"""Voltage over a conducting SCR, V (decision: 1.2 to 1.6 V are usual)."""


@dataclass(frozen=True)
class PlantData:
    """What a plant is made of; SI units.

    Attributes:
        parameters: the motor, and the line it usually has.
        resistance_ohm: source resistance of a phase.
        inertia: inertia of motor and load over the motor's own.
    """

    parameters: DriveParameters
    resistance_ohm: float = 0.005
    inertia: float = 1.0


class DrivePlant(Stateful):
    """A plant that runs.

    Attributes:
        circuit: line, bridge and motor.
        rated_amps: rated armature current, A.
    """

    _kept = ("_contacts", "_relay")

    def __init__(self, data: PlantData, *, energy: bool = False) -> None:
        """Begin at rest, without current, the contactor open."""
        parameters = data.parameters
        self.data = data
        self.rated_amps = parameters.amps
        self.line = AcLine(
            parameters.line_v,
            parameters.line_hz,
            inductance_h=parameters.source_h,
            resistance_ohm=data.resistance_ohm,
        )
        self.motor = Motor(parameters.motor)
        self.motor.inertia_kg_m2 *= data.inertia
        self.bridge = Bridge(drop_v=SCR_DROP_V)
        self.circuit = Circuit(self.line, self.bridge, self.motor, energy=energy)
        self.circuit.open_contactor()
        self._relay = False
        self._contacts: list[tuple[int, bool]] = []

    @property
    def now_ns(self) -> int:
        """The plant's present, ns."""
        return self.circuit.now_ns

    def advance(self, until_ns: int) -> None:
        """Let time pass to an instant, ns; an instant that has passed is the present."""
        while self._contacts and self._contacts[0][0] <= until_ns:
            at_ns, closed = self._contacts.pop(0)
            self.circuit.advance(max(at_ns, self.circuit.now_ns))
            if closed:
                self.circuit.close_contactor()
            else:
                self.circuit.open_contactor()
        if until_ns > self.circuit.now_ns:
            self.circuit.advance(until_ns)

    def relay(self, *, on: bool) -> None:
        """Turn the contactor's relay on or off, now: the contacts follow."""
        if on != self._relay:
            self._relay = on
            delay = PICK_UP_NS if on else DROP_OUT_NS
            self._contacts = [(self.now_ns + delay, on)]

    def sample(self) -> Sample:
        """Return the integrals since the last call."""
        return self.circuit.sample()

    def state(self) -> SavedState:
        """Return all that its future depends on."""
        return super().state() | {"circuit": self.circuit.state()}

    def restore(self, state: SavedState) -> None:
        """Take a state over.

        Raises:
            ParameterError: it is not the state of such a plant.
        """
        check_names("plant", state, (*self._kept, "circuit"))
        super().restore({name: state[name] for name in self._kept})
        self.circuit.restore(state["circuit"])
