"""A running task: latch, scan, commit, error log."""

from __future__ import annotations

import enum
import math
from collections import deque
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import cast

from automax_ros.compile.compiler import CompiledTask, ScanSteps
from automax_ros.compile.layout import Layout, Role, StateField
from automax_ros.compile.scan_io import ScanTooLong, StateValues
from automax_ros.core.kinds import WriteKind
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType, Latched, Value
from automax_ros.running.backplane import BUS_ERROR, NO_MODULES, Backplane
from automax_ros.running.error_log import LOG_FIELD, LOG_NUMBERS, ErrorLog, LogEntry
from automax_ros.running.events import Events
from automax_ros.running.printing import format_print
from automax_ros.running.views import Memory

SCAN_TOO_LONG = 7040
OVERLAP = 7070
PRINTED_LINES = 1000
"""Lines of PRINT that a task keeps."""


class Status(enum.Enum):
    """What a task is doing."""

    STOPPED = "stopped"
    RUNNING = "running"
    ENDED = "ended by STOP"
    FAULTED = "faulted"


_RUNNING = Status.RUNNING
"""A name of its own, since each scan asks for it and an enumeration's member is slow to get."""


@dataclass
class ScanRecord:
    """All that one scan saw and did; ``reads``, ``writes`` are (view, element, value), ``commits`` (view, value)."""

    time_ns: int
    scan: int
    latched: Latched = ()
    reads: list[tuple[int, int, Value]] = field(default_factory=list)
    writes: list[tuple[int, int, Value]] = field(default_factory=list)
    commits: list[tuple[int, Value]] = field(default_factory=list)
    errors: list[tuple[int, int]] = field(default_factory=list)
    skipped: int = 0
    duration_ns: int = 0


class TaskIo:
    """What a compiled scan touches: common memory through one task, its error log and its printed lines.

    The members are bound once, so that a scan pays for no more than the memory itself.
    """

    def __init__(self, task: Task) -> None:
        """Bind a task's memory."""
        memory = task.memory
        self.latch: Callable[[], Latched] = partial(memory.latch, task.plan)
        self.read_now = memory.read_now
        self._memory, self._writer, self._task = memory, task.writer, task
        self._backplane = task.backplane

    def commit(self, changes: list[tuple[int, Value]]) -> None:
        """Write back what blocks changed."""
        if changes:
            self._memory.commit(changes, self._writer)

    def write_now(self, view: int, value: Value, element: int = 0) -> None:
        """Write actual memory for a BASIC statement."""
        self._memory.write_now(view, value, self._writer, element, WriteKind.BASIC)

    def forces(self) -> tuple[bool, ...]:
        """Return which of the commons that blocks write a force holds."""
        return tuple(map(self._memory.is_forced, self._task.written))

    def log(self, line: int, code: int) -> None:
        """Log a run-time error of this scan."""
        self._task.errors.add(LogEntry(line, code, self._task.scan_number))

    def print_line(self, values: tuple[Value, ...], separators: str) -> None:
        """Print to the task's log."""
        self._task.printed.append(format_print(values, separators))

    def set_event(self, name: str) -> None:
        """Set a software event (SET)."""
        self._task.events.event(name).set(self._memory.now_ns)

    def errors_logged(self) -> bool:
        """Return whether the error log holds an entry (TST_ERRLOG@)."""
        return self._task.errors.count > 0

    def clear_errors(self) -> None:
        """Clear the error log (CLR_ERRLOG)."""
        self._task.errors.clear()

    def io_read(self, slot: int, register: int) -> tuple[int, int]:
        """Return a register's word and 0, or 0 and the bus error of a register that does not answer."""
        place = self._backplane.readable(slot, register)
        if place is None:
            return 0, BUS_ERROR
        return cast(int, self.read_now(*place)), 0

    def io_write(self, slot: int, register: int, value: int) -> int:
        """Write a register's word; return 0, or the bus error of a register that does not answer or take it."""
        place = self._backplane.writable(slot, register)
        if place is None:
            return BUS_ERROR
        view, element = place
        self.write_now(view, (value + 0x8000 & 0xFFFF) - 0x8000, element)
        return 0


class RecordingIo(TaskIo):
    """The same, noting everything in ``record``."""

    def __init__(self, task: Task) -> None:
        """Bind a task's memory and begin with an empty record."""
        super().__init__(task)
        self.record = ScanRecord(0, 0)
        self.latch = self._latch
        self.read_now = self._read_now
        self._plan = task.plan

    def _latch(self) -> Latched:
        self.record.latched = latched = self._memory.latch(self._plan)
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
        """Write back what blocks changed and note it."""
        self.record.commits = changes
        super().commit(changes)

    def log(self, line: int, code: int) -> None:
        """Log a run-time error and note it."""
        self.record.errors.append((line, code))
        super().log(line, code)


class Task:
    """One task in one rack: its compiled functions, its state, and its place in the rack.

    ``writer`` is the id under which the write log knows it. Nothing happens before ``run``.
    """

    def __init__(
        self,
        compiled: CompiledTask,
        memory: Memory,
        *,
        writer: int = 0,
        slot: int = 0,
        priority: int = 11,
        backplane: Backplane = NO_MODULES,
        events: Events | None = None,
    ) -> None:
        """Install the task: its state is as at installation (2.4.5)."""
        self.memory = memory
        self.writer = writer
        self.slot, self.priority = slot, priority
        self.backplane = backplane
        self.events = Events() if events is None else events
        self.printed: deque[str] = deque(maxlen=PRINTED_LINES)
        self._recording = False
        self._scans: Generator[bool, None, None] | None = None
        self.install(compiled)
        memory.watch_forces(self._look_at_forces)

    def install(self, compiled: CompiledTask) -> None:
        """Begin again, with this or another program: state and error log are as at installation (2.4.5)."""
        self._put_down()
        self.compiled = compiled
        self.plan = self.memory.plan([self.memory.view(name) for name in compiled.latched])
        self.written = tuple(self.memory.view(name) for name in compiled.written)
        self._state: StateValues = compiled.layout.fresh()
        self.errors = ErrorLog()
        self.status = Status.STOPPED
        self.scan_number = 0
        self._forced = any(map(self.memory.is_forced, self.written))
        self._io: TaskIo = self._make_io()

    @property
    def name(self) -> str:
        """The task's name."""
        return self.compiled.program.name

    @property
    def period_ns(self) -> int:
        """Scan period."""
        return self.compiled.program.period_ns

    @property
    def layout(self) -> Layout:
        """The layout of a snapshot."""
        return snapshot_layout(self.compiled)

    @property
    def state(self) -> StateValues:
        """The state, field by field as ``compiled.layout`` has it.

        Between scans the compiled scan holds it, so ask again after each scan: a list got earlier is out of date.
        """
        self._put_down()
        return self._state

    def record_scans(self, *, on: bool = True) -> None:
        """Begin or end to keep a record of each scan."""
        self._put_down()
        self._recording = on
        self._io = self._make_io()

    def run(self, now_ns: int = 0) -> ScanRecord | None:
        """Put the task into RUN: blocks start again, the statements before SCAN_LOOP execute once.

        Returns the record of that part, as scan 0, if scans are recorded.
        """
        self.compiled.layout.restart(self.state)
        self.status, self.scan_number = Status.RUNNING, 0
        record = self._begin_record(now_ns, 0)
        self.memory.now_ns = now_ns
        try:
            if self.compiled.startup(self.state, self._io):
                self.status = Status.ENDED
        except ScanTooLong as error:
            self._too_long(error)
        return record

    def scan(self, now_ns: int, skipped: int = 0) -> ScanRecord | None:
        """Execute one scan at an instant; ``skipped`` deadlines were missed before it. Returns its record, if kept."""
        if self.status is not _RUNNING:
            return None
        self.scan_number += 1
        record = self._begin_record(now_ns, skipped) if self._recording else None
        self.memory.now_ns = now_ns
        if self._scans is None:
            scans = self.compiled.scans_forced if self._forced else self.compiled.scans
            self._scans = scans(self._state, self._io)
        try:
            if next(self._scans):
                self.status = Status.ENDED
        except BaseException as error:
            # The scans have stored the state and ended: the next one begins from it.
            self._scans = None
            if not isinstance(error, ScanTooLong):
                raise
            self._too_long(error)
        return record

    def scan_modeled(
        self, now_ns: int, skipped: int = 0, form: ScanSteps | None = None
    ) -> Generator[int, int | None, ScanRecord | None]:
        """Execute one scan in steps; ``skipped`` deadlines were missed before it. Returns its record, if kept.

        Yields the ns that pass before the next memory access and is sent the time then, None for the time it is; with
        another ``form`` of the scan, what that yields. The state is whole again when the generator has ended.
        """
        if self.status is not Status.RUNNING:
            return None
        self.scan_number += 1
        record = self._begin_record(now_ns, skipped)
        self.memory.now_ns = now_ns
        if form is None:
            form = self.compiled.scan_steps_forced if self._forced else self.compiled.scan_steps
        steps = form(self.state, self._io)
        try:
            while True:
                later = yield next(steps)
                if later is not None:
                    self.memory.now_ns = later
        except StopIteration as end:
            if end.value:
                self.status = Status.ENDED
        except ScanTooLong as error:
            self._too_long(error)
        return record

    def stop(self) -> None:
        """Stop the task; its locals keep their values."""
        if self.status is Status.RUNNING:
            self.status = Status.STOPPED

    def overlap(self) -> None:
        """Fault the task: a scan was still under way when the next one was due (code 14, J2-3106-1 p. C-1)."""
        self.errors.add(LogEntry(self.compiled.program.scan_loop_line, OVERLAP, self.scan_number))
        self.status = Status.FAULTED

    def snapshot(self) -> list[Value]:
        """Return the task's state as flat values, in the order of ``layout``."""
        return [*self.compiled.layout.flatten(self.state), *self.errors.flatten()]

    def restore(self, values: list[Value]) -> None:
        """Take a snapshot over.

        Raises:
            ValueError: it does not fit the layout.
        """
        state, log = values[:-LOG_NUMBERS], values[-LOG_NUMBERS:]
        restored = self.compiled.layout.restore(state)
        self.errors.restore([int(number) for number in log])
        self.state[:] = restored

    def value(self, name: str) -> Value | list[Value]:
        """Return a local, a tunable or a block's state by its name in the layout.

        Raises:
            KeyError: the layout has no such field.
        """
        return self.state[self.compiled.layout.index(name)]

    def tune(self, name: str, value: object) -> None:
        """Set a tunable, as the operator does (2.4.5).

        Raises:
            KeyError: the task has no tunable of that name.
            ValueError: the value lies outside its limits or is not of its type.
        """
        self.state[self.compiled.layout.index(name)] = self.tuning(name, value)

    def tuning(self, name: str, value: object) -> int | float:
        """Return what a tunable would hold if it were set to a value; nothing is set.

        Raises:
            KeyError: the task has no tunable of that name.
            ValueError: the value lies outside its limits or is not of its type.
        """
        symbol = self.compiled.program.symbols[name]
        if symbol.tuning is None:
            raise KeyError(name)
        low, high = symbol.tuning.low, symbol.tuning.high
        assert not isinstance(low, str)
        assert not isinstance(high, str)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise ValueError(f"{name} cannot be {value!r}: that is not a number")
        # A limit such as 0.1 is held in single precision too, so the stored value is what must lie inside.
        stored = stored_real(float(value))[0] if symbol.type is DataType.REAL else int(value)
        if symbol.type is not DataType.REAL and stored != value:
            raise ValueError(f"{name} = {value} is not a whole number")
        if not low <= stored <= high:
            raise ValueError(f"{name} = {value:.8g} lies outside {low:.8g} to {high:.8g}")
        return stored

    def _look_at_forces(self) -> None:
        """Scan from now on in the form that heeds forces, or in the quick one."""
        self._put_down()
        self._forced = any(map(self.memory.is_forced, self.written))

    def waiting(self) -> list[int]:
        """Return, as numbers, what a suspended task waits for; a control-block task is never suspended."""
        return []

    def wait_again(self, numbers: Sequence[int]) -> None:
        """Take over what ``waiting`` gave; ValueError where a task cannot wait for that."""
        if numbers:
            raise ValueError(f"task {self.name} cannot wait: it is no BASIC task")

    def _make_io(self) -> TaskIo:
        return RecordingIo(self) if self._recording else TaskIo(self)

    def _put_down(self) -> None:
        """Let the compiled scan store the state that it holds."""
        if self._scans is not None:
            self._scans.close()
            self._scans = None

    def _begin_record(self, now_ns: int, skipped: int) -> ScanRecord | None:
        """Return the new record of a scan, or None if none is kept."""
        if not isinstance(self._io, RecordingIo):
            return None
        self._io.record = ScanRecord(now_ns, self.scan_number, skipped=skipped)
        return self._io.record

    def _too_long(self, error: ScanTooLong) -> None:
        self._io.log(error.line, SCAN_TOO_LONG)
        self.status = Status.FAULTED


def snapshot_layout(compiled: CompiledTask) -> Layout:
    """Return the layout of a task's snapshots: the state, then the error log."""
    log = StateField(LOG_FIELD, DataType.DOUBLE, Role.LOG, 0, LOG_NUMBERS, is_array=True)
    return Layout((*compiled.layout.fields, log))
