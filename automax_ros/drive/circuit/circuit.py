"""The power circuit: line, bridge and machine, advanced from event to event.

Between events every current is known in closed form (``network``, ``waves``, ``conduction``). Gates and line changes
are at integer nanoseconds; the instants of extinction and commutation are not rounded.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import cos, inf, sin
from typing import Final

from automax_ros.drive.base.errors import GateError, ParameterError
from automax_ros.drive.base.motor import Machine
from automax_ros.drive.base.state import SavedState, check_names
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.conduction import CircuitEvent, Conduction, EventKind
from automax_ros.drive.circuit.meter import Sample
from automax_ros.drive.circuit.network import Network, Phases
from automax_ros.drive.circuit.scr import BIT, mask_of, numbers_of
from automax_ros.drive.circuit.waves import ZERO_A, WavePiece
from automax_ros.drive.circuit.wiring import ARMATURE_ARC, PHASE_ARC

ARC_V: Final = 1200.0
"""Voltage of an arc in an opening contactor or fuse, V (decision: above any voltage of these drives)."""


class Circuit(Conduction):
    """One drive's power circuit.

    Attributes:
        now_ns: the present, ns.
        current_a: armature current, A; positive out of rail P, from bridge 1.
        energy: the energy meter, None unless requested (it triples the computing time of an interval).
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
        step_ns: int = 0,
    ) -> None:
        """Create the circuit at the line's start without current.

        Args:
            line: the AC line, of this circuit alone.
            bridge: the SCRs.
            machine: the load.
            trace: whether turn-on, extinction and commutation are events too.
            energy: whether to meter energies.
            arc_v: voltage with which an opening contactor or fuse drives its current to zero, V.
            step_ns: the longest interval of constant speed, ns; 0 leaves it to the machine.
        """
        super().__init__(line, bridge, machine, trace=trace, energy=energy)
        self._arc_v = arc_v
        self._step_ns = step_ns

    def begin_with(self, numbers: Iterable[int], current_a: float) -> None:
        """Start with two SCRs that conduct an armature current (A), of the sign that they carry.

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

    # Control

    def fire(self, on_ns: int, off_ns: int, *numbers: int) -> None:
        """Gate SCRs, given by their numbers, from one instant to another (ns).

        Raises:
            GateError: no such SCR, the window is empty or begins in the past.
        """
        self.fire_mask(on_ns, off_ns, mask_of(numbers))

    def fire_mask(self, on_ns: int, off_ns: int, mask: int) -> None:
        """Gate the SCRs of a mask likewise.

        Raises:
            GateError: an SCR of bridge 2 where there is none, the window is empty or begins in the past.
        """
        if on_ns < self.now_ns:
            raise GateError(f"a gate window from {on_ns} ns begins in the past; it is {self.now_ns} ns")
        self.bridge.fire_mask(on_ns, off_ns, mask)

    def advance(self, until_ns: int) -> None:
        """Advance to an instant (ns); gates and changes that begin exactly then wait for the next call.

        Raises:
            ParameterError: the instant is in the past.
            SourceShortError: two phases are shorted and the line has no impedance.
        """
        if until_ns < self.now_ns:
            raise ParameterError(f"cannot go back from {self.now_ns} to {until_ns} ns")
        bridge, line, machine, pending = self.bridge, self.line, self.machine, self.bridge.pending
        longest_ns = self._step_ns
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
            stop = now + machine.step_ns
            if stop > until_ns:  # noqa: PLR1730 - min() costs a call
                stop = until_ns
            if longest_ns and stop > now + longest_ns:
                stop = now + longest_ns
            if stop > line.next_change_ns:  # noqa: PLR1730
                stop = line.next_change_ns
            if pending and stop > pending[0][0]:
                stop = pending[0][0]
            self._run(stop)

    def sample(self) -> Sample:
        """Return the integrals since the last call (or the start), and restart them."""
        sample = self.present_sample()
        self._begin_sample()
        return sample

    def present_sample(self) -> Sample:
        """Return the integrals since the last sample without ending it; the list of intervals is the circuit's own."""
        volt_s = self._volt_s + self._z.r * self._charge + self._z.l * (self.current_a - self._current_before)
        duration_s = (self.now_ns - self._sample_ns) * 1e-9
        charge, zero_s, overlap_s = self._charge, self._zero_s, self._overlap_s
        return Sample(duration_s, charge, volt_s, zero_s, overlap_s, self._square, self._pieces, self._highest)

    def pieces(self) -> list[WavePiece]:
        """Return the armature current since the last sample by intervals, without those in which none flowed."""
        return self._pieces[:]

    def take_events(self) -> list[CircuitEvent]:
        """Return the events since the last call; the last 10,000 are kept, ``events_lost`` counts the others."""
        events = [CircuitEvent(*raw) for raw in self._events]
        self._events.clear()
        return events

    # Present values

    @property
    def conducting(self) -> tuple[int, ...]:
        """The SCRs that conduct, ascending; shorted ones are not listed."""
        return numbers_of(self._net.mask)

    @property
    def flows(self) -> bool:
        """Whether armature current flows."""
        return self._net.active

    @property
    def idle_s(self) -> float:
        """Time since armature current last flowed, s; 0 while it flows."""
        return 0.0 if self._net.active else (self.now_ns - self._ended_ns) * 1e-9

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

    def phase_currents(self) -> Phases:
        """Return the currents out of the line's three phases, A."""
        angle = self.line.angle(self.now_ns)
        return self._phases(self._net, self.current_a, sin(angle), cos(angle))

    @property
    def line_a(self) -> float:
        """The greatest of the line's phase currents, A, without sign."""
        net = self._net
        if net.modes:
            return max(map(abs, self.phase_currents()))
        return net.largest_share * abs(self.current_a) if net.active else 0.0

    # Faults

    def short_scr(self, number: int, *, shorted: bool = True) -> None:
        """Short an SCR in both directions, or replace it by a sound one, which takes over the present current."""
        phases = self.phase_currents()
        left_on = 0
        if shorted:
            self._emit(EventKind.SCR_SHORTED, 0.0, number)
        else:
            leg = BIT[number] // 2
            current = self._net.leg_current(leg, self.current_a, phases)
            if abs(current) > ZERO_A:
                left_on = 1 << (2 * leg + (current < 0))
        self.bridge.short(number, shorted=shorted)
        self._rewire(phases, left_on)

    def open_gate(self, number: int, *, is_open: bool = True) -> None:
        """Open (or repair) the gate lead of an SCR; each time it should fire is an event."""
        self.bridge.open_gate(number, is_open=is_open)

    def open_phase(self, phase: int) -> None:
        """Open a phase (0 to 2), as by a fuse or upstream; an arc drives its current to zero first."""
        wiring = self.bridge.wiring
        if wiring.open_phases >> phase & 1 or wiring.phase_arc_v[phase]:
            return
        phases = self.phase_currents()
        if abs(phases[phase]) > ZERO_A and self._arc_v:
            self.bridge.wiring = wiring.with_arc(phase, self._arc_v if phases[phase] > 0 else -self._arc_v)
        else:
            self._open(PHASE_ARC << phase, 0.0)
        self._rewire(phases)

    def close_phase(self, phase: int) -> None:
        """Close a phase again."""
        phases = self.phase_currents()
        wiring = self.bridge.wiring
        self.bridge.wiring = replace(wiring.with_arc(phase, 0.0), open_phases=wiring.open_phases & ~(1 << phase))
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

    # State

    def state(self) -> SavedState:
        """Return all that the future depends on, with line, bridge and machine: plain data that JSON keeps exactly.

        Events and the part of the present sample that have not been fetched are included.
        """
        return super().state() | {
            "line": self.line.state(),
            "bridge": self.bridge.state(),
            "machine": self.machine.state(),
            "energy": self.energy.state() if self.energy else None,
            "_pieces": [piece.numbers() for piece in self._pieces],
            "events": [(kind.value, *rest) for kind, *rest in self._events],
            "conducting": self._net.mask,
            # The order in which currents are checked determines the last bits of an instant that several share.
            "guards": [[net.mask, [guard[0] for guard in net.guards]] for net in self._build_networks()],
        }

    def restore(self, state: SavedState) -> None:
        """Restore the state of a circuit created from the same data, and continue from there, bit for bit.

        Raises:
            ParameterError: it is not the state of such a circuit.
        """
        parts = ("line", "bridge", "machine", "energy", "_pieces", "events", "conducting", "guards")
        check_names("circuit", state, (*self._kept, *parts))
        if (state["energy"] is None) != (self.energy is None):
            raise ParameterError("the state is that of a circuit with another choice of energy=")
        super().restore({name: state[name] for name in self._kept})
        self._pieces = [WavePiece(*numbers) for numbers in state["_pieces"]]
        self._highest = inf
        self.line.restore(state["line"])
        self.bridge.restore(state["bridge"])
        self.machine.restore(state["machine"])
        if self.energy is not None:
            self.energy.restore(state["energy"])
        self._events.clear()
        self._events.extend((EventKind(kind), *rest) for kind, *rest in state["events"])
        self._nets.clear()
        for mask, order in state["guards"]:
            self._network(mask).put_in_order(order)
        self._net = self._network(state["conducting"])

    def _build_networks(self) -> list[Network]:
        found = {net.mask: net for net in [*self._nets.values(), self._net]}
        return [found[mask] for mask in sorted(found)]

    # Changes from outside

    def _change_line(self, now_ns: int) -> None:
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

    def _rewire(self, phases: Phases, left_on: int = 0) -> None:
        old = self._net
        self._nets.clear()
        angle = self.line.angle(self.now_ns)
        net = self._enter(old.mask | left_on, phases, sin(angle), cos(angle))
        if old.active and not net.active:
            self._ended_ns = float(self.now_ns)
        gone = old.mask & ~net.mask
        if gone:
            self.bridge.put_out(gone, float(self.now_ns))
        self._note_switch(old, net, gone, 0.0)
