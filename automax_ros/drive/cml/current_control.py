"""The current control: feedback, reference chain, regulator, choice of the bridge, phase firing (52.1.2, 52.2.1).

Start, stop and faults are not its business: it is told to begin, to scan with a reference, to fire open loop, or off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.drive.cml.firing import Firing
from automax_ros.drive.cml.reference import FULL, ReferenceChain
from automax_ros.drive.cml.regulator import Regulator
from automax_ros.drive.cml.signals import RATED, Measured, Pulse
from automax_ros.drive.state import Stateful

if TYPE_CHECKING:
    from automax_ros.drive.cml.latching import Latched
    from automax_ros.drive.cml.outputs import Outputs
    from automax_ros.drive.cml.pll import Pll

LONGEST_ZERO_US = 3472
"""Largest DC_TIME, us (52.2.1)."""


class CurrentControl(Stateful):
    """Keeps the armature current on its reference; ``parts`` are what its state consists of.

    Attributes:
        i_fdbk: I_FDBK of the last scan, counts.
        dc_time: DC_TIME of the last scan, us.
        bridge: 1 or 2.
        discontinuous: whether the current was zero at some time in the last scan.
        block: whether gates that are on shall end at once.
    """

    _kept = ("i_fdbk", "dc_time", "bridge", "discontinuous", "block")

    def __init__(self) -> None:
        """Begin with everything off."""
        self.i_fdbk = 0
        self.dc_time = 0
        self.bridge = 1
        self.discontinuous = False
        self.block = False
        self.chain = ReferenceChain()
        self.regulator = Regulator()
        self.firing = Firing()
        self.parts: tuple[Stateful, ...] = (self, self.chain, self.regulator, self.firing)

    @property
    def delta_us(self) -> float:
        """DELTA of the last scan, us."""
        return self.regulator.delta_us

    def begin(self) -> None:
        """Begin a run: references and DELTA at 0, on bridge 1."""
        self.bridge = 1
        self.chain.begin()
        self.regulator.begin(0.0)
        self.firing.begin()

    def feed_back(self, measured: Measured, lim_bar: int, period_ns: int) -> None:
        """Scale the mean current of the last scan, 4095 counts at LIM_BAR: once each scan, whatever the drive does."""
        counts = measured.current * FULL * 100 / (RATED * lim_bar)
        self.i_fdbk = self.regulator.feedback(counts, measured.zero_us, period_ns / 6000)
        self.dc_time = min(measured.zero_us, LONGEST_ZERO_US)
        self.discontinuous = measured.zero_us > 0

    def scan(
        self,
        measured: Measured,  # noqa: ARG002
        reference: int,
        settings: Latched,
        pll: Pll,
        *,
        reverse: bool,
    ) -> tuple[Pulse, ...]:
        """Regulate the current and plan the pulses up to the next interrupt.

        Args:
            measured: what was measured since the last interrupt; ``feed_back`` has seen it.
            reference: counts, 4095 at LIM_BAR; 0 in a stop.
            settings: the inputs in force.
            pll: where the line is.
            reverse: whether the SCRs are fired in the order of the other rotation.
        """
        interval_s = pll.period_ns / 6e9
        wanted = self.chain.scan(reference, settings.ref_rate, settings.ref_lag, interval_s)
        self.bridge = 2 if wanted < 0 else 1
        error = (wanted - self.i_fdbk) * (1 if self.bridge == 1 else -1)
        highest_us = pll.period_ns / 2000
        self.regulator.scan(error, settings.kp, settings.pi_w_lead, 1.0, interval_s, highest_us)
        return self._fire(pll, self.regulator.delta_us, self.bridge, reverse)

    def open_loop(self, delta_us: float, bridge: int, pll: Pll, *, reverse: bool) -> tuple[Pulse, ...]:
        """Fire at a DELTA (us) on bridge 1 or 2 without regulation: the test mode (52.1.4)."""
        self.bridge = bridge
        self.regulator.begin(delta_us)
        return self._fire(pll, delta_us, bridge, reverse)

    def off(self, pll: Pll) -> tuple[Pulse, ...]:
        """Fire nothing; the cycle is counted on."""
        return self._fire(pll, 0.0, 0, False)

    def show(self, outputs: Outputs) -> None:
        """Write the loop's outputs; to be called in run alone, they are held in standby (52.2.1)."""
        outputs.dc_time = self.dc_time
        outputs.bridge_pol = self.bridge == 2
        outputs.ref_rate_out, outputs.ref_lag_out = round(self.chain.rate_out), round(self.chain.lag_out)
        outputs.fdbk_gain, outputs.i_fdbk = self.regulator.fdbk_gain, self.i_fdbk
        outputs.integral_gain, outputs.delta = self.regulator.integral_gain, round(self.regulator.delta_us)

    def _fire(self, pll: Pll, delta_us: float, bridge: int, reverse: bool) -> tuple[Pulse, ...]:
        return self.firing.pulses(pll.position, pll.period_ns, round(delta_us * 1000), bridge, reverse)
