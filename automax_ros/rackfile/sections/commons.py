"""The ``common`` section: the rack's common variables, their options and their presets.

Presets are in the variable's own type. The hardware has none; in the emulator a preset is a write by the rack at time 0
(semantics, Scan, memory, tasks).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import (
    Keys,
    Schema,
    either,
    entries,
    line,
    listed,
    may_be_empty,
    scalar,
    section,
    words,
)
from automax_ros.core.kinds import Direction
from automax_ros.core.names import PREDEFINED
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.types import DataType, Value, bare_name
from automax_ros.core.values import value_of, wanted
from automax_ros.core.yaml_text import Node, Scalar, YamlSequence
from automax_ros.rackfile.model.config import DEFAULT_OUT_LIMIT, CommonVariable
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.reading.names import COMMON_NAME, DeclarationFault, VariableName, is_reserved, variable_name
from automax_ros.rackfile.reading.scale import SCHEMA as SCALE
from automax_ros.rackfile.reading.scale import Scale, scale_of
from automax_ros.rackfile.reading.values import (
    Key,
    ProblemList,
    Section,
    entries_of,
    flag_key,
    is_plain_word,
    kind_of,
    number_hint,
    number_key,
    report_twice,
    schemas,
    text_key,
    text_value,
    wrong_kind,
)
from automax_ros.rackfile.sections.points import KEYS, PointReader

_CODE = "AMX6406"
_DIRECTIONS = {"closed": Direction.CLOSED, "out": Direction.OUT, "in": Direction.IN}


def _direction(node: Node, what: str, findings: ProblemList) -> Direction | None:
    if not isinstance(node, Scalar) or node.is_null:
        wrong_kind(node, what, "out, in or closed", findings)
        return None
    if node.text not in _DIRECTIONS:
        message = f"{what} is {quoted(node.text)}; it must be out, in or closed"
        findings.add("AMX6407", message, node.span, did_you_mean(node.text, _DIRECTIONS))
    return _DIRECTIONS.get(node.text)


_ROS = Key(
    "ros",
    words("`out`: a topic with the value; `in`: that, and one that writes it; `closed`: neither.", _DIRECTIONS),
    _direction,
)
RATE = number_key("rate_limit_hz", "Most messages per second on the topic.", 0.01, 2000.0, "AMX6408")
"""Range of `rate_limit_hz`, 0.01 to 2000 Hz (decision: 2000 Hz is one message per tick of 0.5 ms)."""
_NON_VOLATILE = flag_key("non_volatile", "Whether the value survives STOP ALL, a power cycle and a restart.")
DESCRIPTION_LIMIT = 200
UNIT, DESCRIPTION = (
    text_key("unit", line("The engineer's unit.", 16)),
    text_key("description", line("A line about the variable.", DESCRIPTION_LIMIT), DESCRIPTION_LIMIT),
)
"""Longest `unit` and longest `description`, 16 and 200 characters (decision)."""
OPTIONS: Keys = {
    **schemas(_ROS, RATE),
    "preset": either(
        "Written when the rack starts; for an array also a list, the last subscript running fastest.",
        scalar("The value, for an array that of each element."),
        listed("A value for each element.", scalar("The value of an element.")),
    ),
    **schemas(_NON_VOLATILE, UNIT),
    "scale": SCALE,
    **schemas(DESCRIPTION),
    **KEYS,
}
"""The keys of a common variable."""
SCHEMA: Schema = may_be_empty(
    entries(
        "The rack's common variables: name, type character, length of a string, largest subscripts.",
        COMMON_NAME,
        may_be_empty(section("A common variable.", OPTIONS)),
    )
)
_PREDEFINED_BARE = {bare_name(name): name for name in PREDEFINED}


def _preset(node: Node | None, variable: CommonVariable, findings: ProblemList) -> Value | tuple[Value, ...] | None:
    what = f"preset of {variable.name}"
    if not isinstance(node, YamlSequence):
        return None if node is None else _read_one(node, variable, what, findings)
    if not variable.is_array:
        findings.add(_CODE, f"{what} is a list, but the variable is not an array", node.span)
        return None
    if len(node.items) != variable.elements:
        message = f"{what} has {len(node.items)} values; the array has {variable.elements} elements"
        findings.add(_CODE, message, node.span, "subscripts count from 0: an array (10) has 11 elements")
        return None
    values = [_read_one(item, variable, what, findings) for item in node.items]
    return tuple(value for value in values if value is not None) if None not in values else None


def _read_one(node: Node, variable: CommonVariable, what: str, findings: ProblemList) -> Value | None:
    kind = variable.type
    if kind is DataType.STRING:
        text = text_value(node, what, findings, limit=1000)
        if text is not None and len(text) > variable.length:
            message = f"{what} has {len(text)} characters; the string holds {variable.length}"
            findings.add(_CODE, message, node.span)
            return None
        return text
    value = value_of(node.text, kind) if is_plain_word(node) else None
    if value is None:
        findings.add(_CODE, f"{what} must be {wanted(kind)}, not {kind_of(node)}", node.span, number_hint(node))
    return value


class CommonReader:
    """Reads the ``common`` section."""

    def __init__(
        self, modules: Iterable[ModuleConfig], findings: ProblemList, unread: frozenset[int] = frozenset()
    ) -> None:
        """Create without variables; I/O points are on ``modules``, or in slots whose module could not be read."""
        self._points = PointReader(modules, findings, unread)
        self._findings = findings
        self._names: dict[str, Span] = {}
        self._bare: dict[str, tuple[str, Span]] = {}
        self._simple = 0
        self._left_closed: list[tuple[str, Span]] = []

    def read(self, node: Node) -> tuple[CommonVariable, ...]:
        """Return the variables without errors, in the order of the file."""
        entries = entries_of(node, "common", self._findings) or ()
        variables = [self._variable(key, value) for key, value in entries]
        if self._left_closed:
            name, span = self._left_closed[0]
            message = (
                f"{len(self._left_closed)} simple commons from {name} on have no topic: "
                f"without the key ros only the first {DEFAULT_OUT_LIMIT} of a rack are published"
            )
            self._findings.add("AMX6412", message, span, "write ros: out or ros: closed for each of them")
        return tuple(item for item in variables if item is not None)

    def _variable(self, key: Scalar, node: Node) -> CommonVariable | None:
        declared = self._name(key)
        has_options = entries_of(node, f"options of {quoted(key.text)}", self._findings) is not None
        if declared is None or not has_options:
            return None
        name = declared.name
        section = Section(node, f"common variable {name}", OPTIONS, self._findings, owner=name)
        self._check_predefined(key, declared, section)
        variable = CommonVariable(name, declared.type, declared.dimensions, declared.length, line=key.span.line)
        direction = self._direction(section, variable, key)
        point = self._points.read(section, declared, key.span)
        if direction is Direction.IN and point is not None:
            self._points.check_input(point, declared, section.key_span("ros"))
        return replace(
            variable,
            non_volatile=bool(section.read(_NON_VOLATILE)),
            preset=_preset(section.get("preset"), variable, self._findings),
            direction=direction,
            rate_limit_hz=self._rate(section, name, direction),
            unit=section.read(UNIT) or "",
            description=section.read(DESCRIPTION) or "",
            point=point,
            scale=self._scale(section, variable, direction),
        )

    def _name(self, key: Scalar) -> VariableName | None:
        try:
            declared = variable_name(self._findings.upper_case(key.text, key.span))
        except DeclarationFault as fault:
            self._findings.add(fault.code, f"{quoted(key.text)}: {fault.message}", key.span, fault.hint)
            return None
        bare = bare_name(declared.name)
        if is_reserved(declared.name):
            message = f"{declared.name} is a word of the language and cannot name a variable"
            self._findings.add("AMX6401", message, key.span)
        if declared.name in self._names:
            report_twice(key, f"variable {declared.name}", self._names[declared.name], self._findings, "AMX6402")
            return None
        if bare in self._bare:
            other, place = self._bare[bare]
            message = f"{declared.name} and {other} are two variables: they differ only in type"
            notes = (Note(f"{other} is defined here", place),)
            self._findings.add("AMX6403", message, key.span, "give one of them another name", notes)
        self._names[declared.name] = key.span
        self._bare.setdefault(bare, (declared.name, key.span))
        return declared

    def _check_predefined(self, key: Scalar, declared: VariableName, section: Section) -> None:
        """The rack writes these (2.4.6); a preset or a writer on ROS would contradict it (decision)."""
        name = _PREDEFINED_BARE.get(bare_name(declared.name))
        if name is None:
            return
        if declared.name != name or declared.dimensions:
            message = f"{declared.name} must be the simple BOOLEAN {name}: the name is pre-defined"
            self._findings.add("AMX6410", message, key.span)
        for option in ("preset", "non_volatile", *KEYS):
            if option in section:
                message = f"{name} has no {option}: the rack itself writes it"
                self._findings.add("AMX6410", message, section.key_span(option))
        ros = section.get("ros")
        if isinstance(ros, Scalar) and ros.text == "in":
            self._findings.add("AMX6410", f"{name} cannot be written: the rack itself writes it", ros.span)

    def _direction(self, section: Section, variable: CommonVariable, key: Scalar) -> Direction:
        if not variable.is_array:
            self._simple += 1
        node = section.get("ros")
        if node is None:
            return self._default_direction(variable, key)
        direction = section.read(_ROS) or Direction.CLOSED
        if direction is not Direction.CLOSED and variable.is_array and variable.type is DataType.STRING:
            message = f"{variable.name} cannot be published: ROS 2 has no standard message for an array of strings"
            self._findings.add("AMX6413", message, node.span, "write ros: closed")
        return direction

    def _default_direction(self, variable: CommonVariable, key: Scalar) -> Direction:
        if variable.is_array:
            return Direction.CLOSED
        if self._simple <= DEFAULT_OUT_LIMIT:
            return Direction.OUT
        self._left_closed.append((variable.name, key.span))
        return Direction.CLOSED

    def _rate(self, section: Section, name: str, direction: Direction) -> float | None:
        rate = section.read(RATE)
        if "rate_limit_hz" in section and direction is Direction.CLOSED:
            message = f"rate_limit_hz of {name} has no effect: the variable has no topic"
            self._findings.add("AMX6414", message, section.key_span("rate_limit_hz"), "write ros: out as well")
        return rate

    def _scale(self, section: Section, variable: CommonVariable, direction: Direction) -> Scale | None:
        node, name = section.get("scale"), variable.name
        if node is None:
            return None
        span = section.key_span("scale")
        if direction is Direction.CLOSED:
            message = f"scale of {name} has no effect: the variable has no topic"
            self._findings.add("AMX6451", message, span, "write ros: out or ros: in too")
        return scale_of(node, name, variable.type, span, self._findings, is_array=variable.is_array)
