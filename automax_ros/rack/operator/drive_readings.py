"""What instruments show of the drives in this process at an instant: bridge, gates, DELTA, faults."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from automax_ros.core.ticks import NS_PER_US
from automax_ros.drive.current_loop.sequence import Phase
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import DrivenPlant
from automax_ros.runtime.tasks.cml_task import CmlTask

_TURN = 360.0


@dataclass(frozen=True)
class DriveReading:
    """One drive: the SCRs that conduct and those that are gated, by their numbers.

    ``delta_deg`` is DELTA in degrees of the line, None unless the current minor loop regulates; ``state`` is that of
    the loop in words, "" where a task of this rack runs none; ``faults`` are its latched ones.
    """

    driven: DrivenPlant
    conducting: tuple[int, ...]
    gates: tuple[int, ...]
    delta_deg: float | None = None
    state: str = ""
    faults: tuple[str, ...] = ()


def read_drives(rack: Rack, trips: Sequence[str]) -> Iterator[DriveReading]:
    """Yield the drives that turn plants; ``trips`` are the lines of ``DriveTrips``. Time is not advanced."""
    loops = {int(task.cml.facts["io_cntl_slot"]): task for task in rack.tasks if isinstance(task, CmlTask)}
    for driven in rack.part.driven:
        plant, task = rack.plants[driven.name], loops.get(driven.slot)
        scrs = plant.circuit.conducting, plant.bridge.gated_numbers(plant.now_ns)
        if task is None:
            yield DriveReading(driven, *scrs)
            continue
        loop = task.loop
        angle = _TURN * loop.outputs.delta * NS_PER_US / loop.pll.period_ns
        phase = loop.sequence.phase
        yield DriveReading(
            driven,
            *scrs,
            angle if phase is Phase.RUN else None,
            phase.name.lower().replace("_", " "),
            faults_of(trips, task.name),
        )


def faults_of(trips: Sequence[str], task: str) -> tuple[str, ...]:
    """Return the faults of a task's current minor loop among the lines of ``DriveTrips``, without the task."""
    own = f"{task}: "
    return tuple(line.removeprefix(own) for line in trips if line.startswith(own))
