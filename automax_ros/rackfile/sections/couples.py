"""The key ``couple`` of a plant: the shaft of another plant, and the coupling between the two."""

from __future__ import annotations

from collections.abc import Mapping

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, section
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.yaml_text import Node
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.coupling import LEAST_RATIO, MOST_RATIO, CouplingData
from automax_ros.rackfile.model.plants import CoupleConfig, PlantConfig, build_plants, couple_plants, plant_name
from automax_ros.rackfile.reading.values import ProblemList, Section, number_key, schemas, text_key

CODE = "AMX6478"
_TO = text_key("to", plant_name("The other plant."))
_DAMPING = number_key("damping_nms_per_rad", "Damping of the spring.", 0.0, 1e6, CODE)
NUMBERS = (
    number_key("ratio", "Speed of this plant's motor over that of the other.", LEAST_RATIO, MOST_RATIO, CODE, 1),
    number_key("stiffness_nm_per_rad", "Stiffness at this shaft; without it stiff.", 1.0, 1e7, CODE),
    _DAMPING,
)
"""The numbers of a coupling, and their ranges (decision)."""
KEYS: Keys = schemas(_TO, *NUMBERS)
SCHEMA: Schema = section("What couples the shaft to that of another plant.", KEYS, ("to",))


def read_couple(node: Node, what: str, findings: ProblemList) -> CoupleConfig | None:
    """Return the coupling of a plant, None if a problem was reported."""
    where = f"couple of {what}"
    section = Section(node, where, KEYS, findings)
    if not section.require(("to",), where, node.span):
        return None
    named, text, numbers = section.get("to"), section.read(_TO), section.read_all(NUMBERS)
    if text is None or named is None:
        return None
    if _DAMPING.name in numbers and "stiffness_nm_per_rad" not in section:
        message = f"{where} has a damping and no stiffness: a stiff shaft does not swing"
        findings.add(CODE, message, section.key_span(_DAMPING.name))
    return CoupleConfig(findings.upper_case(text, named.span), CouplingData(**numbers), named.span.line)


def check_couples(plants: Mapping[str, PlantConfig], findings: ProblemList) -> None:
    """Report couplings to unknown plants, or of a plant that is coupled already; then impossible ones."""
    taken: dict[str, int] = {}
    before = findings.errors
    for name, config in plants.items():
        if config.couple is not None:
            _check(name, config.couple, plants, taken, findings)
    if findings.errors == before == 0:
        made = build_plants(plants.values())
        for config in plants.values():
            try:
                couple_plants(made, (config,))
            except ParameterError as error:
                assert config.couple is not None
                findings.add(CODE, f"plant {config.name}: {error}", Span(config.couple.line, 1, 2))


def _check(
    name: str, couple: CoupleConfig, plants: Mapping[str, PlantConfig], taken: dict[str, int], findings: ProblemList
) -> None:
    span = Span(couple.line, 1, 2)
    other = plants.get(couple.to)
    if couple.to == name:
        findings.add(CODE, f"plant {name} is coupled to itself", span, "name another plant")
        return
    if other is None:
        hint = near_or_listed(couple.to, [key for key in plants if key != name])
        findings.add(CODE, f"plant {name} is coupled to {quoted(couple.to)}, which the rack does not have", span, hint)
        return
    if other.motor is None:
        findings.add(CODE, f"plant {name} is coupled to {couple.to}, which has no motor: it is not simulated", span)
    for item in (name, couple.to):
        if item in taken:
            message = f"plant {item} is coupled already (line {taken[item]})"
            findings.add(CODE, message, span, "a plant is coupled to one other, and one of the two says so")
    taken.update(dict.fromkeys((name, couple.to), couple.line))
