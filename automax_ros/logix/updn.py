"""UPDN, the up/down accumulator of the Logix controllers, as needed to accumulate a position after PMUL."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from automax_ros.logix.data_types import Instruction, require_real, single


@dataclass
class UpDownAccumulator(Instruction):
    """A tag of type UP_DOWN_ACCUM, with the instruction's internal accumulator.

    Set the input members, call ``scan``, read ``Out``. Numbers are REAL: each sum is rounded to an IEEE single, so
    whole numbers are exact up to 2**24 = 16,777,216 and counts are lost beyond.

    Covered: all eight members and the three cases of the algorithm: Initialize gives InitialValue, else Hold keeps the
    accumulator, else it becomes accumulator + InPlus - InMinus. Not covered: the controller's math status flags.

    InPlus is added first, then InMinus is subtracted, each sum rounded (decision). A sum that overflows is Infinity
    with EnableOut cleared (decision). The accumulator is 0 on a first scan, the first execution of a new tag or after
    a prescan (decision).
    """

    Initialize: bool = False
    InitialValue: float = 0.0
    InPlus: float = 0.0
    InMinus: float = 0.0
    Hold: bool = False
    Out: float = field(default=0.0, init=False)
    accumulator: float = field(default=0.0, init=False)

    def scan(self) -> None:
        """Execute the instruction once, if EnableIn is set; without it Out and the accumulator do not change.

        Raises:
            ValueError: InitialValue, InPlus or InMinus is not a number; nothing was executed.
        """
        for member in ("InitialValue", "InPlus", "InMinus"):
            require_real(member, getattr(self, member))
        if not self.EnableIn:
            self.EnableOut = False
            return
        if self._first_scan:
            self.accumulator = 0.0
            self._first_scan = False
        if self.Initialize:
            self.accumulator = single(self.InitialValue)
        elif not self.Hold:
            self.accumulator = single(single(self.accumulator + single(self.InPlus)) - single(self.InMinus))
        self.Out = self.accumulator
        self.EnableOut = math.isfinite(self.Out)
