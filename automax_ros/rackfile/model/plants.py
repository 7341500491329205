"""The ``plants`` section of a rack file, in the engineering units of the file.

``line`` is the line of the file where a plant is defined, ``supply`` its AC line.
``build_plants`` makes the plants of a running rack from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from automax_ros.core.json_schema import Schema, named
from automax_ros.drive.base.nameplate import EXAMPLES, NamePlate, derive
from automax_ros.drive.plant.coupling import CoupledPlants, CouplingData
from automax_ros.drive.plant.overspeed import FULL
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData
from automax_ros.drive.web.data import SurfaceData
from automax_ros.rackfile.reading.scale import Scale

PLANT_NAME = r"[A-Z][A-Z0-9_]{0,15}"
"""A plant's name, as a pattern."""
MOTORS = {"dc_10hp_240v": "10hp", "dc_150hp_500v": "150hp", "dc_800hp_700v": "800hp"}
"""Motors that a plant may have by name, each with its name in ``drive/base/nameplate``."""


def plant_name(text: str) -> Schema:
    """Return the schema of a value that names a plant, described by ``text``."""
    return named(text, f"^{PLANT_NAME.replace('A-Z', 'A-Za-z')}$")


@dataclass(frozen=True)
class SupplyConfig:
    """The AC line of a plant, in the units of the keys; None is the usual value for its motor.

    ``standard``: the phases pass in the standard order C, B, A (52.1.5).
    """

    v_ll: float | None = None
    hz: float | None = None
    ls_mh: float | None = None
    rs_mohm: float | None = None
    standard: bool = True


@dataclass(frozen=True)
class LoadConfig:
    """The load of a plant's motor.

    ``torque_nm`` keeps its direction at any speed, positive brakes positive speed. ``torque_per_rpm`` are pairs of rpm
    (ascending) and N m; ``friction_nm`` is Coulomb friction; ``speed_rpm`` the speed at which the shaft is held, 0 for
    a locked rotor, None for a shaft that turns; ``from_ros`` whether ROS 2 may set ``torque_nm``.
    """

    torque_nm: float = 0.0
    torque_per_rpm: tuple[tuple[float, float], ...] = ()
    friction_nm: float = 0.0
    speed_rpm: float | None = None
    from_ros: bool = False


@dataclass(frozen=True)
class CoupleConfig:
    """Coupling of a plant's shaft: the other plant's name, and the data; ``line`` is the line of the file."""

    to: str
    data: CouplingData
    line: int = 0


@dataclass(frozen=True)
class PlantConfig:
    """A plant; ``line`` is the line of the file.

    ``motor`` is a name of ``MOTORS`` or a plate; None for a plant of which only the drive's parameters are known, which
    is not simulated. ``motor_overload_ratio`` is in %, ``inertia`` that of motor and load over the motor's own.
    ``couple`` is None for no coupling, or if the section of the other plant has it; ``joint`` the name of its shaft on
    ROS, "" if that is the plant's name; ``surface`` the roll or roller that its motor turns, None without one.
    """

    name: str
    motor: str | NamePlate | None = None
    motor_overload_ratio: int | None = None
    line: int = 0
    supply: SupplyConfig = field(default_factory=SupplyConfig)
    load: LoadConfig = field(default_factory=LoadConfig)
    inertia: float = 1.0
    couple: CoupleConfig | None = None
    joint: str = ""
    surface: SurfaceData | None = None

    @property
    def joint_name(self) -> str:
        """The name of its shaft on ROS."""
        return self.joint or self.name

    @property
    def line_hz(self) -> float | None:
        """Frequency of its AC line, Hz; None without a motor."""
        plate = self.plate
        return self.supply.hz if self.supply.hz is not None or plate is None else plate.line_hz

    @property
    def plate(self) -> NamePlate | None:
        """The motor's plate, None without a motor."""
        if self.motor is None:
            return None
        return self.motor if isinstance(self.motor, NamePlate) else EXAMPLES[MOTORS[self.motor]]


@dataclass(frozen=True)
class JointCommand:
    """A common that commands of ros2_control write, ``velocity`` or ``effort`` of a joint.

    ``scale`` converts the counts of an INTEGER to rpm or N m; None for a REAL, whose value is in these units.
    """

    plant: str
    joint: str
    interface: str
    common: str
    scale: Scale | None = None
    line: int = 0


@dataclass(frozen=True)
class FeedConfig:
    """A signal that an instrument brings into an element of a common.

    It is one of a plant (``SIGNALS`` of ``drive/plant/signals``), of its roll or roller (``END_SIGNALS`` of
    ``drive/web/signals``), or of a web (``WEB_SIGNALS`` there), whose name ``plant`` then is. ``scale`` converts the
    signal to the counts of an INTEGER; None for a REAL, which has the signal itself, and for a BOOLEAN.
    """

    plant: str
    common: str
    element: int
    signal: str
    every_ns: int
    scale: Scale | None = None
    line: int = 0
    is_of_web: bool = False

    @property
    def owner(self) -> str:
        """What it shows, in words."""
        return f"{'web' if self.is_of_web else 'plant'} {self.plant}"


def full_speeds(feeds: Iterable[FeedConfig]) -> dict[str, float]:
    """Return by plant the speed (rpm) that its tachometer shows as 4095, for those with a feed in counts.

    If a plant has several such feeds, the first counts (decision).
    """
    found: dict[str, float] = {}
    for feed in feeds:
        if feed.signal == "tach_rpm" and feed.scale is not None:
            found.setdefault(feed.plant, abs(feed.scale.value_of(FULL)))
    return found


def build_plants(configs: Iterable[PlantConfig]) -> dict[str, DrivePlant]:
    """Return the plants that have a motor, by name, at rest."""
    found = ((config.name, plant_data(config)) for config in configs)
    return {name: DrivePlant(data) for name, data in found if data is not None}


def couple_plants(plants: Mapping[str, DrivePlant], configs: Iterable[PlantConfig]) -> dict[str, CoupledPlants]:
    """Couple plants at their start; return the couplings by the names of both, ``UNWIND+WINDER``.

    Raises:
        ParameterError: two plants cannot be coupled so.
    """
    return {
        f"{config.name}+{config.couple.to}": CoupledPlants(
            plants[config.name], plants[config.couple.to], config.couple.data
        )
        for config in configs
        if config.couple is not None
    }


def plant_data(config: PlantConfig) -> PlantData | None:
    """Return the data of a plant in SI units, None for one without a motor.

    Raises:
        ParameterError: the plate contradicts itself, or a value is beyond what can be simulated.
    """
    plate, supply, load = config.plate, config.supply, config.load
    if plate is None:
        return None
    if supply.v_ll is not None:
        plate = replace(plate, line_v=supply.v_ll)
    if supply.hz is not None:
        plate = replace(plate, line_hz=supply.hz)
    parameters = derive(plate)
    if supply.ls_mh is not None:
        parameters = replace(parameters, source_h=supply.ls_mh * 1e-3)
    data = PlantData(
        parameters,
        inertia=config.inertia,
        standard_rotation=supply.standard,
        load=LoadData(load.torque_nm, load.torque_per_rpm, load.friction_nm, load.speed_rpm),
    )
    return data if supply.rs_mohm is None else replace(data, resistance_ohm=supply.rs_mohm * 1e-3)
