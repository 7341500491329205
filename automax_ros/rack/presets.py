"""Values that common variables have when the rack starts, each in the variable's own type.

The hardware has no presets; in the emulator one is a write by the rack at time 0 (semantics, Scan, memory, tasks).
"""

from __future__ import annotations

from automax_ros.core.types import DataType, Value
from automax_ros.core.values import value_of, wanted
from automax_ros.core.yaml_text import Node, Sequence
from automax_ros.rack.findings import Findings
from automax_ros.rack.names import VariableName
from automax_ros.rack.scalars import is_plain_word, kind_of, number_hint, text_value

_CODE = "AMX6406"


def preset_value(
    node: Node, variable: VariableName, elements: int, findings: Findings
) -> Value | tuple[Value, ...] | None:
    """Return the preset of a variable with ``elements`` values; None where there was something to report."""
    what = f"preset of {variable.name}"
    if not isinstance(node, Sequence):
        return _one(node, variable, what, findings)
    if not variable.dimensions:
        findings.add(_CODE, f"{what} is a list, but the variable is not an array", node.span)
        return None
    if len(node.items) != elements:
        message = f"{what} has {len(node.items)} values; the array has {elements} elements"
        findings.add(_CODE, message, node.span, "subscripts count from 0: an array (10) has 11 elements")
        return None
    values = [_one(item, variable, what, findings) for item in node.items]
    return tuple(value for value in values if value is not None) if None not in values else None


def _one(node: Node, variable: VariableName, what: str, findings: Findings) -> Value | None:
    kind = variable.type
    if kind is DataType.STRING:
        return _text(node, variable.length, what, findings)
    value = value_of(node.text, kind) if is_plain_word(node) else None
    if value is None:
        findings.add(_CODE, f"{what} must be {wanted(kind)}, not {kind_of(node)}", node.span, number_hint(node))
    return value


def _text(node: Node, length: int, what: str, findings: Findings) -> str | None:
    text = text_value(node, what, findings, limit=1000)
    if text is not None and len(text) > length:
        findings.add(_CODE, f"{what} has {len(text)} characters; the string holds {length}", node.span)
        return None
    return text
