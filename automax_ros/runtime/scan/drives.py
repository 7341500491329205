"""The 57C406 modules of a rack as current minor loop (CML) tasks use them: each interrupts, measures, fires gates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from automax_ros.drive.current_loop.signals import Command, Measured
from automax_ros.runtime.time.scheduler import EventKey, PeriodicAction

NO_LINE = Measured(0)
"""The measurement of a slot without a 57C406: nothing, so the loop sees no line and never runs (decision)."""


class DrivePort(Protocol):
    """One 57C406 with its drive, or a recording of one.

    A task arms it, is called at each interrupt, then reads the measurement and gives the command up to the next one.
    Without a command the interrupts continue at their present interval.
    """

    def initialise(self) -> None:
        """Give the registers 4136, 4137, 4138 and 4146 their defaults: the task is put into RUN (52.4 to 52.7)."""

    def watch_speed(self, counts: int) -> None:
        """Set up the hardware's overspeed circuit with a threshold, 4095 at full speed; 0 for none (52.1.5)."""

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:
        """Interrupt from ``first_ns`` on: ``due`` is called at each instant, with the order ``key`` among its scans."""

    def disarm(self) -> None:
        """Stop interrupting: gates and contactor relays are off at once. A second call does nothing."""

    @property
    def next_ns(self) -> int | None:
        """The instant of the next interrupt; None while it is not armed."""
        ...

    def measure(self, dig_slot: int) -> Measured:
        """Return the last interrupt's measurement, with present registers; ``dig_slot`` has the digital I/O module."""
        ...

    def command(self, command: Command) -> None:
        """Execute a command up to the next interrupt; its times count from the last one."""


class DriveAccess(Protocol):
    """Finds the 57C406 of a slot: a rack's are in ``Drives``, those of a recording in its replay."""

    def port(self, slot: int) -> DrivePort:
        """Return the 57C406 of a slot; without one, a port that measures no line."""
        ...

    def rack_ns(self, now_ns: int) -> int:
        """Return the rack time of an instant of the task's memory: a recording may have stamps of the wall clock."""
        ...


VoltageFeedback = Callable[[float, float], None]
"""Reports the armature voltage, V, of a drive on a line of a nominal voltage, V, to the 57C405 that is wired to it."""


class Drives:
    """The 57C406 modules of a rack by slot, and the 57C405 modules that are wired to their armatures."""

    def __init__(self) -> None:
        self._ports: dict[int, DrivePort] = {}
        self._voltages: dict[int, VoltageFeedback] = {}

    def attach(self, slot: int, port: DrivePort) -> None:
        """Register the module of a slot."""
        self._ports[slot] = port

    def rack_ns(self, now_ns: int) -> int:
        """Return the instant: it is one of rack time."""
        return now_ns

    def port(self, slot: int) -> DrivePort:
        """Return the 57C406 of a slot; without one, a port that measures no line."""
        return self._ports.get(slot, _NO_MODULE)

    def wire_voltage(self, slot: int, feedback: VoltageFeedback) -> None:
        """Wire the armature of the drive in a slot to the function that reports its voltage."""
        self._voltages[slot] = feedback

    def voltage(self, slot: int) -> VoltageFeedback | None:
        """Return the function that reports the armature voltage of the drive in a slot; None if nothing is wired."""
        return self._voltages.get(slot)


class _NoModule:
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
