"""The table of common variables in a recording: which names it has and how the engineer asks for them."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.core.types import DataType
from automax_ros.wire.messages import Variable, VariableTable

_NAME = re.compile(r"[A-Z_][A-Z0-9_]{0,63}[%!@$]?")
_WATCH = re.compile(r"(?P<name>[A-Z_][A-Z0-9_]{0,63}[%!@$]?)(?:[(\[](?P<subscripts>\d{1,9}(?:,\d{1,9}){0,3})[)\]])?")


class WatchError(ValueError):
    """A name to watch is not one of the recording's variables; ``hint`` says which is near."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True)
class Watched:
    """One column of an export: a simple variable, or the element of an array at a flat index; the engineer's unit."""

    label: str
    variable: int
    element: int
    kind: DataType
    unit: str = ""


def checked_table(table: VariableTable) -> dict[str, Variable]:
    """Return the variables of a table by name.

    Raises:
        ValueError: an entry is not one that a rack writes.
    """
    by_name: dict[str, Variable] = {}
    for entry in table.variables:
        if not _NAME.fullmatch(entry.name):
            raise ValueError(f"variable {entry.id} is named {entry.name[:80]!r}")
        if entry.name in by_name:
            raise ValueError(f"variable {entry.name} stands in it twice")
        DataType.numbered(entry.type)
        by_name[entry.name] = entry
    if len({entry.id for entry in by_name.values()}) < len(by_name):
        raise ValueError("two variables have the same number")
    return by_name


def watched_by_default(variables: dict[str, Variable]) -> list[Watched]:
    """Return all simple numeric and boolean variables, in the order of the table."""
    return [
        Watched(name, entry.id, 0, DataType.numbered(entry.type), entry.unit)
        for name, entry in variables.items()
        if not entry.dimensions and entry.type != DataType.STRING.number
    ]


def watched_by_name(variables: dict[str, Variable], names: Sequence[str]) -> list[Watched]:
    """Return the variables and array elements that were asked for, such as ``REF%`` and ``TABLE%(3)``, each once.

    Raises:
        WatchError: there is no such variable or element.
    """
    found = (_find(variables, name) for name in names)
    return list({(item.variable, item.element): item for item in found}.values())


def _find(variables: dict[str, Variable], asked: str) -> Watched:
    match = _WATCH.fullmatch("".join(asked.upper().split()))
    entry = variables.get(match["name"]) if match else None
    if match is None or entry is None:
        raise WatchError(f"no common variable {asked[:80]!r} in the recording", _suggestion(variables, asked))
    kind = DataType.numbered(entry.type)
    if match["subscripts"] is None:
        if entry.dimensions:
            raise WatchError(f"{entry.name} is an array", f"name one element, such as {_element_name(entry)}")
        return Watched(entry.name, entry.id, 0, kind, entry.unit)
    subscripts = [int(text) for text in match["subscripts"].split(",")]
    if not entry.dimensions:
        raise WatchError(f"{entry.name} is not an array", f"write {entry.name}")
    if len(subscripts) != len(entry.dimensions):
        raise WatchError(
            f"{entry.name} has {len(entry.dimensions)} subscripts, not {len(subscripts)}",
            f"write it as {_element_name(entry)}",
        )
    for subscript, size in zip(subscripts, entry.dimensions, strict=True):
        if subscript >= size:
            raise WatchError(f"subscript {subscript} of {asked[:80]} is out of range", f"the largest is {size - 1}")
    label = f"{entry.name}({','.join(map(str, subscripts))})"
    return Watched(label, entry.id, flat_index(subscripts, entry.dimensions), kind, entry.unit)


def flat_index(subscripts: Sequence[int], dimensions: Sequence[int]) -> int:
    """Return the index of an array element, last dimension fastest."""
    index = 0
    for subscript, size in zip(subscripts, dimensions, strict=True):
        index = index * size + subscript
    return index


def _element_name(entry: Variable) -> str:
    return f"{entry.name}({','.join('0' * len(entry.dimensions))})"


def _suggestion(variables: dict[str, Variable], asked: str) -> str:
    name = "".join(asked.upper().split())[:80].split("(", 1)[0].split("[", 1)[0]
    near = difflib.get_close_matches(name, list(variables)[:5000], n=3, cutoff=0.6)
    near += [item for item in variables if item.rstrip("%!@$") == name.rstrip("%!@$") and item not in near]
    if near:
        return f"did you mean {' or '.join(near[:3])}?"
    return f"it has {', '.join(list(variables)[:8])}{' ...' if len(variables) > 8 else ''}"
