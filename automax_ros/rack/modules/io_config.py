"""What all I/O modules have in common: registers that stand in a table, no keys of their own, no tasks, any slot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from automax_ros.compile.cost import Model
from automax_ros.core.json_schema import Keys
from automax_ros.rack.modules.configured import Registers
from automax_ros.rack.modules.kind import Arrangement, FoundModule
from automax_ros.rack.task_config import TaskConfig


class WithoutTasks:
    """What the configuration of a module says that runs no tasks and holds no common variables of its own."""

    tick_ns = 0
    times = Model.NONE
    has_battery = False
    keeps_locals = True
    common_registers = 0

    @property
    def tasks(self) -> tuple[TaskConfig, ...]:
        """No tasks."""
        return ()


@dataclass(frozen=True)
class IoConfig(WithoutTasks):
    """An I/O module in any slot; ``node`` begins its name."""

    slot: int
    model: str
    node: str
    registers: Registers
    line: int = 0

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node."""
        return f"{self.node}_{self.slot}"


@dataclass(frozen=True)
class IoModel:
    """One catalogue number: what the module is, and its registers."""

    title: str
    registers: Registers


@runtime_checkable
class HasTable(Protocol):
    """A kind of module whose catalogue numbers each have registers of their own."""

    @property
    def table(self) -> Mapping[str, IoModel]: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class IoKind:
    """A kind of module of which a rack file says nothing but its number and its slot."""

    word: str
    node: str
    table: Mapping[str, IoModel]
    models: Mapping[str, str] = field(init=False)
    options: Keys = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Derive what the other kinds say for themselves."""
        titles = {number: model.title for number, model in self.table.items()}
        object.__setattr__(self, "models", MappingProxyType(titles))

    def read(self, found: FoundModule) -> IoConfig:
        """Read the section, which has no keys of its own."""
        return IoConfig(found.slot, found.model, self.node, self.table[found.model].registers, found.span.line)

    def check_places(self, rack: Arrangement) -> None:
        """Find nothing wrong: no source tells of a slot where these modules may not stand."""
