"""The bridge's gates, latches and failures: which SCRs may conduct, conduct, or are broken."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, replace
from heapq import heappop, heappush
from math import inf
from typing import Final

from automax_ros.drive.base.errors import GateError, require
from automax_ros.drive.base.state import SavedState, Stateful, check_names
from automax_ros.drive.circuit.scr import BIT, FORWARD_MASK, MASK, PARTNER, mask_of, numbers_of
from automax_ros.drive.circuit.wiring import Wiring

REST_NS: Final = 10
"""Time for which an extinguished SCR stays off, gated or not, ns (decision: keeps events from piling up at one
instant)."""
UNLATCHED_NS: Final = 100_000
"""Time for which it stays off if it had conducted for less than ``REST_NS``, ns (decision: it did not latch)."""


class Bridge(Stateful):
    """Twelve SCRs (S6R), or the six of bridge 1 (S6).

    A gate is a window of integer nanoseconds. In it an SCR with forward voltage turns on; it stays on until its current
    is zero, then needs ``turn_off_s`` before it blocks forward voltage without a gate.
    """

    _kept = ("pending", "gated", "gate_end_ns", "recovering", "on_ns", "recovered_ns", "rest_ns", "open_gates")

    def __init__(self, *, reversing: bool = True, turn_off_s: float = 150e-6, drop_v: float = 0.0) -> None:
        """Create the bridge with all SCRs off and sound.

        Args:
            reversing: whether there is a bridge 2.
            turn_off_s: turn-off time of an SCR, s (100 to 400 us are usual; 0 for ideal ones).
            drop_v: voltage over a conducting SCR, V.

        Raises:
            ParameterError: a value outside its range.
        """
        self.reversing = reversing
        self.turn_off_ns = round(require("turn-off time in s", turn_off_s, 0.0, 0.01) * 1e9)
        self.drop_v = require("SCR drop in V", drop_v, 0.0, 10.0)
        self.wiring = Wiring()
        self.pending: list[tuple[int, int, int]] = []
        """Pending gate windows: start (ns), end (ns), mask; a heap."""
        self.gated = 0
        """SCRs whose gate window has begun and is not yet known to have ended."""
        self.gate_end_ns = [0] * 12
        self.recovering = 0
        """SCRs that were extinguished and are not yet known to have recovered."""
        self.on_ns = [0.0] * 12
        """Instant at which each SCR last turned on."""
        self.recovered_ns = [0.0] * 12
        """Instant at which each extinguished SCR blocks forward voltage again."""
        self.rest_ns = [0.0] * 12
        """Instant until which each extinguished SCR cannot turn on."""
        self.open_gates = 0

    def fire(self, on_ns: int, off_ns: int, numbers: Iterable[int]) -> None:
        """Gate SCRs from one instant to another, ns; a later window of the same SCR replaces the rest of this one.

        Raises:
            GateError: no such SCR, or the window is empty.
        """
        self.fire_mask(on_ns, off_ns, mask_of(numbers))

    def fire_mask(self, on_ns: int, off_ns: int, mask: int) -> None:
        """Gate the SCRs of a mask likewise.

        Raises:
            GateError: an SCR of bridge 2 where there is none, or the window is empty.
        """
        if mask & ~FORWARD_MASK and not self.reversing:
            raise GateError("an S6 has no bridge 2: only the SCRs 1 to 6 can be fired")
        if off_ns <= on_ns:
            raise GateError(f"a gate window from {on_ns} to {off_ns} ns is empty")
        heappush(self.pending, (on_ns, off_ns, mask))

    def cancel(self, now_ns: int) -> None:
        """Cancel every gate window, begun or pending, as when pulses are suppressed; conducting SCRs stay on."""
        self.pending.clear()
        self.gated = 0
        self.gate_end_ns = [min(end, now_ns) for end in self.gate_end_ns]

    def take_back(self) -> None:
        """Cancel the gate windows that have not begun."""
        self.pending.clear()

    def begin_gates(self, now_ns: int) -> int:
        """Begin every window that is due; return the mask of fired SCRs whose gate lead is open."""
        lost = 0
        pending, ends = self.pending, self.gate_end_ns
        while pending and pending[0][0] <= now_ns:
            _, off_ns, mask = heappop(pending)
            if self.open_gates:
                lost |= mask & self.open_gates
                mask &= ~self.open_gates
            self.gated |= mask
            while mask:
                low = mask & -mask
                ends[low.bit_length() - 1] = off_ns
                mask ^= low
        return lost

    def candidates(self, now_ns: float, conducting: int) -> int:
        """Return the SCRs that forward voltage would turn on now: gated ones, and those not recovered."""
        gated, recovering = self.gated, self.recovering
        waiting = (gated | recovering) & ~conducting
        mask = 0
        while waiting:
            low = waiting & -waiting
            waiting ^= low
            bit = low.bit_length() - 1
            if gated & low:
                if self.gate_end_ns[bit] > now_ns:
                    mask |= low
                else:
                    gated ^= low
            if recovering & low:
                if self.recovered_ns[bit] > now_ns:
                    mask |= low
                elif self.rest_ns[bit] <= now_ns:
                    recovering ^= low
        self.gated, self.recovering = gated, recovering
        return mask

    def window_end_ns(self, mask: int, now_ns: float) -> float:
        """Return the instant until which all SCRs of a mask stay candidates, ns."""
        end = inf
        while mask:
            low = mask & -mask
            mask ^= low
            bit = low.bit_length() - 1
            own = float(self.gate_end_ns[bit]) if self.gated & low else now_ns
            if self.recovering & low:
                own = max(own, self.recovered_ns[bit])
            end = min(end, own)
        return end

    def rest_end_ns(self, mask: int) -> float:
        """Return the instant from which every extinguished SCR of a mask may conduct again, ns."""
        bits = (bit for bit in range(12) if mask & self.recovering & 1 << bit)
        return max((self.rest_ns[bit] for bit in bits), default=0.0)

    def gated_numbers(self, now_ns: int) -> tuple[int, ...]:
        """Return the SCRs that are gated at an instant."""
        return tuple(n for n in numbers_of(self.gated) if self.gate_end_ns[BIT[n]] > now_ns)

    def put_out(self, mask: int, now_ns: float) -> None:
        """Record that SCRs were extinguished."""
        self.recovering |= mask
        while mask:
            low = mask & -mask
            mask ^= low
            bit = low.bit_length() - 1
            self.recovered_ns[bit] = now_ns + self.turn_off_ns
            self.rest_ns[bit] = now_ns + (REST_NS if now_ns - self.on_ns[bit] >= REST_NS else UNLATCHED_NS)

    def open_gate(self, number: int, *, is_open: bool = True) -> None:
        """Open (or repair) the gate lead of an SCR."""
        mask = mask_of([number])
        self.open_gates = self.open_gates | mask if is_open else self.open_gates & ~mask
        if is_open:
            self.gated &= ~mask

    def short(self, number: int, *, shorted: bool = True) -> None:
        """Short an SCR, and with it its partner (or replace it by a sound one)."""
        mask_of([number])
        leg = 1 << BIT[number] // 2
        old = self.wiring.shorted
        self.wiring = replace(self.wiring, shorted=old | leg if shorted else old & ~leg)
        pair = MASK[number] | MASK[PARTNER[number]]
        self.recovering &= ~pair

    def state(self) -> SavedState:
        """Return gates, latches and failures."""
        wiring = asdict(self.wiring) | {"phase_arc_v": list(self.wiring.phase_arc_v)}
        return super().state() | {"wiring": wiring}

    def restore(self, state: SavedState) -> None:
        """Restore a state; raises ParameterError if it is not the state of a bridge."""
        check_names("bridge", state, (*self._kept, "wiring"))
        super().restore({name: state[name] for name in self._kept})
        wiring = state["wiring"]
        check_names("wiring", wiring, tuple(asdict(self.wiring)))
        self.wiring = Wiring(**wiring | {"phase_arc_v": tuple(wiring["phase_arc_v"])})
