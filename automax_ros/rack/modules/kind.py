"""What a kind of module is. The loader, the rack, the stream and the nodes know modules only through these protocols.

A kind reads its section of a rack file into a configuration; a configuration builds the module of a running rack.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from automax_ros.compile.cost import CostModel, Model
from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys
from automax_ros.drive.plant import DrivePlant
from automax_ros.rack.findings import Findings
from automax_ros.rack.plants.reading import Plants
from automax_ros.rack.scheduled_task import ScheduledTask
from automax_ros.rack.sections import Section
from automax_ros.rack.task_config import TaskConfig
from automax_ros.rack.tasks import TaskReader
from automax_ros.rack.triggers import MakeTrigger
from automax_ros.running.backplane import Backplane
from automax_ros.running.common_clock import CommonClock
from automax_ros.running.drives import Drives
from automax_ros.running.events import Events
from automax_ros.running.execution import Execution
from automax_ros.running.interrupts import Interrupts
from automax_ros.running.memory import CommonMemory
from automax_ros.running.process_inputs import ProcessInputs
from automax_ros.running.scheduler import Scheduler
from automax_ros.running.task import Task
from automax_ros.running.views import Memory

ModuleState = Mapping[str, Any]
"""What a module keeps next to common memory, as numbers, texts, lists and mappings: ``{}`` where that is nothing."""


@dataclass(frozen=True)
class Interrupt:
    """An interrupt that a module raises while the rack has a common clock.

    ``status`` is its interrupt status and control register (ISCR), which an EVENT names. ``period`` is the register
    with the time between two, less one, in 0.5 ms; None where the module counts in a way of its own. ``inputs`` are
    the registers that freeze at the interrupt. ``enable`` is a bit of ``status`` that must be set too, None where the
    EVENT is enough.
    """

    status: int
    period: int | None = None
    inputs: range = range(0)
    enable: int | None = None


@dataclass(frozen=True)
class Registers:
    """The registers of a module: how many, and who writes them.

    Tasks write ``outputs``. Of ``either`` a variable with ``ros: in`` is an input, any other what its task makes of it.
    The rest are inputs, but for the ``reserved``: they are the module's own, and no point may stand there. ``reals``
    are those on which REAL variables may stand. ``copies`` are pairs of a register and the input that shows the same;
    ``clock_status`` pairs of an input and the bits that are set while there is a common
    clock; ``counters`` are the first of two registers that count 24 bits. ``by_itself``: the module writes registers
    without an interrupt too. ``shown`` are inputs that the module alone writes: neither ROS 2 nor a feed may.
    ``commands`` are outputs that tasks alone write.
    A module with drops has ``area`` registers for each, 0 being none, and points may stand on those of ``areas``.
    """

    count: int = 0
    outputs: Collection[int] = range(0)
    either: Collection[int] = range(0)
    reserved: Collection[int] = range(0)
    reals: Collection[int] = range(0)
    interrupts: tuple[Interrupt, ...] = ()
    copies: tuple[tuple[int, int], ...] = ()
    clock_status: tuple[tuple[int, int], ...] = ()
    counters: tuple[int, ...] = ()
    by_itself: bool = False
    shown: Collection[int] = range(0)
    commands: Collection[int] = range(0)
    area: int = 0
    areas: Collection[int] = range(0)

    @property
    def writes(self) -> bool:
        """Whether the module writes registers, and so is a writer of its own."""
        return self.by_itself or bool(self.interrupts)

    @property
    def writable(self) -> Collection[int]:
        """The registers that a task may write."""
        if not self.either:
            return self.outputs
        return frozenset({*self.outputs, *self.either}) if self.outputs else self.either

    def direction(self, register: int) -> str:
        """Return in a word what a register is: ``input``, ``output`` or ``either``."""
        if register in self.either:
            return "either"
        return "output" if register in self.outputs else "input"

    def place(self, register: int) -> str:
        """Return how messages name a register: by its number, or by its drop and its number there."""
        if not self.area:
            return f"register {register}"
        return f"drop {register // self.area} register {register % self.area}"


NO_REGISTERS = Registers()


class ModuleConfig(Protocol):
    """A module as a rack file configures it. Its kind (``rack/modules``) has the rest.

    ``name`` is unique in the rack and that of its node; ``tick_ns`` is that of its tasks, 0 where it can have none;
    ``common_registers`` is how many 16-bit registers of common variables it can hold, 0 for none.
    """

    @property
    def slot(self) -> int: ...  # noqa: D102

    @property
    def model(self) -> str: ...  # noqa: D102

    @property
    def line(self) -> int: ...  # noqa: D102

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def tick_ns(self) -> int: ...  # noqa: D102

    @property
    def tasks(self) -> tuple[TaskConfig, ...]: ...  # noqa: D102

    @property
    def registers(self) -> Registers: ...  # noqa: D102

    @property
    def common_registers(self) -> int: ...  # noqa: D102

    @property
    def has_battery(self) -> bool: ...  # noqa: D102

    @property
    def keeps_locals(self) -> bool:
        """Whether its tasks keep their locals at STOP ALL and without power (2.4.5)."""
        ...

    @property
    def times(self) -> Model:
        """Whose execution times its tasks have, Model.NONE for a module without tasks."""
        ...

    def build(self, parts: Parts) -> Module:
        """Return the module of a running rack."""
        ...


def cost_model(module: ModuleConfig) -> CostModel:
    """Return what times the tasks of a module have; a UDC with one task has others than one with two (table 5)."""
    return CostModel(module.times, alone=len(module.tasks) == 1)


@dataclass(frozen=True)
class FoundModule:
    """A module of a rack file as its kind reads it; ``where`` names it in messages.

    ``executive`` is the version of the Programming Executive in tenths (``rack/executive.py``).
    """

    slot: int
    model: str
    section: Section
    where: str
    span: Span
    tasks: TaskReader
    findings: Findings
    executive: int
    plants: Plants


@dataclass(frozen=True)
class Standing:
    """A module as the rules of places see it: all modules whose number is known, right in the rest or not."""

    slot: int
    model: str
    kind: ModuleKind
    span: Span


@dataclass(frozen=True)
class Arrangement:
    """All modules of a rack file. Unless ``complete``, one could not be read and may be the one that a rule misses.

    ``modules`` are the configurations of those that could be read, in the order of slots.
    """

    standing: Sequence[Standing]
    complete: bool
    span: Span
    findings: Findings
    modules: Sequence[ModuleConfig] = ()

    def of(self, kind: ModuleKind) -> list[Standing]:
        """Return the modules of one kind, in the order of slots."""
        return sorted((item for item in self.standing if item.kind is kind), key=lambda item: item.slot)


class ModuleKind(Protocol):
    """A kind of module: what a rack file may say of it, and where it may stand.

    ``word`` names the kind in messages; ``models`` are its catalogue numbers, each with what it is.
    """

    @property
    def word(self) -> str: ...  # noqa: D102

    @property
    def models(self) -> Mapping[str, str]: ...  # noqa: D102

    @property
    def options(self) -> Keys:
        """The keys of its section with the schemas of their values, ``module`` left out."""
        ...

    def read(self, found: FoundModule) -> ModuleConfig | None:
        """Read a module's section; what is wrong goes to the findings, None where no module can be made of it."""
        ...

    def check_places(self, rack: Arrangement) -> None:
        """Report modules of this kind that stand where none can, or that are missing."""
        ...


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
class Parts:
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
            OperationRefused: it cannot be moved now (rack/operations.py).
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
