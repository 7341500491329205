"""Looks at all plants of a rack at a fixed rate of rack time, for whoever wants to know: streams, reports.

They are looked at whether or not somebody wants to know: where a plant's time stops on its way decides the last bits of
its numbers, and a run that is watched must be the same as one that is not (decision). For the same reason no look is
left out where the host is late: late ones follow in order, as the interrupts of drives do (decision).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

SAMPLE_NS = 10_000_000
"""Time between two looks, ns: 100 a second (decision)."""
_KEY = EventKey(EventClass.OBSERVE, 0, "")
Look = Callable[[int], None]
"""Is told the instant (ns) of a look: all plants are at that instant, and nothing else happens at it any more."""


class PlantSampling:
    """The looks at the plants of one rack: at whole multiples of ``SAMPLE_NS``, after all else of the instant."""

    def __init__(self, plants: Mapping[str, DrivePlant], scheduler: Scheduler) -> None:
        """Take the plants; nothing is posted yet."""
        self._plants, self._scheduler = plants, scheduler
        self._looks: list[Look] = []

    def observe(self, look: Look) -> None:
        """Call something at each look from now on."""
        self._looks.append(look)

    def begin(self) -> None:
        """Begin, with this instant where it is one of the rate's; a rack without plants has no looks."""
        if self._plants:
            first_ns = -(-self._scheduler.now_ns // SAMPLE_NS) * SAMPLE_NS
            self._scheduler.at(first_ns, _KEY, self._look)

    def _look(self, now_ns: int) -> None:
        self._scheduler.at(now_ns + SAMPLE_NS, _KEY, self._look)
        for plant in self._plants.values():
            plant.advance(now_ns)
        for look in self._looks:
            look(now_ns)
