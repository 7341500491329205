"""What a recording made from outside says of itself, apart from its messages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import automax_ros
from automax_ros.bags.live.topics import MAX_VALUE_TOPICS
from automax_ros.wire.rack_files import RACK_FILE, RackFile, fingerprint

GAPS_NAMED = 20
"""Gaps that the bag tells one by one; it tells the number of all."""


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
        data["gaps"] = f"{len(gaps)}: " + "; ".join(gaps[:GAPS_NAMED])
    if ended is not None:
        data["ended"] = ended
    return data


def lacking(
    files: Sequence[RackFile], tasks: Iterable[str], wrong: Iterable[str], left_out: int, waiting: Iterable[str]
) -> list[str]:
    """Return what a bag lacks for a replay without the repository.

    ``wrong`` are tasks that run another source than the stored one, ``left_out`` counts topics of commons, ``waiting``
    are tasks that cannot be executed again yet.
    """
    owners = {file.owner for file in files}
    wanted = {RACK_FILE: RACK_FILE, **{task: f"{task}.BLK" for task in tasks}}
    found = [f"the file {name}" for owner, name in wanted.items() if owner not in owners]
    found += [f"the source that task {task} runs (another one is stored)" for task in wrong]
    if left_out:
        found.append(f"the topics of {left_out} common variables beyond the first {MAX_VALUE_TOPICS}")
    return found + [f"a full scan and a state of task {task} to begin with" for task in waiting]
