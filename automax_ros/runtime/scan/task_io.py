"""Access of a task's compiled functions to common memory, registers, the error log and printed lines."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol, cast

from automax_ros.compile.base.functions import text_of
from automax_ros.core.kinds import WriteKind
from automax_ros.core.machine_code import mypyc_attr
from automax_ros.core.types import Latched, Value
from automax_ros.runtime.memory.image import Image
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.registers import BUS_ERROR, Backplane
from automax_ros.runtime.memory.views import CellCommit, LatchPlan
from automax_ros.runtime.scan.error_log import ErrorLog
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.scan.scan_record import ScanRecord

PRINT_ZONE = 14
"""Columns of a zone of PRINT; a comma advances to the next one (decision)."""
Call = Callable[[], Any]
OutcomeOf = Callable[[Call], Any]
"""Returns the result of a call outside the task, or its result when the scan was executed first."""


def at_once(call: Call) -> Any:
    """Return the result of a call."""
    return call()


class Host(Protocol):
    """The task of a ``TaskIo``; ``plan`` are the views that a scan latches, ``written`` those that its blocks write."""

    writer: int
    backplane: Backplane
    events: Events
    plan: LatchPlan
    written: tuple[int, ...]
    errors: ErrorLog
    printed: deque[str]

    def log_error(self, line: int, code: int) -> None: ...  # noqa: D102

    def clear_errors(self, *, inside: bool = False) -> None: ...  # noqa: D102


class ScanMemory(Protocol):
    """The memory of a scan: the four operations of ``Memory``."""

    @property
    def now_ns(self) -> int: ...  # noqa: D102

    def latch(self, plan: LatchPlan) -> Latched: ...  # noqa: D102

    def commit(self, changes: Sequence[tuple[int, Value]], writer: int) -> None: ...  # noqa: D102

    def read_now(self, view: int, element: int = 0) -> Value: ...  # noqa: D102

    def write_now(  # noqa: D102
        self, view: int, value: Value, writer: int, element: int = 0, kind: WriteKind = WriteKind.BASIC
    ) -> None: ...

    def is_forced(self, view: int) -> bool: ...  # noqa: D102


def register_read(
    backplane: Backplane, read_now: Callable[[int, int], Value], slot: int, register: int
) -> tuple[int, int]:
    """Return a register's word by ``read_now`` and 0, or 0 and the bus error of one that does not answer."""
    place = backplane.readable(slot, register)
    if place is None:
        return 0, BUS_ERROR
    view, element = place
    return cast(int, read_now(view, element)), 0


def register_written(
    backplane: Backplane, write_now: Callable[[int, Value, int], None], slot: int, register: int, value: int
) -> int:
    """Write a register's 16 bits by ``write_now``; return 0, or the bus error of one that cannot be written."""
    place = backplane.writable(slot, register)
    if place is None:
        return BUS_ERROR
    view, element = place
    write_now(view, (value + 0x8000 & 0xFFFF) - 0x8000, element)
    return 0


def format_print(values: tuple[Value, ...], separators: str) -> str:
    """Return a line of PRINT: a comma advances to the next zone of 14 columns, a semicolon joins (decision)."""
    line = ""
    for value, separator in zip(values, separators, strict=True):
        line += text_of(value)
        if separator == ",":
            line = line.ljust((len(line) // PRINT_ZONE + 1) * PRINT_ZONE)
    return line


MinorLoop = Callable[[tuple[Any, ...], list[Value] | None], Sequence[Value] | None]
"""Executes the current minor loop of a drive with its inputs and a local DIAG_DATA; None if it writes no outputs."""


def _no_loop(inputs: tuple[Any, ...], records: list[Value] | None) -> Sequence[Value] | None:  # noqa: ARG001
    return None


@mypyc_attr(allow_interpreted_subclasses=True)
class TaskIo:
    """Access of a compiled scan to memory, error log and printed lines; members are bound once, so that it is fast."""

    def __init__(self, task: Host, memory: ScanMemory, outcome_of: OutcomeOf = at_once) -> None:
        self.latch: Callable[[], Latched] = (
            memory.latching(task.plan) if isinstance(memory, Image) else partial(memory.latch, task.plan)
        )
        self.read_now = memory.read_now
        self._common = memory if isinstance(memory, CommonMemory) else None
        self.cell_commit: CellCommit | None = None if self._common is None else self._common.committing()
        self._memory, self._writer, self._task = memory, task.writer, task
        self._backplane, self._outcome_of = task.backplane, outcome_of
        self.minor_loop: MinorLoop = _no_loop

    def commit(self, changes: list[tuple[int, Value]]) -> None:
        """Write back the values that blocks changed."""
        if not changes:
            return
        common = self._common
        if common is not None:  # the same object with its class known: a compiled call
            common.commit(changes, self._writer)
        else:
            self._memory.commit(changes, self._writer)

    def write_now(self, view: int, value: Value, element: int = 0) -> None:
        """Write actual memory for a BASIC statement."""
        self._memory.write_now(view, value, self._writer, element, WriteKind.BASIC)

    def forces(self) -> tuple[bool, ...]:
        """Return for each common that blocks write whether a force holds it."""
        return tuple(map(self._memory.is_forced, self._task.written))

    def log(self, line: int, code: int) -> None:
        """Log a run-time error of this scan."""
        self._task.log_error(line, code)

    def print_line(self, values: tuple[Value, ...], separators: str) -> None:
        """Print to the task's log."""
        self._task.printed.append(format_print(values, separators))

    def set_event(self, name: str) -> None:
        """Set a software event (SET)."""
        self._outcome_of(lambda: self._task.events.event(name).set(self._memory.now_ns))

    def errors_logged(self) -> bool:
        """Return whether the error log holds an entry (TST_ERRLOG@)."""
        return bool(self._outcome_of(lambda: self._task.errors.count > 0))

    def clear_errors(self) -> None:
        """Clear the error log (CLR_ERRLOG)."""
        self._task.clear_errors(inside=True)

    def io_read(self, slot: int, register: int) -> tuple[int, int]:
        """Return a register's word and 0, or 0 and the bus error of a register that does not answer."""
        return register_read(self._backplane, self.read_now, slot, register)

    def io_write(self, slot: int, register: int, value: int) -> int:
        """Write a register's word; return 0, or the bus error of a register that does not answer or is not writable."""
        return register_written(self._backplane, self.write_now, slot, register, value)


@mypyc_attr(allow_interpreted_subclasses=True)
class RecordingIo(TaskIo):
    """The same, with everything noted in ``record``."""

    def __init__(self, task: Host, memory: ScanMemory, outcome_of: OutcomeOf = at_once) -> None:
        super().__init__(task, memory, outcome_of)
        self.record = ScanRecord(0, 0)
        self.latch = self._latch
        self.read_now = self._read_now
        self.cell_commit = None  # commits are noted
        self._plan = task.plan
        self._image: Image | None = memory if isinstance(memory, Image) else None
        self._latched = memory.latching(task.plan) if isinstance(memory, Image) else None

    def _latch(self) -> Latched:
        record, image, latch = self.record, self._image, self._latched
        if image is None or latch is None:
            record.time_ns = self._memory.now_ns
            record.latched = latched = self._memory.latch(self._plan)
        else:  # the same object with its class known: a compiled attribute
            record.time_ns = image.now_ns
            record.latched = latched = latch()
        return latched

    def _read_now(self, view: int, element: int = 0) -> Value:
        value = self._memory.read_now(view, element)
        self.record.reads.append((view, element, value))
        return value

    def write_now(self, view: int, value: Value, element: int = 0) -> None:
        """Write actual memory and note it."""
        self.record.writes.append((view, element, value))
        super().write_now(view, value, element)

    def commit(self, changes: list[tuple[int, Value]]) -> None:
        """Write back the values that blocks changed and note them."""
        self.record.commits = changes
        super().commit(changes)

    def log(self, line: int, code: int) -> None:
        """Log a run-time error and note it."""
        self.record.errors.append((line, code))
        super().log(line, code)
