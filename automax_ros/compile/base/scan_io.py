"""The interface between compiled tasks and their callers: the state, the accesses of a task, its ways to end."""

from __future__ import annotations

import enum
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from automax_ros.compile.base.layout import StateValue
from automax_ros.core.types import Latched, Value

StateValues = list[StateValue]


class ScanTooLong(Exception):
    """A scan executed more statements than allowed; ``line`` is the BASIC line that it had reached."""

    def __init__(self, line: int) -> None:
        super().__init__(f"more statements than a scan may execute, at line {line}")
        self.line = line


class ScanIo(Protocol):
    """The accesses of a compiled scan apart from its own state."""

    def latch(self) -> Latched:
        """Return the latched commons in the order of ``CompiledTask.latched``."""

    def forces(self) -> tuple[bool, ...]:
        """Return for each of ``CompiledTask.written`` whether a force holds it."""

    def commit(self, changes: list[tuple[int, Value]]) -> None:
        """Write back the changes of blocks as pairs of view and value; called only if there are any."""

    def read_now(self, view: int, element: int = 0) -> Value:
        """Read actual memory."""

    def write_now(self, view: int, value: Value, element: int = 0) -> None:
        """Write actual memory."""

    def log(self, line: int, code: int) -> None:
        """Log a run-time error."""

    def print_line(self, values: tuple[Value, ...], separators: str) -> None:
        """Print to the task's log; a separator (``,`` ``;`` or a blank) follows each value."""

    def errors_logged(self) -> bool:
        """Return whether the error log has an entry."""

    def clear_errors(self) -> None:
        """Clear the error log."""

    def set_event(self, name: str) -> None:
        """Set a software event."""

    def io_read(self, slot: int, register: int) -> tuple[int, int]:
        """Return a register of an I/O module, and the problem or 0."""

    def io_write(self, slot: int, register: int, value: int) -> int:
        """Write a register of an I/O module; return the problem or 0."""

    def minor_loop(self, inputs: tuple[Value | None, ...], records: list[Value] | None) -> Sequence[Value] | None:
        """Execute a scan of the drive's current minor loop.

        ``inputs`` are in the order of the block's declaration, None for one that has no default and is not programmed;
        ``records`` is a local DIAG_DATA, which the loop writes. Returns the outputs except DIAG_DATA in the order of
        the declaration, or None where none is written.
        """


class Suspension(enum.IntEnum):
    """Why a BASIC task gives up the Processor, and the meaning of the number after it."""

    END = 0
    """END: it continues at its next START EVERY; with 0 after it its run has ended."""
    STOP = 1
    """STOP: its run has ended."""
    DELAY = 2
    """It continues after this many ns."""
    EVENT = 3
    """It waits for the event of this index in ``Program.events``."""
    EMPTY = 4
    """It waits for a message of the channel of this number."""
    FULL = 5
    """It waits for room in the channel of this number."""
    ABSENT = 6
    """It waits for another task to open the channel of this number for input."""
    PORT = 7
    """It waits for a character of a port, for ever."""
    BUSY = 8
    """It has executed the most statements allowed before others get their turn."""


Wish = tuple[int, int]
"""A ``Suspension`` and its number, for which a BASIC task waits."""

MUST_WAIT = -1
"""Returned by an access to a channel in place of a problem where the task must wait."""


class BackgroundIo(ScanIo, Protocol):
    """The additional accesses of a BASIC task."""

    def start_every(self, period_ns: int) -> None:
        """Start a period after each of which the task continues, from now on."""

    def open_reader(self, number: int, types: str, depth: int) -> int:
        """Make this task the reader of a channel; return the problem or 0. ``types``: type characters, `.` for REAL."""

    def open_writer(self, number: int, types: str) -> int:
        """Open a channel for writing; return the problem, 0, or MUST_WAIT while it has no reader."""

    def receive(self, number: int) -> tuple[tuple[Value, ...], int]:
        """Remove the oldest message of a channel; return it and 0, or nothing and the problem or MUST_WAIT."""

    def send(self, number: int, message: tuple[Value, ...]) -> int:
        """Append a message to a channel; return 0, the problem, or MUST_WAIT where it is full."""


LineValues = tuple[int, tuple[StateValue, ...]]
"""A BASIC line to be executed next, and the values before it: the state's fields, then the latched commons."""
ScanLines = Callable[[StateValues, Any], Generator[LineValues, None, bool]]


@dataclass(frozen=True)
class LineForm:
    """A scan or a burst as a generator that yields before each BASIC line; ``lines`` are those that it can yield."""

    scan: ScanLines
    lines: frozenset[int]
