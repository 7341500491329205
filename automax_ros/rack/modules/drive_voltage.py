"""A 57C405 of a running rack: it shows the armature voltage that is wired to it (52.6.1)."""

from __future__ import annotations

from functools import cache

from automax_ros.core.numbers import round_count
from automax_ros.rack.modules.io_module import IoModule

GAINS = {230: 0.02, 380: 0.0121, 460: 0.01, 550: 0.00835, 660: 0.00696}
"""Volts at the 57C405 a volt of the armature, by the nominal line voltage of the transformer, V rms (52.6.1)."""
FULL_SCALE_V, FULL_SCALE_COUNTS = 10.0, 4095
"""What the input shows at its full scale (decision: as a 57C409)."""


@cache
def voltage_gain(line_v: float) -> float:
    """Return the gain of the transformer for a line of a nominal voltage (V rms, line to line)."""
    return GAINS[min(GAINS, key=lambda nominal: abs(nominal - line_v))]


def voltage_counts(volts: float, line_v: float) -> int:
    """Return what register 0 shows for an armature voltage, V."""
    counts = round_count(volts * voltage_gain(line_v) / FULL_SCALE_V * FULL_SCALE_COUNTS)
    return max(-FULL_SCALE_COUNTS, min(FULL_SCALE_COUNTS, counts))


class DriveAnalogModule(IoModule):
    """A 57C405."""

    def feel(self, volts: float, line_v: float) -> None:
        """Show an armature voltage, V, through the transformer for a line of a nominal voltage, V."""
        self._show(0, voltage_counts(volts, line_v))
