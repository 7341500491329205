"""A module of a running rack: all that the rack, the stream and the nodes know of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.module import ModuleConfig

ModuleState = Mapping[str, Any]
"""State of a module apart from common memory, as numbers, texts, lists and mappings: ``{}`` if it has none."""


class Module(Protocol):
    """A module of a running rack. ``tasks`` are in the order in which they start: priority, then name."""

    @property
    def config(self) -> ModuleConfig: ...  # noqa: D102

    @property
    def tasks(self) -> Sequence[ScheduledTask]: ...  # noqa: D102

    @property
    def kept(self) -> frozenset[tuple[int, int]]:
        """Views and elements that it keeps when STOP ALL or a restart clears memory, such as its inputs."""
        ...

    def power_on(self) -> None:
        """Start its activity now, at the scheduler's time."""

    def power_off(self) -> None:
        """End all its activity."""

    def stopped_all(self) -> None:
        """React to a STOP ALL: its tasks are stopped, and common memory is cleared except what it ``kept``."""

    def state(self) -> ModuleState:
        """Return its state apart from common memory."""
        ...

    def load(self, state: ModuleState) -> None:
        """Restore a state, in place of ``power_on``; ValueError if it does not fit."""


@runtime_checkable
class Operable(Protocol):
    """A module with controls for an operator: ``controls`` are their names with their positions."""

    @property
    def controls(self) -> Mapping[str, tuple[str, ...]]: ...  # noqa: D102

    def operate(self, verb: str, value: str) -> None:
        """Move a control to one of its positions; OperationRefused if it cannot be moved now."""


@dataclass
class QuietModule:
    """A module without activity: it has only its registers, if any. Others derive from it."""

    config: ModuleConfig
    kept: frozenset[tuple[int, int]] = frozenset()
    tasks: Sequence[ScheduledTask] = ()

    def power_on(self) -> None:
        """Start nothing."""

    def power_off(self) -> None:
        """End nothing."""

    def stopped_all(self) -> None:
        """Do nothing."""

    def state(self) -> ModuleState:
        """Return an empty state: its registers are in common memory."""
        return {}

    def load(self, state: ModuleState) -> None:
        """Restore nothing."""


class ProcessorModule(QuietModule):
    """A Processor: the rack puts its tasks into RUN. Locals, tunables, error logs stay without power (2.4.5)."""

    def power_off(self) -> None:
        """Stop the tasks."""
        for task in self.tasks:
            task.stop()

    def state(self) -> ModuleState:
        """Return the state of each task."""
        return {item.task.name: item.state() for item in self.tasks}

    def load(self, state: ModuleState) -> None:
        """Restore the state of each task; those that ran continue. ValueError if it does not fit the tasks."""
        if set(state) != {item.task.name for item in self.tasks}:
            raise ValueError(f"{self.config.name} has the tasks {[item.task.name for item in self.tasks]}")
        for item in self.tasks:
            item.load(state[item.task.name])
