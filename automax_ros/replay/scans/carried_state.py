"""Whether a replay that begins with a file of a recording is the same as one that comes to it from the file before.

Each file of a split recording begins with an image of memory and the states of all tasks. One pass takes a file, and of
the next one what stands before its first scan; another begins with that next file. Where what both carry is the same at
that place, all that follows is the same, too, and what they count can be added up.

What was before the file and is told nowhere in it is left out of the comparison, and a pass says if it asks for it:
values that were latched before (the first scan of each task is a full one), when the task scanned last, whether a task
that does not scan any more has stopped by itself, forces that held earlier. Then it proves nothing.

What the path scan by scan must know of scans that were executed otherwise.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.core.types import Value
from automax_ros.messages.types.messages import Scan


@dataclass(frozen=True)
class Skipped:
    """Scans that were executed again elsewhere: stamp, length, number and ``latched`` are those of the last.

    ``errors`` are scan, line and code of each that was logged.
    """

    count: int
    scan: int
    stamp: int
    duration_ns: int
    latched: Sequence[Value]
    errors: Sequence[tuple[int, int, int]]
    counted: bool


class PartStart:
    """What one task asks of the time before its first message: ``unsure`` if an answer may matter.

    ``scanned`` and ``went_on``: whether a scan came, and whether the first one was not the start of the task.
    """

    def __init__(self) -> None:
        self.unsure = self.scanned = self.went_on = False
        self._latch_told = False

    @property
    def is_settled(self) -> bool:
        """Whether a scan has told what it latched: later ones ask for nothing before the first message."""
        return self._latch_told

    def asks_back(self, matters: bool) -> None:
        """When the task scanned last is asked for."""
        self.unsure = self.unsure or (matters and not self.scanned)

    def scans(self, scan: Scan) -> None:
        """A scan comes."""
        if not self.scanned:
            self.scanned, self.went_on = True, scan.scan != 0
        if not self._latch_told and scan.scan:
            self._latch_told = True
            self.unsure = self.unsure or not scan.full


@dataclass(frozen=True)
class CarriedState:
    """What a pass carries to a place of a recording: a SHA-256, the stopped tasks, whether no force has ever held."""

    content: str
    stopped: frozenset[str]
    knows_no_force: bool


def digest(content: object) -> str:
    """Return a SHA-256 of numbers, texts and None in lists, tuples and dicts, bit for bit."""
    return hashlib.sha256(repr(content).encode()).hexdigest()
