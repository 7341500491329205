"""`watch` and `alarms` of a rack file: the commons to show, and the booleans that are alarms, in this order."""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import SCALAR, Schema, listed
from automax_ros.core.names import NameFault, element
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node
from automax_ros.core.yaml_text import YamlSequence as YamlList
from automax_ros.rackfile.model.config import CommonElement, CommonVariable
from automax_ros.rackfile.reading.values import ProblemList, text_value, wrong_kind

MOST_WATCHED = 16
"""Most commons that a rack file watches (decision: a line of a terminal holds no more)."""
MOST_ALARMS = 128
"""Most alarms of a rack file (decision: a bound, far above what a panel's annunciator has)."""
_LONGEST = 100
SCHEMA: Schema = listed(
    "The commons that the status line shows, in this order: `REF%`, `TABLE%(3)`.",
    {"type": list(SCALAR)},
    0,
    MOST_WATCHED,
)
ALARMS_SCHEMA: Schema = listed(
    "The booleans that are alarms: `BREAK@`, `FAULT@(3)`; reports tell when each came and went.",
    {"type": list(SCALAR)},
    0,
    MOST_ALARMS,
)


def read_watch(
    node: Node, variables: Sequence[CommonVariable], findings: ProblemList
) -> tuple[CommonElement, ...] | None:
    """Return the commons that a rack file watches; report errors in the findings.

    Commons are not looked up while the file has other errors, which may be in the commons.
    """
    hint = "keep those that show how the plant stands"
    found = _Named("watch", MOST_WATCHED, "write watch: [REF%, RUN@]", hint).read(node, variables, findings)
    return None if found is None else tuple(meant for meant, _ in found)


def read_alarms(node: Node, variables: Sequence[CommonVariable], findings: ProblemList) -> tuple[CommonElement, ...]:
    """Return the booleans that a rack file calls alarms, as ``read_watch`` does; none if there are errors."""
    hint = "keep those that tell a person of a fault"
    found = _Named("alarms", MOST_ALARMS, "write alarms: [FAULT@, BREAK@]", hint).read(node, variables, findings) or []
    for meant, span in found:
        kind = meant.variable.type
        if kind is not DataType.BOOLEAN:
            message = f"alarms names {meant.label}, which is {kind.word}: an alarm is a BOOLEAN"
            findings.add("AMX6225", message, span, "name the BOOLEAN that a task makes of it")
    return tuple(meant for meant, _ in found)


class _Named:
    """A key of a rack file whose value is a list of commons, each named once."""

    def __init__(self, key: str, most: int, form: str, fewer: str) -> None:
        self._key, self._most, self._form, self._fewer = key, most, form, fewer

    def read(
        self, node: Node, variables: Sequence[CommonVariable], findings: ProblemList
    ) -> list[tuple[CommonElement, Span]] | None:
        """Return the commons with their places; report errors in the findings."""
        key = self._key
        if not isinstance(node, YamlList):
            wrong_kind(node, key, "a list of commons", findings, self._form)
            return None
        if len(node.items) > self._most:
            message = f"{key} names {len(node.items)} commons; it may name at most {self._most}"
            findings.add("AMX6222", message, node.span, self._fewer)
            return None
        known = {variable.name: variable for variable in variables}
        is_whole = not findings.errors
        found: dict[str, tuple[CommonElement, Span]] = {}
        for item in node.items:
            name = text_value(item, f"a common of {key}", findings, limit=_LONGEST)
            if name is None or not is_whole:
                continue
            try:
                meant = element(name, known, f"{key}: the rack has no common variable")
            except NameFault as fault:
                findings.add("AMX6220", fault.message, item.span, fault.hint)
                continue
            if meant.label in found:
                first = found[meant.label][1]
                message = f"{key} names {meant.label} twice"
                findings.add("AMX6221", message, item.span, "leave one out", (Note("first here", first),))
            else:
                found[meant.label] = meant, item.span
        return list(found.values())
