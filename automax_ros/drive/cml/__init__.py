"""The current minor loop of a DC drive: what the DC_DRIVE_CML block and a PMI do each sixth of a line cycle (52.0)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.drive.cml.inputs import INPUTS, Inputs
    from automax_ros.drive.cml.minor_loop import CurrentMinorLoop, Outcome
    from automax_ros.drive.cml.outputs import OUTPUTS
    from automax_ros.drive.cml.signals import Command, Measured, Pulse

__all__ = ["INPUTS", "OUTPUTS", "Command", "CurrentMinorLoop", "Inputs", "Measured", "Outcome", "Pulse"]

__getattr__ = face(__name__, "signals", "inputs", "outputs", "minor_loop")
