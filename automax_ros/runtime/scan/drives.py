"""The 57C406 modules of a rack as current minor loop (CML) tasks know them: each interrupts, measures and fires gates.

The module fulfils ``DrivePort`` and attaches itself; a replay fulfils it with what was recorded.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from automax_ros.drive.current_loop.signals import Command, Measured
from automax_ros.runtime.time.scheduler import EventKey, PeriodicAction

NO_LINE = Measured(0)
"""What a slot without a 57C406 measures: nothing, so the loop sees no line and never runs (decision)."""


class DrivePort(Protocol):
    """One 57C406 with the drive that it controls.

    A task arms it, is called at each interrupt, and there asks what was measured and says what shall happen up to the
    next. Without a command the interrupts go on at the interval that they have.
    """

    def initialise(self) -> None:
        """Give the registers 4136, 4137, 4138 and 4146 their defaults: the task is put into RUN (52.4 to 52.7)."""
        ...

    def watch_speed(self, counts: int) -> None:
        """Set up the hardware's overspeed circuit with a threshold, 4095 at full speed; 0 for none (52.1.5)."""
        ...

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:
        """Interrupt at ``first_ns`` and from then on.

        At each interrupt ``due`` is called with its instant, in its place ``key`` among the scans of that instant.
        """
        ...

    def disarm(self) -> None:
        """Interrupt no more: gates and contactor relays are off at once. A second time this does nothing."""
        ...

    @property
    def next_ns(self) -> int | None:
        """When the next interrupt comes, None while it is not armed."""
        ...

    def measure(self, dig_slot: int) -> Measured:
        """Return what was measured at the last interrupt, and how registers and inputs stand.

        Inputs and relays are those of the drive digital I/O module in ``dig_slot``.
        """
        ...

    def command(self, command: Command) -> None:
        """Carry out what shall happen up to the next interrupt; its times count from the last one."""
        ...


class DriveAccess(Protocol):
    """Finds the 57C406 of a slot: a rack's are in ``Drives``, those of a recording in its replay."""

    def port(self, slot: int) -> DrivePort:
        """Return the 57C406 of a slot; without one, what measures no line."""
        ...

    def rack_ns(self, now_ns: int) -> int:
        """Return the rack time of an instant as the task's memory has it: a recording may have stamps of the day."""
        ...


VoltageFeedback = Callable[[float, float], None]
"""Shows the armature voltage, V, of a drive on a line of a nominal voltage, V: the 57C405 that is wired to it."""


class Drives:
    """The 57C406 modules of a rack by slot, and the 57C405 modules that are wired to their armatures."""

    def __init__(self) -> None:
        """Begin with none."""
        self._ports: dict[int, DrivePort] = {}
        self._voltages: dict[int, VoltageFeedback] = {}

    def attach(self, slot: int, port: DrivePort) -> None:
        """Take the module of a slot."""
        self._ports[slot] = port

    def rack_ns(self, now_ns: int) -> int:
        """Return the instant: it is one of rack time."""
        return now_ns

    def port(self, slot: int) -> DrivePort:
        """Return the 57C406 of a slot; without one, what measures no line."""
        return self._ports.get(slot, _NO_MODULE)

    def wire_voltage(self, slot: int, feedback: VoltageFeedback) -> None:
        """Wire the armature of the drive in a slot to what shows its voltage."""
        self._voltages[slot] = feedback

    def voltage(self, slot: int) -> VoltageFeedback | None:
        """Return what shows the armature voltage of the drive in a slot, None where nothing is wired."""
        return self._voltages.get(slot)


class _NoModule:
    """What stands where no 57C406 does: it neither interrupts nor measures."""

    next_ns = None

    def initialise(self) -> None:
        pass

    def watch_speed(self, counts: int) -> None:
        pass

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:
        pass

    def disarm(self) -> None:
        pass

    def measure(self, dig_slot: int) -> Measured:  # noqa: ARG002
        return NO_LINE

    def command(self, command: Command) -> None:
        pass


_NO_MODULE = _NoModule()
