"""Tasks of a rack, checked and compiled against its common memory, and what the rack offers the modules they run on."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property

from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.compile.compiler import CompiledTask, compile_program
from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms, NativeOutcome
from automax_ros.core.diagnostics import Diagnostic, SourceText, has_errors
from automax_ros.core.kinds import WriterKind
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.language.program import Program
from automax_ros.language.tree.task_kind import TaskKind
from automax_ros.rack.tasks.scheduled_task import After, ScheduledTask
from automax_ros.rack.tasks.triggers import ClockTrigger, DriveTrigger, EventTrigger, MakeTrigger, Trigger, WaitTrigger
from automax_ros.rackfile.checks.tasks import check_source, check_tasks, commons_of, findings_by_task, with_findings
from automax_ros.rackfile.model.config import RackConfig, Timing
from automax_ros.rackfile.model.module import ModuleConfig, TaskConfig, cost_model
from automax_ros.rackfile.model.writers import WriterSpec, writers_of
from automax_ros.rackfile.processes import processes_of
from automax_ros.runtime.memory.common_clock import CommonClock
from automax_ros.runtime.memory.memory import CommonMemory, ProcessInputs
from automax_ros.runtime.memory.registers import Backplane
from automax_ros.runtime.memory.views import Memory
from automax_ros.runtime.scan.channels import Channels
from automax_ros.runtime.scan.drives import Drives
from automax_ros.runtime.scan.events import Events
from automax_ros.runtime.scan.execution import Execution
from automax_ros.runtime.tasks.basic_task import BasicTask
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.tasks.interrupts import Interrupts
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import Scheduler


def task_class(program: Program) -> type[Task]:
    """Return the class of a BASIC task, of that of a drive's current minor loop, or of any other that scans."""
    if program.is_basic:
        return BasicTask
    return Task if program.cml is None else CmlTask


Finding = tuple[SourceText, list[Diagnostic]]
"""The diagnostics of a text."""


class RackError(Exception):
    """A rack or a task cannot be built; ``findings`` are the diagnostics with the texts they refer to."""

    def __init__(self, message: str, findings: Sequence[Finding] = ()) -> None:
        super().__init__(message)
        self.findings = list(findings)


@dataclass(frozen=True)
class PreparedReload:
    """Another source for a task, checked and compiled; ``compiled`` is None with a ``fault`` that forbids installation.

    ``programs`` are those of all tasks once it is installed, ``among`` those that it was checked against.
    """

    task: str
    source: SourceText
    compiled: CompiledTask | None
    programs: Mapping[str, Program]
    among: Mapping[str, Program]
    fault: RackError | None = None


class Installation:
    """All tasks of a rack, compiled; ``warnings`` are those of their checks, ``native`` the outcomes by task."""

    def __init__(
        self,
        config: RackConfig,
        here: Collection[str] | None = None,
        *,
        sources: Mapping[str, SourceText] | None = None,
        native: NativeForms = IN_PYTHON,
    ) -> None:
        """Check all tasks and compile them, or only those in ``here``; ``sources`` replace the tasks' files.

        Scans in modeled time are executed in steps, so not made native. RackError if a task has errors: nothing is
        started then (the hardware's E0).
        """
        self._config = config
        modeled = config.execution is Timing.MODELED
        self._native = native.off("scans in modeled time are executed in steps") if modeled else native
        self._views = {variable.name: view for view, variable in enumerate(config.variables)}
        self._compiled: dict[str, CompiledTask] = {}
        self._programs: Mapping[str, Program] = {}
        self.sources: dict[str, SourceText] = {}
        self.warnings: list[Finding] = []
        checked = check_tasks(config, sources)
        failed = [(source, result.diagnostics) for _, source, result in checked if has_errors(result.diagnostics)]
        if failed:
            names = ", ".join(source.name for source, _ in failed)
            raise RackError(f"no task is started: errors in {names} (the rack shows E0)", failed)
        for task, source, result in checked:
            assert result.program is not None
            self.sources[task.name] = source
            self._programs = {**self._programs, task.name: result.program}
            if result.diagnostics:
                self.warnings.append((source, result.diagnostics))
            if here is None or task.name in here:
                self._compiled[task.name] = self._compile(task.name, result.program)
        self.native: Mapping[str, NativeOutcome] = self._native.made(self._compiled)
        self._compiled = {name: outcome.compiled for name, outcome in self.native.items()}
        distributed = len(self._compiled) < len(checked)
        self._cut = processes_of(config, self._programs.values()) if distributed else ()

    def again(self, config: RackConfig) -> Installation:
        """Return that of another rack with the same tasks, modules and commons; none of this one's may be reloaded."""
        other = copy(self)
        other._config = config
        other.sources, other._compiled = dict(self.sources), dict(self._compiled)
        return other

    @property
    def programs(self) -> Mapping[str, Program]:
        """The programs of all tasks, by name."""
        return self._programs

    def compiled(self, task: str) -> CompiledTask:
        """Return a task of the rack's file."""
        return self._compiled[task]

    def prepare(self, task: str, source: SourceText) -> PreparedReload:
        """Check and compile another source for a task of the rack; safe on any thread, since nothing is changed."""
        among = self._programs
        try:
            program = self._check(task, source, among)
            compiled = self._native.form(self._compile(task, program)).compiled
        except RackError as fault:
            return PreparedReload(task, source, None, among, among, fault)
        return PreparedReload(task, source, compiled, {**among, task: program}, among)

    def is_current(self, prepared: PreparedReload) -> bool:
        """Return whether no task was reloaded since a source was checked against them."""
        return prepared.among is self._programs

    def take(self, prepared: PreparedReload) -> CompiledTask:
        """Make a prepared source the task's program, and return it compiled; RackError if it has errors."""
        if prepared.fault is not None:
            raise prepared.fault
        assert prepared.compiled is not None
        self._programs = prepared.programs
        return prepared.compiled

    def _check(self, task: str, source: SourceText, among: Mapping[str, Program]) -> Program:
        module = self._module(task)
        result = check_source(source, task, module.tick_ns, commons_of(self._config), module.times)
        if result.program is not None:
            found = findings_by_task(self._config, {**among, task: result.program})
            result = with_findings(result, found.pop(task, ()))
            self._refuse_misfit(task, source, found)
        if result.program is None or has_errors(result.diagnostics):
            raise RackError(f"{source.name} has errors: task {task} stays as it is", [(source, result.diagnostics)])
        self._refuse_bonds(task, source, {**among, task: result.program})
        before = self._compiled[task].program
        if _kind(result.program) != _kind(before):
            what = _kind(before)
            raise RackError(f"task {task} is {what}: {source.name} is another kind of task, restart the rack with it")
        return result.program

    def _refuse_misfit(self, task: str, source: SourceText, found: Mapping[str, Sequence[Diagnostic]]) -> None:
        """Refuse a source with which another task, as it runs now, would have errors (decision)."""
        wrong = [(self.sources[name], list(items)) for name, items in found.items() if has_errors(items)]
        if wrong:
            raise RackError(f"{source.name} does not fit the other tasks: task {task} stays as it is", wrong)

    def _refuse_bonds(self, task: str, source: SourceText, programs: Mapping[str, Program]) -> None:
        """Refuse a source with which modules of other processes would have to share this one (decision)."""
        for process in processes_of(self._config, programs.values()) if self._cut else ():
            if not any({*process.slots} <= {*part.slots} for part in self._cut):
                why = f"{process.reasons[-1]}, so {' and '.join(process.modules)} would have to share a process"
                raise RackError(f"{source.name}: {why}: restart the rack with it; task {task} stays as it is")

    def _compile(self, task: str, program: Program) -> CompiledTask:
        modeled = self._config.execution is Timing.MODELED
        costs = cost_model(self._module(task)) if modeled else CostModel(Model.NONE)
        compiled = compile_program(program, self._views, costs)
        if modeled:  # the form that is executed: else it would be compiled during the task's first scan
            _ = compiled.burst_steps if program.kind is TaskKind.BASIC else compiled.scan_steps
        return compiled

    def _module(self, task: str) -> ModuleConfig:
        return next(module for module, item in self._config.placed_tasks if item.name == task)


def _kind(program: Program) -> str:
    if program.cml is not None:
        return f"a task of {program.cml.block.name}"
    return "a BASIC task" if program.kind is TaskKind.BASIC else "a control-block task"


@dataclass(frozen=True)
class RackServices:
    """Services of a rack for its modules.

    ``execution`` returns, for a module's name, the execution of its scans; ``after`` is called after each scan, with
    None if a task has faulted, ``no_event`` with a task whose event did not come in time. ``report_writes`` reports to
    observers the writes that were not made by a scan. A 57C406 attaches itself to ``drives``. ``plants`` are those with
    a motor, by name; the rack keeps their states. ``stopwatch`` (ns, monotonic) measures execution times; without one
    they count as 0.
    """

    config: RackConfig
    installation: Installation
    memory: CommonMemory
    scheduler: Scheduler
    backplane: Backplane
    events: Events
    channels: Channels
    clock: CommonClock
    interrupts: Interrupts
    inputs: ProcessInputs
    drives: Drives
    plants: Mapping[str, DrivePlant]
    execution: Callable[[str], Execution]
    after: After
    no_event: Callable[[Task], None]
    report_writes: Callable[[], None]
    stopwatch: Callable[[], int] | None

    @cached_property
    def _writers(self) -> dict[tuple[WriterKind, str], WriterSpec]:
        return {(item.kind, item.name): item for item in writers_of(self.config)}

    def writer(self, module: str) -> int:
        """Return the id under which a module writes registers."""
        return self._writers[WriterKind.IO, module].id

    def install(
        self,
        task: TaskConfig,
        execution: Execution,
        *,
        memory: Memory | None = None,
        trigger: MakeTrigger | None = None,
        then: Callable[[Task], None] | None = None,
    ) -> ScheduledTask:
        """Return a task of a module's configuration, installed; it works on the rack's ``memory`` unless one is given.

        Without ``trigger`` its scans start by the clock, or by the event that SCAN_LOOP names. ``then`` is called after
        each scan, and after its start-up part, when observers were notified.
        """
        compiled, place = self.installation.compiled(task.name), self._writers[WriterKind.TASK, task.name]
        installed = task_class(compiled.program)(
            compiled,
            memory or self.memory,
            writer=place.id,
            slot=place.slot,
            priority=task.priority,
            backplane=self.backplane,
            events=self.events,
            channels=self.channels,
            drives=self.drives,
        )

        def after(scanned: Task, record: ScanRecord | None) -> None:
            self.after(scanned, record)
            if then is not None:
                then(scanned)

        return ScheduledTask(
            installed,
            self.installation.sources[task.name],
            scheduler=self.scheduler,
            trigger=trigger or self._usual_trigger,
            execution=execution,
            after=self.after if then is None else after,
            stopwatch=self.stopwatch,
        )

    def _usual_trigger(self, task: Task) -> Trigger:
        """Return the trigger of a Processor's task, and connect the interrupts that it waits for.

        It is a drive's 57C406, the wait of a BASIC task, the event that SCAN_LOOP names, else the clock (4.0).
        """
        self.interrupts.bind(task)
        if isinstance(task, CmlTask):
            return DriveTrigger(task)
        if isinstance(task, BasicTask):
            return WaitTrigger(task, self.events, self.channels, self.scheduler, lambda: self.no_event(task))
        event = task.compiled.program.event
        if event is None:
            return ClockTrigger(task, self.scheduler)
        return EventTrigger(self.events.event(event), task, self.scheduler, lambda: self.no_event(task))
