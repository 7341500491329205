"""The hardware's overspeed circuit, which DIGITAL_TACH sets up: it trips a drive without its loop (52.1.5).

It counts the pulses of a digital tachometer, so it detects a speed that has been above the threshold for
``COUNTED_NS``. The threshold is OSV_THRESH at task initialisation, in counts of which 4095 are full speed; it stays
until the next initialisation or a loss of power, also while no task runs. A trip turns gates and contactor off, and is
kept until it was reported to the loop and the loop's faults are reset, which they cannot be while the speed is above
the threshold (decision: of the circuit nothing is published but that it is there).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from automax_ros.drive.plant.plant import RAD_S_PER_RPM, DrivePlant
from automax_ros.drive.plant.signals import tach_rpm

COUNTED_NS: Final = 20_000_000
"""Time for which the circuit counts pulses, ns (decision: longer than a feed and a scan take, so an OSV_FDBK that is
sound trips first)."""
FULL: Final = 4095
"""Counts of full speed (52.1.5, SPEED_FDBK)."""
NEVER: Final = -1
SOUND, TRIPPED, REPORTED = 0, 1, 2
"""The circuit has not tripped; it has tripped; it has tripped and reported this to the loop."""


class OverspeedCircuit:
    """The circuit of one drive.

    Attributes:
        counts: the threshold, 0 where the circuit is not set up.
    """

    def __init__(self, plant: DrivePlant | None, full_rpm: float | None = None) -> None:
        """Create it without a threshold; ``full_rpm``: the speed of 4095 counts, None for the motor's base speed."""
        self._plant = plant
        self._full_rpm = full_rpm or 0.0
        if plant is not None and not full_rpm:
            self._full_rpm = plant.data.parameters.values["base_speed_rad_s"].value / RAD_S_PER_RPM
        self.counts = 0
        self._above_ns = NEVER
        self._trip = SOUND

    @property
    def threshold_rpm(self) -> float:
        """The threshold, rpm."""
        return self.counts * self._full_rpm / FULL

    @property
    def sees(self) -> bool:
        """Whether it measures a speed above the threshold."""
        plant = self._plant
        return plant is not None and 0 <= self._above_ns <= plant.now_ns - COUNTED_NS

    @property
    def tripped(self) -> bool:
        """Whether a trip keeps gates and contactor off."""
        return self._trip != SOUND

    @property
    def is_news(self) -> bool:
        """Whether it has tripped and not reported this to the loop."""
        return self._trip == TRIPPED

    def look(self) -> bool:
        """Check the plant's present speed; return whether the circuit trips now."""
        plant = self._plant
        if plant is None or not self.counts:
            return False
        if abs(tach_rpm(plant)) <= self.threshold_rpm:
            self._above_ns = NEVER
            return False
        if self._above_ns == NEVER:
            self._above_ns = plant.now_ns
        if self._trip != SOUND or not self.sees:
            return False
        self._trip = TRIPPED
        return True

    def note_reported(self) -> None:
        """Record that the trip was reported to the loop."""
        if self._trip == TRIPPED:
            self._trip = REPORTED

    def holds(self, *, ok: bool) -> bool:
        """Return whether a trip holds gates and contactor off against a command; ``ok``: the loop has no fault."""
        if self._trip == REPORTED and ok and not self.sees:
            self._trip = SOUND
        return self._trip != SOUND

    def unpower(self) -> None:
        """Clear threshold and trip: the module has no power."""
        self.load((0, NEVER, SOUND))

    def state(self) -> list[int]:
        """Return the state."""
        return [self.counts, self._above_ns, self._trip]

    def load(self, state: Sequence[int]) -> None:
        """Restore what ``state`` returned."""
        self.counts, self._above_ns, self._trip = state
