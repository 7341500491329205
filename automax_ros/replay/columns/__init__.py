"""A recording executed again in blocks of thousands of scans, as far as they are uniform and nothing differs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.replay.columns.segments import BlockReplay

__all__ = ["BlockReplay"]

__getattr__ = face(__name__, "segments")
