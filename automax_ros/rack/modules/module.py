"""A module of a running rack, and what the rack gives to it. The rack, the stream and the nodes know no more of one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rack.tasks.triggers import MakeTrigger
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.task import TaskConfig
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
"""What a module keeps next to common memory, as numbers, texts, lists and mappings: ``{}`` where that is nothing."""


class Install(Protocol):
    """Makes a task of a module's configuration."""

    def __call__(
        self,
        task: TaskConfig,
        execution: Execution,
        *,
        memory: Memory | None = None,
        trigger: MakeTrigger | None = None,
        then: Callable[[Task], None] | None = None,
    ) -> ScheduledTask:
        """Return the task, installed; it works on the rack's ``memory`` unless it has another.

        Without ``trigger`` its scans begin by the clock, or by the event that SCAN_LOOP names. ``then`` is called after
        each scan, and after its start-up part, when observers were told.
        """
        ...


@dataclass(frozen=True)
class RackServices:
    """What a rack gives to its modules.

    ``install`` makes their tasks; ``execution`` makes, by a module's name, what executes them. ``tell_writes`` tells
    observers of writes that no scan has made. ``writer`` returns the id under which a module writes registers.
    A 57C406 attaches itself to ``drives``.
    ``plants`` are those with a motor, by name; the rack keeps their states. ``full_speeds`` has the speed (rpm) that a
    plant's tachometer shows as 4095, by name, where a feed brings it in counts.
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
    """A module of a running rack. ``tasks`` stand in the order in which they start: priority, then name."""

    @property
    def config(self) -> ModuleConfig: ...  # noqa: D102

    @property
    def tasks(self) -> Sequence[ScheduledTask]: ...  # noqa: D102

    @property
    def kept(self) -> frozenset[tuple[int, int]]:
        """The views and elements that it keeps when STOP ALL or a restart clears memory, such as its inputs."""
        ...

    def power_on(self) -> None:
        """Begin what it does by itself, at the scheduler's present."""
        ...

    def power_off(self) -> None:
        """End all that it does by itself."""
        ...

    def stopped_all(self) -> None:
        """Follow a STOP ALL: its tasks are stopped, and common memory is cleared but for what it ``kept``."""
        ...

    def state(self) -> ModuleState:
        """Return what it keeps apart from common memory."""
        ...

    def load(self, state: ModuleState) -> None:
        """Take over a state, in place of ``power_on``.

        Raises:
            ValueError: the state does not fit.
        """
        ...


@runtime_checkable
class Operable(Protocol):
    """A module with controls that a person moves.

    ``controls`` are their names, such as ``test_switch``, with their positions, such as ``A``, ``B`` and ``centre``.
    """

    @property
    def controls(self) -> Mapping[str, tuple[str, ...]]: ...  # noqa: D102

    def operate(self, verb: str, value: str) -> None:
        """Move a control of ``controls`` to one of its positions.

        Raises:
            OperationRefused: it cannot be moved now (rack/operate/operations.py).
        """
        ...


@dataclass
class QuietModule:
    """A module that does nothing by itself: its registers, if it has some, are all there is."""

    config: ModuleConfig
    kept: frozenset[tuple[int, int]] = frozenset()
    tasks: Sequence[ScheduledTask] = field(default=())

    def power_on(self) -> None:
        """Nothing begins."""

    def power_off(self) -> None:
        """Nothing ends."""

    def stopped_all(self) -> None:
        """Nothing follows."""

    def state(self) -> ModuleState:
        """Return nothing: its registers are in common memory."""
        return {}

    def load(self, state: ModuleState) -> None:
        """Take over nothing."""
