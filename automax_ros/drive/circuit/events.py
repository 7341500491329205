"""What happens in a power circuit, as a list that the circuit hands out."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Final


class EventKind(enum.Enum):
    """What happened; ``number`` of an event is an SCR's, or a phase (0 to 2), or 0."""

    TURN_ON = "turn on"
    EXTINCTION = "extinction"
    COMMUTATION_START = "commutation start"
    COMMUTATION_END = "commutation end"
    COMMUTATION_FAILURE = "commutation failure"
    """An SCR got forward voltage before it recovered, or the incoming one went out instead of the outgoing."""
    ARMATURE_SHORT = "armature short"
    """A phase conducts to both rails: the armature is shorted."""
    LINE_SHORT = "line short"
    """Two phases are shorted through a rail, other than by a commutation."""
    CROSS_FIRE = "cross-fire"
    """SCRs of both bridges conduct."""
    SCR_SHORTED = "SCR shorted"
    GATE_OPEN = "gate open"
    """A gate was to be fired whose lead is open."""
    PHASE_OPEN = "phase open"
    """A phase's current has ended, by a fuse or in the line."""
    PHASE_CLOSED = "phase closed"
    ARMATURE_OPEN = "armature open"
    """The contactor's current has ended."""
    ARMATURE_CLOSED = "armature closed"


ROUTINE: Final = frozenset(
    {EventKind.TURN_ON, EventKind.EXTINCTION, EventKind.COMMUTATION_START, EventKind.COMMUTATION_END}
)
"""What happens in every healthy cycle; told only on request."""


@dataclass(frozen=True)
class CircuitEvent:
    """One thing that happened.

    Attributes:
        kind: what.
        base_ns: an integer instant at or shortly before it, ns.
        after_s: how long after ``base_ns`` it happened (s), not rounded.
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
