"""The part of a rack that is in one process: the whole rack, or some modules of a distributed one.

A part has the tasks and plants of its modules; of other modules it has only the registers (``rack/distributed``).
All that has a number (variables, writers) is that of the whole rack.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

from automax_ros.rackfile.model.config import DrivenPlant, RackConfig, driven_plants
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plants import PlantConfig
from automax_ros.rackfile.model.webs import WebConfig, joined_plants
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.registers import Backplane


@dataclass(frozen=True)
class RackPart:
    """The modules in ``slots`` of a rack."""

    config: RackConfig
    slots: frozenset[int]

    @classmethod
    def of(cls, config: RackConfig, slots: Collection[int] | None) -> RackPart:
        """Return the part with the modules in ``slots``, the whole rack for None; ValueError if a slot is empty."""
        there = frozenset(module.slot for module in config.modules)
        chosen = there if slots is None else frozenset(slots)
        if not chosen <= there:
            raise ValueError(f"rack {config.name} has no module in slot {min(chosen - there)}")
        return cls(config, chosen)

    @property
    def is_whole(self) -> bool:
        """Whether all modules are in this process."""
        return len(self.slots) == len(self.config.modules)

    @property
    def holds_common_memory(self) -> bool:
        """Whether common memory is in this process, which then serves the rack's commons, tables and operators."""
        return self.config.common_memory_slot in self.slots

    @property
    def modules(self) -> list[ModuleConfig]:
        """Its modules, by slot."""
        return [module for module in self.config.modules if module.slot in self.slots]

    @property
    def tasks(self) -> list[str]:
        """The names of its tasks."""
        return [task.name for module in self.modules for task in module.tasks]

    def is_elsewhere(self, kind: str, what: str | int) -> bool:
        """Return whether a ``task``, ``plant``, ``web`` (by name) or ``module`` (by slot) is in another process."""
        return what in self._elsewhere[kind]

    @cached_property
    def _elsewhere(self) -> dict[str, frozenset[str | int]]:
        return {kind: names - self._owned[kind] for kind, names in RackPart.of(self.config, None)._owned.items()}

    @property
    def _owned(self) -> dict[str, frozenset[str | int]]:
        return {
            "module": frozenset(self.slots),
            "task": frozenset(self.tasks),
            "plant": frozenset(plant.name for plant in self.plants),
            "web": frozenset(web.name for web in self.webs),
        }

    @cached_property
    def driven(self) -> tuple[DrivenPlant, ...]:
        """The plants that its drives turn, by slot and drive."""
        return tuple(item for item in driven_plants(self.config) if item.slot in self.slots)

    @property
    def plants(self) -> list[PlantConfig]:
        """The plants that its drives turn, and all that webs and couplings join to them, in the order of the file.

        Plants that no drive turns are in the process with common memory (decision).
        """
        joined = joined_plants(self.config.plants, self.config.webs)
        slots = {item.name: item.slot for item in driven_plants(self.config)}
        found = []
        for plant in self.config.plants:
            driving = {slots[name] for name in joined[plant.name] if name in slots} or {self.config.common_memory_slot}
            if driving & self.slots:
                found.append(plant)
        return found

    @property
    def webs(self) -> list[WebConfig]:
        """The webs between its plants, in the order of the file."""
        names = {plant.name for plant in self.plants}
        return [web for web in self.config.webs if web.start in names]

    def elsewhere(self, memory: CommonMemory, backplane: Backplane) -> frozenset[tuple[int, int]]:
        """Return the views and elements of modules in other processes, which decide on their values."""
        found: set[tuple[int, int]] = set()
        for module in self.config.modules:
            bank = backplane.bank(module.slot)
            if bank is not None and module.slot not in self.slots:
                found |= memory.registers.showing(bank.view, range(bank.registers))
        return frozenset(found)
