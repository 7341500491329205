"""`watch` of a rack file: the commons to show, in this order."""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import SCALAR, Schema, listed
from automax_ros.core.names import NameFault, element
from automax_ros.core.yaml_text import Node
from automax_ros.core.yaml_text import YamlSequence as YamlList
from automax_ros.rackfile.model.config import CommonElement, CommonVariable
from automax_ros.rackfile.reading.values import ProblemList, text_value, wrong_kind

MOST_WATCHED = 16
"""Most commons that a rack file watches (decision: a line of a terminal holds no more)."""
_LONGEST = 100
SCHEMA: Schema = listed(
    "The commons that the status line shows, in this order: `REF%`, `TABLE%(3)`.",
    {"type": list(SCALAR)},
    0,
    MOST_WATCHED,
)


def read_watch(
    node: Node, variables: Sequence[CommonVariable], findings: ProblemList
) -> tuple[CommonElement, ...] | None:
    """Return the commons that a rack file watches; report errors in the findings.

    Commons are not looked up while the file has other errors, which may be in the commons.
    """
    if not isinstance(node, YamlList):
        wrong_kind(node, "watch", "a list of commons", findings, "write watch: [REF%, RUN@]")
        return None
    if len(node.items) > MOST_WATCHED:
        message = f"watch names {len(node.items)} commons; it may name at most {MOST_WATCHED}"
        findings.add("AMX6222", message, node.span, "keep those that show how the plant stands")
        return None
    known = {variable.name: variable for variable in variables}
    is_whole = not findings.errors
    found: dict[str, tuple[CommonElement, Span]] = {}
    for item in node.items:
        name = text_value(item, "a common of watch", findings, limit=_LONGEST)
        if name is None or not is_whole:
            continue
        try:
            meant = element(name, known, "watch: the rack has no common variable")
        except NameFault as fault:
            findings.add("AMX6220", fault.message, item.span, fault.hint)
            continue
        if meant.label in found:
            first = found[meant.label][1]
            findings.add(
                "AMX6221", f"watch names {meant.label} twice", item.span, "leave one out", (Note("first here", first),)
            )
        else:
            found[meant.label] = meant, item.span
    return tuple(meant for meant, _ in found.values())
