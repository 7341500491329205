"""Instructions of the Logix controllers that replace AutoMax racks: what the AutoMax block becomes after a migration.

Structures and members have the controller's own spelling, so that a tag is read here as in Logix Designer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.logix.pmul import PulseMultiplier
    from automax_ros.logix.pulse_comparison import PulseComparison
    from automax_ros.logix.pulse_conversion import ConversionError, PulseParameters
    from automax_ros.logix.updn import UpDownAccumulator

__all__ = [
    "ConversionError",
    "PulseComparison",
    "PulseMultiplier",
    "PulseParameters",
    "UpDownAccumulator",
]

__getattr__ = face(__name__, "pmul", "updn", "pulse_conversion", "pulse_comparison")
