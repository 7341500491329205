"""What can be seen of a plant at an instant."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from automax_ros.drive.plant import DrivePlant
from automax_ros.drive.scr import REVERSE


@dataclass(frozen=True)
class Energies:
    """Energies since the plant was at rest, J; ``line_j`` is the sum of the others, within the model's accuracy.

    ``stored_j`` is in the inductances. ``shaft_j`` became motion: kinetic energy, friction and work of the load.
    """

    line_j: float
    loss_j: float
    stored_j: float
    shaft_j: float


@dataclass(frozen=True)
class PlantSignals:
    """How a plant stands at an instant; SI units, speed in rpm.

    Attributes:
        time_ns: the instant.
        current_a, voltage_v: armature current, and voltage over the armature's terminals.
        torque_nm: torque of the motor in the last interval, N m.
        load_nm: torque of the load at this speed, N m.
        speed_rpm: speed of the shaft.
        angle_rad: its angle.
        field: field current over the rated one.
        bridge: 1 (forward) or 2 (reverse), the bridge that conducts; 0 while none does.
        contactor: whether the contacts are closed.
        line_hz, line_v: frequency of the line, and its voltage from line to line, rms.
        energies: None where they are not metered.
    """

    time_ns: int
    current_a: float
    voltage_v: float
    torque_nm: float
    load_nm: float
    speed_rpm: float
    angle_rad: float
    field: float
    bridge: int
    contactor: bool
    line_hz: float
    line_v: float
    energies: Energies | None


def signals_of(plant: DrivePlant) -> PlantSignals:
    """Return how a plant stands at its present."""
    circuit, motor, line = plant.circuit, plant.motor, plant.line
    conducting = circuit.conducting
    return PlantSignals(
        plant.now_ns,
        circuit.current_a,
        circuit.armature_v,
        motor.torque_n_m,
        motor.load_torque(motor.speed_rad_s),
        motor.speed_rad_s * 30 / pi,
        motor.angle_rad,
        1.0 if motor.field is None else motor.field.current,
        (2 if conducting[-1] in REVERSE else 1) if conducting else 0,
        plant.bridge.wiring.armature_closed,
        line.frequency_hz,
        line.v_ll_v,
        _energies(plant),
    )


def _energies(plant: DrivePlant) -> Energies | None:
    meter = plant.circuit.energy
    if meter is None:
        return None
    return Energies(meter.source_j, meter.loss_j, meter.stored_j, plant.motor.shaft_j)
