"""The drive's part of a scan record: the measurement of its 57C406 at an interrupt, and the command of the loop.

Both are among the reads of the scan's record, under views that no rack has, one whole number per element; a number that
has its usual value is left out (decision: a drive at rest then takes some five numbers per scan).
"""

from __future__ import annotations

from collections.abc import Iterable

from automax_ros.core.ticks import NS_PER_S
from automax_ros.drive.current_loop.signals import Command, Measured, Pulse

MEASURED_VIEW = 0xFFF0
"""The view of the measurement; the element is the place in ``Measured``. The rack time follows: s, then ns."""
COMMAND_VIEW = 0xFFEF
"""The view of the command: first the fields of ``Command`` without the pulses, then three numbers per pulse."""
MEASURED_NAMES = (*Measured._fields, "time s", "time ns")
COMMAND_NAMES = tuple(name for name in Command._fields if name != "pulses")
MOST_PULSES = 16
"""Most gate windows of one command that are recorded (decision: six SCRs, each as first and as second, are twelve)."""
MEASURED_NUMBERS = len(MEASURED_NAMES)
COMMAND_NUMBERS = len(COMMAND_NAMES) + MOST_PULSES * len(Pulse._fields)

Noted = tuple[int, int, int]
"""View, element, number."""

_PULSE = len(Pulse._fields)
_SECONDS, _REST = len(Measured._fields), len(Measured._fields) + 1
_USUAL = tuple(int(Measured._field_defaults.get(name, 0)) for name in Measured._fields)
_USUAL_COMMAND = tuple(int(Command._field_defaults.get(name, 0)) for name in COMMAND_NAMES)
_FIRST_PULSE = len(COMMAND_NAMES)


def noted_measured(measured: Measured) -> list[Noted]:
    """Return the numbers to note of a measurement; the first is always noted, so that there is one."""
    noted: list[Noted] = [(MEASURED_VIEW, 0, measured[0])]
    for place, value in enumerate(measured):
        if place and value != _USUAL[place]:
            noted.append((MEASURED_VIEW, place, value))
    return noted


def noted_time(now_ns: int) -> list[Noted]:
    """Return the numbers to note of rack time: the stamp of a scan may be one of the wall clock."""
    seconds, rest = divmod(now_ns, NS_PER_S)
    return [(MEASURED_VIEW, _SECONDS, seconds), (MEASURED_VIEW, _REST, rest)]


def noted_command(command: Command) -> list[Noted]:
    """Return the numbers to note of a command; the first is always noted."""
    numbers = [command.next_ns, command.relays, command.level, int(command.block), int(command.ok)]
    for pulse in command.pulses[:MOST_PULSES]:
        numbers += pulse
    noted: list[Noted] = []
    for place, value in enumerate(numbers):
        if not place or value != (_USUAL_COMMAND[place] if place < _FIRST_PULSE else 0):
            noted.append((COMMAND_VIEW, place, value))
    return noted


def measured_of(noted: Iterable[Noted]) -> Measured | None:
    """Return the noted measurement; None if there is none."""
    numbers = _of_view(MEASURED_VIEW, noted)
    if 0 not in numbers:
        return None
    return Measured(*(numbers.get(place, usual) for place, usual in enumerate(_USUAL)))


def time_of(noted: Iterable[Noted]) -> int | None:
    """Return the noted rack time in ns; None if there is none."""
    numbers = _of_view(MEASURED_VIEW, noted)
    return numbers[_SECONDS] * NS_PER_S + numbers.get(_REST, 0) if _SECONDS in numbers else None


def command_of(noted: Iterable[Noted]) -> Command | None:
    """Return the noted command; None if there is none."""
    numbers = _of_view(COMMAND_VIEW, noted)
    if not numbers:
        return None
    fields = {
        name: type(Command._field_defaults.get(name, 0))(numbers.get(place, _USUAL_COMMAND[place]))
        for place, name in enumerate(COMMAND_NAMES)
    }
    starts = range(_FIRST_PULSE, max(numbers) + 1, _PULSE)
    pulses = tuple(Pulse(*(numbers.get(start + item, 0) for item in range(_PULSE))) for start in starts)
    return Command(**fields, pulses=pulses)


def _of_view(view: int, noted: Iterable[Noted]) -> dict[int, int]:
    return {element: value for entry_view, element, value in noted if entry_view == view}
