"""The interface of a kind of module: how its section of a rack file becomes a configuration, and its allowed slots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.reading.values import ProblemList, Section
from automax_ros.rackfile.sections.plants import Plants
from automax_ros.rackfile.sections.tasks import TaskReader


@dataclass(frozen=True)
class ModuleSection:
    """The section of a module for its kind to read; ``where`` names the module in messages.

    ``executive`` is the version of the Programming Executive in tenths (``rackfile/reading/executive.py``).
    """

    slot: int
    model: str
    section: Section
    where: str
    span: Span
    tasks: TaskReader
    findings: ProblemList
    executive: int
    plants: Plants


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

    standing: Sequence[PlacedModule]
    complete: bool
    span: Span
    findings: ProblemList
    modules: Sequence[ModuleConfig] = ()

    def of(self, kind: ModuleKind) -> list[PlacedModule]:
        """Return the modules of one kind, in the order of slots."""
        return sorted((item for item in self.standing if item.kind is kind), key=lambda item: item.slot)


class ModuleKind(Protocol):
    """A kind of module: its options in a rack file, and its allowed slots.

    ``word`` names the kind in messages; ``models`` are its catalogue numbers, each with its title.
    """

    @property
    def word(self) -> str: ...  # noqa: D102

    @property
    def models(self) -> Mapping[str, str]: ...  # noqa: D102

    @property
    def options(self) -> Keys:
        """The keys of its section with the schemas of their values, without ``module``."""
        ...

    def read(self, found: ModuleSection) -> ModuleConfig | None:
        """Read a module's section; report errors in the findings, and return None if no configuration results."""
        ...

    def check_places(self, rack: RackLayout) -> None:
        """Report modules of this kind in slots where they may not be, or that are missing."""
        ...
