"""The rack: modules, common memory, tasks and their schedule, wired from a configuration. No ROS 2.

rack = Rack(config)
rack.start()
rack.run(10.0)      # ten simulated seconds
rack.value("SPEED_REF%")
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from automax_ros.compile.compiler import compile_program
from automax_ros.core.diagnostics import Diagnostic, SourceText, has_errors
from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import NS_PER_S, seconds_ns
from automax_ros.core.types import DataType, Value
from automax_ros.rack.config import RackConfig
from automax_ros.rack.settings import common_named
from automax_ros.rack.tasks_check import check_tasks
from automax_ros.rack.views import view_specs
from automax_ros.rack.writers import OPERATOR_WRITER, PRESET_WRITER, WriterSpec, writers_of
from automax_ros.running.memory import CommonMemory
from automax_ros.running.scheduler import EventClass, EventKey, Scheduler
from automax_ros.running.task import ScanRecord, Status, Task
from automax_ros.running.views import MemoryValueError, Write


class RackError(Exception):
    """A rack cannot be built; ``findings`` are the diagnostics with the texts they refer to."""

    def __init__(self, message: str, findings: Sequence[tuple[SourceText, list[Diagnostic]]] = ()) -> None:
        """Take a message and what is wrong in which text."""
        super().__init__(message)
        self.findings = list(findings)


class RackObserver(Protocol):
    """Somebody who is told what happens in a rack, in order."""

    def scanned(self, task: Task, record: ScanRecord, writes: list[Write]) -> None:
        """A task has scanned (or, as scan 0, executed what stands before SCAN_LOOP), with its writes to memory."""
        ...

    def written(self, writes: list[Write]) -> None:
        """Memory was written from outside the tasks."""
        ...

    def tuned(self, task: Task, now_ns: int) -> None:
        """A tunable of a task was set between two scans."""
        ...

    def all_stopped(self, reason: str, now_ns: int) -> None:
        """A fault has stopped all tasks (STOP ALL)."""
        ...


@dataclass
class TaskStatistics:
    """Counts of one task since RUN; times in ns, measured only where the rack has a stopwatch."""

    scans: int = 0
    skipped: int = 0
    last_ns: int = 0
    longest_ns: int = 0
    total_ns: int = 0


@dataclass
class Processor:
    """A Processor module with its tasks, in the order in which they start: priority, then name."""

    slot: int
    model: str
    tick_ns: int
    tasks: list[Task] = field(default_factory=list)


class Rack:
    """A rack that runs. ``stopwatch`` (ns, monotonic) measures execution times; without one they count as 0."""

    def __init__(self, config: RackConfig, *, stopwatch: Callable[[], int] | None = None) -> None:
        """Compile all tasks against the rack's common memory.

        Raises:
            RackError: a task has errors; nothing is started then (the hardware's E0).
        """
        self.config = config
        self.memory = CommonMemory(view_specs(config.variables))
        self.writers: tuple[WriterSpec, ...] = writers_of(config)
        self.scheduler = Scheduler()
        self.warnings: list[tuple[SourceText, list[Diagnostic]]] = []
        self.sources: dict[str, SourceText] = {}
        self.processors = self._processors()
        self.statistics = {task.name: TaskStatistics() for task in self.tasks}
        self.stop_reason: str | None = None
        self._observers: list[RackObserver] = []
        self._stopwatch = stopwatch

    @property
    def tasks(self) -> list[Task]:
        """All tasks: by slot, then in starting order."""
        return [task for processor in self.processors for task in processor.tasks]

    @property
    def now_ns(self) -> int:
        """Rack time: ns since the rack was started."""
        return self.scheduler.now_ns

    @property
    def fingerprint(self) -> int:
        """A number of 63 bits that configuration and sources determine: the run's id where no other is given."""
        digest = hashlib.sha256(self.config.text.encode())
        for name in sorted(self.sources):
            digest.update(name.encode() + b"\0" + self.sources[name].text.encode() + b"\0")
        return int.from_bytes(digest.digest()[:8], "big") >> 1

    def observe(self, observer: RackObserver) -> None:
        """Tell an observer everything from now on; records and the write log are kept from then on."""
        self._observers.append(observer)
        self.memory.keep_log()
        for task in self.tasks:
            task.record_scans()

    def start(self, settings: Sequence[tuple[str, Value]] = ()) -> None:
        """Write presets, then ``settings`` (name and value, as an operator would), and put all tasks into RUN.

        A name may be that of an array's element: ``TABLE%(3)``.

        Scans begin at once: the first of each task at this instant, then each period.

        Raises:
            NameFault: a setting names a variable that the rack does not have.
            MemoryValueError: a setting's value does not fit.
        """
        now = self.now_ns
        self.memory.now_ns = now
        self._write_presets()
        for name, value in settings:
            found = common_named(self.config, name)
            self.memory.write_from_outside(self.memory.view(found.name), value, OPERATOR_WRITER, found.index)
        self._tell_writes()
        for task in sorted(self.tasks, key=lambda task: (task.priority, task.name)):
            if self.stop_reason is None:
                self._start(task, now)
        for task in self.tasks:
            key = EventKey(EventClass.SCAN, task.priority, task.name)
            self.scheduler.every(task.period_ns, now, key, self._scanner(task))

    def run(self, seconds: float) -> None:
        """Let simulated time pass."""
        self.scheduler.run_until(self.now_ns + seconds_ns(seconds))

    def write(self, name: str, value: Value, writer: int = OPERATOR_WRITER, element: int = 0) -> None:
        """Write a common from outside the tasks, between scans.

        Raises:
            KeyError: the rack has no such variable.
            MemoryValueError: the value does not fit the variable.
        """
        self.write_view(self.memory.view(name), [(element, value)], writer)

    def write_view(self, view: int, values: Sequence[tuple[int, Value]], writer: int) -> None:
        """Write elements of a variable from outside the tasks, between scans.

        Raises:
            MemoryValueError: a value does not fit; nothing is written then.
        """
        memory = self.memory
        accepted = [(element, memory.accepted(view, value, element)) for element, value in values]
        memory.now_ns = self.now_ns
        for element, value in accepted:
            memory.write_now(view, value, writer, element, WriteKind.OUTSIDE)
        self._tell_writes()

    def force(self, name: str, value: Value, writer: int = OPERATOR_WRITER) -> None:
        """Hold a common at a value against every write, between scans.

        Raises:
            KeyError: the rack has no such variable.
            MemoryValueError: the value does not fit, or the variable cannot be forced: a string, an array, or a
                register of which both the word and bits are named (J2-3106-1 p. 18-10).
        """
        view = self.memory.view(name)
        reason = self._why_not_forced(view)
        if reason is not None:
            raise MemoryValueError(f"{name} cannot be forced: {reason}")
        self.memory.now_ns = self.now_ns
        self.memory.force(view, value, writer=writer)
        self._tell_writes()

    def unforce(self, name: str, writer: int = OPERATOR_WRITER) -> None:
        """End a force; the value stays until the next write.

        Raises:
            KeyError: the rack has no such variable.
        """
        self.memory.now_ns = self.now_ns
        self.memory.release(self.memory.view(name), writer=writer)
        self._tell_writes()

    def _why_not_forced(self, view: int) -> str | None:
        spec = self.memory.specs[view]
        if spec.is_array or spec.type is DataType.STRING:
            return "it is an array" if spec.is_array else "it is a string"
        others = self.memory.registers.others(view)
        return f"{self.memory.specs[others[0]].name} is part of the same register" if others else None

    def tune(self, task: Task, name: str, value: object) -> None:
        """Set a tunable of a task, between scans.

        Raises:
            KeyError: the task has no tunable of that name.
            ValueError: the value lies outside its limits or is not of its type.
        """
        task.tune(name, value)
        for observer in self._observers:
            observer.tuned(task, self.now_ns)

    def value(self, name: str, element: int = 0) -> Value:
        """Return the present value of a common.

        Raises:
            KeyError: the rack has no such variable.
        """
        return self.memory.read_now(self.memory.view(name), element)

    def task(self, name: str) -> Task:
        """Return a task by name.

        Raises:
            KeyError: the rack has no such task.
        """
        for task in self.tasks:
            if task.name == name:
                return task
        raise KeyError(name)

    def stop(self) -> None:
        """Stop all tasks; memory keeps what it holds."""
        for task in self.tasks:
            task.stop()

    def stop_all(self, reason: str) -> None:
        """Stop all tasks because of a fault; volatile commons become 0 (2.4.5)."""
        self.stop_reason = reason
        self.stop()
        self.memory.now_ns = self.now_ns
        self.memory.clear(PRESET_WRITER)
        self._write_batteries()
        self._tell_writes()
        for observer in self._observers:
            observer.all_stopped(reason, self.now_ns)

    def _processors(self) -> list[Processor]:
        checked = check_tasks(self.config)
        failed = [(source, result.diagnostics) for _, source, result in checked if has_errors(result.diagnostics)]
        if failed:
            names = ", ".join(source.name for source, _ in failed)
            raise RackError(f"no task is started: errors in {names} (the rack shows E0)", failed)
        views = {variable.name: view for view, variable in enumerate(self.config.variables)}
        ids = {writer.name: writer.id for writer in self.writers if writer.is_task}
        compiled = {}
        for task_config, source, result in checked:
            assert result.program is not None
            self.sources[task_config.name] = source
            if result.diagnostics:
                self.warnings.append((source, result.diagnostics))
            compiled[task_config.name] = compile_program(result.program, views)
        processors = []
        for module in self.config.processors:
            tasks = [
                Task(compiled[item.name], self.memory, writer=ids[item.name], slot=module.slot, priority=item.priority)
                for item in sorted(module.tasks, key=lambda item: (item.priority, item.name))
            ]
            processors.append(Processor(module.slot, module.model, module.tick_ns, tasks))
        return processors

    def _write_presets(self) -> None:
        """Write presets, as a writer of their own, at the start (decision): the hardware has none."""
        for view, variable in enumerate(self.config.variables):
            for element, value in enumerate(variable.presets):
                self.memory.write_from_outside(view, value, PRESET_WRITER, element)
        self._write_batteries()

    def _write_batteries(self) -> None:
        """Set the pre-defined BATTERYSTATUSn@ of the slots that hold a module with a battery (2.4.6)."""
        slots = [processor.slot for processor in self.config.processors]
        if self.config.common_memory is not None:
            slots.append(self.config.common_memory.slot)
        present = {f"BATTERYSTATUS{slot}@" for slot in slots}
        for view, variable in enumerate(self.config.variables):
            if variable.name in present:
                self.memory.write_from_outside(view, True, PRESET_WRITER)

    def _start(self, task: Task, now_ns: int) -> None:
        record = task.run(now_ns)
        self._after(task, record)

    def _scanner(self, task: Task) -> Callable[[int, int], None]:
        """Return what the scheduler calls for each scan of a task."""
        statistics, stopwatch = self.statistics[task.name], self._stopwatch

        def scan(now_ns: int, skipped: int) -> None:
            if task.status is not Status.RUNNING:
                return
            began = stopwatch() if stopwatch else 0
            record = task.scan(now_ns, skipped)
            statistics.scans += 1
            statistics.skipped += skipped
            if stopwatch:
                taken = stopwatch() - began
                statistics.last_ns = taken
                statistics.total_ns += taken
                statistics.longest_ns = max(statistics.longest_ns, taken)
                if record is not None:
                    record.duration_ns = taken
            self._after(task, record)

        return scan

    def _after(self, task: Task, record: ScanRecord | None) -> None:
        if record is not None:
            writes = self.memory.drain()
            for observer in self._observers:
                observer.scanned(task, record, writes)
        if task.status is Status.FAULTED:
            last = task.errors.last
            self.stop_all(f"task {task.name}: {last.describe() if last else 'fault'}")

    def _tell_writes(self) -> None:
        writes = self.memory.drain()
        if writes:
            for observer in self._observers:
                observer.written(writes)


def scans_per_second(rack: Rack) -> float:
    """Return how many scans the rack's tasks execute in a second of rack time."""
    return sum(NS_PER_S / task.period_ns for task in rack.tasks)
