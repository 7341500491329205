"""Start, stop and coast stop of the drive (52.1.3, 52.3.1).

A start is the rising edge of CML_RUN, seen at a system clock tick in standby while nothing forbids it; an edge that
comes at another time is forgotten, and not logged (decision). The first tick after task initialisation has no edge.
"""

from __future__ import annotations

import enum
from typing import Final

from automax_ros.drive.base.state import Stateful

CLOSE_NS: Final = 30_000_000
"""From the relay to the next step, ns: the contactor closes meanwhile. With the nine cycles of the shorted SCR test at
60 Hz that makes the 180 ms of 52.3.1 (decision: no feedback of the contactor is known)."""


class Phase(enum.IntEnum):
    """The phase of the drive between standby and run."""

    STANDBY = 0
    CLOSING = 1
    """The contactor's relay is on; the contactor closes."""
    SCR_TEST = 2
    """Gates are fired one by one: the shorted SCR test."""
    RUN = 3
    STOPPING = 4
    """The current is brought to zero, then the contactor opens: neither rate limit nor lag of the reference hold it up
    (decision)."""


_RUN: Final = int(Phase.RUN)
_WAITING: Final = (Phase.CLOSING, Phase.SCR_TEST, Phase.STOPPING)


class Sequence(Stateful):
    """The state machine.

    Attributes:
        phase: the drive's phase.
        relays: the contactor relays that are on.
    """

    _kept = ("phase", "relays", "_since_ns", "_run_before")

    def __init__(self) -> None:
        self.phase = Phase.STANDBY
        self.relays = 0
        self._since_ns = 0
        self._run_before = True

    @property
    def running(self) -> bool:
        """DC_CML_STATE: TRUE until a stop has opened the contactor (decision)."""
        return self.phase >= _RUN

    @property
    def under_way(self) -> bool:
        """Whether a start or stop waits for its next step."""
        return self.phase in _WAITING

    def tick(self, now_ns: int, *, run: bool, may_start: bool, relay: int) -> None:
        """Follow CML_RUN at a tick; ``may_start``: locked, permitted, no fault."""
        rising = run and not self._run_before
        self._run_before = run
        if self.phase is Phase.STANDBY:
            if rising and may_start:
                self._enter(Phase.CLOSING, now_ns)
                self.relays = relay
        elif not run and self.phase is Phase.RUN:
            self._enter(Phase.STOPPING, now_ns)
        elif not run and self.phase is not Phase.STOPPING:
            self.coast()

    def closed(self, now_ns: int) -> bool:
        """Return whether the closing time of the contactor has passed."""
        return self.phase is Phase.CLOSING and now_ns - self._since_ns >= CLOSE_NS

    def test(self, now_ns: int) -> None:
        """Begin the shorted SCR test."""
        self._enter(Phase.SCR_TEST, now_ns)

    def run(self, now_ns: int) -> None:
        """Start to run."""
        self._enter(Phase.RUN, now_ns)

    def stopped(self, now_ns: int, *, dropout_s: float, discontinuous: bool) -> bool:
        """Return whether a stop may open the contactor: the current is discontinuous, or MAX_M_DROPOUT has passed."""
        if self.phase is not Phase.STOPPING:
            return False
        return discontinuous or now_ns - self._since_ns >= dropout_s * 1e9

    def coast(self) -> None:
        """Open the contactor at once and go to standby."""
        self.phase = Phase.STANDBY
        self.relays = 0

    def _enter(self, phase: Phase, now_ns: int) -> None:
        self.phase, self._since_ns = phase, now_ns
