"""The report of a distributed rack: each process tells its part, and they are put together as if it had been one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def merged_report(
    parts: Mapping[str, Mapping[str, Any]], names: Sequence[str], deaths: Mapping[str, int]
) -> dict[str, Any]:
    """Return the report of a rack, from those of its processes by name.

    ``names`` are those of all processes, that of common memory first. Commons, forces and time are the first's; tasks
    and displays are of their own processes; what was done in several processes at one instant was done once, and is
    refused where one of them has refused it. ``processes`` says of each how often it died, whether it has told its
    part, and which commons had another value there at its end: those that were written in the last moment (decision).
    """
    there = [parts[name] for name in names if name in parts]
    first = there[0] if there else {}
    stops = [part["stopped"] for part in there if part["stopped"] is not None]
    return {
        **first,
        "stopped": min(stops, key=lambda stop: stop["time_s"]) if stops else None,
        "tasks": {task: told for part in there for task, told in part["tasks"].items()},
        "displays": {module: shown for part in there for module, shown in part.get("displays", {}).items()},
        "operations": _operations(item for part in there for item in part["operations"]),
        "processes": {
            name: {
                "deaths": deaths.get(name, 0),
                "told": name in parts,
                "differs": _differing(first, parts[name]) if name in parts else [],
            }
            for name in names
        },
    }


def _differing(first: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    return [name for name, value in first["commons"].items() if other["commons"].get(name) != value]


def _operations(told: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    found: dict[tuple[Any, ...], Mapping[str, Any]] = {}
    for item in told:
        key = item["at"], item["what"], item.get("of")
        if key not in found or not item["ok"]:
            found[key] = item
    return sorted(found.values(), key=lambda item: float(item["at"]))
