"""The other processes of a distributed rack, as one process knows them from their presences.

It uses neither a clock nor ROS: the receiver of a ``Presence`` passes it on with the time (ns, monotonic).
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.types.messages import Presence, Stage

BEAT_NS = 20 * NS_PER_MS
"""Period at which a process publishes its presence."""
SILENCE_NS = 75 * NS_PER_MS
"""A process of another host that is silent for this long is lost (decision: it is noticed within 100 ms)."""
HUNG_NS = 10_000 * NS_PER_MS
"""A process of this host that still lives may be held up for this long (decision): a busy host is not lost."""
MISSING_NS = 200 * NS_PER_MS
"""After this time DDS has sent dropped messages again (decision); those still missing are requested."""
HELD_UP_NS = 45 * NS_PER_MS
"""A process that was itself held up this long declares no other lost until it has read what arrived meanwhile."""


class PresenceVerdict(enum.Enum):
    """What a received presence means."""

    OWN = "own"
    KNOWN = "known"
    NEW = "new"
    OTHER_RUN = "other run"
    """It is of a rack of this name, but not of this run."""
    OTHER_FILE = "other file"
    """It has another rack file or other sources."""
    SLOT_TAKEN = "slot taken"
    """It has modules that are in this process."""


@dataclass
class Peer:
    """Another process: its last presence, when that was received, and which of its batches have arrived.

    ``received`` is the number of the last one, by itself or in an image; ``lacking`` that of the last one that is known
    to be missing, ``imaged`` that of the last one in an image. ``short_since_ns`` is when announced batches were first
    missed, None as long as none is.
    """

    presence: Presence
    received_ns: int
    received: int = 0
    lacking: int = 0
    imaged: int = 0
    short_since_ns: int | None = None

    @property
    def process(self) -> int:
        """The number of this process, another one after a restart."""
        return self.presence.process

    @property
    def stage(self) -> int:
        """The stage that it has reached."""
        return self.presence.state

    @property
    def gap(self) -> bool:
        """Whether batches are missing: an image that was sent before the last of them does not bring them."""
        return self.lacking > self.imaged

    def got(self, sequence: int) -> None:
        """Note a batch that has arrived; a skipped number is a gap."""
        if sequence > self.received + 1:
            self.lacking = sequence - 1
        self.received = max(self.received, sequence)
        self.short_since_ns = None

    def caught_up(self, sequence: int) -> None:
        """Note an image that contains its batches up to a number."""
        self.received, self.imaged = max(self.received, sequence), max(self.imaged, sequence)
        self.short_since_ns = None


@dataclass
class Peers:
    """All other processes of one run, by the slot that names each.

    ``process``, ``process_slot`` and ``slots`` are this process's own, ``fingerprint`` that of its rack and sources;
    ``run_id`` is 0 while it knows no run: then it joins the first one that a presence names. ``lost`` are those whose
    process disappeared without leaving and has not come back. ``lives`` returns whether a process of this host lives,
    None for others.
    """

    process: int
    process_slot: int
    slots: Collection[int]
    fingerprint: int
    run_id: int = 0
    epoch_ns: int = 0
    by_slot: dict[int, Peer] = field(default_factory=dict)
    lost: set[int] = field(default_factory=set)
    lives: Callable[[Presence], bool | None] = lambda _: None
    _looked_ns: int = 0

    def receive(self, presence: Presence, now_ns: int) -> PresenceVerdict:
        """Process a presence."""
        refused = self._refusal(presence)
        if refused is not None:
            return refused
        if presence.run_id and not self.run_id:
            self.run_id = presence.run_id
        if presence.epoch_ns and not self.epoch_ns:
            self.epoch_ns = presence.epoch_ns
        peer = self.by_slot.get(presence.seat)
        if peer is not None and peer.process == presence.process:
            peer.presence, peer.received_ns = presence, now_ns
            return PresenceVerdict.KNOWN
        # Batches from before its first presence were not received: the first one that it announces is missing.
        self.by_slot[presence.seat] = Peer(presence, now_ns)
        self.lost.discard(presence.seat)
        return PresenceVerdict.NEW

    def is_short(self, presence: Presence) -> bool:
        """Whether a presence, if it is an accepted one and the latest, announces batches that were not received."""
        return self._short(presence) is not None

    def missed(self, presence: Presence, now_ns: int) -> None:
        """Note that batches announced by a presence are missing, though all that arrived was read since."""
        peer = self._short(presence)
        if peer is not None:
            peer.short_since_ns = now_ns if peer.short_since_ns is None else peer.short_since_ns
            if now_ns - peer.short_since_ns >= MISSING_NS:
                peer.lacking = max(peer.lacking, presence.sequence)

    def _short(self, presence: Presence) -> Peer | None:
        """Return the process whose latest presence this is, if it announces batches that were not received."""
        peer = self.by_slot.get(presence.seat)
        return peer if peer is not None and peer.presence is presence and presence.sequence > peer.received else None

    def _refusal(self, presence: Presence) -> PresenceVerdict | None:
        if presence.process == self.process:
            return PresenceVerdict.OWN
        if presence.run_id and self.run_id and presence.run_id != self.run_id:
            return PresenceVerdict.OTHER_RUN
        if presence.fingerprint != self.fingerprint:
            return PresenceVerdict.OTHER_FILE
        if set(presence.slots) & set(self.slots):
            return PresenceVerdict.SLOT_TAKEN
        return None

    def look(self, now_ns: int) -> list[Peer]:
        """Remove and return the processes lost since the last call. To be called at each beat."""
        held_up = now_ns - self._looked_ns > HELD_UP_NS
        self._looked_ns = now_ns
        gone = [peer for peer in self.by_slot.values() if self._is_gone(peer, now_ns, held_up=held_up)]
        for peer in gone:
            del self.by_slot[peer.presence.seat]
            if peer.stage != Stage.LEAVING:
                self.lost.add(peer.presence.seat)
        return [peer for peer in gone if peer.stage != Stage.LEAVING]

    def _is_gone(self, peer: Peer, now_ns: int, *, held_up: bool) -> bool:
        lives = self.lives(peer.presence)
        if lives is False:
            return True
        return not held_up and now_ns - peer.received_ns > (HUNG_NS if lives else SILENCE_NS)

    def of(self, process: int) -> Peer | None:
        """Return the process with a number; None if it is not of this run."""
        return next((peer for peer in self.by_slot.values() if peer.process == process), None)

    def running(self) -> Iterator[Peer]:
        """Yield those that scan, by slot."""
        return (peer for _, peer in sorted(self.by_slot.items()) if peer.stage == Stage.RUNNING)

    def owing(self) -> Peer | None:
        """Return a process with missing batches; None if there is none."""
        return next((peer for _, peer in sorted(self.by_slot.items()) if peer.gap), None)
