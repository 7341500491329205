"""A running task: latch, scan, commit, error log."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Mapping, Sequence
from typing import Any, Final

from automax_ros.compile.base.layout import Layout
from automax_ros.compile.base.scan_io import ScanTooLong, StateValues
from automax_ros.compile.compiler import CompiledTask, ScanSteps
from automax_ros.core.machine_code import mypyc_attr
from automax_ros.core.types import Value
from automax_ros.language.program import tunable_value
from automax_ros.language.tree.tree import Scope
from automax_ros.runtime.memory.image import Image
from automax_ros.runtime.memory.registers import NO_MODULES, Backplane
from automax_ros.runtime.memory.views import Memory
from automax_ros.runtime.scan.channels import ChannelAccess, Channels
from automax_ros.runtime.scan.drives import DriveAccess, Drives
from automax_ros.runtime.scan.error_log import LOG_NUMBERS, ErrorLog, LogEntry, snapshot_layout
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.scan.scan_in_progress import Begun, Progress, ReplayableReads, ScanInProgress
from automax_ros.runtime.scan.scan_record import ScanRecord, Status, Steps
from automax_ros.runtime.scan.task_io import OutcomeOf, RecordingIo, ScanMemory, TaskIo, at_once
from automax_ros.runtime.tasks.modeled_scan import scan_in_steps

__all__ = ["EVENT_TIMEOUT", "OVERLAP", "SCAN_TOO_LONG", "ScanRecord", "Status", "Task"]

SCAN_TOO_LONG = 7040
OVERLAP = 7070
EVENT_TIMEOUT = 7071
PRINTED_LINES = 1000
"""Lines of PRINT that a task keeps."""
_RUNNING: Final = Status.RUNNING
"""Kept as a constant, because each scan needs it and an enumeration's member is slow to get."""


@mypyc_attr(allow_interpreted_subclasses=True)
class Task:
    """A task in a rack: compiled functions and state. ``writer`` is its id in the write log; ``run`` starts it."""

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
        channels: ChannelAccess | None = None,
        drives: DriveAccess | None = None,
    ) -> None:
        """Install the task (2.4.5); without ``events``, ``channels`` and ``drives`` it gets its own."""
        self.memory = memory
        self._image: Image | None = memory if isinstance(memory, Image) else None
        self.writer, self.slot, self.priority = writer, slot, priority
        self.backplane, self.events = backplane, Events() if events is None else events
        self.channels: ChannelAccess = Channels() if channels is None else channels
        self._drives: DriveAccess = Drives() if drives is None else drives
        self.printed: deque[str] = deque(maxlen=PRINTED_LINES)
        self._recording = False
        self._scans: Generator[bool, None, None] | None = None
        self._replayable = ReplayableReads(memory)
        self._under_way: ScanInProgress | None = None
        self.install(compiled)
        memory.watch_forces(self._check_forces)

    def install(self, compiled: CompiledTask) -> None:
        """Install this or another program: state and error log are as at installation (2.4.5)."""
        self._put_down()
        self.compiled = compiled.holding(frozenset())
        self.forces: dict[str, Value] = {}
        self._forces_wait = False
        latched = [self.memory.view(name) for name in compiled.latched]
        self.plan, self._replayable.latched = self.memory.plan(latched), latched
        self.written = tuple(self.memory.view(name) for name in compiled.written)
        self._state: StateValues = compiled.layout.fresh()
        self._arrays = [position for position, field in enumerate(compiled.layout.fields) if field.is_array]
        self.errors = ErrorLog()
        self.status, self.scan_number = Status.STOPPED, 0
        self._forced = any(map(self.memory.is_forced, self.written))
        self._under_way = None
        self._bind()

    @property
    def name(self) -> str:
        """The task's name."""
        return self.compiled.program.name

    @property
    def period_ns(self) -> int:
        """The scan period, ns."""
        return self.compiled.program.period_ns

    @property
    def layout(self) -> Layout:
        """The layout of a snapshot."""
        return snapshot_layout(self.compiled)

    @property
    def state(self) -> StateValues:
        """The state, field by field as in ``compiled.layout``; get it again after each scan.

        While a modeled scan is in progress it is the state after the scan before.
        """
        self._put_down()
        return self._state

    def record_scans(self, *, on: bool = True) -> None:
        """Begin or stop keeping a record of each scan."""
        self._put_down()
        self._recording = on
        self._bind()

    def run(self, now_ns: int = 0) -> ScanRecord | None:
        """Put the task into RUN: blocks start again, the part before SCAN_LOOP executes. Returns scan 0, if kept."""
        self.heed_forces()
        self.compiled.layout.restart(self.state)
        self.status, self.scan_number = Status.RUNNING, 0
        record = self._begin_record(now_ns, 0, self._io)
        self.memory.now_ns = now_ns
        try:
            if self.compiled.startup(self.state, self._io):
                self.status = Status.ENDED
        except ScanTooLong as error:
            self.too_long(error)
        return record

    def scan(self, now_ns: int, skipped: int = 0) -> ScanRecord | None:
        """Execute one scan at an instant; ``skipped`` deadlines were missed before it. Returns its record, if kept."""
        if self.status is not _RUNNING:
            return None
        self.scan_number += 1
        record, noting = None, self._noting
        if noting is not None:
            noting.record = record = ScanRecord(now_ns, self.scan_number, skipped)
        if self._image is not None:  # the same object with its class known: a compiled attribute
            self._image.now_ns = now_ns
        else:
            self.memory.now_ns = now_ns
        if self._scans is None:
            self.heed_forces()
            scans = self.compiled.scans_forced if self._forced else self.compiled.scans
            self._scans = scans(self._state, self._io)
        try:
            for stopped in self._scans:  # a scan; next() would be looked up each time
                if stopped:
                    self.status = Status.ENDED
                break
        except BaseException as error:
            # The scans have stored the state and ended: the next one starts from it.
            self._scans = None
            if not isinstance(error, ScanTooLong):
                raise
            self.too_long(error)
        return record

    @property
    def is_done(self) -> bool:
        """Whether it has reached the end of its program, as only a BASIC task can: not by STOP."""
        return False

    @property
    def present_scan(self) -> int:
        """The number of the scan in progress, or of the last one."""
        return self.scan_number + (self._under_way is not None)

    @property
    def progress(self) -> Progress | None:
        """The progress of the modeled scan that is being executed; None if there is none."""
        return None if self._under_way is None else self._under_way.progress

    def scan_modeled(self, now_ns: int, skipped: int = 0, form: ScanSteps | None = None) -> Steps:
        """Execute one scan in steps; ``skipped`` deadlines were missed before it. Returns its record, if kept.

        It yields the ns that pass before the next memory access (with another ``form`` of the scan, what that yields)
        and is sent the time then, None if it is unchanged. State and number of the scan become the task's at its end;
        closed before that, it leaves them as they were (decision: what it has written stays written).
        """
        return scan_in_steps(self, now_ns, skipped, form)

    def begin_steps(self, now_ns: int, skipped: int, form: ScanSteps | None) -> Begun:
        """Begin a scan in steps; the task must be in RUN: see ``scan_modeled``."""
        self.heed_forces()
        self._put_down()
        self._replayable.begin()
        self._under_way = scan = ScanInProgress(now_ns, skipped, self._state[:], None, self._replayable)
        for position in self._arrays:  # the copy has its own
            array = scan.state[position]
            assert isinstance(array, list)
            scan.state[position] = array[:]
        if self.errors.count:
            scan.log = self.errors.copy()
        record = self._begin_record(now_ns, skipped, self._replayable_io) if self._recording else None
        self._begins(now_ns)
        return scan, record, (form or self._form_in_steps())(scan.state, self._replayable_io)

    def end_steps(self, outcome: Any) -> None:
        """End the scan in progress with the result of its compiled form: TRUE if the task executed STOP."""
        scan = self._under_way
        assert scan is not None
        self.scan_number += 1
        self._state, self._under_way = scan.state, None
        if self._forces_wait:
            self.heed_forces()
        if outcome:
            self._over(outcome, scan.began_ns)

    def give_up_steps(self) -> None:
        """Restore the task to its state before the scan in progress, without forces that wait.

        The garbage collector may abandon a scan at any point of the program.
        """
        scan, self._under_way = self._under_way, None
        self.errors = ErrorLog() if scan is None or scan.log is None else scan.log

    def resume_scan(self, progress: Progress) -> Steps:
        """Return a scan in steps with the progress of another: the last step of that was yielded (see ``progress``)."""
        steps = self.scan_modeled(progress["began_ns"], progress["skipped"])
        now_ns = self.memory.now_ns
        for number in range(progress["steps"]):
            next(steps)
            if not number:
                self._replayable.replay(progress["heard"], progress["latched_ns"])
        self._replayable.end_replay()
        self.memory.now_ns = now_ns
        return steps

    def stop(self) -> None:
        """Stop the task; its locals keep their values."""
        if self.status is Status.RUNNING:
            self.status = Status.STOPPED

    def fault(self, code: int, now_ns: int) -> ScanRecord | None:
        """Fault the task for an impossible scan, logged at SCAN_LOOP. Returns a record of that alone, if kept."""
        self.scan_number += 1
        record = self._begin_record(now_ns, 0, self._io)
        self._io.log(self.compiled.program.scan_loop_line, code)
        self.status = Status.FAULTED
        return record

    def log_error(self, line: int, code: int) -> None:
        """Log a run-time error of the scan in progress."""
        entry, scan = LogEntry(line, code, self.present_scan), self._under_way
        self.errors.add(entry)
        if scan is not None:
            if scan.own_errors is None:
                scan.own_errors = ErrorLog()
            scan.own_errors.add(entry)

    def clear_errors(self, *, inside: bool = False) -> None:
        """Clear the error log; if the operator does, what a scan in progress has logged remains (decision)."""
        scan = self._under_way
        if scan is None or inside:
            self.errors.clear()
            if scan is not None:
                scan.own_errors = None
        else:
            scan.log = None
            self.errors = scan.own_errors.copy() if scan.own_errors else ErrorLog()

    def snapshot(self) -> list[Value]:
        """Return the task's state as flat values, in the order of ``layout``."""
        errors = self.errors if self._under_way is None else self._under_way.log or ErrorLog()
        return [*self.compiled.layout.flatten(self.state), *errors.flatten()]

    def restore(self, values: list[Value]) -> None:
        """Restore a snapshot; ValueError if it does not fit the layout."""
        restored = self.compiled.layout.restore(values[:-LOG_NUMBERS])
        self.errors.restore([int(number) for number in values[-LOG_NUMBERS:]])
        self.state[:] = restored

    def value(self, name: str) -> Value | list[Value]:
        """Return a local, a tunable or a block's state by its name in the layout; KeyError if it has none."""
        return self.state[self.compiled.layout.index(name)]

    def tune(self, name: str, value: object) -> None:
        """Set a tunable, as the operator does (2.4.5); raises what ``tuning`` does."""
        position, fitting = self.compiled.layout.index(name), self.tuning(name, value)
        self.state[position] = fitting
        if self._under_way is not None:
            self._under_way.state[position] = fitting

    def tuning(self, name: str, value: object) -> int | float:
        """Return the value that a tunable would have if it were set (``tunable_value``, with its errors)."""
        return tunable_value(self.compiled.program.symbols[name], name, value)

    def hold(self, forces: Mapping[str, Value]) -> None:
        """Hold these simple locals, and no others, at values of their types; ``held`` has those in effect.

        A modeled scan in progress ends first, as it began (decision).
        """
        self.forces = dict(forces)
        self._forces_wait = True
        self.heed_forces()

    def why_not_forced(self, name: str, scope: Scope) -> str | None:  # noqa: ARG002
        """Return why a variable that the task declares in a scope cannot be forced; None if it can."""
        return None

    @property
    def held(self) -> dict[str, Value]:
        """The locals that are held in the next scan, with their values, by name."""
        layout, state = self.compiled.layout, self._state
        found: dict[str, Value] = {}
        for name in sorted(self.compiled.held):
            value = state[layout.index(name)]
            assert not isinstance(value, list)
            found[name] = value
        return found

    def lose_locals(self) -> None:
        """Set the locals to their values at installation, except forced ones and tunables."""
        self.compiled.layout.lose_locals(self.state, self.forces)

    def heed_forces(self) -> None:
        """Set forced locals to their values, and scan in the form that keeps them; during a scan do nothing."""
        if not self._forces_wait or self._under_way is not None:
            return
        self._forces_wait = False
        self._put_down()
        self.compiled = self.compiled.holding(frozenset(self.forces))
        for name, value in self.forces.items():
            self._state[self.compiled.layout.index(name)] = value

    def _check_forces(self) -> None:  # scan in the form that respects forces, or in the fast one
        self._put_down()
        self._forced = any(map(self.memory.is_forced, self.written))

    def waiting(self) -> list[int]:
        """Return, as numbers, the wait of a suspended task; a control-block task is never suspended."""
        return []

    def wait_again(self, numbers: Sequence[int]) -> None:
        """Restore what ``waiting`` returned; raise ValueError if a task cannot wait for that."""
        if numbers:
            raise ValueError(f"task {self.name} cannot wait: only a BASIC task can")

    def _put_down(self) -> None:  # the compiled scan stores the state that it holds
        if self._scans is not None:
            self._scans.close()
            self._scans = None

    def _begins(self, now_ns: int) -> None:
        self.memory.now_ns = now_ns

    def _form_in_steps(self) -> ScanSteps:
        return self.compiled.scan_steps_forced if self._forced else self.compiled.scan_steps

    def _over(self, outcome: Any, began_ns: int) -> None:  # noqa: ARG002
        self.status = Status.ENDED

    def _bind(self) -> None:
        self._io = self._make_io(self.memory, at_once)
        self._replayable_io = self._make_io(self._replayable, self._replayable.outcome_of)
        self._noting = self._io if isinstance(self._io, RecordingIo) else None

    def _make_io(self, memory: ScanMemory, outcome_of: OutcomeOf) -> TaskIo:
        return RecordingIo(self, memory, outcome_of) if self._recording else TaskIo(self, memory, outcome_of)

    def _begin_record(self, now_ns: int, skipped: int, io: TaskIo) -> ScanRecord | None:
        if not isinstance(io, RecordingIo):
            return None
        io.record = ScanRecord(now_ns, self.present_scan, skipped=skipped)
        return io.record

    def too_long(self, error: ScanTooLong) -> None:
        """Fault the task for a scan that takes too long."""
        (self._io if self._under_way is None else self._replayable_io).log(error.line, SCAN_TOO_LONG)
        self.status = Status.FAULTED
