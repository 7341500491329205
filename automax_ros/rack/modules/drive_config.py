"""The 57C406 as a rack file configures it: its slot, and the plant that it drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from automax_ros.core.json_schema import Keys
from automax_ros.rack.modules.configured import Registers
from automax_ros.rack.modules.io_config import IoModel, WithoutTasks
from automax_ros.rack.modules.kind import Arrangement, FoundModule
from automax_ros.rack.plants.config import plant_name

if TYPE_CHECKING:
    from automax_ros.rack.plants.config import PlantConfig

TACH_THRESHOLD, PHASE_STEP, PERIOD_STEP, OPTIONS = 4136, 4137, 4138, 4146
"""The registers that an application may write (52.7)."""
DEFAULTS = {TACH_THRESHOLD: 109, PHASE_STEP: 4, PERIOD_STEP: 2, OPTIONS: 0}
"""What initialisation of the CML task writes to them (52.4.1, 52.5.1, 52.6.2, 52.7)."""
ACCESS_NS = 5_000
"""By how much an access of the application delays the microprocessor, ns (52.7, decision: no manual says how much)."""
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
