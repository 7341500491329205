"""What dynamic blocks mean at a scan time: how they respond to steps and to frequencies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.tuning.driven import DrivenBlock
    from automax_ros.tuning.frequency import Measured, Sweep
    from automax_ros.tuning.step_response import StepResponse, respond
    from automax_ros.tuning.tuning import Tuning, Verdict

__all__ = [
    "DrivenBlock",
    "Measured",
    "StepResponse",
    "Sweep",
    "Tuning",
    "Verdict",
    "respond",
]

__getattr__ = face(__name__, "tuning", "driven", "step_response", "frequency")
