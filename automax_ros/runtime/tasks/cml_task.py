"""The task of a DC drive: its scans begin at the interrupts of a 57C406, and its first block is the current minor loop.

The loop (``drive/current_loop``) is a part of the task's state. Measurement and command of the 57C406 are noted in the
record of a scan (``drive_record``), so that it can be executed again without the drive. The loop's time is that of the
latch (decision: in modeled execution a scan latches later than its interrupt).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from automax_ros.compile.compiler import CompiledTask, ScanSteps
from automax_ros.core.types import Latched, Value
from automax_ros.drive.current_loop.inputs import INPUTS, Inputs
from automax_ros.drive.current_loop.minor_loop import NUMBERS, CurrentMinorLoop
from automax_ros.drive.current_loop.outputs import PAGE_NUMBER, SIZE, Record, next_entry_index, page_of, writes
from automax_ros.drive.current_loop.signals import Command, Measured
from automax_ros.language.program import BoundCall
from automax_ros.language.tree.tree import Reference, Scope
from automax_ros.runtime.scan.drive_record import noted_command, noted_measured, noted_time
from automax_ros.runtime.scan.drives import DrivePort
from automax_ros.runtime.scan.error_log import LOG_NUMBERS
from automax_ros.runtime.scan.scan_in_progress import Begun
from automax_ros.runtime.scan.scan_record import ScanRecord, Status
from automax_ros.runtime.scan.task_io import OutcomeOf, RecordingIo, ScanMemory, TaskIo
from automax_ros.runtime.tasks.task import Task

_TRUE_INPUTS = ("SPEED_FDBK", "OSV_FDBK")
"""Inputs on which a force has no effect (52.1.5): the loop gets the value under it."""
_SCR_TEST = "BAD_SCR_OUT"
"""The output that enables the shorted SCR test if it is programmed (52.3.1)."""
_RECORDS = "DIAG_DATA"
_new = tuple.__new__
"""Makes a named tuple like a plain tuple: its own constructor takes twice the time."""
_FRESH = CurrentMinorLoop().numbers()
_NOTHING = [0.0] * NUMBERS
"""The numbers in a snapshot of a loop that has not scanned, as every block state of an installation is 0 (decision)."""


Under = tuple[int, int, Value]
"""An input of the loop that a force holds: its place in ``Inputs``, its view, and the value under the force."""
Sensed = tuple[int, Measured, Sequence[Under]]
"""Rack time of a scan, the measurement, and the values under forces."""


class _LoopScans:
    def __init__(self, task: CmlTask, io: TaskIo, memory: ScanMemory, outcome_of: OutcomeOf) -> None:
        self._task, self._io, self._memory, self._outcome_of = task, io, memory, outcome_of
        self._recording = io if isinstance(io, RecordingIo) else None
        self._latched_ns = 0
        self._command = Command(0)
        self._initialised = False
        self._take_latch = io.latch
        io.latch = self._latch_at

    def scan(self, inputs: tuple[Any, ...], records: list[Value] | None) -> Sequence[Value] | None:
        """Execute a scan of the loop; ``records`` is a local DIAG_DATA. Returns the other outputs, if written."""
        task, recording = self._task, self._recording
        now_ns, measured, under = self._outcome_of(self._sense)
        if type(measured) is not Measured:
            measured = Measured(*measured)
        for place, view, value in under:
            inputs = (*inputs[:place], value, *inputs[place + 1 :])
            if recording is not None:
                recording.record.reads.append((view, 0, value))
        outcome = task.loop.scan(now_ns, measured, _new(Inputs, inputs))
        self._command, self._initialised = outcome.command, outcome.initialised
        if recording is not None:
            reads = recording.record.reads
            reads += noted_measured(measured)
            reads += noted_time(now_ns)
            reads += noted_command(outcome.command)
        self._outcome_of(self._give)
        if outcome.initialised:
            self._clear(records)
        for code in outcome.problems:
            self._io.log(task.cml.line, code)
        if outcome.record is not None:
            self._keep(outcome.record, records)
        return outcome.outputs

    def _latch_at(self) -> Latched:
        self._latched_ns = self._memory.now_ns
        return self._take_latch()

    def _sense(self) -> Sensed:
        return self._task.sense(self._latched_ns)

    def _give(self) -> None:
        port = self._task.port
        if self._initialised:
            port.watch_speed(self._task.loop.overspeed_counts)
        port.command(self._command)

    def _clear(self, records: list[Value] | None) -> None:  # at task initialisation (52.2.2)
        view = self._task.records
        if records is not None:
            records[:] = [0] * len(records)
        elif view is not None:
            for index in range(SIZE):
                self._io.write_now(view, 0, index)

    def _keep(self, record: Record, records: list[Value] | None) -> None:  # local or common (52.3.2)
        view, io = self._task.records, self._io
        if records is not None:
            page = page_of(int(records[PAGE_NUMBER]))
            for index, value in writes(page, int(records[next_entry_index(page)]), record):
                records[index] = value
        elif view is not None:
            page = page_of(int(io.read_now(view, PAGE_NUMBER)))
            for index, value in writes(page, int(io.read_now(view, next_entry_index(page))), record):
                io.write_now(view, value, index)


class CmlTask(Task):
    """A task that runs the current minor loop of a drive.

    ``cml`` is its CALL; ``records`` the view of a common DIAG_DATA, if any; ``true_inputs`` are place in ``Inputs`` and
    view of the commons for which the loop ignores forces.
    """

    cml: BoundCall

    def install(self, compiled: CompiledTask) -> None:
        """Install this or another program of such a task, as at the beginning."""
        cml = compiled.program.cml
        assert cml is not None
        self.cml = cml
        self._slots = int(cml.facts["io_cntl_slot"]), int(cml.facts["dig_io_slot"])
        self.records = self._common(_RECORDS, compiled)
        views = ((INPUTS.index(name), self._common(name, compiled)) for name in _TRUE_INPUTS)
        self.true_inputs = tuple((place, view) for place, view in views if view is not None)
        self._port: DrivePort | None = None
        self._before: list[float] | None = None
        self._inputs_forced = self._any_forced()
        self.loop = CurrentMinorLoop(tests_scrs=_SCR_TEST in cml.arguments)
        super().install(compiled)

    @property
    def port(self) -> DrivePort:
        """The 57C406 that IO_CNTL_SLOT names."""
        if self._port is None:
            self._port = self._drives.port(self._slots[0])
        return self._port

    def sense(self, latched_ns: int) -> Sensed:
        """Return rack time, the measurement, and the values under forces that have no effect on the loop."""
        measured = self.port.measure(self._slots[1])
        under: tuple[Under, ...] = ()
        if self._inputs_forced:
            memory = self.memory
            forced = [(place, view) for place, view in self.true_inputs if memory.is_forced(view)]
            under = tuple((place, view, memory.under_force(view)) for place, view in forced)
        return self._drives.rack_ns(latched_ns), measured, under

    def run(self, now_ns: int = 0) -> ScanRecord | None:
        """Put the task into RUN: the loop starts again, and its 57C406's registers get their defaults (52.7)."""
        self.loop.restart()
        record = super().run(now_ns)
        if self.status is Status.RUNNING:
            self.port.initialise()
        return record

    def scan(self, now_ns: int, skipped: int = 0) -> ScanRecord | None:
        """Execute one scan at an interrupt; if the task ends, the drive stops."""
        record = super().scan(now_ns, skipped)
        self._follow_end()
        return record

    def begin_steps(self, now_ns: int, skipped: int, form: ScanSteps | None) -> Begun:
        """Begin a scan in steps: if it is abandoned, the loop is as it is now."""
        begun = super().begin_steps(now_ns, skipped, form)
        self._before = self.loop.numbers()
        return begun

    def end_steps(self, outcome: Any) -> None:
        """End the scan in progress."""
        super().end_steps(outcome)
        self._before = None
        self._follow_end()

    def give_up_steps(self) -> None:
        """Restore task and loop to their state before the scan in progress."""
        super().give_up_steps()
        before, self._before = self._before, None
        if before is not None:
            self.loop.take(before)

    def why_not_forced(self, name: str, scope: Scope) -> str | None:
        """Return why a variable cannot be forced: an output of the loop, or a local that its faults depend on (52.0).

        A common SPEED_FDBK or OSV_FDBK may be forced for all others: the loop uses the value under it (decision).
        """
        symbol = self.compiled.program.symbols.get(name)
        if symbol is None or symbol.scope is not scope:
            return None
        where = f"of {self.cml.block.name} in task {self.name} (line {self.cml.line}), which FORCE does not reach"
        if any(isinstance(target, Reference) and target.name == name for target in self.cml.targets):
            return f"it is an output {where}"
        given = (self.cml.arguments.get(keyword) for keyword in _TRUE_INPUTS)
        if scope is Scope.LOCAL and any(isinstance(item, Reference) and item.name == name for item in given):
            return f"it is an input {where}"
        return None

    def snapshot(self) -> list[Value]:
        """Return state, loop and error log as flat values, in the order of ``layout``."""
        values = super().snapshot()
        numbers = self.loop.numbers() if self._before is None else self._before
        return [*values[:-LOG_NUMBERS], *(_NOTHING if numbers == _FRESH else numbers), *values[-LOG_NUMBERS:]]

    def restore(self, values: list[Value]) -> None:
        """Restore a snapshot; ValueError or OverflowError if it does not fit the layout."""
        state, log = values[: -LOG_NUMBERS - NUMBERS], values[-LOG_NUMBERS:]
        numbers = values[len(state) : -LOG_NUMBERS]
        before = self.loop.numbers()
        try:
            self.loop.take([float(number) for number in numbers] if any(numbers) else _FRESH)
            super().restore([*state, *log])
        except (ValueError, OverflowError):
            self.loop.take(before)
            raise

    def _check_forces(self) -> None:
        super()._check_forces()
        self._inputs_forced = self._any_forced()

    def _any_forced(self) -> bool:
        return any(self.memory.is_forced(view) for _, view in self.true_inputs)

    def _follow_end(self) -> None:
        if self.status is not Status.RUNNING:
            self.port.disarm()

    def _common(self, keyword: str, compiled: CompiledTask) -> int | None:
        given = self.cml.arguments.get(keyword)
        if not isinstance(given, Reference):
            return None
        symbol = compiled.program.symbols[given.name]
        return self.memory.view(symbol.name) if symbol.scope is Scope.COMMON else None

    def _make_io(self, memory: ScanMemory, outcome_of: OutcomeOf) -> TaskIo:
        io = super()._make_io(memory, outcome_of)
        io.minor_loop = _LoopScans(self, io, memory, outcome_of).scan
        return io
