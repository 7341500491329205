"""The part of a rack that is in one process: the whole rack, or some modules of a distributed one.

A part has the tasks and plants of its modules; of other modules it has only the registers (``rack/distributed``).
All that has a number (variables, writers) is that of the whole rack.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

from automax_ros.rackfile.model.config import DrivenPlant, RackConfig, driven_plants
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plants import PlantConfig
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

    def is_elsewhere(self, what: str | int) -> bool:
        """Return whether a task or plant (by name) or a module (by slot) is in another process."""
        return what in self._elsewhere

    @cached_property
    def _elsewhere(self) -> frozenset[str | int]:
        return RackPart.of(self.config, None)._names - self._names

    @property
    def _names(self) -> frozenset[str | int]:
        return frozenset[str | int]([*self.slots, *self.tasks, *(plant.name for plant in self.plants)])

    @cached_property
    def driven(self) -> tuple[DrivenPlant, ...]:
        """The plants that its drives turn, by slot and drive."""
        return tuple(item for item in driven_plants(self.config) if item.slot in self.slots)

    @property
    def plants(self) -> list[PlantConfig]:
        """The plants that its drives turn and all plants coupled to them, in the order of the file.

        Plants that no drive turns are in the process with common memory (decision).
        """
        coupled = _find_coupled(self.config.plants)
        slots = {item.name: item.slot for item in driven_plants(self.config)}
        found = []
        for plant in self.config.plants:
            driving = {slots[name] for name in coupled[plant.name] if name in slots} or {self.config.common_memory_slot}
            if driving & self.slots:
                found.append(plant)
        return found

    def elsewhere(self, memory: CommonMemory, backplane: Backplane) -> frozenset[tuple[int, int]]:
        """Return the views and elements of modules in other processes, which decide on their values."""
        found: set[tuple[int, int]] = set()
        for module in self.config.modules:
            bank = backplane.bank(module.slot)
            if bank is not None and module.slot not in self.slots:
                found |= memory.registers.showing(bank.view, range(bank.registers))
        return frozenset(found)


def _find_coupled(plants: Sequence[PlantConfig]) -> dict[str, set[str]]:
    groups = {plant.name: {plant.name} for plant in plants}
    for plant in plants:
        if plant.couple is not None:
            joined = groups[plant.name] | groups[plant.couple.to]
            groups.update(dict.fromkeys(joined, joined))
    return groups
