"""The configuration of a rack: checked, frozen, without a trace of YAML.

``line`` is the line of the file (from 1) where a thing is defined, for messages that show both places.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from automax_ros.core.kinds import Direction
from automax_ros.core.names import Element, element
from automax_ros.core.types import DataType, Value
from automax_ros.rackfile.model.module import ModuleConfig, Registers, TaskConfig
from automax_ros.rackfile.model.plants import FeedConfig, JointCommand, PlantConfig
from automax_ros.rackfile.model.webs import WebConfig
from automax_ros.rackfile.reading.executive import NEWEST
from automax_ros.rackfile.reading.scale import Scale

MAX_SLOT = 15
"""Highest slot of the largest rack (J2-3106-1 p. 10-2)."""
DEFAULT_OUT_LIMIT = 200
"""Most simple commons, from the top of the file, that are published without `ros` (decision)."""


class Timing(enum.Enum):
    """Duration of scans: no time at all, or the manual's time for their Processor (53)."""

    IDEAL = "ideal"
    MODELED = "modeled"


class ModuleLoss(enum.Enum):
    """Reaction of a distributed rack to the loss of a process: stop all tasks, or continue with the present values."""

    STOP_ALL = "stop_all"
    HOLD = "hold"


@dataclass(frozen=True)
class IoPoint:
    """Place of an I/O point: slot, (first) register, and the bit (0 to 15) of a BOOLEAN."""

    slot: int
    register: int
    bit: int | None = None


@dataclass(frozen=True)
class CommonVariable:
    """One variable of common memory.

    ``name`` includes its type character. ``dimensions`` are numbers of elements (largest subscript + 1), () for a
    simple variable. ``length`` is the longest text of a STRING, 0 for other types. ``preset`` is one value, for an
    array with different values one for each element in the order of memory (last subscript fastest), None if the file
    has none. ``point`` is its place on a module, None for common memory itself. A variable with ``bank`` is all the
    registers of the module in that slot; its name, ``SLOT:5%``, is one that no task can declare. ``scale`` converts its
    counts for ROS 2; without one (None) the topic has the variable's own type.
    """

    name: str
    type: DataType
    dimensions: tuple[int, ...] = ()
    length: int = 0
    non_volatile: bool = False
    preset: Value | tuple[Value, ...] | None = None
    direction: Direction = Direction.CLOSED
    rate_limit_hz: float | None = None
    unit: str = ""
    description: str = ""
    line: int = 0
    point: IoPoint | None = None
    bank: int | None = None
    scale: Scale | None = None

    @property
    def is_array(self) -> bool:
        """Whether the variable has subscripts."""
        return bool(self.dimensions)

    @property
    def elements(self) -> int:
        """Number of its values."""
        count = 1
        for size in self.dimensions:
            count *= size
        return count

    @property
    def registers(self) -> int:
        """16-bit registers it takes; a BOOLEAN counts 1 bit, a STRING its characters and 1 byte (decision)."""
        if self.type is DataType.BOOLEAN:
            return -(-self.elements // 16)
        if self.type is DataType.STRING:
            return self.elements * ((self.length + 2) // 2)
        return self.elements * (1 if self.type is DataType.INTEGER else 2)

    @property
    def presets(self) -> tuple[Value, ...]:
        """The preset of every element, () if there is none."""
        if self.preset is None:
            return ()
        return self.preset if isinstance(self.preset, tuple) else (self.preset,) * self.elements


NO_SUCH_COMMON = "the rack has no common variable"
"""Begins the message about a name that is not that of a common."""
CommonElement = Element[CommonVariable]
"""A simple common variable, or one element of an array."""


@dataclass(frozen=True)
class RackConfig:
    """A rack without errors.

    ``namespace`` is its ROS namespace without the slash, ``path`` the YAML file and ``text`` its content. Modules are
    in the order of slots, variables in the order of the file; after them come the registers of the modules that have
    some, each as one variable with a ``bank``. ``executive`` is the version of the Programming Executive in tenths (42
    is 4.2), ``auto_run`` whether the tasks that ran are put into RUN after a power cycle. ``plants`` and ``webs``
    are in the order of the file, ``feeds`` and ``joint_commands`` in that of their plants and webs. ``watch`` are the
    commons to show, None if the file has no such key, ``alarms`` the booleans that are alarms. ``meant_so`` are
    commons, plants and slots that are as they are on purpose, each with the line of the file that says so.
    """

    name: str
    namespace: str
    path: Path
    text: str
    operator: bool
    modules: tuple[ModuleConfig, ...]
    variables: tuple[CommonVariable, ...]
    execution: Timing = Timing.IDEAL
    executive: int = NEWEST
    auto_run: bool = False
    on_module_loss: ModuleLoss = ModuleLoss.STOP_ALL
    plants: tuple[PlantConfig, ...] = ()
    webs: tuple[WebConfig, ...] = ()
    feeds: tuple[FeedConfig, ...] = ()
    joint_commands: tuple[JointCommand, ...] = ()
    watch: tuple[CommonElement, ...] | None = None
    alarms: tuple[CommonElement, ...] = ()
    meant_so: Mapping[str, int] = field(default_factory=dict)

    @cached_property
    def by_name(self) -> Mapping[str, CommonVariable]:
        """The variables by their full names."""
        return {variable.name: variable for variable in self.variables}

    @property
    def declared(self) -> tuple[CommonVariable, ...]:
        """The variables that the file defines: all but the registers of modules."""
        return tuple(variable for variable in self.variables if variable.bank is None)

    def common(self, name: str) -> CommonElement:
        """Return the simple common, or the element of an array, with a name.

        Raises:
            NameFault: there is none.
        """
        return element(name, self.by_name, NO_SUCH_COMMON)

    def is_input(self, variable: CommonVariable) -> bool:
        """Return whether a variable shows an input: the process sets it, no task may write it."""
        point = variable.point
        if point is None:
            return False
        found = self._directions[point.slot].direction(point.register)
        return found == "input" or (found == "either" and variable.direction is Direction.IN)

    @cached_property
    def _directions(self) -> Mapping[int, Registers]:
        return {module.slot: module.registers for module in self.modules}

    @property
    def task_modules(self) -> tuple[ModuleConfig, ...]:
        """The modules that run tasks."""
        return tuple(module for module in self.modules if module.tick_ns)

    @property
    def placed_tasks(self) -> list[tuple[ModuleConfig, TaskConfig]]:
        """All tasks with their modules: modules in the order of slots, tasks in the order of the file."""
        return [(module, task) for module in self.modules for task in module.tasks]

    @property
    def common_memory_slot(self) -> int:
        """The slot of the module that holds the common variables: the first that can."""
        return next((module.slot for module in self.modules if module.common_registers), 0)


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
