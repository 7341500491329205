"""Gaps in the current: pulses that are missing in every cycle, as with an open gate or a blown fuse (52.3).

The current of a sound bridge is alike in all six scans of a cycle. Where some of them have little current while the
reference is steady, a regulator that reacts to each of them would drive up the sound pulses until the drive trips.
So it follows the mean of a cycle then, slowly, and keeps DELTA nearly constant: the drive runs on and can be diagnosed
(decision).
"""

from __future__ import annotations

from typing import Final

from automax_ros.drive.base.state import Stateful

CYCLE: Final = 6
"""Scans of a line cycle."""
LEAST: Final = 60.0
"""Reference below which nothing is called a gap, counts (decision)."""
LOW: Final = 0.5
HIGH: Final = 0.75
"""A scan with less than the first part of the reference is a gap if another of the cycle has more than the second
(decision)."""
STEADY: Final = 12
"""Scans for which a reference must have been steady (decision)."""
STEP: Final = 0.06
"""Largest change of a steady reference in a scan: this part of it plus ``STEP_COUNTS`` (decision)."""
STEP_COUNTS: Final = 12.0
MEMORY: Final = 18
"""Scans for which the regulator stays slow after a gap (decision: three cycles)."""
SURGE: Final = 1.4
"""A scan above this times the greatest of the previous cycle and the reference, plus ``SURGE_COUNTS``, is not due to a
gap, and the regulator is no longer slow (decision)."""
SURGE_COUNTS: Final = 400.0


class Gaps(Stateful):
    """Watches the current of each scan for gaps.

    Attributes:
        recent: the current of the last six scans, counts in the direction of the bridge in use.
        left: scans for which the regulator stays slow; 0 while there is no gap.
    """

    _kept = ("recent", "left", "_wanted", "_steady")

    def __init__(self) -> None:
        self.recent = [0.0] * CYCLE
        self.left = 0
        self._wanted = 0.0
        self._steady = 0

    def begin(self) -> None:
        """Start a run, or use of another bridge."""
        self.recent = [0.0] * CYCLE
        self.left = self._steady = 0

    @property
    def mean(self) -> float:
        """The mean current of the last cycle, counts."""
        recent = self.recent
        return (recent[0] + recent[1] + recent[2] + recent[3] + recent[4] + recent[5]) / CYCLE

    def see(self, current: float, wanted: float) -> bool:
        """Add current and reference of a scan, counts in the direction of the bridge; return whether there are gaps."""
        recent = self.recent
        greatest = max(recent)
        surge = current > SURGE * max(greatest, wanted) + SURGE_COUNTS
        self.recent = [*recent[1:], current]
        change = wanted - self._wanted
        self._wanted = wanted
        if wanted < LEAST:
            self.left = 0
        self._steady = self._steady + 1 if abs(change) <= STEP * wanted + STEP_COUNTS and wanted >= LEAST else 0
        if surge:
            self.left = 0
        elif self._is_gap(current, greatest, wanted):
            self.left = MEMORY
        elif self.left:
            self.left -= 1
        return self.left > 0

    def _is_gap(self, current: float, greatest: float, wanted: float) -> bool:
        """Return whether a scan is a gap: first compared with the reference, then with the mean of the cycle."""
        if self.left:
            wanted = self.mean
            return current < LOW * wanted and wanted >= LEAST
        return self._steady > STEADY and current < LOW * wanted and greatest > HIGH * wanted
