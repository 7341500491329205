"""The frames of a network, and the drops that a module receives: their senders, their silence, their rivals.

A cycle without a frame of a drop counts as silence; ``TIMEOUT_CYCLES`` of them are a receive time-out, and ``MISSES``
time-outs in a row lose the drop (57C570 manual p. 18-6), after 88 ms. The length of a time-out is ours (decision): no
source at hand prints it, and the loss of a station is reported within 100 ms, as that of a process of a distributed
rack. A carrier transmits the frames: ``ros/nodes/network.py``, or a test.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple, dataclass
from typing import Any

from automax_ros.rackfile.modules.network import HALF, LAST_DROP, MASTER, greatest_depth

TIMEOUT_CYCLES, MISSES = 4, 4
MOST_RIVALS = 8
"""Most senders that are listed as rivals at one time (decision): a stranger can call itself anything."""
_WRAP = 1 << 32


@dataclass(frozen=True)
class DropMessage:
    """The registers that one station sends of one drop, once per cycle.

    ``station`` is the sender's drop, ``depth`` how many drops it represents, ``defined`` whether a task has set that.
    ``drop`` is one of the sender's own, or 0 in the master's frame of the broadcast registers. ``words`` are 32 signed
    numbers of 16 bits: the half of the area that the sender writes. ``sequence`` counts its cycles modulo 2^32.
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
    """Sender of a frame: the run of a rack, the slot of the module, and the rack's name for messages."""

    run_id: int
    slot: int
    rack: str

    def __str__(self) -> str:
        return f"rack {self.rack or '?'} slot {self.slot}"


Send = Callable[[int, Sequence[DropMessage]], None]
"""Transmits a module's frames: rack time (ns), the frames of a cycle."""


@dataclass(frozen=True)
class NetworkStatus:
    """Status of a module on its network.

    ``heard`` are the drops that it receives, ``lost`` those that it waits for, ``rivals`` the senders that use its own
    drops or another's. ``code`` is C if a drop is lost (57C570 manual p. 18-6), else "".
    """

    drop: int
    depth: int
    defined: bool
    heard: tuple[int, ...]
    lost: tuple[int, ...]
    rivals: tuple[Sender, ...]
    code: str
    counters: tuple[tuple[str, int], ...]


@dataclass
class Drop:
    """A drop that is awaited: its sender, None before its first frame, and its silence (cycles)."""

    sender: Sender | None = None
    sequence: int = 0
    defined: bool = False
    silent: int = 0

    @property
    def is_lost(self) -> bool:
        """Whether four time-outs followed each other."""
        return self.silent >= TIMEOUT_CYCLES * MISSES

    @property
    def is_received(self) -> bool:
        """Whether its frames arrive."""
        return self.sender is not None and not self.is_lost


class Reception:
    """The drops that a module waits for; ``rivals`` are senders that use another's, with their silence (cycles)."""

    def __init__(self, awaited: Iterable[int] = ()) -> None:
        self._awaited = tuple(awaited)
        self.drops: dict[int, Drop] = {}
        self.rivals: dict[Sender, int] = {}
        self.clear()

    def clear(self) -> None:
        """Forget all senders: the power was switched on."""
        self.drops = {drop: Drop() for drop in self._awaited}
        self.rivals = {}

    def take(self, sender: Sender, frame: DropMessage) -> int | None:
        """Record the sender of a frame; return how many frames of the drop were missed, None for a rival's."""
        known = self.drops.setdefault(frame.drop, Drop())
        if known.is_received and known.sender != sender:
            self.add_rival(sender)
            return None
        missed = (frame.sequence - known.sequence - 1) % _WRAP if known.is_received else 0
        if missed >= _WRAP // 2:  # an older one, overtaken by another
            return None
        known.sender, known.sequence, known.defined, known.silent = sender, frame.sequence, frame.defined, 0
        return missed

    def add_rival(self, rival: Sender) -> None:
        """Record a sender that uses another's drop."""
        if rival in self.rivals or len(self.rivals) < MOST_RIVALS:
            self.rivals[rival] = 0

    def cycle(self) -> int:
        """Count a cycle of silence; return how many receive time-outs it completed."""
        timeouts = 0
        for drop in self.drops.values():
            if not drop.is_lost:
                drop.silent += 1
                timeouts += drop.silent % TIMEOUT_CYCLES == 0
        silences = {sender: silent + 1 for sender, silent in self.rivals.items()}
        self.rivals = {sender: silent for sender, silent in silences.items() if silent < TIMEOUT_CYCLES * MISSES}
        return timeouts

    @property
    def received(self) -> tuple[int, ...]:
        """The drops whose frames arrive."""
        return tuple(sorted(drop for drop, item in self.drops.items() if item.is_received))

    @property
    def lost(self) -> tuple[int, ...]:
        """The drops that are lost."""
        return tuple(sorted(drop for drop, item in self.drops.items() if item.is_lost))

    def state(self) -> dict[str, object]:
        """Return all of its state."""
        drops = [
            [number, None if item.sender is None else list(astuple(item.sender)), *astuple(item)[1:]]
            for number, item in sorted(self.drops.items())
        ]
        return {"drops": drops, "rivals": [[*astuple(item), silent] for item, silent in sorted(self.rivals.items())]}

    def load(self, drops: Iterable[Sequence[Any]], rivals: Iterable[Sequence[Any]]) -> None:
        """Restore a state; TypeError if it is not one."""
        self.drops = {
            number: Drop(None if sender is None else Sender(*sender), *rest) for number, sender, *rest in drops
        }
        self.rivals = {Sender(*item): silent for *item, silent in rivals}
