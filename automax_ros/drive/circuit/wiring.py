"""The wiring of a bridge apart from its conducting SCRs: closed, open or shorted parts, and paths for the current."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from automax_ros.drive.circuit.scr import P

PHASE_ARC: Final = 1 << 12
"""The bit of an arc in phase A; the next two are B's and C's."""
ARMATURE_ARC: Final = 1 << 15


@dataclass(frozen=True)
class Wiring:
    """The closed, open or shorted parts apart from the conducting SCRs.

    Attributes:
        shorted: mask of legs (6 bits) that a failed SCR shorts.
        open_phases: mask of phases that are open.
        phase_arc_v: voltage of an arc in each phase (V), with the sign of its current; 0 without one.
        armature_closed: whether the armature is connected.
        armature_arc_v: voltage of an arc in the armature's contactor (V), with the sign of its current.
    """

    shorted: int = 0
    open_phases: int = 0
    phase_arc_v: tuple[float, float, float] = (0.0, 0.0, 0.0)
    armature_closed: bool = True
    armature_arc_v: float = 0.0

    @property
    def arcing(self) -> bool:
        """Whether a phase or the contactor is opening."""
        return self.armature_arc_v != 0.0 or self.phase_arc_v != (0.0, 0.0, 0.0)

    def with_arc(self, phase: int, arc_v: float) -> Wiring:
        """Return the same with an arc of a voltage (V) in a phase; 0 ends it."""
        a, b, c = (arc_v if x == phase else old for x, old in enumerate(self.phase_arc_v))
        return replace(self, phase_arc_v=(a, b, c))


def closed_legs(mask: int, wiring: Wiring) -> dict[int, int]:
    """Return the closed legs with their direction: +1 from phase to rail, -1 back, 0 both ways (shorted)."""
    legs = {}
    for leg in range(6):
        if wiring.shorted >> leg & 1:
            legs[leg] = 0
        elif mask >> (2 * leg) & 3:
            legs[leg] = 1 if mask >> (2 * leg) & 1 else -1
    return legs


def settle(mask: int, wiring: Wiring) -> int:
    """Return a mask without the SCRs that cannot carry current because there is no return path."""
    edges: dict[int, tuple[int, int]] = {leg: (leg // 2, 3 + leg % 2) for leg in closed_legs(mask, wiring)}
    edges.update({10 + x: (x, 5) for x in range(3) if not wiring.open_phases >> x & 1})
    if wiring.armature_closed:
        edges[20] = (3, 4)
    while True:
        degree = [sum(node in ends for ends in edges.values()) for node in range(6)]
        loose = [edge for edge, ends in edges.items() if any(degree[node] == 1 for node in ends)]
        if not loose:
            break
        for edge in loose:
            del edges[edge]
    return sum((mask & 3 << (2 * leg)) for leg in range(6) if leg in edges and not wiring.shorted >> leg & 1)


def is_line_short(rail: int, legs: dict[int, int]) -> bool:
    """Return whether the phases on a rail are shorted for longer than a commutation: not all conduct the same way."""
    ways = [legs[leg] for leg in legs if leg % 2 == rail]
    return len(ways) > 1 and abs(sum(ways)) != len(ways)


def leg_currents(legs: dict[int, int]) -> dict[int, tuple[float, float, float, float]]:
    """Return each leg's current, from phase to rail, as weights of armature current and three phase currents."""
    both = [x for x in range(3) if 2 * x in legs and 2 * x + 1 in legs]
    weights: dict[int, tuple[float, float, float, float]] = {}
    for leg in legs:
        x = leg // 2
        if x not in both:
            weights[leg] = _weights({1 + x: 1.0})
    if not both:
        return weights
    # Current into P apart from the phases on both rails: the armature current less that of the single legs there.
    into_p = {0: 1.0 / len(both)}
    for leg in legs:
        if leg % 2 == P and leg // 2 not in both:
            into_p[1 + leg // 2] = -1.0 / len(both)
    for x in both:
        to_p = dict(into_p)
        for y in both:
            to_p[1 + y] = to_p.get(1 + y, 0.0) - 0.5 / len(both)
        to_p[1 + x] = to_p.get(1 + x, 0.0) + 0.5
        weights[2 * x] = _weights(to_p)
        to_m = {index: -weight for index, weight in to_p.items()}
        to_m[1 + x] += 1.0
        weights[2 * x + 1] = _weights(to_m)
    return weights


def _weights(parts: dict[int, float]) -> tuple[float, float, float, float]:
    return parts.get(0, 0.0), parts.get(1, 0.0), parts.get(2, 0.0), parts.get(3, 0.0)
