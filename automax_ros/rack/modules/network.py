"""A network module 57C404 of a running rack: its registers, and what it exchanges with the other racks of a network.

Once in a cycle of 5.5 ms of rack time it sends, as long as it has power: the master the broadcast registers and its
half of each drop on which a variable of its rack file stands or to which a task has written since the power came
(decision: a drop of its own is not sent because a stranger claims to be there); a slave, while it hears the master, its
half of the drops that it represents. What arrives is written into registers by the module, between two scans, at the
instant at which it arrives, and recorded like any other write: a replay needs no network. The length of the cycle is
ours, after the tick of a Processor (decision): no source at hand prints one. A host that is late skips cycles, which do
not count as time-outs (decision).

A lost drop keeps the values that came last; its status bits are cleared and the module shows the code C until it is
heard again; that no task stops for it is ours (decision). STOP ALL clears outputs, so that the others see 0; the depth
of a slave stays as it was defined (decision). Without power the module is silent and forgets all.

The drop depth is 1 when the power comes; register 20 shows 0 then, so that a task's 1 can be seen (decision). The
module processes what a task writes there at its next cycle. Before that a drop communicates, its status bits being 0.

Counters show what they have counted at every sixteenth cycle (decision: each showing is an entry of the write log).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

from automax_ros.core.kinds import WriteKind
from automax_ros.core.numbers import sign_extended
from automax_ros.rack.modules.module import ModuleState, RackServices
from automax_ros.rack.modules.network_drops import DropMessage, Hearing, NetworkStatus, Send, Sender
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.network import (
    AREA,
    BROADCAST,
    CRC_ERRORS,
    DEPTH,
    DONE,
    INVALID,
    LAST_DROP,
    MASTER,
    OVERRUNS,
    OWN_DROP,
    RECEIVED,
    STATUS,
    TIMEOUTS,
    TRANSMITTED,
    VALID,
    from_master,
    from_slave,
    greatest_depth,
)
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent

CYCLE_NS = 5_500_000
"""Time between two frames of a drop, ns."""
SHOW_EVERY = 16
"""Cycles between two showings of the counters."""
LOST_CODE = "C"
"""The hardware's code for four receive time-outs in a row (57C570 manual p. 18-6)."""
_COUNTERS = {
    "received": RECEIVED,
    "timeouts": TIMEOUTS,
    "unreadable": CRC_ERRORS,
    "missed": OVERRUNS,
    "transmitted": TRANSMITTED,
}
_WORD = 0xFFFF


class NetworkModule:
    """A 57C404."""

    tasks: Sequence[ScheduledTask] = ()

    def __init__(self, config: ModuleConfig, network: str, drop: int, parts: RackServices) -> None:
        """Take a module's configuration; nothing happens before the power comes."""
        bank = parts.backplane.bank(config.slot)
        assert bank is not None
        self.config, self.network = config, network
        self._drop, self._parts, self._view = drop, parts, bank.view
        registers = config.registers
        inputs = [number for number in range(registers.count) if registers.direction(number) == "input"]
        self.kept = parts.memory.registers.showing(bank.view, [*inputs, DEPTH])
        self._named = self._named_drops()
        self._hearing = Hearing(self._named if self._is_master else (MASTER,))
        self._key = EventKey(EventClass.IO, config.slot, "network")
        self._event: ScheduledEvent | None = None
        self._written: set[int] = set()
        if self._is_master:
            self._watch_writes()
        self._send: Send | None = None
        self._sequence = 0
        self._forget()

    # Station

    def connect(self, send: Send) -> None:
        """Let what it sends be carried from now on."""
        self._send = send

    def receive(self, frames: Iterable[tuple[Sender, DropMessage]], damaged: int = 0) -> None:
        """Take frames of others, between two scans, and count those that arrived but could not be read."""
        if self._event is None:
            return
        self._count["unreadable"] += damaged
        self._parts.memory.now_ns = self._parts.scheduler.now_ns
        for sender, frame in frames:
            if frame.is_sound:
                self._take(sender, frame)
            else:
                self._count["unreadable"] += 1
        self._parts.tell_writes()

    def status(self) -> NetworkStatus:
        """Return how it stands."""
        hearing = self._hearing
        powered = self._event is not None
        return NetworkStatus(
            self._drop,
            self._depth,
            self._defined,
            hearing.heard,
            hearing.lost,
            tuple(sorted(hearing.rivals)),
            LOST_CODE if powered and hearing.lost else "",
            tuple((name, count & _WORD) for name, count in self._count.items()),
        )

    # Module

    def power_on(self) -> None:
        """Show its drop, and begin."""
        self._forget()
        self._parts.memory.now_ns = self._parts.scheduler.now_ns
        self._write(OWN_DROP, self._drop | VALID)
        self._begin(self._parts.scheduler.now_ns + CYCLE_NS)

    def power_off(self) -> None:
        """Fall silent; its memory is lost."""
        if self._event is not None:
            self._event.cancel()
            self._event = None
        self._parts.memory.now_ns = self._parts.scheduler.now_ns
        for number in range(self.config.registers.count):
            self._write(number, 0)

    def stopped_all(self) -> None:
        """Go on: its outputs are 0 now, and the others see that."""

    def state(self) -> ModuleState:
        """Return when the next cycle comes (ns), what it counted, and whom it hears."""
        return {
            "next_ns": self._parts.scheduler.due_ns(self._event) if self._event is not None else None,
            "depth": self._depth,
            "defined": self._defined,
            "sequence": self._sequence,
            "written": sorted(self._written),
            "bits": list(self._bits),
            "count": dict(self._count),
            **self._hearing.state(),
        }

    def load(self, state: ModuleState) -> None:
        """Take over a state, with the registers of that time.

        Raises:
            ValueError: the state is that of another module.
        """
        if set(state) != set(self.state()) or set(state["count"]) != set(_COUNTERS):
            raise ValueError(f"{self.config.name} has another state")
        self._depth, self._defined, self._sequence = state["depth"], state["defined"], state["sequence"]
        self._bits, self._count = list(state["bits"]), dict(state["count"])
        self._written.update(state["written"])
        self._hearing.load(state["drops"], state["rivals"])
        if state["next_ns"] is not None:
            self._begin(state["next_ns"])

    @property
    def _is_master(self) -> bool:
        return self._drop == MASTER

    @property
    def _own(self) -> range:
        return range(self._drop, self._drop + self._depth)

    def _named_drops(self) -> list[int]:
        """Return the drops on whose areas variables of the rack file stand."""
        places = (spec.place for spec in self._parts.memory.specs)
        drops = {place.register // AREA for place in places if place is not None and place.bank == self._view}
        return sorted(drops - {MASTER})

    def _watch_writes(self) -> None:
        """Note to which drops a task writes that no variable stands on."""
        for drop in range(1, LAST_DROP + 1):
            for number in from_master(drop) if drop not in self._named else ():
                self._parts.memory.watch(self._view, number, partial(self._written.add, drop))

    def _forget(self) -> None:
        self._depth, self._defined = 1, False
        self._written.clear()
        self._bits = [0] * len(STATUS)
        self._count = dict.fromkeys(_COUNTERS, 0)
        self._hearing.clear()

    def _begin(self, first_ns: int) -> None:
        self._event = self._parts.scheduler.every(CYCLE_NS, first_ns, self._key, self._cycle)

    def _cycle(self, now_ns: int, _: int) -> None:
        self._parts.memory.now_ns = now_ns
        self._sequence += 1
        self._count["timeouts"] += self._hearing.cycle()
        if not self._is_master:
            self._process_depth()
        self._show_drops()
        if self._is_master or self._hearing.drops[MASTER].is_heard:
            self._transmit(now_ns)
        if self._sequence % SHOW_EVERY == 0:
            for name, number in _COUNTERS.items():
                self._write(number, self._count[name])
        self._parts.tell_writes()

    def _process_depth(self) -> None:
        """Follow what a task has written into the depth register since it was processed."""
        word = self._read(DEPTH)
        if word == 0 or word & DONE:
            return
        value = word & ~INVALID
        if 1 <= value <= greatest_depth(self._drop):
            self._depth, self._defined = value, True
            self._write(DEPTH, value | DONE)
        else:
            self._write(DEPTH, value | DONE | INVALID)

    def _show_drops(self) -> None:
        """Show which drops communicate, as far as that has changed: stimuli may have written something else."""
        for index, bits in enumerate(self._communicating()):
            if self._bits[index] != bits:
                self._bits[index] = bits
                self._write(STATUS[index], bits)

    def _communicating(self) -> list[int]:
        """Return the status bits: the master shows drops whose depth is defined, a slave 0 and its own (p. 18-6)."""
        hearing = self._hearing
        if self._is_master:
            drops = [drop for drop in hearing.heard if hearing.drops[drop].defined]
        else:
            drops = [MASTER, *self._own] if self._defined and hearing.heard else []
        words = [0] * len(STATUS)
        for drop in drops:
            words[drop // 16] |= 1 << drop % 16
        return words

    def _transmit(self, now_ns: int) -> None:
        frames = [self._frame(drop) for drop in self._sent()]
        self._count["transmitted"] += len(frames)
        if self._send is not None:
            self._send(now_ns, frames)

    def _sent(self) -> Iterable[int]:
        """Return the drops of which it sends a half in each cycle."""
        if not self._is_master:
            return self._own
        return [MASTER, *sorted({*self._named, *self._written})]

    def _frame(self, drop: int) -> DropMessage:
        numbers = from_master(drop) if self._is_master else from_slave(drop)
        words = tuple(sign_extended(self._read(number), 16) for number in numbers)
        return DropMessage(self._drop, self._depth, self._defined, drop, self._sequence % (1 << 32), words)

    def _take(self, sender: Sender, frame: DropMessage) -> None:
        """Take a sound frame: that of the other side, or of a rival that uses drops of this module."""
        from_the_master = frame.station == MASTER
        if self._is_master == from_the_master:
            if from_the_master or not set(self._own).isdisjoint(frame.drops):
                self._hearing.meet(sender)
            return
        if from_the_master and frame.drop != MASTER and frame.drop not in self._own:
            return
        if from_the_master and frame.drop != MASTER:
            self._accept(frame, from_master(frame.drop), self._follows_master(sender))
        elif from_the_master:
            self._accept(frame, BROADCAST, self._hearing.take(sender, frame))
        else:
            self._accept(frame, from_slave(frame.drop), self._hearing.take(sender, frame))

    def _follows_master(self, sender: Sender) -> int | None:
        """Return 0 where the master that is heard has sent it: only its broadcast frame shows missed cycles."""
        return 0 if self._hearing.drops[MASTER].is_heard and self._hearing.drops[MASTER].sender == sender else None

    def _accept(self, frame: DropMessage, registers: range, missed: int | None) -> None:
        if missed is None:
            return
        self._count["received"] += 1
        self._count["missed"] += missed
        for number, word in zip(registers, frame.words, strict=False):
            self._write(number, word)

    def _read(self, number: int) -> int:
        return int(self._parts.memory.read_now(self._view, number)) & _WORD

    def _write(self, number: int, word: int) -> None:
        """Write a register that has another value."""
        if self._read(number) != word & _WORD:
            value, writer = sign_extended(word & _WORD, 16), self._parts.writer(self.config.name)
            self._parts.memory.write_now(self._view, value, writer, number, WriteKind.OUTSIDE)
