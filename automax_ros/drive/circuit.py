"""The power circuit: line, bridge and machine, advanced from event to event.

Between events every current is known in closed form (``network``, ``waves``); root finding serves only to find the instant of
an event: a current that ends, a gated SCR that gets forward voltage. Gates and line changes lie on integer nanoseconds,
the instants of extinction and commutation are not rounded.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from math import cos, exp, inf, sin, sqrt

from automax_ros.drive.ac_line import AcLine
from automax_ros.drive.bridge import Bridge
from automax_ros.drive.errors import GateError, ParameterError, SourceShortError
from automax_ros.drive.events import ROUTINE, Event, EventKind
from automax_ros.drive.meter import EnergyMeter, Sample
from automax_ros.drive.motor import Machine
from automax_ros.drive.network import (
    ARMATURE_ARC,
    ARMATURE_SHORT,
    CROSS_FIRE,
    LINE_SHORT,
    PHASE_ARC,
    Impedances,
    Network,
    settle,
)
from automax_ros.drive.scr import BIT, mask_of, numbers_of, rail_of
from automax_ros.drive.waves import ZERO_A, Piece, first_zero

MECHANICS_STEP_NS = 3_500_000
"""The longest interval of constant speed, ns: just over a firing interval at 48 Hz."""
ARC_V = 1200.0
"""Voltage of an arc in an opening contactor or fuse, V (decision: above any voltage of these drives)."""
EVENTS_KEPT = 10_000
PIECES_KEPT = 64
_NO_MODES = (0.0, 0.0, 0.0)
_ALARMS = (
    (ARMATURE_SHORT, EventKind.ARMATURE_SHORT),
    (LINE_SHORT, EventKind.LINE_SHORT),
    (CROSS_FIRE, EventKind.CROSS_FIRE),
)


class Circuit:
    """One drive's power circuit.

    Attributes:
        now_ns: the present, ns.
        current_a: armature current, A; positive out of rail P, from bridge 1.
        energy: the energy meter, None unless asked for (it triples the time an interval takes).
    """

    def __init__(
        self,
        line: AcLine,
        bridge: Bridge,
        machine: Machine,
        *,
        trace: bool = False,
        energy: bool = False,
        arc_v: float = ARC_V,
        step_ns: int = MECHANICS_STEP_NS,
    ) -> None:
        """Begin at the line's start without current.

        Args:
            line: the AC line, of this circuit alone.
            bridge: the SCRs.
            machine: what they feed.
            trace: whether turn-on, extinction and commutation are events too.
            energy: whether to meter energies.
            arc_v: voltage with which an opening contactor or fuse drives its current to zero, V.
            step_ns: the longest interval of constant speed, ns.
        """
        self.line = line
        self.bridge = bridge
        self.machine = machine
        self.now_ns = line.start_ns
        self.current_a = 0.0
        self.energy = EnergyMeter() if energy else None
        self._trace = trace
        self._arc_v = arc_v
        self._step_ns = step_ns
        self._z = Impedances.of(line, machine.inductance_h, machine.resistance_ohm, bridge.drop_v)
        self._nets: dict[int, Network] = {}
        self._modes = (0.0, 0.0, 0.0)
        self._newest = [0, 0]
        self._emf = machine.emf(0.0)
        self._events: deque[tuple[EventKind, int, float, int, float]] = deque(maxlen=EVENTS_KEPT)
        self.events_lost = 0
        bridge.wiring = replace(bridge.wiring, open_phases=sum(1 << x for x in line.missing))
        self._net = self._network(0)
        self._begin_sample()

    def begin_with(self, numbers: Iterable[int], current_a: float) -> None:
        """Begin with two SCRs that conduct an armature current (A), of the sign that they carry.

        Raises:
            ParameterError: these SCRs cannot carry it.
        """
        net = self._network(mask_of(numbers))
        shares = [guard[3] * current_a for guard in net.guards]
        if not net.active or net.modes or min(shares, default=-1.0) < 0:
            raise ParameterError(f"SCRs {', '.join(map(str, numbers))} cannot begin with {current_a:g} A")
        self.current_a = self._current_before = current_a
        share = net.share
        self._enter(net.mask, (share[0] * current_a, share[1] * current_a, share[2] * current_a), 0.0, 1.0)

    # What a controller does

    def fire(self, on_ns: int, off_ns: int, *numbers: int) -> None:
        """Gate SCRs, given by their numbers, from one instant to another (ns).

        Raises:
            GateError: no such SCR, the window is empty or begins in the past.
        """
        if on_ns < self.now_ns:
            raise GateError(f"a gate window from {on_ns} ns begins in the past; it is {self.now_ns} ns")
        self.bridge.fire(on_ns, off_ns, numbers)

    def advance(self, until_ns: int) -> None:
        """Let time pass to an instant (ns); gates and changes that begin exactly then wait for the next call.

        Raises:
            ParameterError: the instant lies in the past.
            SourceShortError: two phases are shorted and the line has no impedance.
        """
        if until_ns < self.now_ns:
            raise ParameterError(f"cannot go back from {self.now_ns} to {until_ns} ns")
        bridge, line, pending = self.bridge, self.line, self.bridge.pending
        while True:
            now = self.now_ns
            if now >= until_ns:
                return
            if line.next_change_ns <= now:
                self._change_line(now)
            if pending and pending[0][0] <= now:
                lost = bridge.begin_gates(now)
                if lost:
                    for number in numbers_of(lost):
                        self._emit(EventKind.GATE_OPEN, 0.0, number)
            stop = until_ns
            if stop > now + self._step_ns:
                stop = now + self._step_ns
            if stop > line.next_change_ns:
                stop = line.next_change_ns
            if pending and stop > pending[0][0]:
                stop = pending[0][0]
            self._run(stop)

    def sample(self) -> Sample:
        """Return the integrals since the last call (or the start), and begin anew."""
        volt_s = self._volt_s + self._z.r * self._charge + self._z.l * (self.current_a - self._current_before)
        duration_s = (self.now_ns - self._sample_ns) * 1e-9
        sample = Sample(
            duration_s, self._charge, volt_s, self._zero_s, self._overlap_s, self._square, self._pieces
        )
        self._begin_sample()
        return sample

    def pieces(self) -> list[Piece]:
        """Return the armature current since the last sample, interval by interval, without those where none flowed."""
        return [Piece(*piece) for piece in self._pieces]

    def take_events(self) -> list[Event]:
        """Return what happened since the last call; the last 10,000 are kept, ``events_lost`` counts the others."""
        events = [Event(*raw) for raw in self._events]
        self._events.clear()
        return events

    # What can be seen at this instant

    @property
    def conducting(self) -> tuple[int, ...]:
        """The SCRs that conduct, ascending; shorted ones are not listed."""
        return numbers_of(self._net.mask)

    @property
    def emf_v(self) -> float:
        """The EMF in the last interval, V."""
        return self._emf

    @property
    def armature_v(self) -> float:
        """The voltage over the armature's terminals, V: the limit from the right; the EMF while no current flows."""
        net = self._net
        if not net.active:
            return self._emf
        angle = self.line.angle(self.now_ns)
        driven = net.c * cos(angle) + net.d * sin(angle)
        rate = self.line.omega * (net.d * cos(angle) - net.c * sin(angle))
        rest = self.current_a - driven - (net.constant - self._emf) / net.resistance
        return self._z.r * self.current_a + self._z.l * (rate - net.decay * rest) + self._emf

    def phase_currents(self) -> tuple[float, float, float]:
        """Return the currents out of the line's three phases, A."""
        angle = self.line.angle(self.now_ns)
        return self._phases(self._net, self.current_a, sin(angle), cos(angle))

    # What can break

    def short_scr(self, number: int, *, shorted: bool = True) -> None:
        """Let an SCR fail into a short both ways (or put a sound one in)."""
        phases = self.phase_currents()
        self.bridge.short(number, shorted=shorted)
        if shorted:
            self._emit(EventKind.SCR_SHORTED, 0.0, number)
        self._rewire(phases)

    def open_gate(self, number: int, *, is_open: bool = True) -> None:
        """Break (or mend) the gate lead of an SCR; each time it should fire is an event."""
        self.bridge.open_gate(number, is_open=is_open)

    def open_phase(self, phase: int) -> None:
        """Open a phase (0 to 2) by fuse or upstream; an arc drives its current to zero first."""
        wiring = self.bridge.wiring
        if wiring.open_phases >> phase & 1 or wiring.phase_arc_v[phase]:
            return
        phases = self.phase_currents()
        if abs(phases[phase]) > ZERO_A and self._arc_v:
            arcs = list(wiring.phase_arc_v)
            arcs[phase] = self._arc_v if phases[phase] > 0 else -self._arc_v
            self.bridge.wiring = replace(wiring, phase_arc_v=tuple(arcs))
        else:
            self._open(PHASE_ARC << phase, 0.0)
        self._rewire(phases)

    def close_phase(self, phase: int) -> None:
        """Close a phase again."""
        phases = self.phase_currents()
        wiring = self.bridge.wiring
        arcs = tuple(0.0 if x == phase else arc for x, arc in enumerate(wiring.phase_arc_v))
        self.bridge.wiring = replace(wiring, phase_arc_v=arcs, open_phases=wiring.open_phases & ~(1 << phase))
        self._emit(EventKind.PHASE_CLOSED, 0.0, phase)
        self._rewire(phases)

    def open_contactor(self) -> None:
        """Open the armature's contactor; an arc drives its current to zero first."""
        wiring = self.bridge.wiring
        if not wiring.armature_closed or wiring.armature_arc_v:
            return
        phases = self.phase_currents()
        if abs(self.current_a) > ZERO_A and self._arc_v:
            arc_v = self._arc_v if self.current_a > 0 else -self._arc_v
            self.bridge.wiring = replace(wiring, armature_arc_v=arc_v)
        else:
            self._open(ARMATURE_ARC, 0.0)
        self._rewire(phases)

    def close_contactor(self) -> None:
        """Close the armature's contactor."""
        phases = self.phase_currents()
        self.bridge.wiring = replace(self.bridge.wiring, armature_closed=True, armature_arc_v=0.0)
        self._emit(EventKind.ARMATURE_CLOSED, 0.0, 0)
        self._rewire(phases)

    # From event to event

    def _run(self, stop_ns: int) -> None:
        """Let time pass to an instant before which no gate begins and the line stays as it is."""
        line, bridge, machine = self.line, self.bridge, self.machine
        start_ns, omega = self.now_ns, line.omega
        total = (stop_ns - start_ns) * 1e-9
        theta = line.start_angle + omega * ((start_ns - line.start_ns) * 1e-9)
        emf = self._emf = machine.emf(total)
        net, current = self._net, self.current_a
        modes = self._modes
        sine, cosine = sin(theta), cos(theta)
        t = charge = ahead_sine = ahead_cosine = ahead_fall = 0.0
        while True:
            first = left = total - t
            out = on = soonest = 0
            k = a = 0.0
            ahead = -1.0
            decay = net.decay
            if net.active:
                k = (net.constant - emf) / net.resistance
                a = current - net.c * cosine - net.d * sine - k
            if (bridge.gated | bridge.recovering) & ~net.mask:
                now_ns = start_ns + t * 1e9
                wanted = bridge.candidates(now_ns, net.mask)
                if wanted:
                    when, mask = self._watch(wanted, now_ns, (theta, sine, cosine, k, a), left)
                    if when == 0.0:
                        self.current_a, self._modes = current, modes
                        net = self._switch(0, mask, start_ns, t, sine, cosine)
                        current, modes = self.current_a, self._modes
                        continue
                    if when < first:
                        first, on = when, mask
            for mask, c, d, share, part, wa, wb, wc, bend in net.guards:
                guard_k, guard_a = share * k + part, share * a
                value = c * cosine + d * sine + guard_k + guard_a
                slope = omega * (d * cosine - c * sine) - decay * guard_a
                if guard_a < 0.0:
                    bend -= decay * decay * guard_a  # noqa: PLW2901
                guard_b = 0.0
                if net.modes:
                    guard_b = wa * modes[0] + wb * modes[1] + wc * modes[2]
                    if guard_b:
                        value += guard_b
                        slope -= net.decay_s * guard_b
                        if guard_b < 0.0:
                            bend -= net.decay_s * net.decay_s * guard_b  # noqa: PLW2901
                # A parabola of this bend stays below the current: positive at the end, it proves that there is no zero.
                if value >= -ZERO_A and (value > ZERO_A or slope >= 0.0):
                    least = value if value > 0.0 else 0.0
                    if least + first * (slope - 0.5 * bend * first) > 0.0:
                        continue
                    if first == left:  # likewise from the values at both ends, which the interval needs anyway
                        if ahead != left:
                            ahead, angle = left, theta + omega * left
                            ahead_sine, ahead_cosine = sin(angle), cos(angle)
                            ahead_fall = exp(-decay * left)
                        final = c * ahead_cosine + d * ahead_sine + guard_k + guard_a * ahead_fall
                        if guard_b:
                            final += guard_b * exp(-net.decay_s * left)
                        sag = 0.5 * bend * left - (final - least) / left
                        if final > 0.0 and (sag <= 0.0 or 2.0 * bend * least > sag * sag):
                            continue
                if -ZERO_A <= value <= ZERO_A and abs(guard_k) + abs(guard_a) + abs(guard_b) + bend < 1e-9:
                    zero = 0.0  # nothing drives it any more
                else:
                    zero = first_zero(c, d, guard_k, guard_a, guard_b, theta, omega, decay, net.decay_s, first)
                if zero <= first:
                    first, out, on = zero, mask, 0
                    if mask != net.guards[0][0]:
                        soonest = mask
            if soonest:
                net.put_first(soonest)
            if first > 0.0:
                before_sine, before_cosine, before = sine, cosine, theta
                theta += omega * first
                if first == ahead:
                    sine, cosine, fall = ahead_sine, ahead_cosine, ahead_fall
                else:
                    sine, cosine, fall = sin(theta), cos(theta), exp(-decay * first)
                if net.active:
                    current = net.c * cosine + net.d * sine + k + a * fall
                    charge += (
                        (net.c * (sine - before_sine) - net.d * (cosine - before_cosine)) / omega
                        + k * first
                        + a * (1.0 - fall) / decay
                    )
                    self._pieces.append((first, before, omega, net.c, net.d, k, a, decay))
                else:
                    self._zero_s += first
                if self.energy is not None:
                    interval = (before, first, k, a)
                    self.energy.add(net, line, self._z, bridge.wiring, emf, interval, modes)
                if net.modes:
                    self._overlap_s += first
                    if net.decay_s < inf:
                        fall = exp(-net.decay_s * first)
                        modes = (modes[0] * fall, modes[1] * fall, modes[2] * fall)
                t += first
            if out or on:
                self.current_a, self._modes = current, modes
                net = self._switch(out, on, start_ns, t, sine, cosine)
                current, modes = self.current_a, self._modes
            elif first >= left:
                break
        self.now_ns = stop_ns
        self.current_a, self._modes = current, modes
        self._charge += charge
        self._volt_s += emf * total
        if len(self._pieces) > PIECES_KEPT:
            self._square += sum(Piece(*piece).square() for piece in self._pieces)
            self._pieces.clear()
        if machine.turns:
            machine.advance(total, charge)
        if self.energy is not None:
            phases = self._phases(net, current, sine, cosine)
            self.energy.stored_j = 0.5 * (self._z.l * current**2 + self._z.ls * sum(phase**2 for phase in phases))

    def _watch(
        self, wanted: int, now_ns: float, state: tuple[float, float, float, float, float], limit: float
    ) -> tuple[float, int]:
        """Return when (s from now) forward voltage first turns on SCRs of a mask, and which; inf if not before a limit.

        ``state`` is the line's angle, its sine and cosine, and k and a of the armature current. No SCR with a time means
        that nothing is known beyond it: some SCR rests until then.
        """
        theta, sine, cosine, k, a = state
        net, bridge, omega, emf = self._net, self.bridge, self.line.omega, self._emf
        decay = net.decay
        soonest, who = inf, 0
        most, now_on = 0.0, 0
        for mask, c, d, constant, by_k, by_a, by_emf, bend in net.watches.get(wanted) or net.watch(wanted):
            short = -constant - by_k * k - by_emf * emf
            fade = by_a * a
            value = c * cosine + d * sine + fade - short
            if value > 0.0:
                if mask & bridge.recovering and bridge.rest_end_ns(mask) > now_ns:
                    rest = (bridge.rest_end_ns(mask) - now_ns) * 1e-9
                    soonest, who = (rest, 0) if rest < soonest else (soonest, who)
                elif value > most:
                    most, now_on = value, mask
                continue
            horizon = limit if limit < soonest else soonest
            if not mask & bridge.gated and horizon > bridge.turn_off_ns * 1e-9:
                horizon = bridge.turn_off_ns * 1e-9
            slope = omega * (d * cosine - c * sine) - decay * fade
            if fade > 0.0:
                bend += decay * decay * fade  # noqa: PLW2901
            # As for the currents: a parabola that stays above the voltage and is negative proves that nothing happens.
            if value + horizon * (slope + 0.5 * bend * horizon) < 0.0:
                continue
            horizon = min(horizon, (bridge.window_end_ns(mask, now_ns) - now_ns) * 1e-9)
            zero = first_zero(-c, -d, short, -fade, 0.0, theta, omega, decay, 0.0, horizon)
            if zero < soonest:
                soonest, who = zero, mask
        return (0.0, now_on) if now_on else (soonest, who)

    def _switch(self, out: int, on: int, start_ns: int, t: float, sine: float, cosine: float) -> Network:
        """Let SCRs go out (or arcs end), or turn on, at an instant; return the circuit from then on."""
        old = self._net
        phases = self._phases(old, self.current_a, sine, cosine)
        if on:
            self._note_turn_on(on, start_ns, t)
        if out >> 12:
            self._open(out, t)
        net = self._enter((old.mask | on) & ~out, phases, sine, cosine)
        gone = old.mask & ~net.mask
        if gone:
            self.bridge.put_out(gone, start_ns + t * 1e9)
            if old.modes and not old.alarms and out:
                self._note_failed_commutation(out, net.mask, t)
        if self._trace or net.alarms & ~old.alarms:
            self._note_switch(old, net, gone, t)
        return net

    def _enter(self, mask: int, phases: tuple[float, float, float], sine: float, cosine: float) -> Network:
        """Make a set of SCRs conduct from the present, with the phase currents (A) just before."""
        net = self._nets.get(mask) or self._network(mask)
        if net.instant or self.bridge.wiring.arcing:
            net, phases = self._clear_up(net, phases, sine, cosine)
        if not net.active:
            self.current_a = 0.0
        self._modes = _NO_MODES
        if net.modes and net.decay_s < inf:
            modes = [0.0, 0.0, 0.0]
            for x, y, z in net.tied:
                # The phases' currents over their common mean; it is what the armature takes.
                mean = (phases[x] + phases[y]) / 2 if z is None else (phases[x] + phases[y] + phases[z]) / 3
                first = phases[x] - mean - net.phase_c[x] * cosine - net.phase_d[x] * sine - net.phase_k[x]
                modes[x], modes[y] = first, -first
                if z is not None:
                    last = phases[z] - mean - net.phase_c[z] * cosine - net.phase_d[z] * sine - net.phase_k[z]
                    modes[y], modes[z] = -first - last, last
            self._modes = (modes[0], modes[1], modes[2])
        self._net = net
        return net

    def _clear_up(
        self, net: Network, phases: tuple[float, float, float], sine: float, cosine: float
    ) -> tuple[Network, tuple[float, float, float]]:
        """Commutate what has no source impedance, open arcs without current; return the circuit and phase currents."""
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

    def _commutate_at_once(
        self, net: Network, phases: tuple[float, float, float], sine: float, cosine: float
    ) -> tuple[Network, tuple[float, float, float]]:
        """Let one SCR go out of phases tied without any impedance: the first whose current the voltages drive to zero."""
        line = self.line
        push, over = [0.0] * 3, [0.0] * 3
        for group in net.rail_of_phases:
            volts = {}
            for x in group:
                c, d = line.unit_wave(x)
                volts[x] = line.amplitude_v * (c * cosine + d * sine) - net.offsets[x]
            for x in group:
                push[x] = volts[x] - sum(volts.values()) / len(group)
                over[x] = phases[x] - net.share[x] * self.current_a
        soonest, gone = inf, 0
        for mask, _, _, share, _, *weights, _ in net.guards:
            slope = sum(weight * volt for weight, volt in zip(weights, push, strict=True))
            if slope < -1e-9:
                value = share * self.current_a + sum(w * part for w, part in zip(weights, over, strict=True))
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

    def _phases(self, net: Network, current: float, sine: float, cosine: float) -> tuple[float, float, float]:
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

    def _change_line(self, now_ns: int) -> None:
        """Begin the line's next segment."""
        line = self.line
        phases = self.phase_currents()
        before = line.omega, line.amplitude_v
        missing = set(line.missing)
        line.advance(now_ns)
        if (line.omega, line.amplitude_v) != before:
            self._rewire(phases)
        for phase in sorted(missing ^ line.missing):
            if phase in line.missing:
                self.open_phase(phase)
            else:
                self.close_phase(phase)

    def _rewire(self, phases: tuple[float, float, float]) -> None:
        """Take over what changed in the wiring or the line, with the phase currents (A) just before."""
        old = self._net
        self._nets.clear()
        angle = self.line.angle(self.now_ns)
        net = self._enter(old.mask, phases, sin(angle), cos(angle))
        gone = old.mask & ~net.mask
        if gone:
            self.bridge.put_out(gone, float(self.now_ns))
        self._note_switch(old, net, gone, 0.0)

    def _open(self, arcs: int, t: float) -> None:
        """Open the phases and the contactor whose arcs have ended."""
        wiring = self.bridge.wiring
        for x in range(3):
            if arcs & PHASE_ARC << x:
                volts = tuple(0.0 if x == y else arc for y, arc in enumerate(wiring.phase_arc_v))
                wiring = replace(wiring, phase_arc_v=volts, open_phases=wiring.open_phases | 1 << x)
                self._emit(EventKind.PHASE_OPEN, t, x)
        if arcs & ARMATURE_ARC:
            wiring = replace(wiring, armature_closed=False, armature_arc_v=0.0)
            self._emit(EventKind.ARMATURE_OPEN, t, 0)
        self.bridge.wiring = wiring
        self._nets.clear()

    # What is told

    def _note_turn_on(self, on: int, start_ns: int, t: float) -> None:
        bridge = self.bridge
        for number in numbers_of(on):
            bit = BIT[number]
            self._newest[bit >> 1 & 1] = number
            if self._trace:
                self._emit(EventKind.TURN_ON, t, number)
            if not bridge.gated >> bit & 1 or bridge.gate_end_ns[bit] <= start_ns + t * 1e9:
                self._emit(EventKind.COMMUTATION_FAILURE, t, number)

    def _note_failed_commutation(self, out: int, left: int, t: float) -> None:
        for number in numbers_of(out & 0xFFF):
            rail = rail_of(number)
            if self._newest[rail] == number and any(rail_of(other) == rail for other in numbers_of(left)):
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

    def _begin_sample(self) -> None:
        self._sample_ns = self.now_ns
        self._current_before = self.current_a
        self._charge = self._volt_s = self._zero_s = self._overlap_s = self._square = 0.0
        self._pieces: list[tuple[float, float, float, float, float, float, float, float]] = []
