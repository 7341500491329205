"""Reads the ``plants`` section: the motors and loads that drives turn. A plant belongs to one drive of one module.

A plant without ``motor`` is not simulated: it has only its drive's parameters (decision).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, either, entries, may_be_empty, section, words
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.yaml_text import Node, Scalar, YamlMapping
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.nameplate import NamePlate
from automax_ros.rackfile.model.plants import (
    MOTORS,
    PLANT_NAME,
    LoadConfig,
    PlantConfig,
    SupplyConfig,
    plant_data,
    plant_name,
)
from automax_ros.rackfile.reading.values import (
    ProblemList,
    Section,
    entries_of,
    number_key,
    report_twice,
    schemas,
    text_value,
    whole_key,
)
from automax_ros.rackfile.sections.couples import SCHEMA as COUPLE_SCHEMA
from automax_ros.rackfile.sections.couples import check_couples, read_couple
from automax_ros.rackfile.sections.feeds import PLANT_SIGNAL, SURFACE_SIGNAL, GivenFeeds
from automax_ros.rackfile.sections.feeds import SCHEMA as FEED_SCHEMA
from automax_ros.rackfile.sections.joints import SCHEMA as JOINT_SCHEMA
from automax_ros.rackfile.sections.joints import GivenJoint, check_joint_names, read_joint
from automax_ros.rackfile.sections.plant_keys import (
    INERTIA,
    LOAD_HINTS,
    LOAD_SCHEMA,
    SUPPLY_SCHEMA,
    read_load,
    read_supply,
)
from automax_ros.rackfile.sections.surfaces import KEYS as SURFACE_KEYS
from automax_ros.rackfile.sections.surfaces import read_surface

MOST_PLANTS = 32
"""Most plants of a rack (decision: two for each of 16 slots)."""
_RATIO = whole_key("motor_overload_ratio", "Motor Overload Ratio of the drive, %.", 115, 400, "AMX6475")
"""Its range is that of LIM_BAR, which must be the same (36)."""
_PLATE = tuple(
    number_key(name, text, 1e-9, 1e9, "AMX6473")
    for name, text in (
        ("hp", "Rated power, hp."),
        ("volts", "Rated armature voltage, V."),
        ("rpm", "Rated speed."),
        ("amps", "Rated armature current, A."),
        ("resistance_ohm", "Resistance of the armature."),
        ("inductance_h", "Inductance of the armature."),
        ("inertia_kg_m2", "Inertia of the motor."),
    )
)
_PLATE_REQUIRED = ("hp", "volts", "rpm")
_SIMULATED: Keys = {
    "line": SUPPLY_SCHEMA,
    "load": LOAD_SCHEMA,
    **schemas(INERTIA),
    "couple": COUPLE_SCHEMA,
    **SURFACE_KEYS,
    "feeds": FEED_SCHEMA,
    "joint": JOINT_SCHEMA,
}
KEYS: Keys = {
    "motor": either(
        "The motor; a plant without one is not simulated.",
        words("A motor that the emulator has.", MOTORS),
        section("The motor's name plate.", schemas(*_PLATE), _PLATE_REQUIRED),
    ),
    **schemas(_RATIO),
    **_SIMULATED,
}
"""The keys of a plant."""
SCHEMA: Schema = may_be_empty(
    entries(
        "The lines, motors and loads of drives, by their names.",
        plant_name("")["pattern"],
        may_be_empty(section("A plant.", KEYS)),
        MOST_PLANTS,
    )
)
_NAME = re.compile(PLANT_NAME + r"\Z")
_LIMIT = 100


@dataclass
class Plants:
    """The plants of one rack file, and the drives that claim them; ``feeds`` and ``joints`` are read with commons."""

    findings: ProblemList
    known: dict[str, PlantConfig] = field(default_factory=dict)
    complete: bool = True
    feeds: list[GivenFeeds] = field(default_factory=list)
    joints: list[GivenJoint] = field(default_factory=list)
    _claimed: dict[str, tuple[str, Span]] = field(default_factory=dict)

    def claim(self, node: Node, what: str) -> PlantConfig | None:
        """Return the plant that a module names for ``what``, None (reported) if there is none or it is claimed."""
        text = text_value(node, what, self.findings, limit=_LIMIT)
        if text is None:
            return None
        name = self.findings.upper_case(text, node.span)
        plant = self.known.get(name)
        if plant is None:
            if self.complete:
                hint = did_you_mean(name, self.known) or "define it in the section `plants:` of the rack file"
                self.findings.add("AMX6474", f"{what}: the rack has no plant {quoted(text)}", node.span, hint)
            return None
        if name in self._claimed:
            user, place = self._claimed[name]
            message = f"{what}: the plant {name} is that of {user} (line {place.line}) already"
            self.findings.add("AMX6474", message, node.span, "a plant belongs to one drive")
            return None
        self._claimed[name] = (what, node.span)
        return plant


def read_plants(node: Node | None, findings: ProblemList) -> Plants:
    """Return the plants of the section; report errors in the findings."""
    plants = Plants(findings)
    if node is None:
        return plants
    places: dict[str, Span] = {}
    entries = entries_of(node, "plants", findings) or ()
    if len(entries) > MOST_PLANTS:
        message = f"the rack file has {len(entries)} plants; at most {MOST_PLANTS} are simulated"
        findings.add("AMX6501", message, entries[MOST_PLANTS][0].span)
        plants.complete = False
    for key, value in entries[:MOST_PLANTS]:
        name = findings.upper_case(key.text, key.span)
        if not _NAME.match(name):
            message = f"{quoted(key.text)}: a plant's name has 1 to 16 letters, digits and underscores, a letter first"
            findings.add("AMX6476", message, key.span)
            plants.complete = False
        elif name in places:
            report_twice(key, f"plant {name}", places[name], findings)
        else:
            places[name] = key.span
            plants.known[name] = _plant(name, key, value, plants)
    if plants.complete:
        check_couples(plants.known, findings)
        rolls = [name for name, plant in plants.known.items() if plant.surface is not None]
        names = {name: (plant.joint_name, places[name]) for name, plant in plants.known.items()}
        check_joint_names(names, findings, rolls)
    return plants


def _plant(name: str, key: Scalar, node: Node, plants: Plants) -> PlantConfig:
    findings = plants.findings
    what = f"plant {name}"
    section = Section(node, what, KEYS, findings, LOAD_HINTS)
    motor = section.get("motor")
    line, load, couple, feeds, joint = (section.get(key) for key in ("line", "load", "couple", "feeds", "joint"))
    needless = next((option for option in _SIMULATED if option in section), "")
    if motor is None and needless:
        findings.add("AMX6009", f"{what} has {needless} and no motor: it is not simulated", section.key_span(needless))
    if feeds is not None:
        has_surface = "roll" in section or "roller" in section
        plants.feeds.append(GivenFeeds(name, feeds, SURFACE_SIGNAL if has_surface else PLANT_SIGNAL))
    if joint is not None:
        plants.joints.append(read_joint(joint, name, findings))
    config = PlantConfig(
        name,
        _motor(motor, f"motor of {what}", findings) if motor else None,
        section.read(_RATIO),
        key.span.line,
        read_supply(line, what, findings) if line else SupplyConfig(),
        read_load(load, what, findings) if load else LoadConfig(),
        section.read(INERTIA) or 1.0,
        read_couple(couple, what, findings) if couple else None,
        plants.joints[-1].name if joint else "",
        read_surface(section, what, findings),
    )
    if not findings.errors:
        try:
            plant_data(config)
        except ParameterError as error:
            findings.add("AMX6473", f"plant {name}: {error}", key.span)
    return config


def _motor(node: Node, what: str, findings: ProblemList) -> str | NamePlate | None:
    if isinstance(node, YamlMapping):
        return _plate(node, what, findings)
    name = text_value(node, what, findings, limit=_LIMIT)
    if name is not None and name not in MOTORS:
        hint = (
            did_you_mean(name, MOTORS)
            or f"motors are {', '.join(MOTORS)}, or a name plate: {{hp: 10, volts: 240, ...}}"
        )
        findings.add("AMX6473", f"{what} is {quoted(name)}, which the emulator does not have", node.span, hint)
        return None
    return name


def _plate(node: YamlMapping, what: str, findings: ProblemList) -> NamePlate | None:
    section = Section(node, what, schemas(*_PLATE), findings)
    if not section.require(_PLATE_REQUIRED, what, node.span):
        return None
    numbers: dict[str, Any] = dict(section.read_all(_PLATE))
    return NamePlate(**numbers) if all(key.name in numbers or key.name not in section for key in _PLATE) else None
