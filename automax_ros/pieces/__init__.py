"""Work cut into named pieces: done by processes of this machine, or by the machines of a Dask cluster."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.pieces.faults import ClusterFault
    from automax_ros.pieces.piece import Done, Piece, PieceFault, Where
    from automax_ros.pieces.run import run_pieces

__all__ = [
    "ClusterFault",
    "Done",
    "Piece",
    "PieceFault",
    "Where",
    "run_pieces",
]

__getattr__ = face(__name__, "piece", "faults", "run")
