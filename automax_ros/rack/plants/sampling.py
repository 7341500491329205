"""Samples all plants of a rack at a fixed rate of rack time, for streams and reports.

They are sampled without an observer too: the instants at which a plant's time is advanced decide the last bits of its
numbers, and a run that is watched must be the same as one that is not (decision). So no sample is left out if the host
is late: late ones follow in order, as the interrupts of drives do (decision).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

SAMPLE_NS = 10_000_000
"""Time between two samples, ns: 100 per second (decision)."""
_KEY = EventKey(EventClass.OBSERVE, 0, "")
Look = Callable[[int], None]
"""Called with the instant (ns) of a sample: all plants are at that instant, and nothing else happens at it any more."""


class PlantSampling:
    """The samples of one rack's plants: at whole multiples of ``SAMPLE_NS``, after all else of the instant."""

    def __init__(self, plants: Mapping[str, DrivePlant], scheduler: Scheduler) -> None:
        """Create the sampling of these plants; nothing is scheduled yet."""
        self._plants, self._scheduler = plants, scheduler
        self._looks: list[Look] = []

    def observe(self, look: Look) -> None:
        """Call ``look`` at each sample from now on."""
        self._looks.append(look)

    def begin(self) -> None:
        """Start, including this instant if it is one of the rate's; a rack without plants has no samples."""
        if self._plants:
            first_ns = -(-self._scheduler.now_ns // SAMPLE_NS) * SAMPLE_NS
            self._scheduler.at(first_ns, _KEY, self._look)

    def _look(self, now_ns: int) -> None:
        self._scheduler.at(now_ns + SAMPLE_NS, _KEY, self._look)
        for plant in self._plants.values():
            plant.advance(now_ns)
        for look in self._looks:
            look(now_ns)
