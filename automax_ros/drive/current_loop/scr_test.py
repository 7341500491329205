"""The shorted SCR diagnostic: one gate fired alone, at a DELTA that grows from cycle to cycle (52.3.1).

The current of an SCR that is fired alone has no return path but a shorted leg. When it is fired DELTA before alpha
180 degrees, its phase is above the one that it takes over from by sqrt(2) V sin(DELTA), and stays above it up to the
next interrupt, where the current is greatest. So each gate that is fired meets three legs, and currents of line and
armature at that interrupt say which of them is shorted (decision: nothing is published but the numbers):

- current in the line, none in the armature: the leg of the SCR that it takes over from, two places before it. The
  source's inductance limits this current, whatever the motor does: every short is found, at standstill and at speed.
- current in line and armature: the leg of the next SCR, one place after it.
- current in the armature alone: the other leg of its own phase, three places after it. This current needs an EMF that
  drives it: a motor that turns backwards.
"""

from __future__ import annotations

from typing import Final

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.circuit.scr import PARTNER
from automax_ros.drive.current_loop.firing import REVERSED, STANDARD
from automax_ros.drive.current_loop.signals import RATED, Measured, Pulse, gate_bits

CYCLES: Final = 9
"""Line cycles for which a bridge is tested (52.3.1)."""
STEP_NS: Final = 100_000
"""Increase of DELTA from cycle to cycle, ns: 0 to 800 us (decision: equal steps)."""
PULSE_NS: Final = 100_000
"""Length of the gate pulse, ns (decision)."""
THRESHOLD: Final = RATED * 5 // 100
"""Current that means a short, as ``Measured`` has it: 5 % of the rated one (decision)."""

GO_ON: Final = -1
PASSED: Final = 0


class ScrTest(Stateful):
    """One test of the SCRs, from ``begin`` on with a scan at each interrupt; ``bridges`` is the number of bridges."""

    _kept = ("bridges", "_scan", "_fired")

    def __init__(self) -> None:
        self.bridges = 1
        self._scan = self._fired = 0

    def begin(self, *, both: bool) -> None:
        """Begin a test of bridge 1, then of bridge 2 if ``both`` (52.7: Dierikon S6R)."""
        self.bridges = 2 if both else 1
        self._scan = self._fired = 0

    def judge(self, measured: Measured, *, reverse: bool) -> int:
        """Judge the gate that was fired before this interrupt.

        Returns:
            BAD_SCR_NUM, 1 to 6, where a short is concluded; GO_ON; or PASSED after the last gate.
        """
        if self._fired:
            place = _suspect(measured)
            if place is not None:
                return _pair(self._fired, place, reverse)
        return PASSED if self._scan >= self.bridges * CYCLES * 6 else GO_ON

    def fire(self, position: int, period_ns: int, *, reverse: bool, late: bool = False) -> tuple[Pulse, ...]:
        """Fire the next gate; arguments as for ``Firing.pulses``; ``late``: commands come after interrupts."""
        cycle = self._scan // 6
        delta_ns = STEP_NS * (cycle % CYCLES)
        if late and not delta_ns:  # a pulse at the interrupt would have ended when the command comes
            delta_ns = PULSE_NS
        # Alpha 180 of the fired SCR is at this interrupt without a DELTA, else at the next one.
        place = position + 4 if delta_ns else position + 3
        self._fired = (REVERSED if reverse else STANDARD)[place % 6] + 10 * (cycle // CYCLES)
        self._scan += 1
        after_ns = period_ns // 6 - delta_ns if delta_ns else 0
        return (Pulse(after_ns, PULSE_NS, gate_bits(self._fired)),)


def _suspect(measured: Measured) -> int | None:
    """Return how many places after the fired SCR the shorted leg is, None without a short."""
    armature = measured.tail_us == 0
    if measured.line >= THRESHOLD:
        return 1 if armature else -2
    return 3 if armature and abs(measured.current) >= THRESHOLD else None


def _pair(fired: int, places: int, reverse: bool) -> int:
    """Return the pair, by its SCR of bridge 1, of the SCR some places after another of the same bridge."""
    order = REVERSED if reverse else STANDARD
    number = order[(order.index(fired % 10) + places) % 6]
    return number if fired < 10 else PARTNER[number + 10]
