"""Phase firing: the gate pulses from one interrupt to the next (52.2.1, DELTA).

An SCR is fired DELTA before the instant of alpha 180 degrees, and the one before it again (double pulse), for a sixth
of a cycle. At an interrupt all pulses that are due before the next are planned. What a greater DELTA makes late is
fired at once if the next is not due yet; none is fired twice (decision).
"""

from __future__ import annotations

from typing import Final

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.signals import Pulse, gate_bits

STANDARD: Final = (2, 3, 4, 5, 6, 1)
"""The SCR whose natural commutation is at each position of a cycle, on a line of the standard rotation."""
REVERSED: Final = (6, 5, 4, 3, 2, 1)
"""The same on a line of the other rotation."""


_GATES: Final = {
    (bridge, reverse): tuple(gate_bits(order[place] + add, order[place - 1] + add) for place in range(6))
    for bridge, add in ((1, 0), (2, 10))
    for reverse, order in ((False, STANDARD), (True, REVERSED))
}
"""The gate bits of each position: its SCR and the one fired before it."""
_new = tuple.__new__


class Firing(Stateful):
    """Plans pulses; ``last`` is the count of sixths of cycles at which the last SCR was fired."""

    _kept = ("count", "last")

    def __init__(self) -> None:
        self.count = 0
        self.last = -6

    def begin(self) -> None:
        """Start again: any SCR may be fired next."""
        self.last = self.count - 6

    def idle(self) -> None:
        """Fire nothing up to the next interrupt; the count of the cycle continues."""
        self.count += 1

    def pulses(
        self,
        position: int,
        period_ns: int,
        next_ns: int,
        delta_ns: int,
        bridge: int,
        reverse: bool,
        earliest_ns: int = 0,
        *,
        ahead: bool = False,
    ) -> tuple[Pulse, ...]:
        """Plan the pulses from an interrupt, at a position of the cycle, to the next.

        Args:
            position: the sixth of the cycle that begins, 0 to 5.
            period_ns: the line's period, ns.
            next_ns: time to the next interrupt, ns.
            delta_ns: DELTA, ns, 0 to half a period.
            bridge: 1 or 2.
            reverse: whether the line has the other rotation.
            earliest_ns: no pulse begins sooner after the interrupt, ns.
            ahead: whether the next command comes after its interrupt: the pulse after the last one is planned too, to
                be fired with this DELTA unless the next command comes first.
        """
        planned = self._plan(position, period_ns, next_ns, delta_ns, bridge, reverse, earliest_ns)
        if ahead:
            number = max(self.last + 1, self.count - 3)
            sixth = period_ns // 6
            after = max(next_ns, max(0, 3 * sixth - delta_ns) + next_ns - (self.count + 1 - number) * sixth)
            word = _GATES[bridge, reverse][(position - self.count + number) % 6]
            planned = (*planned, _new(Pulse, (after, sixth, word)))
        return planned

    def _plan(
        self, position: int, period_ns: int, next_ns: int, delta_ns: int, bridge: int, reverse: bool, earliest_ns: int
    ) -> tuple[Pulse, ...]:
        """Plan the pulses that begin before the next interrupt."""
        self.count = count = self.count + 1
        sixth = period_ns // 6
        delay = max(0, 3 * sixth - delta_ns)
        newest = count if delay < next_ns else count - 1 - (delay - next_ns) // sixth
        number = max(self.last + 1, count - 3)
        if newest < number:
            return ()
        self.last = newest
        words = _GATES[bridge, reverse]
        after = delay - (count - newest) * sixth
        if number == newest and after >= earliest_ns:
            return (_new(Pulse, (after, sixth, words[(position - count + number) % 6])),)
        planned = []
        while number <= newest:
            after = delay - (count - number) * sixth
            if after >= earliest_ns:
                planned.append(Pulse(after, sixth, words[(position - count + number) % 6]))
            elif after + sixth > earliest_ns:
                planned.append(Pulse(earliest_ns, sixth + after - earliest_ns, words[(position - count + number) % 6]))
            number += 1
        return tuple(planned)
