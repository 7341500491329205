"""The PMIs of a UDC in a running rack: their scans, and their exchange with the dual port.

A PMI scans at interrupts of its own and then sees the command registers as they are (decision). The UDC writes the
feedback at the start of each of its scans, so that it is fresh for its tasks (S-3056 p. 4-8), and counts the message.
Without the common clock nothing is exchanged, and the communication status shows that as long as a task is in RUN; STOP
ALL and a power cycle leave feedback and status unchanged (2.4.5).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from automax_ros.drive.base.errors import DriveError
from automax_ros.drive.pmi import registers as table
from automax_ros.drive.pmi.pmi import Commands, Pmi
from automax_ros.rack.modules.io_module import OwnRegisters
from automax_ros.rack.modules.module import ModuleState
from automax_ros.rack.tasks.installation import RackServices
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.udc import RAIL_COUNTERS
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent


class UdcPmis:
    """The PMIs of one UDC: one for each drive that has a plant with a motor."""

    def __init__(
        self, config: ModuleConfig, parts: RackServices, own: OwnRegisters, commanded: Callable[[str], bool]
    ) -> None:
        """Connect the PMIs; ``commanded`` returns whether a task that commands a drive scans."""
        plants = config.plants
        self._name, self._parts, self._commanded = config.name, parts, commanded
        self.read, self.show, self.post = own.read, own.show, parts.scheduler.at
        self._key = EventKey(EventClass.IO, config.slot, "link")
        self._posted = False
        self._links = [
            _Link(self, drive, Pmi(parts.plants[plant.name], plant.motor_overload_ratio), config.slot)
            for drive, plant in sorted(plants.items())
            if plant.name in parts.plants
        ]

    def begin(self) -> None:
        """Start the scans of the PMIs; those that scan already continue."""
        for link in self._links:
            if link.event is None:
                self.show(link.base + table.LINK, table.NO_CLOCK)
                link.scan_at(self._parts.scheduler.now_ns)

    def exchange(self, now_ns: int) -> None:
        """Write the messages of the PMIs at the start of a scan of the UDC."""
        for link in self._links:
            link.receive(now_ns)
        if self._links:
            self._parts.report_writes()

    def follow(self) -> None:
        """Check the common clock when the present change is complete, still at this instant."""
        if self._links and not self._posted:
            self._posted = True
            self.post(self._parts.scheduler.now_ns, self._key, self._check)

    def state(self) -> dict[str, object]:
        """Return the state of each PMI by its drive."""
        return {link.drive: link.state() for link in self._links}

    def load(self, state: Mapping[str, ModuleState]) -> None:
        """Restore a state; ValueError if it is that of other drives, or not one of PMIs."""
        if set(state) != {link.drive for link in self._links}:
            raise ValueError(f"{self._name} has PMIs for other drives")
        for link in self._links:
            link.load(state[link.drive])
        self.follow()

    # For the links

    def commands(self, link: _Link) -> Commands:
        """Return the commands and conditions that a PMI reads at this instant."""
        return Commands(
            self.read(link.base + table.CONTROL) & 0xFFFF,
            self.read(link.base + table.REFERENCE),
            self.read(link.base + table.ALPHA),
            self.read(link.base + table.INPUTS),
            self._parts.clock.runs,
            self._commanded(link.drive),
        )

    def _check(self, _: int) -> None:
        """Show that the clock does not run while tasks do."""
        self._posted = False
        if self._parts.clock.runs:
            return
        for link in self._links:
            if self._commanded(link.drive):
                self.show(link.base + table.LINK, table.NO_CLOCK)
        self._parts.report_writes()


class _Link:
    def __init__(self, udc: UdcPmis, drive: str, pmi: Pmi, slot: int) -> None:
        self.drive, self.base = drive, table.DRIVE_B if drive == "B" else 0
        self.event: ScheduledEvent | None = None
        self._udc, self._pmi = udc, pmi
        self._key = EventKey(EventClass.IO, slot, f"pmi {drive}")
        self._next_ns = 0

    def scan_at(self, at_ns: int) -> None:
        """Schedule the PMI's next scan. None is left out if the host is late (decision)."""
        self._next_ns = at_ns
        self.event = self._udc.post(at_ns, self._key, self._scan)

    def receive(self, now_ns: int) -> None:
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
        next_ns = None if self.event is None else self._next_ns
        return {"pmi": self._pmi.state(), "next_ns": next_ns}

    def load(self, state: ModuleState) -> None:
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
