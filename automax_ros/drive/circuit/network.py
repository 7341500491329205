"""The circuit of a set of closed legs: source, legs, armature, as decoupled first-order modes.

Phase x obeys ``e_x - (Ls d/dt + Rs) i_x = v_x`` with all source impedances equal and an isolated neutral; the
armature obeys ``(L d/dt + R) i + E = v_P - v_M``. For every set of closed legs this separates into

* one mode of the armature current with L + n Ls, R + n Rs, where n is 1/p + 1/m for p and m phases on the rails (2 for
  two SCRs, 1.5 while one commutates), or 0 where a phase on both rails shorts the armature;
* modes of the currents that flow between the phases of one rail, less their equal share of the armature current: Ls,
  Rs.

Each is solved in closed form (``waves``). SCRs are ideal apart from a constant drop. In a loop of legs alone no voltage
drives the current, and the legs share it as equal small resistances would.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf
from typing import Final

from automax_ros.drive.base.totals import add_up
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.scr import FORWARD_MASK, REVERSE_MASK, M, P
from automax_ros.drive.circuit.wiring import ARMATURE_ARC, PHASE_ARC, Wiring, closed_legs, is_line_short, leg_currents

TURN_ON_V: Final = 1e-5
"""Forward voltage, beyond the drop, at which a gated SCR turns on, V (decision: above rounding, 0.1 ns of a line's
slope)."""
SLOWEST_DECAY: Final = 0.01
"""A resistance below L x this (1/s) counts as L x this (decision): so a steady state exists; 20 microohm at 2 mH."""

Potential = tuple[float, float, float, float, float, float]
"""A voltage: factors of cos, sin, 1, of the armature wave's k and a, and of the EMF."""


@dataclass(frozen=True)
class Impedances:
    """The constants of the circuit, SI units; resistances are at least those that ``SLOWEST_DECAY`` allows."""

    ls: float
    rs: float
    l: float  # noqa: E741 - as in every textbook
    r: float
    drop_v: float

    @staticmethod
    def of(line: AcLine, inductance_h: float, resistance_ohm: float, drop_v: float) -> Impedances:
        """Return the constants, those of the source from a line."""
        ls = line.inductance_h
        rs = max(line.resistance_ohm, SLOWEST_DECAY * ls)
        return Impedances(ls, rs, inductance_h, max(resistance_ohm, SLOWEST_DECAY * inductance_h), drop_v)


Phases = tuple[float, float, float]
"""A value of each of the line's phases."""
Guard = tuple[int, float, float, float, float, float, float, float, float]
"""A current that must stay positive: the SCRs that carry it (mask), factors of cos and sin, share of the armature
current, constant, shares of the three phases' source modes, curvature omega^2 hypot(c, d)."""


Watch = tuple[int, float, float, float, float, float, float, float]
"""A voltage that turns on the SCRs of a mask when it is above 0: a Potential less drops and ``TURN_ON_V``,
curvature."""
_Current = tuple[float, float, float, float, float, float, float]
"""A Guard without its mask and curvature."""


class Network:
    """The equations of one set of closed legs as numbers for ``circuit``; built once for a set and a line segment."""

    __slots__ = (
        "_drop_v", "_omega", "active", "alarms", "arcing", "armature_short", "bend", "c", "calm", "constant", "d",
        "decay", "decay_s", "floating_offset", "guards", "inductance", "instant", "largest_share", "leg_weights",
        "mask", "modes", "offsets", "phase_c", "phase_d", "phase_k", "potentials", "rail_of_phases", "rail_offset",
        "resistance", "share", "sign", "tied", "watches",
    )  # fmt: skip

    def __init__(self, mask: int, wiring: Wiring, line: AcLine, z: Impedances) -> None:
        """Set up the equations of the SCRs of a mask; ``wiring.settle`` has removed what cannot carry current."""
        self.mask = mask
        legs = closed_legs(mask, wiring)
        drops = {leg: direction * z.drop_v for leg, direction in legs.items()}
        self.watches: dict[int, list[Watch]] = {}
        self._drop_v, self._omega = z.drop_v, line.omega
        self._group(legs, drops, wiring)
        self._solve_armature(wiring, line, z)
        self._solve_phases(line, z)
        self._set_potentials(legs, drops, wiring, line, z)
        self._set_guards(legs, wiring, line.omega)
        self.arcing = wiring.arcing
        self.calm = not (self.modes or self.instant or self.arcing)
        """Whether the armature's current alone is needed to enter it."""
        self.alarms = ARMATURE_SHORT if self.armature_short else 0
        if any(is_line_short(rail, legs) for rail in (P, M)):
            self.alarms |= LINE_SHORT
        if mask & FORWARD_MASK and mask & REVERSE_MASK:
            self.alarms |= CROSS_FIRE

    def _group(self, legs: dict[int, int], drops: dict[int, float], wiring: Wiring) -> None:
        """Find the phases that are tied together, their shares of the armature current and their voltage offsets."""
        at_p = [x for x in range(3) if 2 * x in legs]
        at_m = [x for x in range(3) if 2 * x + 1 in legs]
        both = [x for x in at_p if x in at_m]
        present = [x for x in range(3) if not wiring.open_phases >> x & 1]
        self.armature_short = bool(both)
        offsets, share = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.rail_offset = 0.0
        if both:
            self.rail_offset = add_up([drops[2 * x + 1] - drops[2 * x] for x in both]) / len(both)
            groups = [[x for x in present if x in at_p or x in at_m]]
            for x in range(3):
                if x in both:
                    offsets[x] = (drops[2 * x] + drops[2 * x + 1] - self.rail_offset) / 2
                elif x in at_p:
                    offsets[x] = drops[2 * x]
                elif x in at_m:
                    offsets[x] = drops[2 * x + 1] - self.rail_offset
            self.active = wiring.armature_closed
        else:
            on_p, on_m = ([x for x in rail if x in present] for rail in (at_p, at_m))
            groups = [on_p, on_m]
            for rail, group, sign in ((P, on_p, 1.0), (M, on_m, -1.0)):
                for x in group:
                    offsets[x] = drops[2 * x + rail]
                    share[x] = sign / len(group)
            self.active = wiring.armature_closed and bool(on_p and on_m)
            if not self.active:
                share = [0.0, 0.0, 0.0]
        arcs = wiring.phase_arc_v
        self.offsets: Phases = offsets[0] + arcs[0], offsets[1] + arcs[1], offsets[2] + arcs[2]
        self.share: Phases = share[0], share[1], share[2]
        self.largest_share = max(map(abs, self.share))
        self.rail_of_phases = groups
        self.tied = [(g[0], g[1], g[2] if len(g) > 2 else -1) for g in groups if len(g) > 1]
        """Phases on one rail; the third is -1 where there are only two."""
        self.modes = bool(self.tied)

    def _solve_armature(self, wiring: Wiring, line: AcLine, z: Impedances) -> None:
        n, driven = 0.0, [0.0, 0.0]
        self.constant = self.rail_offset - wiring.armature_arc_v
        if not self.armature_short and self.active:
            for sign, group in zip((1.0, -1.0), self.rail_of_phases, strict=True):
                n += 1 / len(group)
                cosine, sine, offset = self._mean(group, line)
                driven[0] += sign * cosine
                driven[1] += sign * sine
                self.constant -= sign * offset
        self.resistance = z.r + n * z.rs
        self.inductance = z.l + n * z.ls
        self.decay = self.resistance / self.inductance
        self.c, self.d = _response(driven[0], driven[1], self.resistance, line.omega * self.inductance)
        self.bend = line.omega * line.omega * hypot(self.c, self.d)

    def _solve_phases(self, line: AcLine, z: Impedances) -> None:
        self.phase_c = self.phase_d = self.phase_k = (0.0, 0.0, 0.0)
        self.decay_s = z.rs / z.ls if z.ls else inf
        self.instant = self.modes and not z.ls and not z.rs
        if self.instant:
            return
        by_c, by_d, const = [0.0] * 3, [0.0] * 3, [0.0] * 3
        for group in self.rail_of_phases:
            if len(group) < 2:
                continue
            cosine, sine, offset = self._mean(group, line)
            for x in group:
                wave = line.unit_wave(x)
                over = line.amplitude_v * wave[0] - cosine, line.amplitude_v * wave[1] - sine
                by_c[x], by_d[x] = _response(*over, z.rs, line.omega * z.ls)
                const[x] = (offset - self.offsets[x]) / z.rs
        self.phase_c = by_c[0], by_c[1], by_c[2]
        self.phase_d = by_d[0], by_d[1], by_d[2]
        self.phase_k = const[0], const[1], const[2]

    def _mean(self, group: list[int], line: AcLine) -> tuple[float, float, float]:
        """Return the factors of cos and sin of the mean source voltage of phases, and their mean offset."""
        waves = [line.unit_wave(x) for x in group]
        scale = line.amplitude_v / len(group)
        mean_offset = add_up([self.offsets[x] for x in group]) / len(group)
        return scale * add_up([wave[0] for wave in waves]), scale * add_up([wave[1] for wave in waves]), mean_offset

    def _set_potentials(
        self, legs: dict[int, int], drops: dict[int, float], wiring: Wiring, line: AcLine, z: Impedances
    ) -> None:
        """Set the potentials of phases (0 to 2) and rails P, M (3, 4) to the neutral; None where they float."""
        impeded = (
            z.rs * self.c + z.ls * line.omega * self.d,
            z.rs * self.d - z.ls * line.omega * self.c,
            0.0,
            z.rs,
            z.rs - z.ls * self.decay,
            0.0,
        )
        rails: list[Potential | None] = [None, None]
        for rail, group in enumerate(self.rail_of_phases):
            if group:
                cosine, sine, offset = self._mean(group, line)
                share = 0.0
                if self.active and not self.armature_short:
                    share = (1.0 if rail == P else -1.0) / len(group)
                rails[rail] = _combine((cosine, sine, -offset, 0.0, 0.0, 0.0), impeded, -share)
        self.floating_offset: Potential | None = _EMF if wiring.armature_closed else None
        if self.armature_short:
            self.floating_offset = _combine(_NOTHING, _UNIT, self.rail_offset)
            tied = rails[P]
            rails[M] = None if tied is None else _combine(tied, _UNIT, -self.rail_offset)
        elif wiring.armature_closed:
            at_p, at_m = rails
            if at_p is None and at_m is not None:
                rails[P] = _combine(at_m, _EMF, 1.0)
            elif at_m is None and at_p is not None:
                rails[M] = _combine(at_p, _EMF, -1.0)
        phases: list[Potential | None] = []
        for x in range(3):
            cosine, sine = line.unit_wave(x)
            potential: Potential | None = None
            if not wiring.open_phases >> x & 1:
                potential = line.amplitude_v * cosine, line.amplitude_v * sine, 0.0, 0.0, 0.0, 0.0
            for rail in (P, M):
                tied = rails[rail]
                if 2 * x + rail in legs and tied is not None:
                    potential = _combine(tied, _UNIT, drops[2 * x + rail])
            phases.append(potential)
        self.potentials = [*phases, *rails]

    def _set_guards(self, legs: dict[int, int], wiring: Wiring, omega: float) -> None:
        """Collect the currents whose zero ends the interval: of SCRs, and of arcs."""
        guards: dict[_Current, int] = {}
        self.leg_weights = leg_currents(legs)
        for leg, weights in self.leg_weights.items():
            if legs[leg]:
                bit = 1 << (2 * leg + (legs[leg] < 0))
                key = self._guard(*(legs[leg] * weight for weight in weights))
                guards[key] = guards.get(key, 0) | bit
        for x, arc_v in enumerate(wiring.phase_arc_v):
            if arc_v:
                sign = 1.0 if arc_v > 0 else -1.0
                key = self._guard(0.0, *(sign * (x == y) for y in range(3)))
                guards[key] = guards.get(key, 0) | PHASE_ARC << x
        if wiring.armature_arc_v:
            key = self._guard(1.0 if wiring.armature_arc_v > 0 else -1.0, 0.0, 0.0, 0.0)
            guards[key] = guards.get(key, 0) | ARMATURE_ARC
        square = omega * omega
        self.guards: list[Guard] = [(mask, *key, square * hypot(key[0], key[1])) for key, mask in guards.items()]
        alone = len(guards) == 1 and self.active and not self.modes
        only = self.guards[0] if alone else None
        self.sign = only[3] if only and abs(only[3]) == 1.0 and only[4] == 0.0 else 0.0
        """1 or -1 where the armature current times this is the only current that must stay positive, else 0."""

    def _guard(self, armature: float, a: float, b: float, c: float) -> _Current:
        """Return the factors of a weighted sum of the armature current and the phase currents."""
        weights = (a, b, c)
        share = armature + add_up([w * part for w, part in zip(weights, self.share, strict=True)])
        if not self.active:
            share = 0.0
        cosine, sine, constant = (
            add_up([w * part for w, part in zip(weights, parts, strict=True)])
            for parts in (self.phase_c, self.phase_d, self.phase_k)
        )
        if not self.modes:
            a = b = c = 0.0
        return share * self.c + cosine, share * self.d + sine, share, constant, a, b, c

    def leg_current(self, leg: int, armature_a: float, phases_a: tuple[float, float, float]) -> float:
        """Return the current of a leg from its phase to its rail, A; 0 for an open one."""
        armature, a, b, c = self.leg_weights.get(leg, (0.0, 0.0, 0.0, 0.0))
        return armature * armature_a + a * phases_a[0] + b * phases_a[1] + c * phases_a[2]

    def put_first(self, mask: int) -> None:
        """Check the current of these SCRs first: the one that ended this circuit last time will do so next time too."""
        self.guards.sort(key=lambda guard: guard[0] != mask)

    def put_in_order(self, masks: list[int]) -> None:
        """Check the currents in the order of these SCRs."""
        place = {mask: index for index, mask in enumerate(masks)}
        self.guards.sort(key=lambda guard: place.get(guard[0], len(place)))

    def watch(self, wanted: int) -> list[Watch]:
        """Return the voltages over SCRs that could begin to conduct: over single ones, and over pairs in series.

        A pair turns on together where one SCR alone has no path for its current: on floating rails or an open phase.
        """
        found = self.watches.get(wanted)
        if found is None:
            found = []
            for mask, (c, d, constant, *rest) in _watch(self.potentials, self.floating_offset, wanted):
                level = TURN_ON_V + self._drop_v * (2 if mask & (mask - 1) else 1)
                by_k, by_a, by_emf = rest
                found.append(
                    (mask, c, d, constant - level, by_k, by_a, by_emf, self._omega * self._omega * hypot(c, d))
                )
            self.watches[wanted] = found
        return found


ARMATURE_SHORT: Final = 1
LINE_SHORT: Final = 2
CROSS_FIRE: Final = 4
"""Bits of ``Network.alarms``."""
# Not Final: mypyc 2.4 treats a Final tuple of floats as never set.
_NOTHING: Potential = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_UNIT: Potential = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_EMF: Potential = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def _combine(one: Potential, two: Potential, factor: float) -> Potential:
    a, b = one, two
    return (
        a[0] + factor * b[0],
        a[1] + factor * b[1],
        a[2] + factor * b[2],
        a[3] + factor * b[3],
        a[4] + factor * b[4],
        a[5] + factor * b[5],
    )


def _response(cosine: float, sine: float, r: float, x: float) -> tuple[float, float]:
    """Return the steady-state current of ``cosine cos + sine sin`` volts in r and x (ohm)."""
    square = r * r + x * x
    return (r * cosine - x * sine) / square, (r * sine + x * cosine) / square


def _watch(nodes: list[Potential | None], floating: Potential | None, wanted: int) -> list[tuple[int, Potential]]:
    """Return the voltages for ``Network.watch``; ``floating`` is the voltage from P to M where both rails float."""
    found = []
    ways = []
    for bit in range(12):
        if wanted >> bit & 1:
            x, rail = divmod(bit // 2, 2)
            ways.append((1 << bit, x, 3 + rail) if bit % 2 == 0 else (1 << bit, 3 + rail, x))
    for mask, start, end in ways:
        one, two = nodes[start], nodes[end]
        if one is not None and two is not None:
            found.append((mask, _combine(one, two, -1.0)))
    for first, start, entry in ways:
        for second, leave, end in ways:
            if first != second and nodes[entry] is None and nodes[leave] is None:
                voltage = _series(nodes, floating, start, entry, leave, end)
                if voltage is not None:
                    found.append((first | second, voltage))
    return found


def _series(
    nodes: list[Potential | None], floating: Potential | None, start: int, entry: int, leave: int, end: int
) -> Potential | None:
    """Return the voltage of the path from ``start`` by floating ``entry`` and ``leave`` to ``end``, if it is one."""
    one, two = nodes[start], nodes[end]
    if start == end and entry != leave:
        way: Potential = _NOTHING
    elif start != end and one is not None and two is not None:
        way = _combine(one, two, -1.0)
    else:
        return None
    if entry == leave:
        return way
    if floating is None or entry < 3 or leave < 3:
        return None
    return _combine(way, floating, -1.0 if entry == 3 else 1.0)
