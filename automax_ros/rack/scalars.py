"""Single values of a rack file: text, numbers, TRUE and FALSE, each checked where it stands."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TypeGuard, TypeVar

from automax_ros.core.text import quoted
from automax_ros.core.types import DataType
from automax_ros.core.values import is_number, number, value_of, whole_number
from automax_ros.core.yaml_text import Mapping, Node, Scalar, Sequence
from automax_ros.rack.findings import Findings

_OCTAL = re.compile(r"[-+]?0+[0-9]")
"""Leading zeros make another number in YAML."""
_T = TypeVar("_T", int, float)


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


def boolean_value(node: Node, what: str, findings: Findings) -> bool | None:
    """Return true or false."""
    value = value_of(node.text, DataType.BOOLEAN) if is_plain_word(node) else None
    if not isinstance(value, bool):
        wrong_kind(node, what, "true or false", findings)
        return None
    return value


def integer_value(node: Node, what: str, findings: Findings, *, low: int, high: int, code: str) -> int | None:
    """Return a whole number from ``low`` to ``high``; ``code`` is the problem where it is not in this range."""
    return _number(node, what, "a whole number", whole_number, findings, (low, high, code))


def number_value(node: Node, what: str, findings: Findings, *, low: float, high: float, code: str) -> float | None:
    """Return a number from ``low`` to ``high``; ``code`` is the problem where it is not in this range."""
    return _number(node, what, "a number", number, findings, (low, high, code))


def is_plain_word(node: Node) -> TypeGuard[Scalar]:
    """Whether a node is a single value without quotes, and without the leading zeros that YAML reads as octal."""
    return isinstance(node, Scalar) and node.plain and not _OCTAL.match(node.text)


def _number(
    node: Node,
    what: str,
    word: str,
    read: Callable[[str], _T],
    findings: Findings,
    limits: tuple[float, float, str],
) -> _T | None:
    low, high, code = limits
    try:
        if not is_plain_word(node):
            raise ValueError
        value = read(node.text)
    except ValueError:
        wrong_kind(node, what, word, findings, number_hint(node))
        return None
    if not low <= value <= high:
        message = f"{what} is {quoted(node.text, marks='')}; it must be {low:g} to {high:g}"
        findings.add(code, message, node.span)
        return None
    return value


def number_hint(node: Node) -> str | None:
    """Return what to do about a value that looks like a number but is not read as one."""
    if not isinstance(node, Scalar) or len(node.text) > 60:
        return None
    if not node.plain and is_number(node.text):
        return f"write {node.text} without quotes"
    digits = node.text.lstrip("+-")
    if node.plain and digits.startswith("0") and digits.isdecimal() and digits.strip("0"):
        return f"write {digits.lstrip('0')} without leading zeros"
    return None
