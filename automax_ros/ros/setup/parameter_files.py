"""Parameters that a command line gives nodes at the start: ``-p`` and ``--params-file``, in their order, the last wins.

rcl gives them to the nodes, too, but does not report a file's key that no node has, nor a name that no node declares:
both are lost silently. So they are read here as well, by rcl's rules, with their places.

- A node's key is its full name, ``/pm1/processor_1``; ``*`` matches one part of it, ``**`` any number. One without a
  leading slash matches the end of the name: ``processor_1`` (decision: rcl would look for ``/processor_1``).
- The program's name in launch, ``/plant/NAME`` with ``-r __ns:=/plant -r __node:=NAME``, means its main node.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, islice
from pathlib import Path
from typing import TypeAlias

from automax_ros.core.diagnostics import Span
from automax_ros.core.text import quoted
from automax_ros.core.user_error import UserError
from automax_ros.core.yaml_text import Flaw, Node, Scalar, YamlMapping, YamlSequence, read_yaml
from automax_ros.rackfile.reading.files import FileFault, read_bytes

ParameterValue: TypeAlias = "bool | int | float | str | list[bool] | list[int] | list[float] | list[str] | None"
MOST_PARAMETERS = 10_000
"""Most parameters of a file (decision: a rack has some hundred tunables)."""
_PARAMETERS = "ros__parameters"
_EVERY = "/**"
_WILD = {"**": "(/[^/]+)*", "*": "/[^/]+"}
_TRUE = frozenset(["y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
_FALSE = frozenset(["n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
_WHOLE = re.compile(r"[-+]?(0x[0-9a-fA-F]{1,16}|[1-9][0-9]{0,18}|0[0-7]{0,18})")
_OCTAL = re.compile(r"[-+]?0[0-7]+")
"""Octal as in C, in which rcl is written; with an 8 or 9 in it, rcl reads a real."""
_REAL = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


class RosArgumentsError(UserError):
    """The words after ``--ros-args``, a file that they name, or ROS_NAMESPACE cannot be used."""


@dataclass(frozen=True)
class GivenParameter:
    """One parameter as it was given: the key of its nodes, its name, its value, and its place."""

    key: str
    name: str
    value: ParameterValue
    place: str

    @property
    def is_for_all(self) -> bool:
        """Whether it names no single node, so that it may be meant for another program."""
        return "*" in self.key

    def means(self, node: str) -> bool:
        """Return whether it is for the node with this full name."""
        pattern = self.key if self.key.startswith("/") else f"{_EVERY}/{self.key}"
        # Repeated ** count once: with many of them a match would take for ever.
        parts = (part for part, same in groupby(pattern.strip("/").split("/")) for part in _once(part, list(same)))
        return re.fullmatch("".join(_WILD.get(part, f"/{re.escape(part)}") for part in parts), node) is not None


def _once(part: str, same: list[str]) -> list[str]:
    return [part] if part == "**" else same


def parameter_of(rule: str) -> GivenParameter:
    """Return the parameter of a rule ``NAME:=VALUE`` or ``NODE:NAME:=VALUE``.

    Raises:
        RosArgumentsError: it cannot be read.
    """
    place = f"-p {quoted(rule, marks='', limit=80)}"
    source, sign, text = rule.partition(":=")
    key, _, name = source.rpartition(":")
    if not sign or not name:
        raise RosArgumentsError(f"{place}: not NAME:=VALUE or NODE:NAME:=VALUE")
    value = _value(_tree(text, place), place)
    return GivenParameter(key or _EVERY, name, value, place)


def parameters_of(path: Path) -> list[GivenParameter]:
    """Return the parameters of a file.

    Raises:
        RosArgumentsError: it cannot be read, or has too many.
    """
    try:
        text = read_bytes(path).decode()
    except UnicodeDecodeError as error:
        raise RosArgumentsError("is not text in UTF-8", place=str(path)) from error
    except FileFault as fault:
        raise RosArgumentsError(str(fault), place=str(path)) from fault
    root = _tree(text, str(path))
    if isinstance(root, Scalar) and root.is_null:
        return []
    found = list(islice(_nodes(root, "", str(path)), MOST_PARAMETERS + 1))
    if len(found) > MOST_PARAMETERS:
        raise RosArgumentsError(f"more than {MOST_PARAMETERS} parameters", place=str(path))
    return found


def _tree(text: str, place: str) -> Node:
    def report(_: Flaw, message: str, span: Span, hint: str | None) -> None:
        raise RosArgumentsError(message, hint, place=f"{place}:{span.line}")

    tree = read_yaml(text, report, "parameters")
    assert tree is not None  # what is wrong was raised
    return tree


def _nodes(node: Node, key: str, path: str) -> Iterator[GivenParameter]:
    if not isinstance(node, YamlMapping):
        raise _fault(f"{key or 'it'} must hold {_PARAMETERS}", node, path)
    for name, value in node.entries:
        if name.text == _PARAMETERS:
            yield from _parameters(value, key or _EVERY, "", path)
        else:
            yield from _nodes(value, f"{key}/{name.text.lstrip('/')}" if key else name.text, path)


def _parameters(node: Node, key: str, prefix: str, path: str) -> Iterator[GivenParameter]:
    if not isinstance(node, YamlMapping):
        raise _fault(f"{_PARAMETERS} of {key} must be names and values", node, path)
    for name, value in node.entries:
        full = f"{prefix}{name.text}"
        if isinstance(value, YamlMapping):
            yield from _parameters(value, key, f"{full}.", path)
        else:
            place = f"{path}:{name.span.line}"
            yield GivenParameter(key, full, _value(value, place), place)


def _value(node: Node, place: str) -> ParameterValue:
    if isinstance(node, Scalar):
        return _scalar(node)
    if isinstance(node, YamlSequence):
        found = [_scalar(item) if isinstance(item, Scalar) else None for item in node.items]
        for kind in (bool, int, float, str):
            if all(type(item) is kind for item in found):
                return found  # type: ignore[return-value]  # all are of one type
    raise RosArgumentsError("a parameter's value is a single value, or a list of values of one type", place=place)


def _scalar(node: Scalar) -> bool | int | float | str | None:
    text = node.text
    if not node.plain:
        return text
    if node.is_null:
        return None
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if _WHOLE.fullmatch(text):
        return int(text, 16 if "x" in text else 8 if _OCTAL.fullmatch(text) else 10)
    if _REAL.fullmatch(text):
        return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    return text


def _fault(message: str, node: Node, path: str) -> RosArgumentsError:
    return RosArgumentsError(message, place=f"{path}:{node.span.line}")
