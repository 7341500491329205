"""Repeats the measurements that a recorded current minor loop task got from its 57C406, and compares its commands."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.drive.current_loop.signals import FMCR, RMCR, Command, Measured, Pulse, gate_numbers
from automax_ros.recordings.read.common_log import Entry
from automax_ros.runtime.scan.drive_record import (
    COMMAND_VIEW,
    MEASURED_VIEW,
    command_of,
    measured_of,
    time_of,
)
from automax_ros.runtime.scan.drives import NO_LINE
from automax_ros.runtime.time.scheduler import EventKey, PeriodicAction

DRIVES = frozenset({MEASURED_VIEW, COMMAND_VIEW})
"""The views of measurements and commands between a loop and its 57C406."""
_RELAYS = {0: "none", FMCR: "FMCR", RMCR: "RMCR"}


class RecordedDrive:
    """A 57C406 that returns the recorded measurements and keeps each command, to be compared.

    A scan that had none, since its task ran no loop then, sees no line (decision).
    """

    next_ns = None

    def __init__(self) -> None:
        """Create the drive, before the first scan."""
        self._measured = NO_LINE
        self._now_ns: int | None = None
        self._recorded: Command | None = None
        self._own: Command | None = None

    def begin(self, entries: Iterable[Entry]) -> None:
        """Begin a scan with its recorded measurement and command."""
        noted = [(view, element, int(value)) for view, element, value in entries]
        self._measured = measured_of(noted) or NO_LINE
        self._now_ns = time_of(noted)
        self._recorded = command_of(noted)
        self._own = None

    def port(self, slot: int) -> RecordedDrive:  # noqa: ARG002
        """Return itself, whatever slot an edited task names: the recording has one drive for each task."""
        return self

    def rack_ns(self, now_ns: int) -> int:
        """Return the recorded rack time of the scan."""
        return now_ns if self._now_ns is None else self._now_ns

    def initialise(self) -> None:
        """Do nothing: the effects of a 57C406 are in the recording."""

    def watch_speed(self, counts: int) -> None:
        """Do nothing: the measurements of the circuit are in the recording."""

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:
        """Do nothing: scans come from the recording."""

    def disarm(self) -> None:
        """Do nothing."""

    def measure(self, dig_slot: int) -> Measured:  # noqa: ARG002
        """Return the recorded measurement."""
        return self._measured

    def command(self, command: Command) -> None:
        """Keep the command of the replayed scan."""
        self._own = command

    def other(self) -> Iterator[tuple[str, str, str]]:
        """Yield the parts of the command that differ: name, recorded text, replayed text."""
        if self._own == self._recorded:
            return
        recorded, own = _texts(self._recorded), _texts(self._own)
        for name, text in recorded.items():
            if own[name] != text:
                yield name, text, own[name]


def _texts(command: Command | None) -> dict[str, str]:
    """Return a command in words, part by part."""
    texts = {
        title: "no command" if command is None else words(getattr(command, name))
        for name, (title, words) in _PARTS.items()
    }
    if command is not None and command.block:
        texts[_PULSES] += "; those that have begun end"
    return texts


def _pulse_text(pulse: Pulse) -> str:
    numbers = " and ".join(map(str, gate_numbers(pulse.gates))) or "nothing"
    return f"{numbers} at {_ms(pulse.after_ns)} for {_ms(pulse.length_ns)}"


def _pulses_text(pulses: tuple[Pulse, ...]) -> str:
    return ", ".join(map(_pulse_text, pulses)) or "none"


def _ms(time_ns: int) -> str:
    return f"{time_ns / NS_PER_MS:.6g} ms"


_PULSES = "gate pulses"
_KNOWN: dict[str, tuple[str, Callable[[Any], str]]] = {
    "next_ns": ("next interrupt", lambda time_ns: f"after {_ms(time_ns)}"),
    "relays": ("contactor", lambda relays: _RELAYS.get(relays, "FMCR and RMCR")),
    "pulses": (_PULSES, _pulses_text),
    "level": ("overcurrent level", lambda level: f"{level} %"),
    "block": ("end of open gate pulses", str),
}
_PARTS = {name: _KNOWN.get(name, (name, str)) for name in Command._fields}
"""The title of each part of a command, and the function that returns its text."""
