"""What the tests of plants share: plants by their motors, and a bridge that fires them at a constant angle."""

from math import radians

from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.circuit.firing import ConstantAlpha
from automax_ros.drive.plant.faults import execute_verb, values_of
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData

MS = 1_000_000
S = 1_000_000_000
LOCKED = LoadData(held_rpm=0.0)


def plant_of(motor: str = "150hp", *, energy: bool = False, **data) -> DrivePlant:
    return DrivePlant(PlantData(derive(EXAMPLES[motor]), **data), energy=energy)


def closed(plant: DrivePlant) -> DrivePlant:
    """Close the contactor and wait for it."""
    plant.relay(on=True)
    plant.advance(plant.now_ns + 100 * MS)
    return plant


def fired(plant: DrivePlant, alpha_deg: float, until_ns: int, *, bridge: int = 1) -> DrivePlant:
    """Fire a bridge at an angle up to an instant."""
    ConstantAlpha(plant.circuit, radians(alpha_deg), bridge=bridge).advance(until_ns)
    return plant


def do(plant: DrivePlant, verb: str, text: str) -> None:
    """Execute a verb on a plant with values from a text."""
    execute_verb(plant, verb, values_of(verb, text))
