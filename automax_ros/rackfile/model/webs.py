"""The ``webs`` section of a rack file, and what webs and couplings make one: ``build_line`` makes it turn.

``how_parted`` says what became of a web that is broken, for those who run a rack and for those who read its messages.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from automax_ros.drive.plant.coupling import CoupledPlants
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.drive.web.chain import Line, build_chains, groups_of
from automax_ros.drive.web.data import Roll, WebData
from automax_ros.rackfile.model.plants import PlantConfig

MOST_WEBS = 31
"""Most webs of a rack: a chain of its 32 plants has no more."""


@dataclass(frozen=True)
class WebConfig:
    """A web from the plant ``start`` to the plant ``end``; ``line`` is the line of the file."""

    name: str
    start: str
    end: str
    data: WebData
    line: int = 0


def build_line(
    plants: Mapping[str, DrivePlant],
    configs: Iterable[PlantConfig],
    webs: Iterable[WebConfig],
    couplings: Mapping[str, CoupledPlants],
) -> Line:
    """Return the rolls, rollers and webs of plants, at rest; ``couplings`` are those of ``couple_plants``.

    Raises:
        ParameterError: a value is beyond what can be simulated, or the webs cannot hang so.
    """
    surfaces = {item.name: item.surface for item in configs if item.surface is not None and item.name in plants}
    if not surfaces:
        return Line({}, {}, ())
    return build_chains(plants, surfaces, {item.name: (item.start, item.end, item.data) for item in webs}, couplings)


def joined_plants(plants: Sequence[PlantConfig], webs: Iterable[WebConfig]) -> dict[str, frozenset[str]]:
    """Return by plant all that passes time together with it, itself too: what webs and couplings join."""
    pairs = [(item.name, item.couple.to) for item in plants if item.couple is not None]
    groups = groups_of([plant.name for plant in plants], [*pairs, *((web.start, web.end) for web in webs)])
    return {name: frozenset(group) for group in groups for name in group}


_EMPTY = 1.0 + 1e-6
"""A roll up to this many diameters of its core has no web (decision: rounding, far below a caliper)."""


class RollSeen(Protocol):
    """A roll or roller at an instant, of a rack that runs or from its messages."""

    @property
    def diameter_m(self) -> float:
        """Diameter now, m."""

    @property
    def web_mps(self) -> float:
        """Speed of its surface, m/s."""


def cores_of(plants: Iterable[PlantConfig]) -> dict[str, float]:
    """Return the diameters of the cores of rolls, m, by plant."""
    surfaces = {item.name: item.surface.surface for item in plants if item.surface is not None}
    return {name: surface.core_m for name, surface in surfaces.items() if isinstance(surface, Roll)}


def news_of(
    web: str, ends: tuple[str, str], cores: Mapping[str, float], rolls: Mapping[str, RollSeen], *, broken: bool
) -> str:
    """Return what has become of a web whose state has changed: ``web W1 broke``, ``web W1 is threaded again``.

    ``ends`` are the plants that it comes from and goes to; ``cores`` are diameters, m; ``rolls`` are those that were
    seen last.
    """
    return f"web {web} {how_parted(*ends, cores, rolls) if broken else 'is threaded again'}"


def how_parted(start: str, end: str, cores: Mapping[str, float], rolls: Mapping[str, RollSeen]) -> str:
    """Return what became of a web between two plants that is broken now: ``broke``, ``ran out: UNWIND is empty``.

    It ran out where the roll that it comes off is bare; that at ``end`` only while the web runs backward, for a winder
    may begin with a bare core. ``cores`` are diameters, m; ``rolls`` are those that were seen last.
    """
    for plant in (start, end):
        roll, core_m = rolls.get(plant), cores.get(plant)
        if roll is None or core_m is None or roll.diameter_m > core_m * _EMPTY:
            continue
        if plant == start or roll.web_mps < 0.0:
            return f"ran out: {plant} is empty"
    return "broke"
