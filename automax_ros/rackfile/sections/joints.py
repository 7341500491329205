"""The key ``joint`` of a plant: its shaft as a joint of ROS, with the commands of ros2_control's controllers.

In the rack file commands are in rpm and N m, as all of a plant (decision); on ROS they are in rad/s and N m (REP-103).
A command writes only a common with ``ros: in``, so the key opens no way into the rack that was closed (decision).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, may_be_empty, named, section
from automax_ros.core.kinds import Direction
from automax_ros.core.names import NameFault, UnknownName
from automax_ros.core.names import element as element_named
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.plants import JointCommand
from automax_ros.rackfile.model.ros_names import roll_joint
from automax_ros.rackfile.reading.scale import SCHEMA as SCALE
from automax_ros.rackfile.reading.scale import Scale, scale_of
from automax_ros.rackfile.reading.values import Key, ProblemList, Section, schemas, text_key, text_value

CODE = "AMX6310"
_ABSENT = "the rack has no common variable"
_JOINT_NAME = r"[A-Za-z](?:_?[A-Za-z0-9])*"
"""A joint's name, as a pattern: one that may begin a topic of ROS."""
LONGEST_NAME = 40
"""Most characters of a joint's name (decision: its topics then stay readable)."""
INTERFACES = {"velocity": math.pi / 30.0, "effort": 1.0}
"""The command interfaces of a joint (ros2_control's names), each with the factor from the rack file's unit to ROS's."""
UNITS = {"velocity": "rpm", "effort": "N m"}
"""The rack file's units."""
_NAME_PATTERN = re.compile(_JOINT_NAME + r"\Z")


def _name(node: Node, what: str, findings: ProblemList) -> str | None:
    text = text_value(node, what, findings, limit=100)
    if text is not None and (not _NAME_PATTERN.match(text) or len(text) > LONGEST_NAME):
        rule = f"1 to {LONGEST_NAME} letters, digits and single underscores, a letter first"
        findings.add(CODE, f"{quoted(text)}: a joint's name has {rule}", node.span)
        return None
    return text


_COMMON = text_key(
    "common", named("The common that a command writes; it has `ros: in`.", r"^[A-Za-z_][A-Za-z0-9_]{0,15}[%!]?$")
)
_NAME = Key("name", named("What ROS calls the joint; the plant's name if left out.", f"^{_JOINT_NAME}$"), _name)
_COMMAND_KEYS: Keys = {**schemas(_COMMON), "scale": SCALE}
_KEYS: Keys = {
    **schemas(_NAME),
    **{
        interface: section(f"Commands of {interface}; scale in {unit}.", _COMMAND_KEYS, ("common",))
        for interface, unit in UNITS.items()
    },
}
SCHEMA: Schema = may_be_empty(section("The shaft as a joint of ROS.", _KEYS))


@dataclass(frozen=True)
class GivenJoint:
    """The commands of a joint in the file: the plant, the joint's name, (interface, node of its value)."""

    plant: str
    name: str
    commands: tuple[tuple[str, Node], ...]


def read_joint(node: Node, plant: str, findings: ProblemList) -> GivenJoint:
    """Return the joint of a plant, by default with the plant's name; report errors in the findings."""
    where = f"joint of plant {plant}"
    section = Section(node, where, _KEYS, findings, owner=f"the {where}")
    name = section.read(_NAME) or plant
    commands = ((interface, section.get(interface)) for interface in INTERFACES)
    return GivenJoint(plant, name, tuple((interface, node) for interface, node in commands if node is not None))


def check_joint_names(
    names: Mapping[str, tuple[str, Span]], findings: ProblemList, with_rolls: Iterable[str] = ()
) -> None:
    """Report joints with the same name; ``names`` are those of the plants, with the place of each plant.

    The plants of ``with_rolls`` have a second joint, that of their roll or roller.
    """
    seen: dict[str, str] = {}
    for plant, (name, span) in names.items():
        if name in seen:
            message = f"the joint of plant {plant} is called {name}, and so is that of plant {seen[name]}"
            findings.add(CODE, message, span, "joint_states knows a joint by its name only")
        seen.setdefault(name, plant)
    for plant in with_rolls:
        name = roll_joint(names[plant][0])
        if name in seen:
            message = f"the joint of plant {seen[name]} is called {name}, and so is that of the roll of plant {plant}"
            findings.add(CODE, message, names[seen[name]][1], "joint_states knows a joint by its name only")


def read_commands(
    given: Iterable[GivenJoint], variables: Sequence[CommonVariable], findings: ProblemList
) -> tuple[JointCommand, ...]:
    """Return the commands of all joints; report errors in the findings. Commons with errors are not looked up."""
    reader = _CommandReader(variables, findings)
    found = [reader.read(joint, interface, node) for joint in given for interface, node in joint.commands]
    return tuple(command for command in found if command is not None)


class _CommandReader:
    def __init__(self, variables: Sequence[CommonVariable], findings: ProblemList) -> None:
        self._variables = {variable.name: variable for variable in variables}
        self._findings = findings
        self._is_whole = not findings.errors
        self._commanded: dict[str, str] = {}

    def read(self, joint: GivenJoint, interface: str, node: Node) -> JointCommand | None:
        findings = self._findings
        where = f"{interface} of the joint of plant {joint.plant}"
        section = Section(node, where, _COMMAND_KEYS, findings)
        if not section.require(("common",), where, node.span):
            return None
        named = section.get("common")
        assert named is not None
        text = section.read(_COMMON)
        variable = self._common(text, named.span, where) if text is not None else None
        if variable is None:
            return None
        scale = self._scale(section, variable, where, named.span)
        return JointCommand(joint.plant, joint.name, interface, variable.name, scale, node.span.line)

    def _common(self, text: str, span: Span, where: str) -> CommonVariable | None:
        try:
            variable = element_named(text, self._variables, _ABSENT).variable
        except NameFault as fault:
            if self._is_whole or not isinstance(fault, UnknownName):
                self._findings.add(CODE, f"{where}: {fault.message}", span, fault.hint)
            return None
        why, hint = self._why_not(variable)
        if why:
            self._findings.add(CODE, f"{where}: {variable.name} {why}", span, hint)
            return None
        self._commanded[variable.name] = where
        return variable

    def _why_not(self, variable: CommonVariable) -> tuple[str, str | None]:
        if variable.is_array or variable.type in (DataType.BOOLEAN, DataType.STRING):
            kind = "an array" if variable.is_array else f"a {variable.type.word}"
            return f"is {kind}: a command is one number", None
        if variable.direction is not Direction.IN:
            return "cannot be written from ROS 2", f"write ros: in for {variable.name}"
        if variable.name in self._commanded:
            return f"is written by the {self._commanded[variable.name]} already", None
        return "", None

    def _scale(self, section: Section, variable: CommonVariable, where: str, span: Span) -> Scale | None:
        node = section.get("scale")
        if node is not None:
            return scale_of(node, variable.name, variable.type, span, self._findings)
        if variable.type.is_integer:
            message = f"{where} has no scale: what is a count of {variable.name}?"
            hint = "for example scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}, in rpm, or N m for effort"
            self._findings.add(CODE, message, span, hint)
        return None
