"""A recording executed again and compared."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.replay.engine import Replay, ReplayOptions, replay
    from automax_ros.replay.report import ReplayReport
    from automax_ros.replay.side_by_side import replay_side_by_side
    from automax_ros.replay.stored_rack import SourceRefused

__all__ = [
    "Replay",
    "ReplayOptions",
    "ReplayReport",
    "SourceRefused",
    "replay",
    "replay_side_by_side",
]

__getattr__ = face(__name__, "report", "stored_rack", "engine", "side_by_side")
