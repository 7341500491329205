"""A Processor of a running rack, with its tasks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.rack.modules.module import ModuleState
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.module import ModuleConfig


@dataclass
class ProcessorModule:
    """A Processor with its tasks."""

    config: ModuleConfig
    tasks: Sequence[ScheduledTask]
    kept: frozenset[tuple[int, int]] = frozenset()

    def power_on(self) -> None:
        """Start nothing: the rack puts tasks into RUN, in the order of all its Processors."""

    def power_off(self) -> None:
        """Stop the tasks; locals, tunables and error logs stay (2.4.5)."""
        for task in self.tasks:
            task.stop()

    def stopped_all(self) -> None:
        """Do nothing: locals, tunables and error logs stay (2.4.5)."""

    def state(self) -> ModuleState:
        """Return the state of each task."""
        return {item.task.name: item.state() for item in self.tasks}

    def load(self, state: ModuleState) -> None:
        """Restore the state of each task; those that ran continue with their next scan."""
        if set(state) != {item.task.name for item in self.tasks}:
            raise ValueError(f"{self.config.name} has the tasks {[item.task.name for item in self.tasks]}")
        for item in self.tasks:
            item.load(state[item.task.name])
