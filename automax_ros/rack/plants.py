"""The plants of a running rack: their state in snapshots, their signals in commons, their samples for streams."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from automax_ros.core.kinds import WriterKind
from automax_ros.core.types import Value
from automax_ros.drive.base.errors import DriveError
from automax_ros.drive.base.state import SavedState
from automax_ros.drive.plant.coupling import CoupledPlants
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.drive.plant.signals import SIGNALS
from automax_ros.rack.base.observers import Observers
from automax_ros.rack.operations.operations import Operations
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.plants import FeedConfig, PlantConfig, build_plants, couple_plants
from automax_ros.rackfile.model.writers import writers_of
from automax_ros.runtime.memory.memory import CommonMemory, ProcessInputs
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
    """Writes signals of plants into commons, at whole multiples of each feed's time, before the scans of the instant.

    A value is written only if it differs from the present one (decision: the write log has changes, not samples). Feeds
    continue while a rack is stopped, and pause while it has no power.
    """

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


class RackPlants(dict[str, DrivePlant]):
    """The plants with a motor, by name. They continue whether or not the rack has power."""

    def __init__(self, configs: Sequence[PlantConfig]) -> None:
        super().__init__(build_plants(configs))
        self._parts: dict[str, DrivePlant | CoupledPlants] = {**self, **couple_plants(self, configs)}

    def state(self) -> dict[str, SavedState]:
        """Return the whole state, by plant; that of a coupling by the names of both plants."""
        return {name: part.state() for name, part in self._parts.items()}

    def load(self, state: Mapping[str, SavedState]) -> None:
        """Restore a state; ValueError if it is not that of these plants."""
        if set(state) != set(self._parts):
            raise ValueError("the state is that of a rack with other plants")
        try:
            for name, part in self._parts.items():
                part.restore(state[name])
        except DriveError as error:
            raise ValueError(f"the state of a plant does not fit: {error}") from error


SAMPLE_NS = 10_000_000
"""Time between two samples, ns: 100 per second (decision)."""
_KEY = EventKey(EventClass.OBSERVE, 0, "")
Look = Callable[[int], None]
"""Called with the instant (ns) of a sample: all plants are at that instant, and nothing else happens at it any more."""


class PlantSampling:
    """The samples of one rack's plants: at whole multiples of ``SAMPLE_NS``, after all else of the instant.

    They are sampled without an observer too: the instants at which a plant's time is advanced decide the last bits of
    its numbers, and a run that is watched must be the same as one that is not (decision). So no sample is left out if
    the host is late: late ones follow in order, as the interrupts of drives do (decision).
    """

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
