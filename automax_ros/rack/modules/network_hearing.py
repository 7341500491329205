"""Whom a network module hears: who sends each drop, since when it is silent, and who sends what is another's.

A cycle without a frame of a drop makes it silent; ``TIMEOUT_CYCLES`` of them are a receive time-out, and ``MISSES`` of
those in a row lose the drop (57C570 manual p. 18-6), after 88 ms. The length of a time-out is ours (decision): no
source at hand prints it, and the loss of a station is told within 100 ms, as that of a process of a distributed rack.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass
from typing import Any

from automax_ros.rack.modules.network_port import Frame, Sender

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

    def take(self, sender: Sender, frame: Frame) -> int | None:
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
