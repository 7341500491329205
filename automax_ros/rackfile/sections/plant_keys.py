"""The keys ``line``, ``load`` and ``inertia`` of a plant."""

from __future__ import annotations

from automax_ros.core.json_schema import Schema, listed, may_be_empty, section
from automax_ros.core.yaml_text import Node, YamlSequence
from automax_ros.drive.circuit.ac_line import HIGHEST_HZ, LOWEST_HZ
from automax_ros.rackfile.model.plants import LoadConfig, SupplyConfig
from automax_ros.rackfile.reading.values import (
    Key,
    ProblemList,
    Section,
    choice_key,
    number_key,
    schemas,
    wrong_kind,
)

CODE = "AMX6477"
SUPPLY = (
    number_key("v_ll", "Line-to-line voltage, V rms.", 50.0, 1000.0, CODE),
    number_key("hz", "Frequency, Hz.", LOWEST_HZ, HIGHEST_HZ, CODE),
    number_key("ls_mh", "Source inductance of a phase, mH.", 0.001, 10.0, CODE),
    number_key("rs_mohm", "Source resistance of a phase, milliohm.", 0.0, 1000.0, CODE, 5),
)
"""Numbers of a line, and their ranges (decision: lines of these drives; without inductance a shorted SCR had no
limit)."""
_ROTATION = choice_key(
    "rotation",
    "CBA is the standard rotation.",
    {"CBA": True, "ABC": False},
    (CODE, "{what} is {given}; it must be CBA (the standard one) or ABC"),
    default="CBA",
)
"""The two rotations of a line (52.1.5)."""
_TORQUE = number_key(
    "torque_nm", "Torque that keeps its direction, N m; positive brakes positive speed.", -1e6, 1e6, CODE, 0
)
_SPEED = number_key(
    "speed_rpm", "The speed at which the shaft is held; alone. 0 is a locked rotor.", -10_000.0, 10_000.0, CODE
)
LOAD = (_TORQUE, number_key("friction_nm", "Coulomb friction, N m.", 0.0, 1e6, CODE, 0), _SPEED)
"""Numbers of a load, and their ranges (decision)."""
INERTIA = number_key("inertia", "Inertia of motor and load over the motor's own.", 1.0, 10_000.0, CODE, 1)
"""Range of ``inertia``, 1 to 10000 (decision): it includes the motor's own, which is 1."""
MOST_PAIRS = 100
"""Most pairs of ``torque_per_rpm`` (decision)."""
_FROM_ROS = choice_key(
    "ros",
    "`in`: ROS 2 sets torque_nm.",
    {"in": True},
    (CODE, "{what} is {given}; it can only be in: ROS 2 sets torque_nm"),
    lambda _: "leave it out where ROS 2 does not set it",
)
LOAD_HINTS = dict.fromkeys(
    ("torque_from", "torque", "torque_common", "torque_ref"),
    "write load: {torque_nm: 100}; ros: in there lets ROS 2 set it, stimuli set load_torque_nm, couple: joins shafts",
)
"""Hints for keys that users may try."""


def _table(node: Node, what: str, findings: ProblemList) -> tuple[tuple[float, float], ...] | None:
    if not isinstance(node, YamlSequence) or not 2 <= len(node.items) <= MOST_PAIRS:
        wrong_kind(node, what, f"a list of 2 to {MOST_PAIRS} pairs, such as [[0, 0], [1750, 300]]", findings)
        return None
    pairs = [_pair(item, what, findings) for item in node.items]
    table = tuple(pair for pair in pairs if pair is not None)
    for below, above, item in zip(table, table[1:], node.items[1:], strict=False):
        if len(table) == len(pairs) and above[0] <= below[0]:
            findings.add(CODE, f"{what}: the speeds must rise, {above[0]:g} follows {below[0]:g} rpm", item.span)
            return None
    return table


def _pair(node: Node, what: str, findings: ProblemList) -> tuple[float, float] | None:
    if not isinstance(node, YamlSequence) or len(node.items) != 2:
        wrong_kind(node, f"a pair of {what}", "a list of two numbers: rpm and N m", findings)
        return None
    rpm = _SPEED.read(node.items[0], f"rpm of {what}", findings)
    torque = _TORQUE.read(node.items[1], f"N m of {what}", findings)
    return None if rpm is None or torque is None else (rpm, torque)


_TORQUE_PER_RPM = Key(
    "torque_per_rpm",
    listed(
        "A table of speed and torque, straight lines between its pairs.",
        listed("rpm and N m.", {"type": "number"}, least=2, most=2),
        least=2,
        most=MOST_PAIRS,
    ),
    _table,
)
_SUPPLY_KEYS, _LOAD_KEYS = schemas(*SUPPLY, _ROTATION), schemas(*LOAD, _TORQUE_PER_RPM, _FROM_ROS)
SUPPLY_SCHEMA: Schema = may_be_empty(section("The AC line of the drive.", _SUPPLY_KEYS))
LOAD_SCHEMA: Schema = may_be_empty(section("What the motor turns.", _LOAD_KEYS))


def read_supply(node: Node, what: str, findings: ProblemList) -> SupplyConfig:
    """Return a plant's AC line; report errors in the findings."""
    where = f"line of {what}"
    section = Section(node, where, _SUPPLY_KEYS, findings)
    return SupplyConfig(**section.read_all(SUPPLY), standard=section.read(_ROTATION) is not False)


def read_load(node: Node, what: str, findings: ProblemList) -> LoadConfig:
    """Return a plant's load; report errors in the findings. A held shaft has no others, which would have no effect."""
    where = f"load of {what}"
    section = Section(node, where, _LOAD_KEYS, findings, LOAD_HINTS)
    others = [key for key in ("torque_nm", "torque_per_rpm", "friction_nm", "ros") if key in section]
    if _SPEED.name in section and others:
        message = f"{where} holds the shaft at a speed: {others[0]} has no effect"
        findings.add(CODE, message, section.key_span(others[0]), f"leave out {others[0]} or {_SPEED.name}")
    return LoadConfig(
        **section.read_all(LOAD),
        torque_per_rpm=section.read(_TORQUE_PER_RPM) or (),
        from_ros=bool(section.read(_FROM_ROS)),
    )
