"""What a kind of module is: how its section of a rack file is read into a configuration, and where it may stand."""

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
    """A module of a rack file as its kind reads it; ``where`` names it in messages.

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
    """A module as the rules of places see it: all modules whose number is known, right in the rest or not."""

    slot: int
    model: str
    kind: ModuleKind
    span: Span


@dataclass(frozen=True)
class RackLayout:
    """All modules of a rack file. Unless ``complete``, one could not be read and may be the one that a rule misses.

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

    def read(self, found: ModuleSection) -> ModuleConfig | None:
        """Read a module's section; what is wrong goes to the findings, None where no module can be made of it."""
        ...

    def check_places(self, rack: RackLayout) -> None:
        """Report modules of this kind that stand where none can, or that are missing."""
        ...
