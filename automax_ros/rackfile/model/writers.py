"""The writers of common memory: the ids of tasks, and of sources outside the tasks, in the write log."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.core.kinds import WriterKind
from automax_ros.rackfile.model.config import RackConfig


@dataclass(frozen=True)
class WriterSpec:
    """One writer: ``slot`` is that of its module, the common memory's for sources outside the tasks."""

    id: int
    name: str
    kind: WriterKind
    slot: int

    @property
    def is_task(self) -> bool:
        """Whether it is a task of the rack."""
        return self.kind is WriterKind.TASK


PRESET_WRITER, ROS_WRITER, OPERATOR_WRITER = 0, 1, 2
_FIRST_TASK = 3


def writers_of(config: RackConfig) -> tuple[WriterSpec, ...]:
    """Return all writers of a rack by their ids: outside sources, tasks by slot and name, modules, plants.

    Only modules with interrupts, or with ``by_itself``, write registers; only plants with feeds write.
    """
    memory_slot = config.common_memory_slot
    outside = [
        WriterSpec(PRESET_WRITER, "rack", WriterKind.PRESET, memory_slot),
        WriterSpec(ROS_WRITER, "ros", WriterKind.ROS, memory_slot),
        WriterSpec(OPERATOR_WRITER, "operator", WriterKind.OPERATOR, memory_slot),
    ]
    tasks = [
        (module.slot, task.name)
        for module in config.modules
        for task in sorted(module.tasks, key=lambda task: task.name)
    ]
    modules = [(module.slot, module.name) for module in config.modules if module.registers.writes]
    plants = [(memory_slot, plant) for plant in dict.fromkeys(feed.plant for feed in config.feeds)]
    first = _FIRST_TASK + len(tasks)
    return (
        *outside,
        *(WriterSpec(number, name, WriterKind.TASK, slot) for number, (slot, name) in enumerate(tasks, _FIRST_TASK)),
        *(WriterSpec(number, name, WriterKind.IO, slot) for number, (slot, name) in enumerate(modules, first)),
        *(
            WriterSpec(number, name, WriterKind.PLANT, slot)
            for number, (slot, name) in enumerate(plants, first + len(modules))
        ),
    )
