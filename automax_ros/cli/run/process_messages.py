"""The report of a distributed rack: each process tells its part, and they are put together as if it had been one."""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from automax_ros.cli.run.status import Progress, Summary
from automax_ros.core.text import printable
from automax_ros.core.ticks import NS_PER_S

_PERIOD_NS = NS_PER_S // 5


@dataclass(frozen=True)
class TextLine:
    """A line for the person."""

    text: str


@dataclass(frozen=True)
class Reported:
    """The report of one process."""

    report: Mapping[str, Any]


ProcessMessage = TextLine | Progress | Summary | Reported
"""What a line says."""


class ProcessOutput:
    """The screen of a process that another one watches (``cli/run/status.Screen``)."""

    def __init__(self) -> None:
        """Begin; nothing is told yet."""
        self.began_ns = self._last_ns = time.monotonic_ns()

    def due(self) -> int:
        """Return the ns since the last progress if it is time for the next, else 0."""
        now = time.monotonic_ns()
        passed = now - self._last_ns
        if passed < _PERIOD_NS:
            return 0
        self._last_ns = now
        return passed

    def progress(self, progress: Progress) -> None:
        """Tell how the process stands."""
        _tell("progress", dataclasses.asdict(progress))

    def message(self, text: str) -> None:
        """Tell a line."""
        _tell("say", text)

    def summary(self, summary: Summary) -> None:
        """Tell what the process's part came to."""
        _tell("summary", dataclasses.asdict(summary))


def tell_report(report: Mapping[str, Any]) -> None:
    """Tell this process's part of the report: it ends in order."""
    _tell("report", report)


def heard(line: str) -> ProcessMessage:
    """Return what a line of a process says."""
    try:
        data = json.loads(line)
        if isinstance(data, dict) and len(data) == 1:
            ((key, value),) = data.items()
            return _KINDS[key](value)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    return TextLine(printable(line))


def _tell(key: str, value: object) -> None:
    sys.stdout.write(json.dumps({key: value}, allow_nan=False) + "\n")
    sys.stdout.flush()


def _with_tuples(data: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in data.items()}


_KINDS: dict[str, Callable[[Any], ProcessMessage]] = {
    "say": lambda text: TextLine(str(text)),
    "progress": lambda data: Progress(**_with_tuples(data)),
    "summary": lambda data: Summary(**_with_tuples(data)),
    "report": Reported,
}


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
