"""The signals of a plant at an instant: single ones, as instruments show them, and all at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from automax_ros.drive.circuit.scr import REVERSE
from automax_ros.drive.plant.faults import active_faults
from automax_ros.drive.plant.plant import FIELD_AMPS, RAD_S_PER_RPM, DrivePlant


def tach_rpm(plant: DrivePlant) -> float:
    """Return the tachometer's reading, rpm: 0 once it is lost."""
    return 0.0 if "lose_tach" in plant.notes else _rpm(plant)


def _rpm(plant: DrivePlant) -> float:
    return plant.motor.speed_rad_s / RAD_S_PER_RPM


def _field(plant: DrivePlant) -> float:
    return 1.0 if plant.motor.field is None else plant.motor.field.current


SIGNALS: Mapping[str, Callable[[DrivePlant], float]] = {
    "armature_a": lambda plant: plant.circuit.current_a,
    "armature_v": lambda plant: plant.circuit.armature_v,
    "speed_rpm": _rpm,
    "tach_rpm": tach_rpm,
    "torque_nm": lambda plant: plant.motor.k_v_s * plant.circuit.current_a,
    "field_a": lambda plant: _field(plant) * FIELD_AMPS * plant.rated_amps,
    "line_hz": lambda plant: plant.line.frequency_hz,
}
"""Instantaneous values at the plant's present, SI units or rpm, signed; the torque is that of the armature."""


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
    """The state of a plant at an instant; SI units, speed in rpm.

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
        faults: the faults by their names of ``plant/faults``, in the order in which they occurred.
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
    faults: tuple[str, ...]
    energies: Energies | None


def signals_of(plant: DrivePlant) -> PlantSignals:
    """Return the signals of a plant at its present."""
    circuit, motor, line = plant.circuit, plant.motor, plant.line
    conducting = circuit.conducting
    return PlantSignals(
        plant.now_ns,
        circuit.current_a,
        circuit.armature_v,
        motor.torque_n_m,
        motor.load_torque(motor.speed_rad_s),
        _rpm(plant),
        motor.angle_rad,
        _field(plant),
        (2 if conducting[-1] in REVERSE else 1) if conducting else 0,
        plant.is_closed,
        line.frequency_hz,
        line.v_ll_v,
        active_faults(plant),
        _energies(plant),
    )


def _energies(plant: DrivePlant) -> Energies | None:
    meter = plant.circuit.energy
    if meter is None:
        return None
    return Energies(meter.source_j, meter.loss_j, meter.stored_j, plant.motor.shaft_j)
