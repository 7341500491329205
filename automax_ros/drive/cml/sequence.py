"""Start, stop and coast stop of the drive (52.1.3, 52.3.1). Times of the contactor are decisions."""

from __future__ import annotations

import enum

from automax_ros.drive.state import Stateful

CLOSE_NS = 100_000_000
"""From the relay to a closed contactor, ns, as the sequence allows for it (decision)."""


class Phase(enum.IntEnum):
    """Where the drive is between standby and run."""

    STANDBY = 0
    CLOSING = 1
    """The contactor's relay is on; the contactor closes."""
    SCR_TEST = 2
    RUN = 3
    STOPPING = 4
    """The current is brought to zero, then the contactor opens."""


class Sequence(Stateful):
    """The state machine.

    Attributes:
        phase: where the drive is.
        relays: which contactor relays are on.
    """

    _kept = ("phase", "relays", "_since_ns", "_run_before")

    def __init__(self) -> None:
        """Begin in standby."""
        self.phase = Phase.STANDBY
        self.relays = 0
        self._since_ns = 0
        self._run_before = True

    @property
    def running(self) -> bool:
        """DC_CML_STATE."""
        return self.phase in (Phase.RUN, Phase.STOPPING)

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

    def scan(self, now_ns: int, *, dropout_s: float, discontinuous: bool) -> None:
        """Move on at a scan."""
        passed = now_ns - self._since_ns
        if self.phase is Phase.CLOSING and passed >= CLOSE_NS:
            self._enter(Phase.RUN, now_ns)
        elif self.phase is Phase.STOPPING and (discontinuous or passed >= dropout_s * 1e9):
            self.coast()

    def coast(self) -> None:
        """Open the contactor at once and go to standby."""
        self.phase = Phase.STANDBY
        self.relays = 0

    def _enter(self, phase: Phase, now_ns: int) -> None:
        self.phase, self._since_ns = phase, now_ns
