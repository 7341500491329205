"""Tasks of a rack, checked and compiled against its common memory."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass

from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.compile.compiler import CompiledTask, compile_program
from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms, NativeOutcome
from automax_ros.core.diagnostics import Diagnostic, SourceText, has_errors
from automax_ros.language.program import Program
from automax_ros.language.tree.task_kind import TaskKind
from automax_ros.rackfile.checks.tasks import check_source, check_tasks, commons_of, findings_by_task, with_findings
from automax_ros.rackfile.model.config import RackConfig, Timing
from automax_ros.rackfile.model.module import ModuleConfig, cost_model
from automax_ros.rackfile.processes import processes_of

Finding = tuple[SourceText, list[Diagnostic]]
"""The diagnostics of a text."""


class RackError(Exception):
    """A rack or a task cannot be built; ``findings`` are the diagnostics with the texts they refer to."""

    def __init__(self, message: str, findings: Sequence[Finding] = ()) -> None:
        """Create from a message and the diagnostics of texts."""
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
