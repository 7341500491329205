"""The table of common variables in a recording: which names it has and how the engineer asks for them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.core.names import element
from automax_ros.core.types import DataType
from automax_ros.wire.messages import Variable, VariableTable

_NAME = re.compile(r"[A-Z_][A-Z0-9_]{0,63}[%!@$]?|SLOT:[0-9]{1,2}%")


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
        NameFault: there is no such variable or element.
    """
    found = (element(name, variables, "the recording has no common variable") for name in names)
    columns = {
        item.label: Watched(
            item.label, item.variable.id, item.index, DataType.numbered(item.variable.type), item.variable.unit
        )
        for item in found
    }
    return list(columns.values())
