"""The events of a power circuit."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Final


class EventKind(enum.Enum):
    """Kind of an event, whose ``number`` is that of an SCR or phase (0 to 2), or 0."""

    TURN_ON = "turn on"
    EXTINCTION = "extinction"
    COMMUTATION_START = "commutation start"
    COMMUTATION_END = "commutation end"
    COMMUTATION_FAILURE = "commutation failure"
    """An SCR got forward voltage before it recovered, or the incoming one was extinguished instead of the outgoing."""
    ARMATURE_SHORT = "armature short"
    """A phase conducts to both rails: the armature is shorted."""
    LINE_SHORT = "line short"
    """Two phases are shorted through a rail, other than by a commutation."""
    CROSS_FIRE = "cross-fire"
    """SCRs of both bridges conduct."""
    SCR_SHORTED = "SCR shorted"
    GATE_OPEN = "gate open"
    """An SCR was to be fired whose gate lead is open."""
    PHASE_OPEN = "phase open"
    """A phase's current has been interrupted, by a fuse or in the line."""
    PHASE_CLOSED = "phase closed"
    ARMATURE_OPEN = "armature open"
    """The contactor has interrupted the armature current."""
    ARMATURE_CLOSED = "armature closed"


ROUTINE: Final = frozenset(
    {EventKind.TURN_ON, EventKind.EXTINCTION, EventKind.COMMUTATION_START, EventKind.COMMUTATION_END}
)
"""Events of every healthy cycle; recorded only on request."""


@dataclass(frozen=True)
class CircuitEvent:
    """An event.

    Attributes:
        kind: its kind.
        base_ns: an integer instant at or shortly before it, ns.
        after_s: time from ``base_ns`` to the event (s), not rounded.
        number: an SCR's number, or a phase.
        current_a: the armature current at that instant, A.
    """

    kind: EventKind
    base_ns: int
    after_s: float
    number: int
    current_a: float

    @property
    def time_s(self) -> float:
        """The instant in s."""
        return self.base_ns * 1e-9 + self.after_s
