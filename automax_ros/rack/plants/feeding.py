"""Writes signals of plants into commons, at whole multiples of each feed's time, before the scans of the instant.

A value is written only if it differs from the present one (decision: the write log has changes, not samples). Feeds
continue while a rack is stopped, and pause while it has no power.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from automax_ros.core.kinds import WriterKind
from automax_ros.core.types import Value
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.drive.plant.signals import SIGNALS
from automax_ros.rack.base.observers import Observers
from automax_ros.rack.operations.operations import Operations
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.plants import FeedConfig
from automax_ros.rackfile.model.writers import writers_of
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.process_inputs import ProcessInputs
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

_AFTER_MODULES = 16
"""Priority among the I/O of an instant, after modules, whose priority is their slot."""


class _Feed:
    __slots__ = ("_scale", "_signal", "element", "view", "writer")

    def __init__(self, config: FeedConfig, view: int, writer: int) -> None:
        self.view, self.element, self.writer = view, config.element, writer
        self._scale, self._signal = config.scale, SIGNALS[config.signal]

    def value(self, plant: DrivePlant) -> Value:
        """Return the instrument's present value."""
        found = self._signal(plant)
        return found if self._scale is None else self._scale.counts_of(found)[0]


class _Round:
    def __init__(
        self,
        plant: DrivePlant,
        feeds: Sequence[_Feed],
        inputs: ProcessInputs,
        operations: Operations,
        observers: Observers,
    ) -> None:
        self._plant, self._feeds, self._inputs = plant, feeds, inputs
        self._memory, self._operations, self._observers = inputs.memory, operations, observers

    def write(self, now_ns: int, _: int) -> None:
        """Write the instruments' present values that differ from memory."""
        plant, memory = self._plant, self._memory
        plant.advance(now_ns)
        if not self._operations.powered:
            return
        memory.now_ns = now_ns
        for feed in self._feeds:
            view, element = feed.view, feed.element
            value = memory.accepted(view, feed.value(plant), element)
            if memory.read_now(view, element) != value:
                self._inputs.write(view, element, value, feed.writer)
        self._observers.report_writes()


class PlantFeeds:
    """The feeds of one rack."""

    def __init__(
        self,
        config: RackConfig,
        plants: Mapping[str, DrivePlant],
        memory: CommonMemory,
        inputs: ProcessInputs,
        scheduler: Scheduler,
    ) -> None:
        """Create the feeds of these plants; nothing is scheduled yet."""
        self._plants, self._inputs, self._scheduler = plants, inputs, scheduler
        writers = {item.name: item.id for item in writers_of(config) if item.kind is WriterKind.PLANT}
        self._groups: dict[tuple[str, int], list[_Feed]] = {}
        for item in (feed for feed in config.feeds if feed.plant in plants):
            feed = _Feed(item, memory.view(item.common), writers[item.plant])
            self._groups.setdefault((item.plant, item.every_ns), []).append(feed)

    def begin(self, operations: Operations, observers: Observers) -> None:
        """Start, including this instant if it is one of theirs: at the rack's start, or after a state was loaded."""
        scheduler = self._scheduler
        for (name, every_ns), feeds in self._groups.items():
            key = EventKey(EventClass.IO, _AFTER_MODULES, f"{name} {every_ns:014}")
            act = _Round(self._plants[name], feeds, self._inputs, operations, observers).write
            scheduler.every(every_ns, -(-scheduler.now_ns // every_ns) * every_ns, key, act)
