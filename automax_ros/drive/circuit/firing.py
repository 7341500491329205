"""Firing instants of the SCRs: natural commutation, and a controller with a constant alpha."""

from __future__ import annotations

from math import pi
from typing import Final

from automax_ros.drive.base.errors import ParameterError, require
from automax_ros.drive.base.state import Stateful
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.scr import FORWARD, REVERSE, direction_of, phase_of

SIXTH: Final = pi / 3
_MARGIN_NS: Final = 1000
"""The search for a natural commutation begins this long before the present, or rounding could skip a turn, ns."""


def natural_angle(number: int, line: AcLine) -> float:
    """Return the line's angle (rad) at which an SCR would take over in a diode bridge: alpha counts from there."""
    return (0.0 if direction_of(number) > 0 else pi) - SIXTH - line.shift[phase_of(number)]


def firing_order(bridge: int, line: AcLine) -> list[int]:
    """Return the SCRs of bridge 1 or 2 in the order of their natural commutation, from the lowest number.

    Raises:
        ParameterError: there is no such bridge.
    """
    if bridge not in {1, 2}:
        raise ParameterError(f"there is no bridge {bridge}; 1 is forward, 2 reverse")
    numbers = FORWARD if bridge == 1 else REVERSE
    start = natural_angle(numbers[0], line)
    return sorted(numbers, key=lambda number: round((natural_angle(number, line) - start) / SIXTH) % 6)


class ConstantAlpha(Stateful):
    """Fires each SCR at an angle after its natural commutation, and the one before it again (double pulse).

    Attributes:
        alpha_rad: the angle, rad; a change applies from the next firing that is not yet posted.
        bridge: 1 or 2.
        pulse_rad: length of each of the two pulses, rad; 60 degrees keep a pair gated until the next is.
    """

    _kept = ("alpha_rad", "pulse_rad", "bridge", "_order", "_position", "_natural_ns")

    def __init__(self, circuit: Circuit, alpha_rad: float, *, bridge: int = 1, pulse_rad: float = SIXTH) -> None:
        self.circuit = circuit
        self.alpha_rad = require("alpha in rad", alpha_rad, 0.0, pi)
        self.pulse_rad = require("pulse length in rad", pulse_rad, 0.0, 2 * SIXTH, above=True)
        self.bridge = 0
        self.use_bridge(bridge)

    def use_bridge(self, bridge: int) -> None:
        """Fire bridge 1 or 2 from now on; posted gates of the other remain."""
        if bridge == self.bridge:
            return
        line, now_ns = self.circuit.line, self.circuit.now_ns
        self._order = firing_order(bridge, line)
        self.bridge = bridge
        instants = [line.instant_of(natural_angle(number, line) + self.alpha_rad, now_ns) for number in self._order]
        self._position = instants.index(min(instants))
        self._natural_ns = min(instants) - round(self.alpha_rad / line.omega * 1e9)

    def advance(self, until_ns: int) -> None:
        """Advance the circuit to an instant (ns) and fire meanwhile."""
        while (on_ns := self._next_ns()) < until_ns:
            self.circuit.advance(on_ns)
            self._fire(on_ns)
        self.circuit.advance(until_ns)

    def post(self, until_ns: int) -> None:
        """Post the gates until an instant (ns) without advancing the circuit, for one that its coupling advances."""
        while (on_ns := self._next_ns()) < until_ns:
            self._fire(on_ns)

    def _next_ns(self) -> int:
        """Return the instant of the next firing, computed on each call, since alpha and the line may have changed."""
        circuit, line = self.circuit, self.circuit.line
        natural = natural_angle(self._order[self._position], line)
        return max(line.instant_of(natural + self.alpha_rad, self._natural_ns - _MARGIN_NS), circuit.now_ns)

    def _fire(self, on_ns: int) -> None:
        line = self.circuit.line
        off_ns = on_ns + max(1, round(self.pulse_rad / line.omega * 1e9))
        self.circuit.fire(on_ns, off_ns, self._order[self._position], self._order[self._position - 1])
        self._position = (self._position + 1) % 6
        following = natural_angle(self._order[self._position], line)
        self._natural_ns = line.instant_of(following, self._natural_ns + round(0.5 * SIXTH / line.omega * 1e9))
