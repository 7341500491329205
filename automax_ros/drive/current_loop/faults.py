"""The drive faults of the current minor loop: their causes, latching and reset (52.1.5, 52.2.2, 52.4).

All but tach loss, which needs a DELTA, are checked at each scan, in standby too (decision). A fault is latched and
logged once; it stays until FAULT_RESET in standby finds its cause gone. While one is active no start is accepted; one
that occurs while the drive runs makes it coast, except a tach loss that TACH_LOSS_STOP only indicates. FAULT_RESET is
a level, read at each system clock tick, not an edge; it resets nothing that no tick has shown yet (decision).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.signals import EXTERNAL_TRIP, LINE, OVERCURRENT, OVERSPEED, ROTATION_ABC, Measured

if TYPE_CHECKING:
    from automax_ros.drive.current_loop.inputs import Inputs, Latched
    from automax_ros.drive.current_loop.outputs import Outputs
    from automax_ros.drive.current_loop.pll import Pll

IOC: Final = 1 << 0
SYNC_LOSS: Final = 1 << 1
TACH_LOSS: Final = 1 << 2
OSV: Final = 1 << 3
EXT_IET: Final = 1 << 4
PHROT: Final = 1 << 5
BAD_SCR: Final = 1 << 6
HARDWARE: Final = 1 << 7
"""Accompanies OSV among the causes where the hardware's overspeed circuit detected it and OSV_FDBK does not."""
OSV_PROBLEM: Final = 7113
OVERSPEED_TRIP: Final = 7119
"""Problem of an OSV, and the problem logged instead where HARDWARE is set."""


class FaultKind(NamedTuple):
    """A drive fault: its bit, its output, and the number of the problem that is logged."""

    bit: int
    output: str
    problem: int


KINDS: Final = (
    FaultKind(IOC, "ioc_out", 7110),
    FaultKind(SYNC_LOSS, "sync_loss_out", 7111),
    FaultKind(TACH_LOSS, "tach_loss_out", 7112),
    FaultKind(OSV, "osv_out", OSV_PROBLEM),
    FaultKind(EXT_IET, "ext_iet_out", 7114),
    FaultKind(PHROT, "phrot_flt_out", 7115),
    FaultKind(BAD_SCR, "bad_scr_out", 7116),
)
"""The drive faults, in the order in which they are logged when several occur at once."""

SYNC_SCANS: Final = 360
"""Scans from task initialisation within which the line sync must lock, or it is lost: 1 s at 60 Hz (decision)."""
TACH_SCANS: Final = 16
"""Scans whose DELTA tach loss averages (52.4)."""
TACH_SPEED: Final = 205
"""SPEED_FDBK below which the motor counts as stopped: 5 % of 4095 (52.4)."""
TACH_HIGHEST_DEG: Final = 127
"""The threshold of register 4136 is limited to 0 up to this in use, degrees (52.4.1)."""


class Faults(Stateful):
    """The drive faults of one drive.

    Attributes:
        active: bits of the faults that are latched.
        bad_scr_num: BAD_SCR_NUM, 0 without a shorted SCR.
    """

    _kept = ("active", "bad_scr_num", "_shown", "_sync_left", "_deltas", "_delta_sum", "_delta_count")

    def __init__(self) -> None:
        self.active = 0
        self.bad_scr_num = 0
        self._shown = 0
        self._sync_left = SYNC_SCANS
        self._deltas = [0] * TACH_SCANS
        self._delta_sum = self._delta_count = 0

    def begin_run(self) -> None:
        """Start a run: DELTA is averaged from here on."""
        self._deltas = [0] * TACH_SCANS
        self._delta_sum = self._delta_count = 0

    def note_delta(self, delta_us: int) -> None:
        """Record the DELTA (us) of a scan in which the drive runs."""
        place = self._delta_count % TACH_SCANS
        self._delta_sum += delta_us - self._deltas[place]
        self._deltas[place] = delta_us
        self._delta_count += 1

    def causes(self, measured: Measured, inputs: Inputs, settings: Latched, pll: Pll, *, running: bool) -> int:
        """Return the bits of the faults whose cause is present at this scan, apart from BAD_SCR."""
        status = measured.status
        found = 0
        if status & OVERCURRENT:
            found |= IOC
        if status & EXTERNAL_TRIP:
            found |= EXT_IET
        if self._sync_lost(measured, pll):
            found |= SYNC_LOSS
        if inputs.osv_fdbk is not None and abs(inputs.osv_fdbk) > settings.osv_thresh:
            found |= OSV
        elif status & OVERSPEED and settings.digital_tach:
            found |= OSV | HARDWARE
        if status & LINE and bool(status & ROTATION_ABC) != inputs.nonstand_phrot and not settings.auto_phrot:
            found |= PHROT
        if running and inputs.speed_fdbk is not None and self._tach_lost(measured, inputs.speed_fdbk, pll):
            found |= TACH_LOSS
        return found

    def latch(self, causes: int) -> list[int]:
        """Latch the faults of these bits; return the problems to log: those of the new ones."""
        new = causes & ~(self.active | HARDWARE)
        if not new:
            return []
        self.active |= new
        problems = [kind.problem for kind in KINDS if kind.bit & new]
        if causes & HARDWARE and new & OSV:
            problems[problems.index(OSV_PROBLEM)] = OVERSPEED_TRIP
        return problems

    def blame(self, pair: int) -> list[int]:
        """Latch a shorted SCR of a pair, 1 to 6; return the problems to log."""
        self.bad_scr_num = pair
        return self.latch(BAD_SCR)

    def reset(self, causes: int) -> None:
        """Reset the faults whose cause is gone, of those that a tick has shown."""
        self.active &= causes | ~self._shown
        if not self.active & BAD_SCR:
            self.bad_scr_num = 0

    def stops(self, settings: Latched) -> bool:
        """Return whether a fault is active that makes the drive coast."""
        return bool(self.active if settings.tach_loss_stop else self.active & ~TACH_LOSS)

    def show(self, outputs: Outputs) -> None:
        """Write the fault outputs of a system clock tick."""
        active = self.active
        if active != self._shown:
            self._shown = active
            for bit, output, _ in KINDS:
                setattr(outputs, output, bool(active & bit))
        outputs.bad_scr_num = self.bad_scr_num

    def _sync_lost(self, measured: Measured, pll: Pll) -> bool:
        if pll.locked:
            self._sync_left = 0
            return False
        if self._sync_left:
            self._sync_left -= 1
        return not self._sync_left or measured.phase_step <= 0 or measured.period_step <= 0

    def _tach_lost(self, measured: Measured, speed: int, pll: Pll) -> bool:
        """Return whether the motor turns by the mean DELTA but is stopped by SPEED_FDBK."""
        if abs(speed) >= TACH_SPEED or self._delta_count < TACH_SCANS:
            return False
        threshold = max(0, min(TACH_HIGHEST_DEG, measured.tach_threshold))
        return self._delta_sum * 360_000 > threshold * TACH_SCANS * pll.period_ns
