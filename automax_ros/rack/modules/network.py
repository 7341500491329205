"""A network module 57C404 of a running rack: its registers, and its exchange with the other racks of a network.

With power, it sends once per cycle of 5.5 ms of rack time. The master sends the broadcast registers and its half of
each drop that has a variable in its rack file or to which a task has written since power-up (decision: a drop of its
own is not sent because a stranger claims to be there). A slave sends, while it receives from the master, its half of
the drops that it represents. Received words are written at the instant of their arrival, between two scans, and
recorded like any other write. The length of the cycle is ours, after the tick of a Processor (decision): no source at
hand prints one. A host that is late skips cycles, which do not count as time-outs (decision).

A lost drop keeps its last values; its status bits are cleared and the module shows the code C until the drop is
received again; that no task stops for it is ours (decision). STOP ALL clears outputs; the depth of a slave stays as it
was defined (decision). Without power the module sends nothing and loses its memory.

The drop depth is 1 after power-up; register 20 shows 0 then, so that a task's 1 can be recognized (decision). A task's
write to it is processed at the next cycle. Until then a drop does not communicate: its status bits are 0. Counters are
shown at every sixteenth cycle (decision: each showing is an entry of the write log).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from automax_ros.core.numbers import sign_extended
from automax_ros.rack.modules.io_module import OwnRegisters
from automax_ros.rack.modules.module import ModuleState, QuietModule
from automax_ros.rack.modules.network_drops import DropMessage, NetworkStatus, Reception, Send, Sender
from automax_ros.rack.tasks.installation import RackServices
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
    NetworkConfig,
    from_master,
    from_slave,
    greatest_depth,
)
from automax_ros.runtime.time.scheduler import NO_EVENT, EventClass, EventKey

CYCLE_NS = 5_500_000
"""Time between two frames of a drop, ns."""
SHOW_EVERY = 16
"""Cycles after which the counters are shown again."""
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


class NetworkModule(QuietModule):
    """A 57C404 on a ``network``; STOP ALL clears its outputs, which the others then receive."""

    def __init__(self, config: NetworkConfig, parts: RackServices) -> None:
        """Create a module from its configuration; it does nothing until power-up."""
        super().__init__(config)
        self.network, self._drop, self._parts = config.network, config.drop, parts
        self._own = OwnRegisters(config, parts)
        registers, memory, view = config.registers, parts.memory, self._own.view
        inputs = [number for number in range(registers.count) if registers.direction(number) == "input"]
        self.kept = memory.registers.showing(view, [*inputs, DEPTH])
        places = (spec.place for spec in memory.specs)
        drops = {place.register // AREA for place in places if place is not None and place.bank == view}
        self._named = sorted(drops - {MASTER})  # those in whose areas the rack file has variables
        self._reception = Reception(self._named if self._is_master else (MASTER,))
        self._key = EventKey(EventClass.IO, config.slot, "network")
        self._event = NO_EVENT
        self._written: set[int] = set()
        for drop in range(1, LAST_DROP + 1) if self._is_master else ():
            for number in from_master(drop) if drop not in self._named else ():
                memory.watch(view, number, partial(self._written.add, drop))
        self._send: Send | None = None
        self._sequence = 0
        self._is_played = False
        self._forget()

    def play(self) -> None:
        """Do nothing from now on: what it wrote in a recording is written from outside (``replay/rerun``)."""
        self._is_played = True

    def connect(self, send: Send) -> None:
        """Set the function that transmits its frames from now on."""
        self._send = send

    def receive(self, frames: Iterable[tuple[Sender, DropMessage]], damaged: int = 0) -> None:
        """Process received frames, between two scans, and count those that could not be read."""
        if self._event.cancelled:
            return
        self._count["unreadable"] += damaged
        for sender, frame in frames:
            if frame.is_sound:
                self._take(sender, frame)
            else:
                self._count["unreadable"] += 1
        self._parts.report_writes()

    def status(self) -> NetworkStatus:
        """Return its status on the network."""
        reception = self._reception
        return NetworkStatus(
            self._drop,
            self._depth,
            self._defined,
            reception.received,
            reception.lost,
            tuple(sorted(reception.rivals)),
            LOST_CODE if reception.lost and not self._event.cancelled else "",
            tuple((name, count & _WORD) for name, count in self._count.items()),
        )

    def power_on(self) -> None:
        """Show its drop, and start its cycles."""
        if self._is_played:
            return
        self._forget()
        self._write(OWN_DROP, self._drop | VALID)
        self._begin(self._parts.scheduler.now_ns + CYCLE_NS)

    def power_off(self) -> None:
        """Stop sending; its memory is lost."""
        if self._is_played:
            return
        self._event.cancel()
        for number in range(self.config.registers.count):
            self._write(number, 0)

    def state(self) -> ModuleState:
        """Return when the next cycle comes (ns), its counters, and from which senders it receives."""
        return {
            "next_ns": self._parts.scheduler.due_ns(self._event),
            "depth": self._depth,
            "defined": self._defined,
            "sequence": self._sequence,
            "written": sorted(self._written),
            "bits": list(self._bits),
            "count": dict(self._count),
            **self._reception.state(),
        }

    def load(self, state: ModuleState) -> None:
        """Restore a state, with the registers of that time; ValueError if it is that of another module."""
        if set(state) != set(self.state()) or set(state["count"]) != set(_COUNTERS):
            raise ValueError(f"{self.config.name} has another state")
        self._depth, self._defined, self._sequence = state["depth"], state["defined"], state["sequence"]
        self._bits, self._count = list(state["bits"]), dict(state["count"])
        self._written.update(state["written"])
        self._reception.load(state["drops"], state["rivals"])
        if state["next_ns"] is not None:
            self._begin(state["next_ns"])

    @property
    def _is_master(self) -> bool:
        return self._drop == MASTER

    @property
    def _drops(self) -> range:
        return range(self._drop, self._drop + self._depth)

    def _forget(self) -> None:
        self._depth, self._defined = 1, False
        self._written.clear()
        self._bits = [0] * len(STATUS)
        self._count = dict.fromkeys(_COUNTERS, 0)
        self._reception.clear()

    def _begin(self, first_ns: int) -> None:
        self._event = self._parts.scheduler.every(CYCLE_NS, first_ns, self._key, self._cycle)

    def _cycle(self, now_ns: int, _: int) -> None:
        self._sequence += 1
        self._count["timeouts"] += self._reception.cycle()
        if not self._is_master:
            self._process_depth()
        self._show_drops()
        if self._is_master or self._reception.drops[MASTER].is_received:
            frames = [self._frame(drop) for drop in self._sent_registers()]
            self._count["transmitted"] += len(frames)
            if self._send is not None:
                self._send(now_ns, frames)
        if self._sequence % SHOW_EVERY == 0:
            for name, number in _COUNTERS.items():
                self._write(number, self._count[name])
        self._parts.report_writes()

    def _process_depth(self) -> None:
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
        """Show which drops communicate, where that changed: stimuli may have written something else.

        The master shows drops whose depth is defined, a slave 0 and its own (p. 18-6).
        """
        reception = self._reception
        if self._is_master:
            drops = [drop for drop in reception.received if reception.drops[drop].defined]
        else:
            drops = [MASTER, *self._drops] if self._defined and reception.received else []
        words = [0] * len(STATUS)
        for drop in drops:
            words[drop // 16] |= 1 << drop % 16
        for index, bits in enumerate(words):
            if self._bits[index] != bits:
                self._bits[index] = bits
                self._write(STATUS[index], bits)

    def _sent_registers(self) -> Iterable[int]:
        if not self._is_master:
            return self._drops
        return [MASTER, *sorted({*self._named, *self._written})]

    def _frame(self, drop: int) -> DropMessage:
        numbers = from_master(drop) if self._is_master else from_slave(drop)
        words = tuple(sign_extended(self._read(number), 16) for number in numbers)
        return DropMessage(self._drop, self._depth, self._defined, drop, self._sequence % (1 << 32), words)

    def _take(self, sender: Sender, frame: DropMessage) -> None:
        from_the_master = frame.station == MASTER
        if self._is_master == from_the_master:
            if from_the_master or not set(self._drops).isdisjoint(frame.drops):
                self._reception.add_rival(sender)
            return
        if from_the_master and frame.drop != MASTER:
            master = self._reception.drops[MASTER]  # only its broadcast frame shows missed cycles
            if frame.drop in self._drops and master.is_received and master.sender == sender:
                self._accept(frame, from_master(frame.drop), 0)
            return
        missed = self._reception.take(sender, frame)
        if missed is not None:
            self._accept(frame, BROADCAST if from_the_master else from_slave(frame.drop), missed)

    def _accept(self, frame: DropMessage, registers: range, missed: int) -> None:
        self._count["received"] += 1
        self._count["missed"] += missed
        for number, word in zip(registers, frame.words, strict=False):
            self._write(number, word)

    def _read(self, number: int) -> int:
        return self._own.read(number) & _WORD

    def _write(self, number: int, word: int) -> None:
        self._own.show(number, sign_extended(word & _WORD, 16))
