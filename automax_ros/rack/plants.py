"""The plants of a running rack and their webs: state in snapshots, signals in commons, samples for streams."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Protocol

from automax_ros.core.kinds import WriterKind
from automax_ros.core.types import DataType, Value
from automax_ros.drive.base.errors import DriveError
from automax_ros.drive.base.state import SavedState
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.drive.plant.signals import SIGNALS
from automax_ros.drive.web.data import MOST_DIAMETER_M
from automax_ros.drive.web.end import WebEnd
from automax_ros.drive.web.signals import END_SIGNALS, WEB_SIGNALS
from automax_ros.drive.web.span import WebSpan
from automax_ros.rack.base.observers import Observers
from automax_ros.rack.operations.operations import Operations
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.plants import FeedConfig, PlantConfig, build_plants, couple_plants
from automax_ros.rackfile.model.webs import WebConfig, build_line
from automax_ros.rackfile.model.writers import writers_of
from automax_ros.runtime.memory.memory import CommonMemory, ProcessInputs
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

_AFTER_MODULES = 16
"""Priority among the I/O of an instant, after modules, whose priority is their slot."""


class _Feed:
    __slots__ = ("_read", "_scale", "_type", "element", "view", "writer")

    def __init__(self, config: FeedConfig, read: Callable[[], float], kind: DataType, view: int, writer: int) -> None:
        self.view, self.element, self.writer = view, config.element, writer
        self._scale, self._read, self._type = config.scale, read, kind

    def value(self) -> Value:
        """Return the instrument's present value."""
        found = self._read()
        if self._scale is not None:
            return self._scale.counts_of(found)[0]
        if self._type is DataType.REAL:
            return found
        return found != 0.0 if self._type is DataType.BOOLEAN else int(found)


class _Round:
    def __init__(
        self,
        advance: Callable[[int], None],
        feeds: Sequence[_Feed],
        inputs: ProcessInputs,
        operations: Operations,
        observers: Observers,
    ) -> None:
        self._advance, self._feeds, self._inputs = advance, feeds, inputs
        self._memory, self._operations, self._observers = inputs.memory, operations, observers

    def write(self, now_ns: int, _: int) -> None:
        """Write the instruments' present values that differ from memory."""
        memory = self._memory
        self._advance(now_ns)
        if not self._operations.powered:
            return
        memory.now_ns = now_ns
        for feed in self._feeds:
            view, element = feed.view, feed.element
            value = memory.accepted(view, feed.value(), element)
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
        plants: RackPlants,
        memory: CommonMemory,
        inputs: ProcessInputs,
        scheduler: Scheduler,
    ) -> None:
        """Create the feeds of these plants and webs; nothing is scheduled yet."""
        self._plants, self._inputs, self._scheduler = plants, inputs, scheduler
        writers = {item.name: item.id for item in writers_of(config) if item.kind is WriterKind.PLANT}
        self._groups: dict[tuple[str, int], list[_Feed]] = {}
        for item in (feed for feed in config.feeds if feed.plant in plants or feed.plant in plants.webs):
            read, kind = plants.reader(item.plant, item.signal), config.by_name[item.common].type
            feed = _Feed(item, read, kind, memory.view(item.common), writers[item.plant])
            self._groups.setdefault((item.plant, item.every_ns), []).append(feed)

    def begin(self, operations: Operations, observers: Observers) -> None:
        """Start, including this instant if it is one of theirs: at the rack's start, or after a state was loaded."""
        scheduler = self._scheduler
        for (name, every_ns), feeds in self._groups.items():
            key = EventKey(EventClass.IO, _AFTER_MODULES, f"{name} {every_ns:014}")
            act = _Round(self._plants.named(name).advance, feeds, self._inputs, operations, observers).write
            scheduler.every(every_ns, -(-scheduler.now_ns // every_ns) * every_ns, key, act)


SURFACE = ".surface"
WEB = "web "
"""What follows the plant's name, and goes before the web's, in the names of their states."""

_STOCK, _HUNG = ("wound_m", "web_m", "turns"), ("m", "broken", "x_m")
"""What stays of a roll or roller, and of a web, while everything rests."""

_MOST_M = 1e12
"""Longest web of a kept state, m (decision: a bound on what a damaged file says)."""


def _is_possible(part: WebEnd | WebSpan, key: str, value: object) -> bool:
    if key == "broken" or isinstance(value, bool):
        return key == "broken" and isinstance(value, bool)
    if not isinstance(value, int | float):
        return False
    least, most = -_MOST_M, _MOST_M
    if isinstance(part, WebSpan):
        least = 1e-6 if key == "m" else -part.stop_m
        most = _MOST_M if key == "m" else part.stop_m
    elif key == "wound_m":
        least, most = 0.0, 0.0 if part.roll is None else part.roll.wound_m(MOST_DIAMETER_M)
    return least <= value <= most


class _Kept(Protocol):
    def state(self) -> SavedState: ...

    def restore(self, state: SavedState) -> None: ...


class RackPlants(dict[str, DrivePlant]):
    """The plants with a motor, by name. They continue whether or not the rack has power.

    Attributes:
        ends: the rolls and rollers by the names of their plants.
        webs: the webs by their own.
        found: what ``restock`` has put back at the start, {} where all began as installed.
    """

    def __init__(self, configs: Sequence[PlantConfig], webs: Sequence[WebConfig] = ()) -> None:
        """Create them at rest.

        Raises:
            ParameterError: the webs cannot hang so.
        """
        super().__init__(build_plants(configs))
        couplings = couple_plants(self, configs)
        line = build_line(self, configs, webs, couplings)
        self.ends: dict[str, WebEnd] = line.ends
        self.webs: dict[str, WebSpan] = line.spans
        self.found: dict[str, SavedState] = {}
        self._parts: dict[str, _Kept] = {**self, **couplings}
        self._parts |= {f"{name}{SURFACE}": end for name, end in self.ends.items()}
        self._parts |= {f"{WEB}{name}": span for name, span in self.webs.items()}

    def named(self, name: str) -> DrivePlant | WebSpan:
        """Return the plant or web of a name; KeyError if there is neither."""
        return self.webs[name] if name in self.webs else self[name]

    def reader(self, name: str, signal: str) -> Callable[[], float]:
        """Return what reads a signal of a plant, of its roll or roller, or of a web, at its present.

        Raises:
            KeyError: there is no such plant or web, or it has no such instantaneous signal.
        """
        if name in self.webs:
            return partial(WEB_SIGNALS[signal], self.webs[name])
        if signal in END_SIGNALS:
            return partial(END_SIGNALS[signal], self.ends[name])
        return partial(SIGNALS[signal], self[name])

    def state(self) -> dict[str, SavedState]:
        """Return the whole state, by plant: that of a coupling by the names of both plants, ``UNWIND+WINDER``.

        That of a roll or roller is ``UNWIND.surface``, that of a web ``web W1``.
        """
        return {name: part.state() for name, part in self._parts.items()}

    def stock(self) -> dict[str, SavedState]:
        """Return what stays while everything rests: web on rolls, counters, webs with their dancers.

        The speeds of shafts do not stay, nor do faults and other stiffnesses (decision: as those of plants).
        """
        found: dict[str, SavedState] = {}
        for names, parts in ((_STOCK, self.ends), (_HUNG, self.webs)):
            for name, part in parts.items():
                state, given = part.state(), repr(part.data)
                found[name] = {"of": given, **{key: state[key] for key in names}}
        return found

    def restock(self, stock: Mapping[str, SavedState]) -> list[str]:
        """Put back what ``stock`` returned, at the start; return the plants and webs whose data are others now.

        Raises:
            ValueError: a number of it is impossible.
        """
        edited = []
        for names, parts in ((_STOCK, self.ends), (_HUNG, self.webs)):
            for name, part in parts.items():
                kept = stock.get(name)
                if kept is None:
                    continue
                if kept["of"] != repr(part.data):
                    edited.append(name)
                    continue
                values = {key: kept[key] for key in names}
                if not all(_is_possible(part, key, value) for key, value in values.items()):
                    raise ValueError(f"what was kept of {name} is impossible")
                part.restore({**part.state(), **values})
                self.found[name] = {"of": kept["of"], **values}
        return edited

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
