"""A task in a rack file, and the limits of priorities and numbers of tasks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

MIN_PRIORITY, MAX_PRIORITY = 4, 11
"""Priorities of tasks: 4 is served first (J2-3106-1 p. 8-2)."""
MAX_TASKS = 32
"""Most tasks of one Processor (J2-3106-1 p. 2-5)."""


@dataclass(frozen=True)
class TaskConfig:
    """A task of a module: ``file`` is its source, ``priority`` is 4 (first) to 11 on a Processor.

    A UDC's tasks have a ``drive``, A or B, in place of a priority (J2-3106-1 p. 8-2): their ``priority`` is 0 and 1,
    so that A comes before B. A ``critical`` task cannot be stopped alone, only with all others (J2-3106-1 p. 8-2).
    """

    name: str
    file: Path
    priority: int
    line: int = 0
    critical: bool = False
    drive: str = ""
