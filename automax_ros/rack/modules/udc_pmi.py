"""The PMIs of a UDC in a running rack: when they scan, and what passes between them and the dual port.

A PMI scans at interrupts of its own and then sees the command registers as they are (decision). The UDC writes the
feedback at the start of each of its scans, so that its tasks have it fresh (S-3056 p. 4-8), and counts the message.
Without the common clock nothing is exchanged, and the communication status says so as long as a task is in RUN;
STOP ALL and a power cycle leave feedback and status as they were (2.4.5).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from automax_ros.core.kinds import WriteKind
from automax_ros.drive.base.errors import DriveError
from automax_ros.drive.pmi import registers as table
from automax_ros.drive.pmi.pmi import Commands, Pmi
from automax_ros.rack.modules.module import ModuleState, RackServices
from automax_ros.rackfile.model.driven import Driving
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.udc import RAIL_COUNTERS
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent


class UdcPmis:
    """The PMIs of one UDC: one for each drive that has a plant with a motor."""

    def __init__(self, config: ModuleConfig, parts: RackServices, bank: int, commanded: Callable[[str], bool]) -> None:
        """Connect the PMIs; ``commanded`` says of a drive whether a task scans that commands it."""
        plants = config.plants if isinstance(config, Driving) else {}
        self._name, self._parts, self._bank, self._commanded = config.name, parts, bank, commanded
        self._key = EventKey(EventClass.IO, config.slot, "link")
        self._looks = False
        self._links = [
            _Link(self, drive, Pmi(parts.plants[plant.name], plant.motor_overload_ratio), config.slot)
            for drive, plant in sorted(plants.items())
            if plant.name in parts.plants
        ]

    def begin(self) -> None:
        """Let the PMIs scan from now on; those that do go on."""
        for link in self._links:
            if link.event is None:
                self.show(link.base + table.LINK, table.NO_CLOCK)
                link.scan_at(self._parts.scheduler.now_ns)

    def exchange(self, now_ns: int) -> None:
        """Write what the PMIs send at the start of a scan of the UDC."""
        for link in self._links:
            link.receive(now_ns)
        if self._links:
            self._parts.tell_writes()

    def follow(self) -> None:
        """Look at the common clock once what has changed is complete, still at this instant."""
        if self._links and not self._looks:
            self._looks = True
            self._parts.scheduler.at(self._parts.scheduler.now_ns, self._key, self._look)

    def state(self) -> dict[str, object]:
        """Return the state of each PMI by its drive."""
        return {link.drive: link.state() for link in self._links}

    def load(self, state: Mapping[str, ModuleState]) -> None:
        """Take over a state.

        Raises:
            ValueError: it is that of other drives.
        """
        if set(state) != {link.drive for link in self._links}:
            raise ValueError(f"{self._name} has PMIs for other drives")
        for link in self._links:
            link.load(state[link.drive])
        self.follow()

    # For the links

    def commands(self, link: _Link) -> Commands:
        """Return what a PMI knows at this instant."""
        return Commands(
            self.read(link.base + table.CONTROL) & 0xFFFF,
            self.read(link.base + table.REFERENCE),
            self.read(link.base + table.ALPHA),
            self.read(link.base + table.INPUTS),
            self._parts.clock.runs,
            self._commanded(link.drive),
        )

    def read(self, register: int) -> int:
        """Return a register."""
        return int(self._parts.memory.read_now(self._bank, register))

    def show(self, register: int, value: int) -> None:
        """Write a register where that changes it."""
        memory = self._parts.memory
        if memory.read_now(self._bank, register) != value:
            memory.now_ns = self._parts.scheduler.now_ns
            memory.write_now(self._bank, value, self._parts.writer(self._name), register, WriteKind.OUTSIDE)

    def post(self, at_ns: int, key: EventKey, action: Callable[[int], None]) -> ScheduledEvent:
        """Post an event."""
        return self._parts.scheduler.at(at_ns, key, action)

    def _look(self, _: int) -> None:
        """Tell of a clock that does not run while tasks do."""
        self._looks = False
        if self._parts.clock.runs:
            return
        for link in self._links:
            if self._commanded(link.drive):
                self.show(link.base + table.LINK, table.NO_CLOCK)
        self._parts.tell_writes()


class _Link:
    """What connects one PMI."""

    def __init__(self, udc: UdcPmis, drive: str, pmi: Pmi, slot: int) -> None:
        self.drive, self.base = drive, table.DRIVE_B if drive == "B" else 0
        self.event: ScheduledEvent | None = None
        self._udc, self._pmi = udc, pmi
        self._key = EventKey(EventClass.IO, slot, f"pmi {drive}")
        self._next_ns = 0

    def scan_at(self, at_ns: int) -> None:
        """Let the PMI scan next at an instant. None is left out where the host is late (decision)."""
        self._next_ns = at_ns
        self.event = self._udc.post(at_ns, self._key, self._scan)

    def receive(self, now_ns: int) -> None:
        """Take the message of an instant."""
        udc = self._udc
        if udc.read(self.base + table.CONTROL) & table.COUNTER_RESET:
            for register in RAIL_COUNTERS[self.drive]:
                udc.show(register, 0)
        for register, value in self._pmi.feedback(now_ns).items():
            udc.show(self.base + register, value)
        count = udc.read(self.base + table.MESSAGES)
        udc.show(self.base + table.MESSAGES, count + 1 if 0 <= count < table.LAST_MESSAGE else 0)
        udc.show(self.base + table.LINK, 0)

    def state(self) -> dict[str, object]:
        """Return the PMI's state, and when it scans next (ns)."""
        next_ns = None if self.event is None else self._next_ns
        return {"pmi": self._pmi.state(), "next_ns": next_ns}

    def load(self, state: ModuleState) -> None:
        """Take over a state.

        Raises:
            ValueError: it is not that of a PMI.
        """
        try:
            self._pmi.restore(state["pmi"])
        except DriveError as error:
            raise ValueError(str(error)) from error
        if self.event is not None:
            self.event.cancel()
            self.event = None
        if state["next_ns"] is not None:
            self.scan_at(state["next_ns"])

    def _scan(self, now_ns: int) -> None:
        self.scan_at(now_ns + self._pmi.interrupt(now_ns, self._udc.commands(self)))
