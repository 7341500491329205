"""What a recording made from outside says of itself, apart from its messages."""

from __future__ import annotations

from collections.abc import Sequence

import automax_ros
from automax_ros.wire.rack_files import RackFile, fingerprint

_GAPS_NAMED = 20


def provenance(
    rack: str,
    files: Sequence[RackFile],
    lacks: Sequence[str],
    replayable_s: float | None,
    gaps: Sequence[str],
    ended: str | None,
) -> dict[str, str]:
    """Return the custom data of the bag; times in s since the start of the run, None where there is nothing to say."""
    data = {"rack": rack, "version": automax_ros.__version__, "recorder": "automax record"}
    if not any("file" in item or "source" in item for item in lacks):
        data["fingerprint"] = f"{fingerprint(files):016x}"
    if lacks:
        data["lacks"] = "; ".join(lacks)
    if replayable_s is not None:
        data["replayable_from_s"] = f"{replayable_s:.6f}"
    if gaps:
        data["gaps"] = f"{len(gaps)}: " + "; ".join(gaps[:_GAPS_NAMED])
    if ended is not None:
        data["ended"] = ended
    return data
