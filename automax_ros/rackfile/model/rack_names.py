"""Names of all that has a value in a rack: commons, variables of tasks, signals of plants and webs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from automax_ros.core.names import Element, NameFault, UnknownName, element
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import DataType
from automax_ros.drive.web.signals import END_KINDS, WEB_KINDS
from automax_ros.language.program import Program, Symbol
from automax_ros.language.tree.tree import Scope
from automax_ros.rackfile.model.config import CommonElement, RackConfig, driven_plants
from automax_ros.rackfile.model.plant_signals import SIGNAL_KINDS

MOST_CHARACTERS = 100
"""Longest name that is looked up (decision: a bound on what strangers send)."""


@dataclass(frozen=True)
class LocalName:
    """A task's own variable, or an element of its array."""

    task: str
    element: Element[Symbol]

    @property
    def label(self) -> str:
        """The full name."""
        return f"{self.task}.{self.element.label}"


@dataclass(frozen=True)
class SignalName:
    """A signal of a plant, of its roll or roller, or of a web, whose name ``plant`` then is."""

    plant: str
    signal: str

    @property
    def label(self) -> str:
        """The full name."""
        return f"{self.plant}/{self.signal}"


Meant = CommonElement | LocalName | SignalName


class RackNames:
    """What names mean in one rack, with the checked tasks that are known."""

    def __init__(self, config: RackConfig, programs: Iterable[Program]) -> None:
        self.config = config
        self.programs = {program.name: program for program in programs}
        self.plants = [plant.name for plant in driven_plants(config)]
        self.ends = [plant.name for plant in config.plants if plant.surface is not None]
        self.webs = [web.name for web in config.webs]

    def find(self, name: str) -> Meant:
        """Return what ``REF%``, ``TABLE%(3)``, ``SPEED.COUNT%``, ``MOTOR/speed_rpm``, ``W1/tension_n`` means.

        Case and blanks do not matter.

        Raises:
            NameFault: nothing here.
        """
        if len(name) > MOST_CHARACTERS:
            raise UnknownName(f"a name of {len(name)} characters: the longest has {MOST_CHARACTERS}")
        plain = "".join(name.split())
        plant, slash, signal = plain.partition("/")
        if slash:
            owner, of = plant.upper(), signal.lower()
            _require(
                "plant or web" if self.webs else "plant",
                owner,
                [*dict.fromkeys((*self.plants, *self.ends)), *self.webs],
            )
            _require("signal", of, self.signals_of(owner))
            return SignalName(owner, of)
        task, dot, own = plain.partition(".")
        if not dot:
            return self.config.common(name)
        _require("task", task.upper(), self.programs)
        return LocalName(task.upper(), element(own, self.locals_of(task.upper()), f"task {task.upper()} has no"))

    def signals_of(self, owner: str) -> dict[str, DataType]:
        """Return the signals of a plant or web with their types: a plant has those of its roll or roller too."""
        if owner in self.webs:
            return dict(WEB_KINDS)
        own = SIGNAL_KINDS if owner in self.plants else {}
        return {**own, **(END_KINDS if owner in self.ends else {})}

    def locals_of(self, task: str) -> dict[str, Symbol]:
        """Return a task's own variables by their full names."""
        symbols = self.programs[task].symbols.values()
        return {symbol.name: symbol for symbol in symbols if symbol.scope is Scope.LOCAL}

    def unknown(self, names: Iterable[str]) -> list[str]:
        """Return those of the names that mean nothing."""
        return [name for name in names if not self._is_known(name)]

    def _is_known(self, name: str) -> bool:
        try:
            return self.find(name) is not None
        except NameFault:
            return False


def _require(what: str, name: str, known: Iterable[str]) -> None:
    if name not in known:
        raise UnknownName(f"the rack has no {what} {quoted(name)}", near_or_listed(name, list(known)))
