"""The current control: feedback, reference chain, regulator, choice of the bridge, phase firing (52.1.2, 52.2.1).

It does not handle start, stop and faults: its caller begins a run, scans with a reference, fires open loop, or turns it
off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.bridge_change import FLOOR, QUIET, RECOVERY_US, BridgeChange, ChangeStage, preset_us
from automax_ros.drive.current_loop.firing import Firing
from automax_ros.drive.current_loop.regulator import FULL, STEPS, ReferenceChain, Regulator
from automax_ros.drive.current_loop.signals import RATED, Measured, Pulse, late_us

if TYPE_CHECKING:
    from automax_ros.drive.current_loop.inputs import Latched
    from automax_ros.drive.current_loop.outputs import Outputs
    from automax_ros.drive.current_loop.pll import Pll


CYCLE: Final = 6
"""Scans of a line cycle."""
LEAST: Final = 60.0
"""Reference below which nothing is called a gap, counts (decision)."""
LOW: Final = 0.5
HIGH: Final = 0.75
"""A scan with less than the first part of the reference is a gap if another of the cycle has more than the second
(decision)."""
STEADY: Final = 12
"""Scans for which a reference must have been steady (decision)."""
STEP: Final = 0.06
"""Largest change of a steady reference in a scan: this part of it plus ``STEP_COUNTS`` (decision)."""
STEP_COUNTS: Final = 12.0
MEMORY: Final = 18
"""Scans for which the regulator stays slow after a gap (decision: three cycles)."""
SURGE: Final = 1.4
"""A scan above this times the greatest of the previous cycle and the reference, plus ``SURGE_COUNTS``, is not due to a
gap, and the regulator is no longer slow (decision)."""
SURGE_COUNTS: Final = 400.0


class Gaps(Stateful):
    """Watches the current of each scan for gaps: pulses that are missing in every cycle, as with an open gate (52.3).

    The current of a sound bridge is alike in all six scans of a cycle. Where some of them have little current while the
    reference is steady, a regulator that reacts to each of them would drive up the sound pulses until the drive trips.
    So it follows the mean of a cycle then, slowly, and keeps DELTA nearly constant: the drive runs on and can be
    diagnosed (decision).

    Attributes:
        recent: the current of the last six scans, counts in the direction of the bridge in use.
        left: scans for which the regulator stays slow; 0 while there is no gap.
    """

    _kept = ("recent", "left", "_wanted", "_steady")

    def __init__(self) -> None:
        self.recent = [0.0] * CYCLE
        self.left = 0
        self._wanted = 0.0
        self._steady = 0

    def begin(self) -> None:
        """Start a run, or use of another bridge."""
        self.recent = [0.0] * CYCLE
        self.left = self._steady = 0

    @property
    def mean(self) -> float:
        """The mean current of the last cycle, counts."""
        recent = self.recent
        return (recent[0] + recent[1] + recent[2] + recent[3] + recent[4] + recent[5]) / CYCLE

    def see(self, current: float, wanted: float) -> bool:
        """Add current and reference of a scan, counts in the direction of the bridge; return whether there are gaps."""
        recent = self.recent
        greatest = max(recent)
        surge = current > SURGE * max(greatest, wanted) + SURGE_COUNTS
        self.recent = [*recent[1:], current]
        change = wanted - self._wanted
        self._wanted = wanted
        if wanted < LEAST:
            self.left = 0
        self._steady = self._steady + 1 if abs(change) <= STEP * wanted + STEP_COUNTS and wanted >= LEAST else 0
        if surge:
            self.left = 0
        elif self._is_gap(current, greatest, wanted):
            self.left = MEMORY
        elif self.left:
            self.left -= 1
        return self.left > 0

    def _is_gap(self, current: float, greatest: float, wanted: float) -> bool:
        """Return whether a scan is a gap: first compared with the reference, then with the mean of the cycle."""
        if self.left:
            wanted = self.mean
            return current < LOW * wanted and wanted >= LEAST
        return self._steady > STEADY and current < LOW * wanted and greatest > HIGH * wanted


COUNTS: Final = FULL * 100 / RATED
"""Counts of feedback per unit of ``Measured.current`` where LIM_BAR is 1 %."""
LONGEST_ZERO_US: Final = 3472
"""Largest DC_TIME, us (52.2.1)."""
AHEAD_US: Final = 50
"""By how much a command must come before the next pulse of the old bridge, us (decision: no two scans take the same
time)."""
FRESH_SCANS: Final = 2
"""Scans within which a preset must give a current; then the search continues from it (decision)."""


class CurrentControl(Stateful):
    """Keeps the armature current on its reference; ``parts`` are the parts with state.

    Attributes:
        i_fdbk: I_FDBK of the last scan, counts.
        dc_time: DC_TIME of the last scan, us.
        part: part of the last scan in which current flowed.
        block: whether gates that are on must end at once.
    """

    _kept = ("i_fdbk", "dc_time", "part", "block", "_fresh")

    def __init__(self) -> None:
        self.i_fdbk = 0
        self.dc_time = 0
        self.part = 0.0
        self.block = False
        self._fresh = 0
        self._late_us = 0
        self.chain = ReferenceChain()
        self.regulator = Regulator()
        self.change = BridgeChange()
        self.firing = Firing()
        self.gaps = Gaps()
        self.parts: tuple[Stateful, ...] = (self, self.chain, self.regulator, self.change, self.firing, self.gaps)

    @property
    def bridge(self) -> int:
        """The bridge in use, 1 or 2."""
        return self.change.bridge

    @property
    def delta_us(self) -> float:
        """DELTA of the last scan, us."""
        return self.regulator.delta_us

    @property
    def discontinuous(self) -> bool:
        """Whether the current was zero at some time in the last scan."""
        return self.part < 1.0

    def begin(self) -> None:
        """Start a run: references and DELTA at 0, on bridge 1."""
        self.chain.begin()
        self._take(1, 0.0)

    def feed_back(self, measured: Measured, lim_bar: int, period_ns: int) -> None:
        """Scale the mean current of the last scan, 4095 counts at LIM_BAR: once per scan, whatever the drive does."""
        counts = measured.current * COUNTS / lim_bar
        zero_us = measured.zero_us
        self._late_us = late_us(measured.status)
        # DC_TIME is in whole us, and the scan is slightly longer.
        self.part = max(0.0, 1.0 - zero_us * 6000 / (period_ns - 12_000)) if zero_us else 1.0
        self.i_fdbk = self.regulator.feedback(counts, self.part)
        self.dc_time = zero_us if zero_us < LONGEST_ZERO_US else LONGEST_ZERO_US

    def scan(
        self, measured: Measured, reference: int, settings: Latched, pll: Pll, *, reverse: bool
    ) -> tuple[Pulse, ...]:
        """Regulate the current and plan the pulses up to the next interrupt.

        Args:
            measured: the measurements since the last interrupt, already passed to ``feed_back``.
            reference: counts, 4095 at LIM_BAR; 0 in a stop.
            settings: the inputs in force.
            pll: position in the line cycle.
            reverse: whether the SCRs are fired in the order of the other rotation.
        """
        period_us = pll.period_ns * 1e-3
        scan_us = period_us / 6
        wanted = self.chain.scan(reference, settings.ref_rate, settings.ref_lag, scan_us * 1e-6)
        fast = settings.fast_change
        late = self._late_us
        # The pulse that was planned ahead is at the place of DELTA in a scan; without gates there is none.
        gated = not self.block and late > (3.0 * scan_us - self.regulator.delta_us) % scan_us - AHEAD_US
        self.block = False
        guard_ns = 0
        if self.change.scan(measured, wanted, scan_us, fast=fast, late=late > 0, gated=late > 0 and gated):
            bridge = self.change.bridge
            self._take(bridge, preset_us(measured, bridge, abs(wanted), settings.cc_thresh, period_us) if fast else 0.0)
            self.block = True
            guard_ns = max(0, RECOVERY_US - measured.tail_us) * 1000
        elif self.change.stage:
            return self._phase_back(pll, reverse)
        self._regulate(wanted, settings, period_us)
        return self._fire(pll, self.regulator.delta_us, self.change.bridge, reverse, guard_ns)

    def _phase_back(self, pll: Pll, reverse: bool) -> tuple[Pulse, ...]:
        """Bring the current of the bridge in use to zero, then turn its gates off."""
        if self.change.stage == ChangeStage.OFF or (self._late_us and self.part < 1.0):
            self.block = True
            self.regulator.begin(0.0)
            return self.off()
        back = QUIET if self.part < 1.0 else FLOOR
        self.regulator.begin(min(self.regulator.delta_us, back * pll.period_ns * 1e-3))
        return self._fire(pll, self.regulator.delta_us, self.change.bridge, reverse)

    def _regulate(self, wanted: float, settings: Latched, period_us: float) -> None:
        """Compute DELTA for the bridge in use."""
        regulator, part = self.regulator, self.part
        regulator.see_late(self._late_us, period_us)
        if self.change.bridge == 2:
            error = self.i_fdbk - wanted if wanted < 0.0 else self.i_fdbk
            wanted = -wanted
        else:
            error = wanted - self.i_fdbk if wanted > 0.0 else -self.i_fdbk
        kp = int(settings.kp * STEPS + 0.5) / STEPS
        if self.gaps.see(wanted - error, wanted):
            regulator.slow(wanted - self.gaps.mean, kp, FLOOR * period_us, 0.5 * period_us)
            return
        if part <= 0.0:
            if self._fresh > 0:
                self._fresh -= 1
            elif wanted >= 1.0:
                regulator.search(error, kp, wanted / FULL, period_us)
            return
        if self._fresh > 0:  # a part of the scan was dead time
            self._fresh = 0
            return
        gain = kp * settings.pi_w_lead * period_us / 6e6
        if part < 1.0:
            regulator.discontinuous(error, kp, gain, settings.ag_factor, settings.cc_thresh, part, period_us)
        else:
            regulator.continuous(error, kp, gain, period_us, FLOOR * period_us)

    def open_loop(self, delta_us: float, bridge: int, pll: Pll, *, reverse: bool) -> tuple[Pulse, ...]:
        """Fire at a DELTA (us) on bridge 1 or 2 without regulation: the test mode (52.1.4)."""
        self.change.begin(bridge)
        self.regulator.begin(delta_us)
        self.block = False
        return self._fire(pll, delta_us, bridge, reverse)

    def off(self) -> tuple[Pulse, ...]:
        """Fire nothing; the count of the cycle continues."""
        self.firing.idle()
        return ()

    def show(self, outputs: Outputs) -> None:
        """Write the loop's outputs; to be called only in run, they are held in standby (52.2.1)."""
        chain, regulator = self.chain, self.regulator
        outputs.dc_time = self.dc_time
        outputs.bridge_pol = self.change.bridge == 2
        outputs.ref_rate_out, outputs.ref_lag_out = round(chain.rate_out), round(chain.lag_out)
        outputs.fdbk_gain, outputs.i_fdbk = regulator.fdbk_gain, self.i_fdbk
        outputs.integral_gain, outputs.delta = regulator.integral_gain, round(regulator.delta_us)

    def _take(self, bridge: int, delta_us: float) -> None:
        """Start to use a bridge without current at a DELTA, us."""
        self.change.begin(bridge)
        self.regulator.begin(delta_us)
        self.firing.begin()
        self.gaps.begin()
        self.block = False
        self._fresh = FRESH_SCANS + (self._late_us > 0) if delta_us else 0

    def _fire(self, pll: Pll, delta_us: float, bridge: int, reverse: bool, guard_ns: int = 0) -> tuple[Pulse, ...]:
        delta_ns = int(delta_us * 1000.0 + 0.5)
        ahead = self._late_us > 0
        return self.firing.pulses(
            pll.position, pll.period_ns, pll.next_ns, delta_ns, bridge, reverse, guard_ns, ahead=ahead
        )
