"""Whom a network module hears: who sends each drop, since when it is silent, and who sends what is another's.

A cycle without a frame of a drop makes it silent; ``TIMEOUT_CYCLES`` of them are a receive time-out, and ``MISSES`` of
those in a row lose the drop (57C570 manual p. 18-6), after 88 ms. The length of a time-out is ours (decision): no
source at hand prints it, and the loss of a station is told within 100 ms, as that of a process of a distributed rack.

What the stations of a network send each other: the module makes and takes frames, whoever carries them is told how.

Nothing here knows of ROS 2: ``ros/nodes/network.py`` is such a carrier, tests are others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple, dataclass
from typing import Any, Protocol, runtime_checkable

from automax_ros.rackfile.modules.network import HALF, LAST_DROP, MASTER, greatest_depth


@dataclass(frozen=True)
class DropMessage:
    """The registers that one station sends of one drop, once per cycle.

    ``station`` is the drop of the sender, ``depth`` how many drops it represents and ``defined`` whether a task has
    said so. ``drop`` is whose registers these are: one of its own where the sender is a slave; 0 in the master's frame
    of the broadcast registers. ``words`` are 32 numbers of 16 bits with sign: the half of the area that it writes.
    ``sequence`` counts the sender's cycles and goes on at 0 after 2^32.
    """

    station: int
    depth: int
    defined: bool
    drop: int
    sequence: int
    words: tuple[int, ...]

    @property
    def is_sound(self) -> bool:
        """Whether a station can have sent it."""
        if len(self.words) != HALF or not all(-0x8000 <= word <= 0x7FFF for word in self.words):
            return False
        if self.station == MASTER:
            return self.depth == 1 and MASTER <= self.drop <= LAST_DROP
        if not MASTER < self.station <= LAST_DROP or not 1 <= self.depth <= greatest_depth(self.station):
            return False
        return self.station <= self.drop < self.station + self.depth

    @property
    def drops(self) -> range:
        """The drops that the sender represents."""
        return range(self.station, self.station + self.depth)


@dataclass(frozen=True, order=True)
class Sender:
    """Who has sent a frame: the run of a rack, the slot of the module, and the rack's name for messages."""

    run_id: int
    slot: int
    rack: str

    def __str__(self) -> str:
        """Return it as messages name it."""
        return f"rack {self.rack or '?'} slot {self.slot}"


Send = Callable[[int, Sequence[DropMessage]], None]
"""Carries what a module sends: rack time (ns), the frames of a cycle."""


@dataclass(frozen=True)
class NetworkStatus:
    """How a module stands on its network.

    ``heard`` are the drops that it hears, ``lost`` those that it waits for, ``rivals`` the senders that use its own
    drops or another's. ``code`` is C where a drop is lost (57C570 manual p. 18-6), else "".
    """

    drop: int
    depth: int
    defined: bool
    heard: tuple[int, ...]
    lost: tuple[int, ...]
    rivals: tuple[Sender, ...]
    code: str
    counters: tuple[tuple[str, int], ...]


@runtime_checkable
class Station(Protocol):
    """A module with a place on a network."""

    @property
    def network(self) -> str:
        """The network's name."""
        ...

    def connect(self, send: Send) -> None:
        """Let what it sends be carried from now on."""
        ...

    def receive(self, frames: Iterable[tuple[Sender, DropMessage]], damaged: int = 0) -> None:
        """Take frames of others, between two scans, and count those that arrived but could not be read."""
        ...

    def status(self) -> NetworkStatus:
        """Return how it stands."""
        ...


TIMEOUT_CYCLES, MISSES = 4, 4
MOST_RIVALS = 8
"""Senders that are told apart as rivals at one time (decision): a stranger can call itself anything."""
_WRAP = 1 << 32


@dataclass
class Drop:
    """A drop that is awaited: who sends it, None as long as nobody has, and how long it has been silent (cycles)."""

    sender: Sender | None = None
    sequence: int = 0
    defined: bool = False
    silent: int = 0

    @property
    def is_lost(self) -> bool:
        """Whether four time-outs followed each other."""
        return self.silent >= TIMEOUT_CYCLES * MISSES

    @property
    def is_heard(self) -> bool:
        """Whether somebody sends it."""
        return self.sender is not None and not self.is_lost


class Hearing:
    """The drops that a module waits for; ``rivals`` are senders of what is another's, with their silence (cycles)."""

    def __init__(self, awaited: Iterable[int] = ()) -> None:
        """Wait for drops from the beginning."""
        self._awaited = tuple(awaited)
        self.drops: dict[int, Drop] = {}
        self.rivals: dict[Sender, int] = {}
        self.clear()

    def clear(self) -> None:
        """Hear nobody: the power was switched on."""
        self.drops = {drop: Drop() for drop in self._awaited}
        self.rivals = {}

    def take(self, sender: Sender, frame: DropMessage) -> int | None:
        """Take in whose frame it is; return how many frames of the drop were missed, None where it is a rival's."""
        known = self.drops.setdefault(frame.drop, Drop())
        if known.is_heard and known.sender != sender:
            self.meet(sender)
            return None
        missed = (frame.sequence - known.sequence - 1) % _WRAP if known.is_heard else 0
        if missed >= _WRAP // 2:  # an older one, that another has overtaken
            return None
        known.sender, known.sequence, known.defined, known.silent = sender, frame.sequence, frame.defined, 0
        return missed

    def meet(self, rival: Sender) -> None:
        """Remember who sends what is another's."""
        if rival in self.rivals or len(self.rivals) < MOST_RIVALS:
            self.rivals[rival] = 0

    def cycle(self) -> int:
        """Let a cycle pass; return how many receive time-outs there were."""
        timeouts = 0
        for drop in self.drops.values():
            if not drop.is_lost:
                drop.silent += 1
                timeouts += drop.silent % TIMEOUT_CYCLES == 0
        silences = {sender: silent + 1 for sender, silent in self.rivals.items()}
        self.rivals = {sender: silent for sender, silent in silences.items() if silent < TIMEOUT_CYCLES * MISSES}
        return timeouts

    @property
    def heard(self) -> tuple[int, ...]:
        """The drops that somebody sends."""
        return tuple(sorted(drop for drop, item in self.drops.items() if item.is_heard))

    @property
    def lost(self) -> tuple[int, ...]:
        """The drops that are awaited in vain."""
        return tuple(sorted(drop for drop, item in self.drops.items() if item.is_lost))

    def state(self) -> dict[str, object]:
        """Return all of it."""
        drops = [
            [number, None if item.sender is None else list(astuple(item.sender)), *astuple(item)[1:]]
            for number, item in sorted(self.drops.items())
        ]
        return {"drops": drops, "rivals": [[*astuple(item), silent] for item, silent in sorted(self.rivals.items())]}

    def load(self, drops: Iterable[Sequence[Any]], rivals: Iterable[Sequence[Any]]) -> None:
        """Take over a state.

        Raises:
            TypeError: it is none.
        """
        self.drops = {
            number: Drop(None if sender is None else Sender(*sender), *rest) for number, sender, *rest in drops
        }
        self.rivals = {Sender(*item): silent for *item, silent in rivals}
