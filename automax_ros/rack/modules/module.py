"""A module of a running rack and the rack's services: all that the rack, the stream and the nodes know of modules."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rack.tasks.triggers import MakeTrigger
from automax_ros.rackfile.model.module import ModuleConfig, TaskConfig
from automax_ros.runtime.memory.common_clock import CommonClock
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.process_inputs import ProcessInputs
from automax_ros.runtime.memory.registers import Backplane
from automax_ros.runtime.memory.views import Memory
from automax_ros.runtime.scan.drives import Drives
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.scan.execution import Execution
from automax_ros.runtime.tasks.interrupts import Interrupts
from automax_ros.runtime.tasks.task import Task
from automax_ros.runtime.time.scheduler import Scheduler

ModuleState = Mapping[str, Any]
"""State of a module apart from common memory, as numbers, texts, lists and mappings: ``{}`` if it has none."""


class Install(Protocol):
    """Installs a task of a module's configuration."""

    def __call__(
        self,
        task: TaskConfig,
        execution: Execution,
        *,
        memory: Memory | None = None,
        trigger: MakeTrigger | None = None,
        then: Callable[[Task], None] | None = None,
    ) -> ScheduledTask:
        """Return the task, installed; it works on the rack's ``memory`` unless another is given.

        Without ``trigger`` its scans start by the clock, or by the event that SCAN_LOOP names. ``then`` is called after
        each scan, and after its start-up part, when observers were notified.
        """
        ...


@dataclass(frozen=True)
class RackServices:
    """Services of a rack for its modules.

    ``install`` makes their tasks; ``execution`` returns, for a module's name, the execution of its scans.
    ``tell_writes`` reports to observers the writes that were not made by a scan. ``writer`` returns the id under which
    a module writes registers. A 57C406 attaches itself to ``drives``. ``plants`` are those with a motor, by name; the
    rack keeps their states. ``full_speeds`` has the speed (rpm) that a plant's tachometer shows as 4095, by name, if a
    feed brings it in counts.
    """

    memory: CommonMemory
    scheduler: Scheduler
    backplane: Backplane
    events: Events
    clock: CommonClock
    interrupts: Interrupts
    inputs: ProcessInputs
    drives: Drives
    install: Install
    execution: Callable[[str], Execution]
    tell_writes: Callable[[], None]
    writer: Callable[[str], int]
    plants: Mapping[str, DrivePlant]
    full_speeds: Mapping[str, float]


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
        ...

    def power_off(self) -> None:
        """End all its activity."""
        ...

    def stopped_all(self) -> None:
        """React to a STOP ALL: its tasks are stopped, and common memory is cleared except what it ``kept``."""
        ...

    def state(self) -> ModuleState:
        """Return its state apart from common memory."""
        ...

    def load(self, state: ModuleState) -> None:
        """Restore a state, in place of ``power_on``.

        Raises:
            ValueError: the state does not fit.
        """
        ...


@runtime_checkable
class Operable(Protocol):
    """A module with controls for an operator.

    ``controls`` are their names, such as ``test_switch``, with their positions, such as ``A``, ``B`` and ``centre``.
    """

    @property
    def controls(self) -> Mapping[str, tuple[str, ...]]: ...  # noqa: D102

    def operate(self, verb: str, value: str) -> None:
        """Move a control of ``controls`` to one of its positions.

        Raises:
            OperationRefused: it cannot be moved now (rack/operations/operations.py).
        """
        ...


@dataclass
class QuietModule:
    """A module without activity: it has only its registers, if any."""

    config: ModuleConfig
    kept: frozenset[tuple[int, int]] = frozenset()
    tasks: Sequence[ScheduledTask] = field(default=())

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
