"""Advances a power circuit from event to event, each interval in closed form.

Root finding serves only to find the instant of an event: a current that ends, a gated SCR that gets forward voltage.
"""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass, replace
from math import cos, exp, inf, sin
from typing import Final

from automax_ros.drive.base.errors import SourceShortError
from automax_ros.drive.base.motor import Machine
from automax_ros.drive.base.state import Stateful
from automax_ros.drive.base.totals import add_up
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.meter import EnergyMeter
from automax_ros.drive.circuit.network import ARMATURE_SHORT, CROSS_FIRE, LINE_SHORT, Impedances, Network, Phases
from automax_ros.drive.circuit.scr import BIT, MASK, NUMBER, RAIL_MASKS, numbers_of
from automax_ros.drive.circuit.search import next_ending, next_turn_on
from automax_ros.drive.circuit.waves import WavePiece
from automax_ros.drive.circuit.wiring import ARMATURE_ARC, PHASE_ARC, settle


class EventKind(enum.Enum):
    """Kind of an event, whose ``number`` is that of an SCR or phase (0 to 2), or 0."""

    TURN_ON = "turn on"
    EXTINCTION = "extinction"
    COMMUTATION_START = "commutation start"
    COMMUTATION_END = "commutation end"
    COMMUTATION_FAILURE = "commutation failure"
    """An SCR got forward voltage before it recovered, or the incoming one was extinguished instead of the outgoing."""
    ARMATURE_SHORT = "armature short"
    """A phase conducts to both rails: the armature is shorted."""
    LINE_SHORT = "line short"
    """Two phases are shorted through a rail, other than by a commutation."""
    CROSS_FIRE = "cross-fire"
    """SCRs of both bridges conduct."""
    SCR_SHORTED = "SCR shorted"
    GATE_OPEN = "gate open"
    """An SCR was to be fired whose gate lead is open."""
    PHASE_OPEN = "phase open"
    """A phase's current has been interrupted, by a fuse or in the line."""
    PHASE_CLOSED = "phase closed"
    ARMATURE_OPEN = "armature open"
    """The contactor has interrupted the armature current."""
    ARMATURE_CLOSED = "armature closed"


ROUTINE: Final = frozenset(
    {EventKind.TURN_ON, EventKind.EXTINCTION, EventKind.COMMUTATION_START, EventKind.COMMUTATION_END}
)
"""Events of every healthy cycle; recorded only on request."""


@dataclass(frozen=True)
class CircuitEvent:
    """An event.

    Attributes:
        kind: its kind.
        base_ns: an integer instant at or shortly before it, ns.
        after_s: time from ``base_ns`` to the event (s), not rounded.
        number: an SCR's number, or a phase.
        current_a: the armature current at that instant, A.
    """

    kind: EventKind
    base_ns: int
    after_s: float
    number: int
    current_a: float

    @property
    def time_s(self) -> float:
        """The instant in s."""
        return self.base_ns * 1e-9 + self.after_s


EVENTS_KEPT: Final = 10_000
PIECES_KEPT: Final = 64
_ALARMS: Final = (
    (ARMATURE_SHORT, EventKind.ARMATURE_SHORT),
    (LINE_SHORT, EventKind.LINE_SHORT),
    (CROSS_FIRE, EventKind.CROSS_FIRE),
)


class Conduction(Stateful):
    """Line, bridge and machine while gates, line and wiring do not change; ``circuit.Circuit`` extends it."""

    _kept = (
        "now_ns", "current_a", "events_lost", "_modes", "_newest", "_emf", "_sample_ns", "_current_before", "_charge",
        "_volt_s", "_zero_s", "_ended_ns", "_overlap_s", "_square",
    )  # fmt: skip

    def __init__(self, line: AcLine, bridge: Bridge, machine: Machine, *, trace: bool, energy: bool) -> None:
        """Create the circuit at the line's start without current; see ``Circuit``."""
        self.line = line
        self.bridge = bridge
        self.machine = machine
        self.now_ns = line.start_ns
        self.current_a = 0.0
        self.energy = EnergyMeter() if energy else None
        self.events_lost = 0
        self._trace = trace
        self._z = Impedances.of(line, machine.inductance_h, machine.resistance_ohm, bridge.drop_v)
        self._nets: dict[int, Network] = {}
        self._modes: Phases = (0.0, 0.0, 0.0)
        self._newest = [0, 0]
        self._ended_ns = float(line.start_ns)
        self._emf = machine.emf(0.0)
        self._events: deque[tuple[EventKind, int, float, int, float]] = deque(maxlen=EVENTS_KEPT)
        bridge.wiring = replace(bridge.wiring, open_phases=sum(1 << x for x in line.missing))
        self._net = self._network(0)
        self._begin_sample()

    def _begin_sample(self) -> None:
        self._sample_ns = self.now_ns
        self._current_before = self.current_a
        self._charge = self._volt_s = self._zero_s = self._overlap_s = self._square = self._highest = 0.0
        self._pieces: list[WavePiece] = []

    def _run(self, stop_ns: int) -> None:
        """Advance to an instant before which no gate begins and the line does not change."""
        line, bridge, machine = self.line, self.bridge, self.machine
        start_ns, omega = self.now_ns, line.omega
        total = (stop_ns - start_ns) * 1e-9
        theta = line.start_angle + omega * ((start_ns - line.start_ns) * 1e-9)
        emf = self._emf = machine.emf(total)
        net, modes = self._net, self._modes
        began_a = current = self.current_a
        sine, cosine = sin(theta), cos(theta)
        t = charge = 0.0
        while True:
            first = left = total - t
            if left <= 0.0:
                break
            out = on = 0
            c, d, decay = net.c, net.d, net.decay
            k = a = 0.0
            if net.active:
                k = (net.constant - emf) / net.resistance
                a = current - c * cosine - d * sine - k
            if (bridge.gated | bridge.recovering) & ~net.mask:
                state = theta, sine, cosine, k, a
                when, mask = next_turn_on(net, bridge, omega, emf, start_ns + t * 1e9, state, left)
                if when < first:
                    first, on = when, mask
            sign = net.sign
            if net.guards and not sign and first > 0.0:
                first, out = next_ending(net, omega, (theta, sine, cosine, k, a), modes, first)
            if first > 0.0:
                end = theta + omega * first
                end_sine, end_cosine, fall = sin(end), cos(end), exp(-decay * first)
                after = c * end_cosine + d * end_sine + k + a * fall
                # Largest deviation of the current from the straight line between both ends.
                sag = 0.125 * (net.bend + decay * decay * (a if a >= 0.0 else -a)) * first * first
                if sign and (sign * current <= sag or sign * after <= sag):
                    first, out = next_ending(net, omega, (theta, sine, cosine, k, a), modes, first)
                    if out:
                        end = theta + omega * first
                        end_sine, end_cosine, fall = sin(end), cos(end), exp(-decay * first)
                        after = c * end_cosine + d * end_sine + k + a * fall
            if first > 0.0:
                if net.active:
                    charge += (
                        (c * (end_sine - sine) - d * (end_cosine - cosine)) / omega
                        + k * first
                        + a * (1.0 - fall) / decay
                    )
                    self._pieces.append(WavePiece(first, theta, omega, c, d, k, a, decay))
                    highest = self._highest - sag
                    if not (-highest <= current <= highest and -highest <= after <= highest):
                        self._highest = max(current, -current, after, -after) + sag
                    current = after
                else:
                    self._zero_s += first
                if net.modes or self.energy is not None:
                    modes = self._fade(modes, (theta, first, k, a))
                theta, sine, cosine = end, end_sine, end_cosine
                t = t + first if first < left else total
            if out or on:
                self.current_a, self._modes = current, modes
                net = self._switch(out, 0 if out else on, start_ns, t, sine, cosine)
                current, modes = self.current_a, self._modes
        self.current_a, self._modes = current, modes
        self._finish(stop_ns, total, charge, current - began_a)

    def _fade(self, modes: Phases, interval: tuple[float, float, float, float]) -> Phases:
        """Count an interval (angle at its start, duration, k and a) and return the decayed modes of the source."""
        net, duration = self._net, interval[1]
        if self.energy is not None:
            self.energy.add(net, self.line, self._z, self.bridge.wiring, self._emf, interval, modes)
        if net.modes:
            self._overlap_s += duration
            if net.decay_s < inf:
                fall = exp(-net.decay_s * duration)
                modes = modes[0] * fall, modes[1] * fall, modes[2] * fall
        return modes

    def _finish(self, stop_ns: int, total: float, charge: float, change_a: float) -> None:
        """Add the integrals of a run and advance the machine."""
        self.now_ns = stop_ns
        self._charge += charge
        self._volt_s += self._emf * total
        if len(self._pieces) > PIECES_KEPT:
            self._square += add_up([piece.square() for piece in self._pieces])
            self._pieces.clear()
        machine = self.machine
        if machine.turns:
            machine.advance(total, charge, change_a)
        if self.energy is not None:
            angle = self.line.angle(stop_ns) if self._net.modes else 0.0
            squares = add_up([phase**2 for phase in self._phases(self._net, self.current_a, sin(angle), cos(angle))])
            self.energy.stored_j = 0.5 * (self._z.l * self.current_a**2 + self._z.ls * squares)

    def _switch(self, out: int, on: int, start_ns: int, t: float, sine: float, cosine: float) -> Network:
        """Extinguish SCRs (or arcs), or turn SCRs on, at an instant; return the circuit from then on."""
        old = self._net
        now_ns = start_ns + t * 1e9
        if on:
            self._note_turn_on(on, now_ns, t)
        if out >> 12:
            self._open(out, t)
        mask = (old.mask | on) & ~out
        net = self._nets.get(mask) or self._network(mask)
        if not net.calm:
            net = self._enter(mask, self._phases(old, self.current_a, sine, cosine), sine, cosine)
        else:
            self._take(net)
        if old.active and not net.active:
            self._ended_ns = now_ns
        gone = old.mask & ~net.mask
        if gone:
            self.bridge.put_out(gone, now_ns)
            if old.modes and not old.alarms and out:
                self._note_failed_commutation(out, net.mask, t)
        if self._trace or net.alarms & ~old.alarms:
            self._note_switch(old, net, gone, t)
        return net

    def _enter(self, mask: int, phases: Phases, sine: float, cosine: float) -> Network:
        """Make a set of SCRs conduct from the present on, given the phase currents (A) just before."""
        net = self._nets.get(mask) or self._network(mask)
        if net.instant or net.arcing:
            net, phases = self._clear_up(net, phases, sine, cosine)
        self._take(net)
        if net.modes and net.decay_s < inf:
            self._modes = _modes(net, phases, sine, cosine)
        return net

    def _take(self, net: Network) -> None:
        """Continue with a circuit, with the modes of the source at 0."""
        if not net.active:
            self.current_a = 0.0
        self._modes = (0.0, 0.0, 0.0)
        self._net = net

    def _clear_up(self, net: Network, phases: Phases, sine: float, cosine: float) -> tuple[Network, Phases]:
        """Commutate phases without source impedance, open arcs without current; return circuit and phase currents."""
        while True:
            wiring = self.bridge.wiring
            if wiring.armature_arc_v and not net.active:
                self._open(ARMATURE_ARC, 0.0)
            for x in range(3):
                if wiring.phase_arc_v[x] and not any(x in group for group in net.rail_of_phases):
                    self._open(PHASE_ARC << x, 0.0)
            if wiring is not self.bridge.wiring:
                net = self._network(net.mask)
            elif net.instant:
                net, phases = self._commutate_at_once(net, phases, sine, cosine)
            else:
                return net, phases

    def _commutate_at_once(self, net: Network, phases: Phases, sine: float, cosine: float) -> tuple[Network, Phases]:
        """Extinguish one SCR of phases tied without impedance: the first whose current is driven to zero."""
        line = self.line
        push, over = [0.0] * 3, [0.0] * 3
        for group in net.rail_of_phases:
            volts = {}
            for x in group:
                c, d = line.unit_wave(x)
                volts[x] = line.amplitude_v * (c * cosine + d * sine) - net.offsets[x]
            for x in group:
                push[x] = volts[x] - add_up(list(volts.values())) / len(group)
                over[x] = phases[x] - net.share[x] * self.current_a
        soonest, gone = inf, 0
        for mask, _, _, share, _, *weights, _ in net.guards:
            slope = add_up([weight * volt for weight, volt in zip(weights, push, strict=True)])
            if slope < -1e-9:
                value = share * self.current_a + add_up([w * part for w, part in zip(weights, over, strict=True)])
                when = max(value, 0.0) / -slope
                if when < soonest:
                    soonest, gone = when, mask
        if not gone:
            raise SourceShortError(
                f"SCRs {', '.join(map(str, numbers_of(net.mask))) or 'shorted'} short two phases at {self.now_ns} ns "
                "and the line has no impedance: give it an inductance or resistance"
            )
        moved = tuple(phases[x] + push[x] * soonest for x in range(3))
        if gone >> 12:
            self._open(gone, 0.0)
        return self._network(net.mask & ~gone), (moved[0], moved[1], moved[2])

    def _phases(self, net: Network, current: float, sine: float, cosine: float) -> Phases:
        """Return the phase currents (A) at an armature current (A) and an angle of the line."""
        a, b, c = net.share
        a, b, c = a * current, b * current, c * current
        if not net.modes:
            return a, b, c
        modes, by_c, by_d, const = self._modes, net.phase_c, net.phase_d, net.phase_k
        return (
            a + by_c[0] * cosine + by_d[0] * sine + const[0] + modes[0],
            b + by_c[1] * cosine + by_d[1] * sine + const[1] + modes[1],
            c + by_c[2] * cosine + by_d[2] * sine + const[2] + modes[2],
        )

    def _network(self, mask: int) -> Network:
        """Return the circuit of the SCRs of a mask, without those that can carry no current."""
        net = self._nets.get(mask)
        if net is None:
            settled = settle(mask, self.bridge.wiring)
            net = self._nets.get(settled)
            if net is None:
                net = self._nets[settled] = Network(settled, self.bridge.wiring, self.line, self._z)
            self._nets[mask] = net
        return net

    def _open(self, arcs: int, t: float) -> None:
        """Open the phases and the contactor whose arcs have ended."""
        wiring = self.bridge.wiring
        for x in range(3):
            if arcs & PHASE_ARC << x:
                wiring = replace(wiring.with_arc(x, 0.0), open_phases=wiring.open_phases | 1 << x)
                self._emit(EventKind.PHASE_OPEN, t, x)
        if arcs & ARMATURE_ARC:
            wiring = replace(wiring, armature_closed=False, armature_arc_v=0.0)
            self._emit(EventKind.ARMATURE_OPEN, t, 0)
        self.bridge.wiring = wiring
        self._nets.clear()

    # Events

    def _note_turn_on(self, on: int, now_ns: float, t: float) -> None:
        bridge = self.bridge
        for number in numbers_of(on) if on & (on - 1) else (NUMBER[on.bit_length() - 1],):
            bit = BIT[number]
            self._newest[bit >> 1 & 1] = number
            bridge.on_ns[bit] = now_ns
            if self._trace:
                self._emit(EventKind.TURN_ON, t, number)
            if not bridge.gated >> bit & 1 or bridge.gate_end_ns[bit] <= now_ns:
                self._emit(EventKind.COMMUTATION_FAILURE, t, number)

    def _note_failed_commutation(self, out: int, left: int, t: float) -> None:
        one, two = self._newest
        failed_p = one and MASK[one] & out and left & RAIL_MASKS[0]
        failed_m = two and MASK[two] & out and left & RAIL_MASKS[1]
        if failed_p or failed_m:
            for number in sorted((one if failed_p else 0, two if failed_m else 0)):
                if number:
                    self._emit(EventKind.COMMUTATION_FAILURE, t, number)

    def _note_switch(self, old: Network, net: Network, gone: int, t: float) -> None:
        for alarm, kind in _ALARMS:
            if net.alarms & alarm and not old.alarms & alarm:
                self._emit(kind, t, 0)
        if self._trace:
            for number in numbers_of(gone):
                self._emit(EventKind.EXTINCTION, t, number)
            if net.modes and not old.modes:
                self._emit(EventKind.COMMUTATION_START, t, 0)
            elif old.modes and not net.modes:
                self._emit(EventKind.COMMUTATION_END, t, 0)

    def _emit(self, kind: EventKind, t: float, number: int) -> None:
        if kind in ROUTINE and not self._trace:
            return
        if len(self._events) == EVENTS_KEPT:
            self.events_lost += 1
        self._events.append((kind, self.now_ns, t, number, self.current_a))


def _modes(net: Network, phases: Phases, sine: float, cosine: float) -> Phases:
    """Return the phase currents (A) less their common mean, which flows through the armature, and the steady part.

    Written out phase by phase: compiled, numbers in a tuple are quick to read only at constant indexes.
    """
    by_c, by_d, const = net.phase_c, net.phase_d, net.phase_k
    a, b, c = phases
    mode_a = mode_b = mode_c = 0.0
    for x, y, z in net.tied:
        if z >= 0:
            mean = (a + b + c) / 3
            mode_a = a - mean - by_c[0] * cosine - by_d[0] * sine - const[0]
            mode_c = c - mean - by_c[2] * cosine - by_d[2] * sine - const[2]
            mode_b = -mode_a - mode_c
        elif x > 0:
            mode_b = b - (b + c) / 2 - by_c[1] * cosine - by_d[1] * sine - const[1]
            mode_c = -mode_b
        else:
            mode_a = a - (a + (b if y == 1 else c)) / 2 - by_c[0] * cosine - by_d[0] * sine - const[0]
            if y == 1:
                mode_b = -mode_a
            else:
                mode_c = -mode_a
    return mode_a, mode_b, mode_c
