"""The phase locked loop: when interrupts come, and whether they keep step with the line (52.5).

An interrupt comes at each sixth of a line cycle, where phase T1 is at its maximum and each 60 degrees after it: the
instants of natural commutation. Once a cycle, at position 0, the loop sees how far T1's maximum lies from where it was
expected, and moves phase and period by at most the steps of the registers 4137 and 4138 (decision: gains, criterion of
lock; nothing is published).
"""

from __future__ import annotations

from automax_ros.drive.cml.signals import LINE, Measured
from automax_ros.drive.state import Stateful

LOST_NS = 2_000_000
"""Largest phase error, ns (52.5.1); beyond it the sync is lost."""
LOCKED_NS = 100_000
"""Phase error within which a cycle counts towards the lock, ns (decision)."""
LOCK_CYCLES = 6
"""Cycles in a row with a small error that make the lock (decision)."""
SHORTEST_US, LONGEST_US = 16_129, 20_833
"""Range of LINE_PERIOD, us: 62 to 48 Hz (52.2.1)."""


class Pll(Stateful):
    """Follows the line.

    Attributes:
        locked: whether it has locked.
        period_ns: period of the line as the loop has it, ns.
        position: which sixth of the cycle begins at the present interrupt, 0 at T1's maximum.
        error_ns: the last phase error, ns; positive where the line is late.
        next_ns: time from the present interrupt to the next, ns.
    """

    _kept = ("locked", "period_ns", "position", "error_ns", "next_ns", "_good", "_preset", "_alive")

    def __init__(self) -> None:
        """Begin unlocked, without a line."""
        self.locked = False
        self.period_ns = 16_666_667
        self.position = 0
        self.error_ns = 0
        self.next_ns = 2_777_778
        self._good = 0
        self._preset = False
        self._alive = False

    @property
    def period_us(self) -> int:
        """LINE_PERIOD, us."""
        return (self.period_ns + 500) // 1000

    def start(self, line_hz: int) -> None:
        """Begin at a nominal frequency, Hz."""
        self.__init__()  # type: ignore[misc]
        self.period_ns = 1_000_000_000 // line_hz
        self.next_ns = self.period_ns // 6

    def follow(self, measured: Measured) -> bool:
        """Follow the line at an interrupt; return whether the sync was lost at it."""
        if not measured.status & LINE or measured.phase_step <= 0 or measured.period_step <= 0:
            return self._lose()
        if not self._preset:
            self._catch(measured)
            return False
        self.position = (self.position + 1) % 6
        sixth = self.period_ns // 6
        self.next_ns = sixth
        if self.position:
            return False
        late = measured.since_sync_ns
        if late > self.period_ns // 2:
            late -= self.period_ns
        self.error_ns = -late
        if abs(late) > LOST_NS:
            return self._lose()
        self._correct(measured)
        if abs(late) <= LOCKED_NS:
            self._good += 1
            self.locked = self.locked or self._good >= LOCK_CYCLES
        else:
            self._good = 0
        return False

    def _correct(self, measured: Measured) -> None:
        error = self.error_ns
        phase = 1000 * min(measured.phase_step, 2000)
        step = 1000 * min(measured.period_step, 1000)
        period = self.period_ns + max(-step, min(step, error // 4))
        self.period_ns = max(1000 * SHORTEST_US, min(1000 * LONGEST_US, period))
        self.next_ns = self.period_ns // 6 + max(-phase, min(phase, error // 2))

    def _catch(self, measured: Measured) -> None:
        """Place the next interrupt on a natural commutation of the line."""
        self._preset = True
        sixth = self.period_ns // 6
        passed = measured.since_sync_ns
        self.position = passed // sixth % 6
        self.next_ns = sixth - passed % sixth
        if self.next_ns < sixth // 4:
            self.position = (self.position + 1) % 6
            self.next_ns += sixth

    def _lose(self) -> bool:
        was = self.locked
        self.locked = self._preset = False
        self._good = 0
        self.next_ns = self.period_ns // 6
        return was
