"""The change from one bridge to the other: phase back, zero current, then the other's gates (52.6).

Ordinary: current must be seen to be zero over a whole scan, then the new bridge begins at DELTA 0 and searches: the
more CEMF is against it and the smaller the reference, the longer that takes (decision). Fast (register 4146 bit 0):
the new bridge begins as soon as the old one's SCRs have recovered, at the DELTA that the CEMF asks for (decision).
"""

from __future__ import annotations

import enum
from math import acos, pi
from typing import Final

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.regulator import BOUNDARY_WAY
from automax_ros.drive.current_loop.signals import VOLTAGE, VOLTS, Measured

FLOOR: Final = 27 / 360
"""DELTA over the period that inversion needs while current is continuous: overlap at 2.5 times the rated current, and
the turn-off time of SCRs (decision)."""
QUIET: Final = 8 / 360
"""DELTA over the period in the phase back once current is discontinuous: it fires next to nothing, and turns off
(decision)."""
RECOVERY_US: Final = 500
"""Time without current after which SCRs block, with a margin (decision)."""
VD0: Final = 1.3505
"""Ideal mean voltage of a bridge over the line-to-line voltage: 3 sqrt(2) / pi."""
PRESET: Final = 0.6
"""Largest conducting part of a scan after a preset, by the law of ``regulator`` (decision)."""
HIGHEST_COS: Final = 0.95
"""Alpha of a preset lies between the angles of this cosine (decision)."""


class ChangeStage(enum.IntEnum):
    """The stage of a change."""

    NONE = 0
    BACK = 1
    """The old bridge is phased back."""
    OFF = 2
    """No current was measured; all gates are off."""


class BridgeChange(Stateful):
    """Chooses the bridge.

    Attributes:
        bridge: 1 or 2, the one in use.
        stage: the stage of a change to the other.
    """

    _kept = ("bridge", "stage")

    def __init__(self) -> None:
        self.bridge = 1
        self.stage = ChangeStage.NONE

    def begin(self, bridge: int) -> None:
        """Start with a bridge, without current."""
        self.bridge = bridge
        self.stage = ChangeStage.NONE

    def scan(
        self,
        measured: Measured,
        wanted: float,
        scan_us: float,
        *,
        fast: bool,
        late: bool = False,
        gated: bool = False,
    ) -> bool:
        """Execute a scan; return whether the other bridge is in use from now on.

        Args:
            measured: the measurements of the last scan.
            wanted: the reference after the lag, counts.
            scan_us: the time of a scan.
            fast: whether the fast change is on.
            late: whether commands come after their interrupt: the gates have continued meanwhile, so measurements from
                before the change do not prove that no current flows.
            gated: whether a gate of the old bridge, fired after this interrupt, may come before the command: it
                conducts again then, and the other bridge would fire across.
        """
        # The sign decides, from one count on (52.1.2): the time of the change itself prevents chattering.
        against = round(wanted if self.bridge == 2 else -wanted)
        if self.stage == ChangeStage.NONE:
            if against < 1:
                return False
            self.stage = ChangeStage.BACK
            if late:
                return False
        elif against < 0:
            self.stage = ChangeStage.NONE
            return False
        if measured.tail_us <= 0:
            self.stage = ChangeStage.BACK
            return False
        if gated or (not fast and measured.tail_us < int(scan_us)):
            self.stage = ChangeStage.OFF
            return False
        self.begin(3 - self.bridge)
        return True


def preset_us(measured: Measured, bridge: int, wanted: float, thresh: int, period_us: float) -> float:
    """Return the DELTA with which a bridge supplies current at once, from the measured CEMF.

    Without armature voltage feedback the CEMF is taken as 0, alpha is 90 degrees whatever the reference: at speed that
    ends in IOC, as 52.6.2 says (decision).

    Args:
        measured: the measurements of the last scan, in which no current flowed.
        bridge: 1 or 2.
        wanted: magnitude of the reference, counts.
        thresh: CC_THRESH, counts: a smaller reference begins with an earlier DELTA.
        period_us: the line's period.
    """
    if not measured.status & VOLTAGE:
        return 0.25 * period_us
    ratio = measured.voltage / (VOLTS * VD0)
    if bridge == 2:
        ratio = -ratio
    continuous = (1.0 - acos(max(-HIGHEST_COS, min(HIGHEST_COS, ratio))) / pi) * 0.5 * period_us
    part = min(PRESET, float((wanted / max(thresh, 1)) ** (1 / 3)))
    return continuous - (1.0 - part) * BOUNDARY_WAY * period_us
