"""The 57C406 as a rack file configures it: its slot, and the plant that it drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from automax_ros.core.json_schema import Keys
from automax_ros.rack.modules.drive_controller import DEFAULTS, DriveControllerModule
from automax_ros.rack.modules.io_config import IoModel, WithoutTasks
from automax_ros.rack.modules.kind import Arrangement, FoundModule, Module, Parts, Registers
from automax_ros.rack.plants.config import plant_name

if TYPE_CHECKING:
    from automax_ros.rack.plants.config import PlantConfig

_COUNT = max(DEFAULTS) + 1
_REGISTERS = Registers(
    _COUNT,
    outputs=frozenset(DEFAULTS),
    reserved=frozenset(range(_COUNT)) - frozenset(DEFAULTS),
    by_itself=True,
)


@dataclass(frozen=True)
class DriveConfig(WithoutTasks):
    """A 57C406; without a ``plant`` it has registers and switches only, and its loop sees no line."""

    slot: int
    model: str
    plant: PlantConfig | None = None
    line: int = 0

    registers: Registers = _REGISTERS

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node."""
        return f"drive_{self.slot}"

    @property
    def plants(self) -> Mapping[str, PlantConfig]:
        """The plant of its one drive."""
        return {} if self.plant is None else {"": self.plant}

    def build(self, parts: Parts) -> Module:
        """Return the module of a running rack."""
        plant = None if self.plant is None else parts.plants.get(self.plant.name)
        full_rpm = None if self.plant is None else parts.full_speeds.get(self.plant.name)
        return DriveControllerModule(self, parts, plant, full_rpm)


class DriveControllerKind:
    """What a rack file may say of a 57C406."""

    word = "drive I/O controller"
    table: Mapping[str, IoModel] = MappingProxyType({"57C406": IoModel("drive I/O controller module", _REGISTERS)})
    models: Mapping[str, str] = MappingProxyType({number: model.title for number, model in table.items()})
    options: Keys = MappingProxyType({"plant": plant_name("The plant that the module drives.")})

    def read(self, found: FoundModule) -> DriveConfig:
        """Read the plant."""
        node = found.section.get("plant")
        what = f"plant of {found.where}"
        plant = None if node is None else found.plants.claim(node, what)
        if node is not None and plant is not None and plant.motor is None and not found.findings.errors:
            found.findings.add("AMX6522", f"{what}: the plant {plant.name} has no motor", node.span)
        return DriveConfig(found.slot, found.model, plant, found.span.line)

    def check_places(self, rack: Arrangement) -> None:
        """Find nothing wrong: no source tells of a slot where a 57C406 may not stand."""


DRIVE_CONTROLLER = DriveControllerKind()
