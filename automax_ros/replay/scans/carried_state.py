"""Proof that a replay that begins with a file of a recording equals one that continues from the file before.

Each file of a split recording begins with an image of memory and the states of all tasks. One pass processes a file and
the beginning of the next one up to its first scan; another pass begins with that next file. If both carry the same
state at that place, everything after it is the same, too, and their totals can be added up.

Information from before the file that is nowhere in it is excluded from the comparison, and a pass reports if it needs
it: values latched before (unless the first scan of a task is a full one), when the task scanned last, whether a task
that no longer scans has stopped by itself, forces that held earlier. Then the comparison proves nothing.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from automax_ros.core.types import Value
from automax_ros.messages.types.messages import Scan


@dataclass(frozen=True)
class Skipped:
    """State that scan-by-scan replay needs about scans replayed in columns.

    Stamp, duration, number and ``latched`` are those of the last scan. ``errors`` are scan, line and code of each
    logged error.
    """

    count: int
    scan: int
    stamp: int
    duration_ns: int
    latched: Sequence[Value]
    errors: Sequence[tuple[int, int, int]]
    counted: bool


class PartStart:
    """The information that one task needs from before its first message: ``unsure`` if it may matter.

    ``scanned``: there was a scan; ``went_on``: the first one was not the start of the task.
    """

    def __init__(self) -> None:
        self.unsure = self.scanned = self.went_on = False
        self._latch_told = False

    @property
    def is_settled(self) -> bool:
        """Whether there was a scan with its latched values: later ones need nothing from before the first message."""
        return self._latch_told

    def asks_back(self, matters: bool) -> None:
        """Record that the time of the last scan is needed; ``matters``: the result depends on it."""
        self.unsure = self.unsure or (matters and not self.scanned)

    def scans(self, scan: Scan) -> None:
        """Record a scan."""
        if not self.scanned:
            self.scanned, self.went_on = True, scan.scan != 0
        if not self._latch_told and scan.scan:
            self._latch_told = True
            self.unsure = self.unsure or not scan.full


@dataclass(frozen=True)
class CarriedState:
    """The state of a pass at a place of a recording: a SHA-256, the stopped tasks, whether no force has ever held."""

    content: str
    stopped: frozenset[str]
    knows_no_force: bool


def digest(content: object) -> str:
    """Return a SHA-256 of numbers, texts and None in lists, tuples and dicts, bit for bit."""
    return hashlib.sha256(repr(content).encode()).hexdigest()
