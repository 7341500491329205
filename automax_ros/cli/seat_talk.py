"""What a process of a distributed rack tells the one that has started it: lines of JSON on its standard output.

Each line is an object with one key: ``say`` a line for the person, ``progress`` how it stands, ``summary`` what its
part of the run came to, ``report`` its part of the report, the last before it ends in order. Any other line is a
text that something else has printed, and is said as it is.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from automax_ros.cli.status_parts import Progress, Summary
from automax_ros.core.text import printable
from automax_ros.core.ticks import NS_PER_S

_PERIOD_NS = NS_PER_S // 5


@dataclass(frozen=True)
class Said:
    """A line for the person."""

    text: str


@dataclass(frozen=True)
class Reported:
    """The report of one process."""

    report: Mapping[str, Any]


Told = Said | Progress | Summary | Reported
"""What a line says."""


class ToldScreen:
    """The screen of a process that another one watches (``cli/status.Screen``)."""

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


def heard(line: str) -> Told:
    """Return what a line of a process says."""
    try:
        data = json.loads(line)
        if isinstance(data, dict) and len(data) == 1:
            ((key, value),) = data.items()
            return _KINDS[key](value)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    return Said(printable(line))


def _tell(key: str, value: object) -> None:
    sys.stdout.write(json.dumps({key: value}, allow_nan=False) + "\n")
    sys.stdout.flush()


def _with_tuples(data: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in data.items()}


_KINDS: dict[str, Callable[[Any], Told]] = {
    "say": lambda text: Said(str(text)),
    "progress": lambda data: Progress(**_with_tuples(data)),
    "summary": lambda data: Summary(**_with_tuples(data)),
    "report": Reported,
}
