"""A YAML text as an editor's language server reads it: plain values by the core schema of YAML 1.2 (10.3.2)."""

from __future__ import annotations

import math
import re
from typing import Any

from automax_ros.core.yaml_text import Node, Scalar, YamlSequence, read_yaml

NULL = re.compile(r"null|Null|NULL|~|")
TRUTH = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
WHOLE = re.compile(r"[-+]?[0-9]+")
REAL = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
INFINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


def data_of(text: str) -> Any:
    """Return the data of a text; keys are texts, as in JSON."""
    flaws: list[str] = []
    root = read_yaml(text, lambda _flaw, message, _span, _hint: flaws.append(message))
    assert flaws == []
    return None if root is None else _data(root)


def _data(node: Node) -> Any:
    if isinstance(node, YamlSequence):
        return [_data(item) for item in node.items]
    if isinstance(node, Scalar):
        return _plain(node.text) if node.plain else node.text
    return {key.text: _data(value) for key, value in node.entries}


def _plain(text: str) -> Any:
    if NULL.fullmatch(text):
        return None
    if text in TRUTH:
        return TRUTH[text]
    if WHOLE.fullmatch(text):
        return int(text)
    if REAL.fullmatch(text):
        return float(text)
    return math.inf if INFINITE.fullmatch(text) else text
