"""The key ``joint`` of a plant: its shaft as a joint of ROS, with commands as ros2_control's controllers take them.

In the rack file commands are in rpm and N m, as all of a plant (decision); on ROS they are in rad/s and N m (REP-103).
A command writes a common with ``ros: in`` and no other, so the key opens no way into the rack that was closed
(decision).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Keys, Schema, may_be_empty, named, section
from automax_ros.core.text import quoted
from automax_ros.core.yaml_text import Node
from automax_ros.rackfile.reading.scale import SCHEMA as SCALE
from automax_ros.rackfile.reading.values import ProblemList, Section, entries_of, text_value

CODE = "AMX6310"
JOINT_NAME = r"[A-Za-z](?:_?[A-Za-z0-9])*"
"""A joint's name, as a pattern: one that may begin a topic of ROS."""
LONGEST_NAME = 40
"""Most characters of a joint's name (decision: its topics then stay readable)."""
INTERFACES = {"velocity": math.pi / 30.0, "effort": 1.0}
"""What a joint is commanded by (ros2_control's names), and the factor from the rack file's unit to ROS's."""
UNITS = {"velocity": "rpm", "effort": "N m"}
"""The rack file's units."""
COMMAND_KEYS: Keys = {
    "common": named("The common that a command writes; it has `ros: in`.", r"^[A-Za-z_][A-Za-z0-9_]{0,15}[%!]?$"),
    "scale": SCALE,
}
"""What may be said of a command."""
KEYS: Keys = {
    "name": named("What ROS calls the joint; the plant's name if left out.", f"^{JOINT_NAME}$"),
    **{
        interface: section(f"Commands of {interface}; scale in {unit}.", COMMAND_KEYS, ("common",))
        for interface, unit in UNITS.items()
    },
}
"""What may be said of a joint."""
SCHEMA: Schema = may_be_empty(section("The shaft as a joint of ROS.", KEYS))
_NAME = re.compile(JOINT_NAME + r"\Z")


@dataclass(frozen=True)
class GivenJoint:
    """The commands of a joint as the file has them: the plant, the joint's name, (interface, what stands there)."""

    plant: str
    name: str
    commands: tuple[tuple[str, Node], ...]


def read_joint(node: Node, plant: str, findings: ProblemList) -> GivenJoint:
    """Return the joint of a plant, named as the plant unless the file says more; what is wrong goes to findings."""
    where = f"joint of plant {plant}"
    section = Section(entries_of(node, where, findings) or (), where, KEYS, findings)
    named = section.get("name")
    name = _name(named, where, findings) if named is not None else None
    commands = ((interface, section.get(interface)) for interface in INTERFACES)
    given = tuple((interface, node) for interface, node in commands if node is not None)
    return GivenJoint(plant, name or plant, given)


def check_joint_names(names: Mapping[str, tuple[str, Span]], findings: ProblemList) -> None:
    """Report joints of one name; ``names`` are those of the plants, with the place of each plant."""
    seen: dict[str, str] = {}
    for plant, (name, span) in names.items():
        if name in seen:
            message = f"the joint of plant {plant} is called {name}, and so is that of plant {seen[name]}"
            findings.add(CODE, message, span, "joint_states knows a joint by its name only")
        seen.setdefault(name, plant)


def _name(node: Node, where: str, findings: ProblemList) -> str | None:
    text = text_value(node, f"name of the {where}", findings, limit=100)
    if text is None:
        return None
    if not _NAME.match(text) or len(text) > LONGEST_NAME:
        rule = f"1 to {LONGEST_NAME} letters, digits and single underscores, a letter first"
        findings.add(CODE, f"{quoted(text)}: a joint's name has {rule}", node.span)
        return None
    return text
