"""The interface of a kind of module: how its section of a rack file becomes a configuration, and its allowed slots."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys
from automax_ros.rackfile.model.module import ModuleConfig, Registers, TaskConfig
from automax_ros.rackfile.reading.values import ProblemList, Section
from automax_ros.rackfile.sections.plants import Plants
from automax_ros.rackfile.sections.tasks import PRIORITIES, TaskPlaces, TaskReader


@dataclass(frozen=True)
class ModuleSection:
    """The section of a module for its kind to read; ``executive`` is the Programming Executive's version in tenths."""

    slot: int
    model: str
    section: Section
    span: Span
    tasks: TaskReader
    executive: int
    plants: Plants

    @property
    def where(self) -> str:
        """The module in messages."""
        return self.section.owner

    @property
    def findings(self) -> ProblemList:
        """The problems of the file."""
        return self.section.findings

    def placed(self, node: str) -> Any:
        """Return slot, model, name and line, as keywords for the module's configuration; ``node`` begins its name."""
        return {"slot": self.slot, "model": self.model, "name": f"{node}_{self.slot}", "line": self.span.line}

    def read_tasks(self, places: TaskPlaces = PRIORITIES) -> tuple[TaskConfig, ...]:
        """Return the module's tasks without errors."""
        node = self.section.get("tasks")
        return self.tasks.read(node, self.where, places) if node is not None else ()


@dataclass(frozen=True)
class PlacedModule:
    """A module for the rules of places: any module with a known number, even if the rest of it has errors."""

    slot: int
    model: str
    kind: ModuleKind
    span: Span


@dataclass(frozen=True)
class RackLayout:
    """All modules of a rack file. Unless ``complete``, one could not be read, and a rule may miss just that one.

    ``modules`` are the configurations of those that could be read, in the order of slots.
    """

    placed: Sequence[PlacedModule]
    complete: bool
    span: Span
    findings: ProblemList
    modules: Sequence[ModuleConfig] = ()

    def of(self, kind: ModuleKind) -> list[PlacedModule]:
        """Return the modules of one kind, in the order of slots."""
        return sorted((item for item in self.placed if item.kind is kind), key=lambda item: item.slot)


class ModuleKind(ABC):
    """A kind of module: its options in a rack file, and its allowed slots.

    ``word`` names the kind in messages; ``models`` are its catalogue numbers, each with its title; ``options`` the keys
    of its section with the schemas of their values, without ``module``. ``table`` has the registers of each number, for
    modules whose registers depend on nothing else.
    """

    word: str
    models: Mapping[str, str]
    options: Keys = MappingProxyType({})
    table: Mapping[str, Registers] = MappingProxyType({})

    @abstractmethod
    def read(self, found: ModuleSection) -> ModuleConfig | None:
        """Read a module's section; report errors in the findings, and return None if no configuration results."""

    def check_places(self, rack: RackLayout) -> None:  # noqa: B027
        """Report modules of this kind in slots where they may not be, or that are missing; most may be anywhere."""
