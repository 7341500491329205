"""The plants that the drives of a rack turn."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.plants import PlantConfig


@dataclass(frozen=True)
class DrivenPlant:
    """A plant that a drive turns: its name, the slot of the drive's module, and ``A`` or ``B`` of a UDC, else ""."""

    config: PlantConfig
    slot: int
    drive: str = ""

    @property
    def name(self) -> str:
        """The plant's name."""
        return self.config.name


def driven_plants(config: RackConfig) -> tuple[DrivenPlant, ...]:
    """Return the simulated plants that drives turn, in the order of slots and drives."""
    found = (
        DrivenPlant(plant, module.slot, drive)
        for module in config.modules
        for drive, plant in sorted(module.plants.items())
    )
    return tuple(item for item in found if item.config.motor is not None)
