"""The keys ``roll``, ``roller`` and ``gear`` of a plant: what the web lies on, and how fast it turns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final, Literal

from automax_ros.core.json_schema import Keys, section
from automax_ros.core.yaml_text import Node
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.web.data import LEAST_GEAR, MOST_GEAR, Roll, Roller, SurfaceData
from automax_ros.rackfile.reading.values import Key, ProblemList, Section, choice_key, number_key, schemas

CODE = "AMX6504"
_TOP: Final = "top"
_BOTTOM: Final = "bottom"
_SIDES: Mapping[str, Literal["top", "bottom"]] = {_TOP: _TOP, _BOTTOM: _BOTTOM}
_DIAMETER = number_key("diameter_m", "Diameter with all that is wound on it.", 0.01, 10.0, CODE)
_CORE = number_key("core_m", "Diameter of the core.", 0.01, 10.0, CODE)
_STOCK: tuple[Key[float], ...] = (
    _DIAMETER,
    _CORE,
    number_key("width_m", "Width of the web.", 0.01, 20.0, CODE),
    number_key("caliper_um", "Thickness of the web.", 1.0, 20_000.0, CODE),
    number_key("density_kg_m3", "Density of the wound roll.", 1.0, 30_000.0, CODE),
)
"""What a roll must say, and the ranges (decision: foil to board, plastics to steel)."""
_MORE: tuple[Key[float], ...] = (
    number_key("core_inertia_kg_m2", "Inertia of core and chucks; without it `inertia` has it.", 0.0, 1e6, CODE),
    number_key("wound_at_n", "Tension that the roll was wound with.", 0.0, 1e7, CODE, 0),
)
_FROM = choice_key(
    "runs_from",
    "Where the web leaves or reaches the roll: `bottom` turns the other way.",
    _SIDES,
    (CODE, "{what} is {given}; it must be top or bottom"),
    default=_TOP,
)
_ROLL_KEYS: Keys = schemas(*_STOCK, _FROM, *_MORE)
_WRAP = number_key("wrap_deg", "Angle of wrap, degrees.", 1.0, 720.0, CODE)
_GRIP: tuple[Key[float], ...] = (_WRAP, number_key("friction", "Friction of web and roller.", 0.001, 10.0, CODE))
_ROLLER_DIAMETER = number_key("diameter_m", "Diameter.", 0.01, 10.0, CODE)
_ROLLER_KEYS: Keys = schemas(_ROLLER_DIAMETER, *_GRIP)
GEAR = number_key("gear", "Turns of the motor per turn of the roll or roller.", LEAST_GEAR, MOST_GEAR, CODE, 1)
KEYS: Keys = {
    **schemas(GEAR),
    "roll": section("A roll that the motor turns.", _ROLL_KEYS, [key.name for key in _STOCK]),
    "roller": section("A roller that the web runs over.", _ROLLER_KEYS, (_ROLLER_DIAMETER.name,)),
}
"""The keys of a plant that say what its web lies on."""


def read_surface(plant: Section, what: str, findings: ProblemList) -> SurfaceData | None:
    """Return the roll or roller of a plant; None if it has none, or a problem was reported."""
    roll, roller, gear = plant.get("roll"), plant.get("roller"), plant.read(GEAR)
    if roll is not None and roller is not None:
        message = f"{what} has a roll and a roller"
        findings.add(CODE, message, plant.key_span("roller"), "a motor turns one of them: leave the other out")
        return None
    if roll is None and roller is None:
        if GEAR.name in plant:
            message = f"{what} has a gear and neither roll nor roller: it turns nothing"
            findings.add(
                CODE, message, plant.key_span(GEAR.name), "a gear between two shafts is the ratio of `couple:`"
            )
        return None
    try:
        surface = _roll(roll, what, findings) if roll is not None else _roller(roller, what, findings)
    except ParameterError as error:
        findings.add(CODE, f"{what}: {error}", plant.key_span("roll" if roll is not None else "roller"))
        return None
    return None if surface is None else SurfaceData(surface, 1.0 if gear is None else gear)


def _roll(node: Node, what: str, findings: ProblemList) -> Roll | None:
    where = f"roll of {what}"
    section = Section(node, where, _ROLL_KEYS, findings)
    if not section.require([key.name for key in _STOCK], where, node.span):
        return None
    numbers, runs_from = section.read_all((*_STOCK, *_MORE)), section.read(_FROM)
    if not has_all(section, numbers, (*_STOCK, *_MORE)) or (runs_from is None and _FROM.name in section):
        return None
    if numbers[_DIAMETER.name] < numbers[_CORE.name]:
        message = f"{where} is smaller than its core: {numbers['diameter_m']:g} m on {numbers['core_m']:g} m"
        findings.add(CODE, message, section.key_span(_DIAMETER.name), "an empty roll has the diameter of its core")
        return None
    return Roll(**numbers, runs_from=runs_from or _TOP)


def _roller(node: Node | None, what: str, findings: ProblemList) -> Roller | None:
    assert node is not None
    where = f"roller of {what}"
    section = Section(node, where, _ROLLER_KEYS, findings)
    if not section.require((_ROLLER_DIAMETER.name,), where, node.span):
        return None
    numbers = section.read_all((_ROLLER_DIAMETER, *_GRIP))
    given = [key.name for key in _GRIP if key.name in section]
    if len(given) == 1:
        other = next(key.name for key in _GRIP if key.name not in section)
        message = f"{where} has {given[0]} and no {other}: its grip follows from both"
        findings.add(CODE, message, section.key_span(given[0]), "without both it never slips by itself")
        return None
    return Roller(**numbers) if has_all(section, numbers, (_ROLLER_DIAMETER, *_GRIP)) else None


def has_all(section: Section, numbers: Mapping[str, float], keys: Iterable[Key[float]]) -> bool:
    """Return whether all of the keys that a section has were read without a problem."""
    return all(key.name in numbers or key.name not in section for key in keys)
