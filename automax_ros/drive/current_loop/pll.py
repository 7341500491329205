"""The phase locked loop: the instants of the interrupts, and their synchronism with the line (52.5).

An interrupt comes at each sixth of a line cycle, where phase T1 is at its maximum and each 60 degrees after it: the
instants of natural commutation (decision). At first, and after a loss, two maxima of T1 give period and phase
(decision). From then on, once per cycle, at position 0, the loop measures the distance of T1's maximum from its
expected place, and moves the phase by all of it and the period by half of it, at most by the registers 4137 and 4138.
So a phase step above the largest error, 2000 us, changes nothing (52.5.1), and the phase needs twice the period's step
(decision). Registers of another ratio are used as they are (decision).
"""

from __future__ import annotations

from typing import Final

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.signals import LINE, Measured

LOST_NS: Final = 2_000_000
"""Largest phase error, ns (52.5.1); beyond it the sync is lost."""
LOCKED_NS: Final = 100_000
"""Phase error within which a cycle counts towards the lock, ns (decision)."""
LOCK_CYCLES: Final = 6
"""Cycles in a row with a small error that make the lock (decision)."""
SHORTEST_NS: Final = 16_128_500
LONGEST_NS: Final = 20_833_499
"""Range of the period, ns: LINE_PERIOD is 16129 to 20833, 62 to 48 Hz (52.2.1)."""
NEVER: Final = -1


class Pll(Stateful):
    """Follows the line.

    Attributes:
        locked: whether it has locked.
        period_ns: the loop's period of the line, ns.
        position: the sixth of the cycle that begins at the present interrupt, 0 at T1's maximum.
        error_ns: the last phase error, ns; positive where the line is late.
        next_ns: time from the present interrupt to the next, ns.
    """

    _kept = (
        "locked", "period_ns", "position", "error_ns", "next_ns", "_good", "_placed", "_passed_ns", "_since_ns",
        "_maximum_ns",
    )  # fmt: skip

    def __init__(self) -> None:
        self.locked = False
        self.period_ns = 16_666_667
        self.position = 0
        self.error_ns = 0
        self.next_ns = 2_777_778
        self._good = 0
        self._placed = False
        self._forget()

    def _forget(self) -> None:
        self._passed_ns = self._since_ns = 0
        self._maximum_ns = NEVER

    @property
    def period_us(self) -> int:
        """LINE_PERIOD, us."""
        return (self.period_ns + 500) // 1000

    def start(self, line_hz: int) -> None:
        """Start at a nominal frequency, Hz."""
        self.__init__()  # type: ignore[misc]
        self.period_ns = 1_000_000_000 // line_hz
        self.next_ns = self.period_ns // 6

    def follow(self, measured: Measured) -> bool:
        """Follow the line at an interrupt; return whether the sync was lost at it."""
        if not measured.status & LINE or measured.phase_step <= 0 or measured.period_step <= 0:
            return self._lose()
        if not self._placed:
            self._look(measured.since_sync_ns)
            return False
        self.position = position = (self.position + 1) % 6
        self.next_ns = self.period_ns // 6
        if position:
            return False
        late = measured.since_sync_ns
        if late > self.period_ns // 2:
            late -= self.period_ns
        self.error_ns = -late
        if abs(late) > LOST_NS:
            return self._lose()
        # Period and phase move towards the line, at most by the steps.
        phase_ns, period_ns = 1000 * measured.phase_step, 1000 * measured.period_step
        self._take_period(self.period_ns + max(-period_ns, min(period_ns, -late // 2)))
        self.next_ns = self.period_ns // 6 + max(-phase_ns, min(phase_ns, -late))
        self._good = self._good + 1 if abs(late) <= LOCKED_NS else 0
        self.locked = self.locked or self._good >= LOCK_CYCLES
        return False

    def _take_period(self, period_ns: int) -> None:
        self.period_ns = max(SHORTEST_NS, min(LONGEST_NS, period_ns))

    def _look(self, since_ns: int) -> None:
        """Wait for two maxima of T1, then set the next interrupt to a natural commutation."""
        self._passed_ns += self.next_ns
        maximum_ns = self._passed_ns - since_ns
        if since_ns < self._since_ns:
            if self._maximum_ns != NEVER:
                self._take_period(maximum_ns - self._maximum_ns)
                self._place(since_ns)
                return
            self._maximum_ns = maximum_ns
        self._since_ns = since_ns
        self.next_ns = self.period_ns // 6

    def _place(self, since_ns: int) -> None:
        self._placed = True
        sixth = self.period_ns // 6
        self.position = since_ns // sixth % 6
        self.next_ns = sixth - since_ns % sixth
        if self.next_ns < sixth // 4:  # too near
            self.position = (self.position + 1) % 6
            self.next_ns += sixth

    def _lose(self) -> bool:
        was = self.locked
        self.locked = self._placed = False
        self._good = 0
        self._forget()
        self.next_ns = self.period_ns // 6
        return was
