"""What the stations of a network send each other: the module makes and takes frames, whoever carries them is told how.

Nothing here knows of ROS 2: ``nodes/network.py`` is such a carrier, tests are others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from automax_ros.rack.modules.network_registers import HALF, LAST_DROP, MASTER, greatest_depth


@dataclass(frozen=True)
class Frame:
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


Send = Callable[[int, Sequence[Frame]], None]
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

    def receive(self, frames: Iterable[tuple[Sender, Frame]], damaged: int = 0) -> None:
        """Take frames of others, between two scans, and count those that arrived but could not be read."""
        ...

    def status(self) -> NetworkStatus:
        """Return how it stands."""
        ...
