"""Messages from the processes of a distributed rack to their supervisor, one JSON line each, and the merged report."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from automax_ros.cli.run.status import Progress, Summary, TerminalOutput
from automax_ros.core.text import printable
from automax_ros.core.ticks import NS_PER_S

_PERIOD_NS = NS_PER_S // 5


@dataclass(frozen=True)
class TextLine:
    """A line of text for the user."""

    text: str


@dataclass(frozen=True)
class Reported:
    """The report of one process."""

    report: Mapping[str, Any]


ProcessMessage = TextLine | Progress | Summary | Reported
"""A message, parsed from a line."""


class ProcessOutput(TerminalOutput):
    """Sends the output of a process to the one that has started it."""

    def __init__(self) -> None:
        """Create the output; nothing is sent yet."""
        super().__init__()
        self._period_ns = _PERIOD_NS

    def progress(self, progress: Progress) -> None:
        """Send the progress of the process."""
        _send("progress", dataclasses.asdict(progress))

    def message(self, text: str) -> None:
        """Send a line of text."""
        _send("say", text)

    def summary(self, summary: Summary) -> None:
        """Send the summary of the process's part."""
        _send("summary", dataclasses.asdict(summary))


def send_report(report: Mapping[str, Any]) -> None:
    """Send this process's part of the report, by which it announces a clean end."""
    _send("report", report)


def parse_message(line: str) -> ProcessMessage:
    """Return the message in a line of a process; a line that is not a message is text."""
    try:
        data = json.loads(line)
        if isinstance(data, dict) and len(data) == 1:
            ((key, value),) = data.items()
            return _KINDS[key](value)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    return TextLine(printable(line))


def _send(key: str, value: object) -> None:
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

    ``names`` are those of all processes, that of common memory first. Commons, forces and time are taken from the
    first, tasks and displays from their own processes. Operations in several processes at one instant count as one,
    which is refused if one of them refused it. ``processes`` gives for each how often it died, whether it has sent its
    part, and which commons had another value there at its end: those that were written in the last moment (decision).
    """
    there = [parts[name] for name in names if name in parts]
    first = there[0] if there else {}
    stops = [part["stopped"] for part in there if part["stopped"] is not None]
    return {
        **first,
        "stopped": min(stops, key=lambda stop: stop["time_s"]) if stops else None,
        "tasks": {task: report for part in there for task, report in part["tasks"].items()},
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


def _operations(reported: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    found: dict[tuple[Any, ...], Mapping[str, Any]] = {}
    for item in reported:
        key = item["at"], item["what"], item.get("of")
        if key not in found or not item["ok"]:
            found[key] = item
    return sorted(found.values(), key=lambda item: float(item["at"]))
