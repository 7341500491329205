"""Which commons the commands of joints write."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from automax_ros.core.diagnostics import Span
from automax_ros.core.kinds import Direction
from automax_ros.core.names import NameFault, UnknownName
from automax_ros.core.names import element as element_named
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.plants import JointCommand
from automax_ros.rackfile.reading.names import VariableName
from automax_ros.rackfile.reading.scale import Scale, scale_of
from automax_ros.rackfile.reading.values import ProblemList, Section, entries_of, text_value
from automax_ros.rackfile.sections.joint_keys import CODE, COMMAND_KEYS, GivenJoint

_ABSENT = "the rack has no common variable"


def read_commands(
    given: Iterable[GivenJoint], variables: Sequence[CommonVariable], findings: ProblemList
) -> tuple[JointCommand, ...]:
    """Return the commands of all joints; what is wrong goes to findings. Commons with errors are not looked for."""
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
        """Return one command, None where there was something to report."""
        findings = self._findings
        where = f"{interface} of the joint of plant {joint.plant}"
        entries = entries_of(node, where, findings)
        if entries is None:
            return None
        section = Section(entries, where, COMMAND_KEYS, findings)
        if not section.require(("common",), where, node.span, findings):
            return None
        named = section.get("common")
        assert named is not None
        variable = self._common(named, where)
        if variable is None:
            return None
        scale = self._scale(section, variable, where, named.span)
        return JointCommand(joint.plant, joint.name, interface, variable.name, scale, node.span.line)

    def _common(self, node: Node, where: str) -> CommonVariable | None:
        """Return the common that a command writes, None (reported) where it cannot."""
        findings = self._findings
        text = text_value(node, f"common of {where}", findings, limit=100)
        if text is None:
            return None
        try:
            variable = element_named(text, self._variables, _ABSENT).variable
        except UnknownName as fault:
            if self._is_whole:
                findings.add(CODE, f"{where}: {fault.message}", node.span, fault.hint)
            return None
        except NameFault as fault:
            findings.add(CODE, f"{where}: {fault.message}", node.span, fault.hint)
            return None
        why, hint = self._why_not(variable)
        if why:
            findings.add(CODE, f"{where}: {variable.name} {why}", node.span, hint)
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
        """Return what counts mean. A common's own scale is that of its topic, in whatever unit: it is not taken."""
        node = section.get("scale")
        if node is not None:
            return scale_of(node, VariableName(variable.name, variable.type, 0, ()), span, self._findings)
        if variable.type.is_integer:
            message = f"{where} has no scale: what is a count of {variable.name}?"
            hint = "for example scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}, in rpm, or N m for effort"
            self._findings.add(CODE, message, span, hint)
        return None
