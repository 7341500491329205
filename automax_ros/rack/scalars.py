"""Single values of a rack file: text, numbers, TRUE and FALSE, each checked where it stands."""

from __future__ import annotations

import re

from automax_ros.core.text import quoted
from automax_ros.rack.findings import Findings
from automax_ros.rack.yaml_text import Mapping, Node, Scalar, Sequence

WHOLE = re.compile(r"[-+]?(0|[1-9][0-9]{0,17})\Z")
"""A whole number: no leading zeros (YAML would read them as octal), no more digits than any range here needs."""
DECIMAL = re.compile(r"[-+]?([0-9]{1,60}(\.[0-9]{0,60})?|\.[0-9]{1,60})([eE][-+]?[0-9]{1,4})?\Z")
_TRUTH = {"true": True, "on": True, "false": False, "off": False}


def kind_of(node: Node) -> str:
    """Return in words what a node is, for messages that wanted something else."""
    if isinstance(node, Mapping):
        return "keys and values"
    if isinstance(node, Sequence):
        return "a list"
    if node.is_null:
        return "nothing"
    return quoted(node.text) if node.plain else f"the text {quoted(node.text)}"


def wrong_kind(node: Node, what: str, wanted: str, findings: Findings, hint: str | None = None) -> None:
    """Report that ``what`` is not of the kind it must be."""
    findings.add("AMX6008", f"{what} must be {wanted}, not {kind_of(node)}", node.span, hint)


def text_value(node: Node, what: str, findings: Findings, *, limit: int) -> str | None:
    """Return a text of one line with at most ``limit`` characters; quotes are optional."""
    if not isinstance(node, Scalar) or node.is_null:
        wrong_kind(node, what, "text", findings)
        return None
    if not is_clean(node.text):
        findings.add("AMX6010", f"{what} has characters that cannot be printed, or more than one line", node.span)
        return None
    if len(node.text) > limit:
        message = f"{what} has {len(node.text)} characters; it may have at most {limit}"
        findings.add("AMX6010", message, node.span)
        return None
    return node.text


def is_clean(text: str) -> bool:
    """Whether a text has only printable characters and tabs: nothing that ends a line or breaks an encoding."""
    return all(char.isprintable() or char == "\t" for char in text)


def truth(node: Node) -> bool | None:
    """Return the value of TRUE, ON, FALSE or OFF in any case; None for anything else."""
    return _TRUTH.get(node.text.lower()) if isinstance(node, Scalar) and node.plain and len(node.text) <= 5 else None


def boolean_value(node: Node, what: str, findings: Findings) -> bool | None:
    """Return true or false."""
    value = truth(node)
    if value is None:
        wrong_kind(node, what, "true or false", findings)
    return value


def integer_value(node: Node, what: str, findings: Findings, *, low: int, high: int, code: str) -> int | None:
    """Return a whole number from ``low`` to ``high``; ``code`` is the problem where it is not in this range."""
    if not isinstance(node, Scalar) or not node.plain or not WHOLE.match(node.text):
        wrong_kind(node, what, "a whole number", findings, number_hint(node))
        return None
    value = int(node.text)
    if not low <= value <= high:
        findings.add(code, f"{what} is {value}; it must be {low} to {high}", node.span)
        return None
    return value


def number_value(node: Node, what: str, findings: Findings, *, low: float, high: float, code: str) -> float | None:
    """Return a number from ``low`` to ``high``; ``code`` is the problem where it is not in this range."""
    if not isinstance(node, Scalar) or not node.plain or not DECIMAL.match(node.text):
        wrong_kind(node, what, "a number", findings, number_hint(node))
        return None
    value = float(node.text)
    if not low <= value <= high:
        findings.add(code, f"{what} is {quoted(node.text, marks='')}; it must be {low:g} to {high:g}", node.span)
        return None
    return value


def number_hint(node: Node) -> str | None:
    """Return what to do about a value that looks like a number but is none."""
    if not isinstance(node, Scalar) or len(node.text) > 60:
        return None
    if not node.plain and DECIMAL.match(node.text):
        return f"write {node.text} without quotes"
    digits = node.text.lstrip("+-")
    if node.plain and digits.startswith("0") and digits.isdecimal() and digits.strip("0"):
        return f"write {digits.lstrip('0')} without leading zeros"
    return None
