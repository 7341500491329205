"""A module of any kind in a rack file: its registers, interrupts and tasks."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.rackfile.model.plants import PlantConfig

MIN_PRIORITY, MAX_PRIORITY = 4, 11
"""Priorities of tasks: 4 is served first (J2-3106-1 p. 8-2)."""
MAX_TASKS = 32
"""Most tasks of one Processor (J2-3106-1 p. 2-5)."""


@dataclass(frozen=True)
class TaskConfig:
    """A task of a module: ``file`` is its source, ``priority`` is 4 (first) to 11 on a Processor.

    A UDC's tasks have a ``drive``, A or B, in place of a priority (J2-3106-1 p. 8-2): their ``priority`` is 0 and 1,
    so that A comes before B. A ``critical`` task cannot be stopped alone, only with all others (J2-3106-1 p. 8-2).
    """

    name: str
    file: Path
    priority: int
    line: int = 0
    critical: bool = False
    drive: str = ""


@dataclass(frozen=True)
class Interrupt:
    """An interrupt that a module raises while the common clock of the rack runs.

    ``status`` is its interrupt status and control register (ISCR), which an EVENT names. ``period`` is the register
    with the time between two, less one, in 0.5 ms; None if the module counts in its own way. ``inputs`` are the
    registers that freeze at the interrupt. ``enable`` is a bit of ``status`` that must be set too, None if the EVENT is
    enough.
    """

    status: int
    period: int | None = None
    inputs: range = range(0)
    enable: int | None = None


@dataclass(frozen=True)
class Registers:
    """The registers of a module: their number, and their writers.

    Tasks write ``outputs``. In ``either`` a variable with ``ros: in`` is an input, any other is decided by its task.
    The rest are inputs, except the ``reserved``: they are the module's own, and no point may be on them. REAL variables
    may be on ``reals``. ``copies`` are pairs of a register and the input that shows the same; ``clock_status`` pairs of
    an input and the bits that are set while the common clock runs; ``counters`` are the first of two registers that
    count 24 bits. ``by_itself``: the module writes registers without an interrupt too. ``shown`` are inputs that only
    the module writes: neither ROS 2 nor a feed may. ``commands`` are outputs that only tasks write. A module with drops
    has ``area`` registers for each, 0 meaning no drops, and points may be on those of ``areas``.
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
        """Whether the module writes registers, and so is a writer in the write log."""
        return self.by_itself or bool(self.interrupts)

    @property
    def writable(self) -> Collection[int]:
        """The registers that a task may write."""
        if not self.either:
            return self.outputs
        return frozenset({*self.outputs, *self.either}) if self.outputs else self.either

    def direction(self, register: int) -> str:
        """Return the direction of a register: ``input``, ``output`` or ``either``."""
        if register in self.either:
            return "either"
        return "output" if register in self.outputs else "input"

    def place(self, register: int) -> str:
        """Return a register's name in messages: its number, or its drop and its number there."""
        if not self.area:
            return f"register {register}"
        return f"drop {register // self.area} register {register % self.area}"


NO_REGISTERS = Registers()


@dataclass(frozen=True, kw_only=True)
class ModuleConfig:
    """A module as a rack file configures it; its kind (``rack/modules``) has the rest.

    ``name`` is unique in the rack and that of its node; ``tick_ns`` is that of its tasks, 0 if it can have none;
    ``common_registers`` is how many 16-bit registers of common variables it can hold, 0 for none. ``keeps_locals``:
    STOP ALL and a loss of power leave the locals of its tasks (2.4.5). ``times`` is the model whose execution times its
    tasks have. ``plants`` are those that its drives turn, by drive: ``A`` and ``B`` of a UDC, "" where the module has
    only one. ``drive`` is the slot of the 57C406 whose armature voltage is wired to it.
    """

    slot: int
    model: str
    name: str
    line: int = 0
    tick_ns: int = 0
    tasks: tuple[TaskConfig, ...] = ()
    registers: Registers = NO_REGISTERS
    common_registers: int = 0
    has_battery: bool = False
    keeps_locals: bool = True
    times: Model = Model.NONE
    plants: Mapping[str, PlantConfig] = field(default_factory=dict)
    drive: int | None = None


def cost_model(module: ModuleConfig) -> CostModel:
    """Return the execution times of a module's tasks; those of a UDC differ with one task and with two (table 5)."""
    return CostModel(module.times, alone=len(module.tasks) == 1)
