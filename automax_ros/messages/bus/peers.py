"""The other processes of a distributed rack, as one process knows them from what they say of themselves.

No clock and no ROS: whoever hears a ``Presence`` tells it with the time (ns, monotonic).
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.types.messages import Presence, Stage

BEAT_NS = 20 * NS_PER_MS
"""How often a process says that it lives."""
SILENCE_NS = 75 * NS_PER_MS
"""A process of another host that has said nothing for so long is lost (decision: it is noticed within 100 ms)."""
HUNG_NS = 10_000 * NS_PER_MS
"""One of this host that lives by the kernel's word may be held up for so long (decision): a busy host is not lost."""
MISSING_NS = 200 * NS_PER_MS
"""After this DDS has sent again what was dropped on the way (decision); what is missing then is asked for."""
HELD_UP_NS = 45 * NS_PER_MS
"""Who was held up for so long itself judges nobody until it has heard what came meanwhile."""


class PresenceVerdict(enum.Enum):
    """What a process's word means."""

    OWN = "own"
    KNOWN = "known"
    NEW = "new"
    OTHER_RUN = "other run"
    """A rack of this name that is not of this run."""
    OTHER_FILE = "other file"
    """It has another rack file or other sources."""
    SEAT_TAKEN = "seat taken"
    """It holds modules that are in this process."""


@dataclass
class Peer:
    """Another process: what it said last, when, and which of its batches have come.

    ``short_since_ns`` is when batches of which it told were first missed, None as long as none is.
    """

    presence: Presence
    heard_ns: int
    received: int = 0
    short_since_ns: int | None = None
    gap: bool = False

    @property
    def process(self) -> int:
        """The number of its life."""
        return self.presence.process

    @property
    def stage(self) -> int:
        """How far it is."""
        return self.presence.state

    def got(self, sequence: int) -> None:
        """Note a batch that has come; one that was left out makes a gap."""
        self.gap = self.gap or sequence > self.received + 1
        self.received = max(self.received, sequence)
        self.short_since_ns = None

    def caught_up(self, sequence: int) -> None:
        """Note an image that contains its batches up to a number."""
        self.received = max(self.received, sequence)
        self.gap, self.short_since_ns = False, None


@dataclass
class Peers:
    """All other processes of one run, by seat.

    ``process``, ``seat`` and ``slots`` are this process's own, ``fingerprint`` that of its rack file and sources;
    ``run_id`` is 0 while it knows of no run: then it joins the one that it hears of. ``lost`` are seats whose process
    has gone silently and has not come back. ``lives`` tells of a process of this host whether it lives, and None
    of others.
    """

    process: int
    seat: int
    slots: Collection[int]
    fingerprint: int
    run_id: int = 0
    epoch_ns: int = 0
    by_seat: dict[int, Peer] = field(default_factory=dict)
    lost: set[int] = field(default_factory=set)
    lives: Callable[[Presence], bool | None] = lambda _: None
    _looked_ns: int = 0

    def heard(self, presence: Presence, now_ns: int) -> PresenceVerdict:
        """Take a process's word."""
        refused = self._refused(presence)
        if refused is not None:
            return refused
        if presence.run_id and not self.run_id:
            self.run_id = presence.run_id
        if presence.epoch_ns and not self.epoch_ns:
            self.epoch_ns = presence.epoch_ns
        peer = self.by_seat.get(presence.seat)
        if peer is None or peer.process != presence.process:
            # What it sent before it was heard has not been taken: the first batch that it tells of is owed.
            self.by_seat[presence.seat] = peer = Peer(presence, now_ns)
            self.lost.discard(presence.seat)
            found = PresenceVerdict.NEW
        else:
            peer.presence, peer.heard_ns, found = presence, now_ns, PresenceVerdict.KNOWN
        return found

    def is_short(self, presence: Presence) -> bool:
        """Whether the latest word of a process, if it was accepted, tells of batches that have not been taken here."""
        return self._told(presence) is not None

    def missed(self, presence: Presence, now_ns: int) -> None:
        """Note that batches of which a word tells are missing, though all that has come here was taken since."""
        peer = self._told(presence)
        if peer is None:
            return
        if peer.short_since_ns is None:
            peer.short_since_ns = now_ns
        peer.gap = peer.gap or now_ns - peer.short_since_ns >= MISSING_NS

    def _told(self, presence: Presence) -> Peer | None:
        """Return the process whose latest word this is, if it tells of batches that have not been taken."""
        peer = self.by_seat.get(presence.seat)
        return peer if peer is not None and peer.presence is presence and presence.sequence > peer.received else None

    def _refused(self, presence: Presence) -> PresenceVerdict | None:
        if presence.process == self.process:
            return PresenceVerdict.OWN
        if presence.run_id and self.run_id and presence.run_id != self.run_id:
            return PresenceVerdict.OTHER_RUN
        if presence.fingerprint != self.fingerprint:
            return PresenceVerdict.OTHER_FILE
        if set(presence.slots) & set(self.slots):
            return PresenceVerdict.SEAT_TAKEN
        return None

    def look(self, now_ns: int) -> list[Peer]:
        """Return those that are lost since the last look: they leave the list. To be called at each beat."""
        held_up = now_ns - self._looked_ns > HELD_UP_NS
        self._looked_ns = now_ns
        gone = [peer for peer in self.by_seat.values() if self._is_gone(peer, now_ns, held_up=held_up)]
        for peer in gone:
            del self.by_seat[peer.presence.seat]
            if peer.stage != Stage.LEAVING:
                self.lost.add(peer.presence.seat)
        return [peer for peer in gone if peer.stage != Stage.LEAVING]

    def _is_gone(self, peer: Peer, now_ns: int, *, held_up: bool) -> bool:
        lives = self.lives(peer.presence)
        if lives is False:
            return True
        return not held_up and now_ns - peer.heard_ns > (HUNG_NS if lives else SILENCE_NS)

    def of(self, process: int) -> Peer | None:
        """Return the process of a number, None where it is not of this run."""
        return next((peer for peer in self.by_seat.values() if peer.process == process), None)

    def running(self) -> Iterator[Peer]:
        """Yield those that scan, by seat."""
        return (peer for _, peer in sorted(self.by_seat.items()) if peer.stage == Stage.RUNNING)

    def owing(self) -> Peer | None:
        """Return one of which batches are missing, None where there is none."""
        return next((peer for _, peer in sorted(self.by_seat.items()) if peer.gap), None)
