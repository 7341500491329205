"""Phase firing: which gates are pulsed when, from one interrupt to the next (52.2.1, DELTA).

An SCR is fired DELTA before the instant of alpha 180 degrees, and the one before it again (double pulse). At an
interrupt all is planned that falls due before the next. What a greater DELTA makes late is fired at once; what a
smaller one moves behind itself is not fired twice (decision).
"""

from __future__ import annotations

from automax_ros.drive.cml.signals import Pulse, gate_bits
from automax_ros.drive.state import Stateful

STANDARD = (2, 3, 4, 5, 6, 1)
"""The SCR whose natural commutation is at each position of a cycle, on a line of the standard rotation."""
REVERSED = (6, 5, 4, 3, 2, 1)
"""The same on a line of the other rotation."""


class Firing(Stateful):
    """Plans pulses. ``last`` counts the sixths of cycles: that of the SCR that was fired last."""

    _kept = ("count", "last")

    def __init__(self) -> None:
        """Begin with nothing fired."""
        self.count = 0
        self.last = -6

    def begin(self) -> None:
        """Begin anew: any SCR may be fired next."""
        self.last = self.count - 6

    def pulses(self, position: int, period_ns: int, delta_ns: int, bridge: int, reverse: bool) -> tuple[Pulse, ...]:
        """Plan the time from an interrupt, at a position of the cycle, to the next.

        Args:
            position: which sixth of the cycle begins, 0 to 5.
            period_ns: the line's period, ns.
            delta_ns: DELTA, ns, 0 to half a period.
            bridge: 1 or 2; 0 fires nothing.
            reverse: whether the line has the other rotation.
        """
        self.count += 1
        if not bridge:
            return ()
        sixth = period_ns // 6
        delay = period_ns // 2 - delta_ns
        found = []
        for back in (3, 2, 1, 0):
            number = self.count - back
            after = delay - back * sixth
            if number > self.last and after < sixth:
                found.append((max(after, 0), number))
        if not found:
            return ()
        order = REVERSED if reverse else STANDARD
        due = [item for item in found if item[0] > 0] or found[-1:]
        if len(found) > len(due):
            due.insert(0, found[len(found) - len(due) - 1])
        planned = []
        for after, number in due:
            place = (position - (self.count - number)) % 6
            scrs = order[place], order[(place - 1) % 6]
            planned.append(Pulse(after, sixth, gate_bits(*(scr + 10 * (bridge == 2) for scr in scrs))))
        self.last = due[-1][1]
        return tuple(planned)
