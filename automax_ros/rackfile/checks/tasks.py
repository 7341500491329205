"""Checks every task of a rack against the rack: its commons, its Processor's tick, rules among tasks and modules."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.compile.base.cost import PLATFORMS, Model
from automax_ros.core.diagnostics import Diagnostic, SourceText, Span, has_errors, in_order
from automax_ros.language.checks.checker import CheckResult, check
from automax_ros.language.program import CommonSpec, Program
from automax_ros.rackfile.checks.common_use import writer_findings
from automax_ros.rackfile.checks.drive_rules import drive_findings
from automax_ros.rackfile.checks.interrupts import interrupt_findings
from automax_ros.rackfile.checks.omissions import rack_warnings
from automax_ros.rackfile.checks.udc_rules import udc_findings
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import ModuleConfig, TaskConfig
from automax_ros.rackfile.reading.files import FileFault, read_task_source
from automax_ros.rackfile.sections.feeds import feed_findings

Rule = Callable[[RackConfig, Mapping[str, Program]], Mapping[str, Sequence[Diagnostic]]]
"""Returns diagnostics by the task in whose source they are; called with the programs without errors."""
RULES: tuple[Rule, ...] = (interrupt_findings, udc_findings, drive_findings, feed_findings, writer_findings)
"""All rules among tasks and modules."""


class CheckedTask(NamedTuple):
    """One task of a rack with the result of its check; diagnostics refer to ``source``."""

    task: TaskConfig
    source: SourceText
    result: CheckResult


def commons_of(config: RackConfig) -> Mapping[str, CommonSpec]:
    """Return the rack's common variables by full name, as the checker compares them with a task's COMMON."""
    return {
        variable.name: CommonSpec(
            name=variable.name,
            type=variable.type,
            place=f"{config.path.name}:{variable.line}",
            dimensions=variable.dimensions,
            length=variable.length,
            is_input=config.is_input(variable),
        )
        for variable in config.declared
    }


def check_tasks(config: RackConfig, sources: Mapping[str, SourceText] | None = None) -> list[CheckedTask]:
    """Check all tasks of a rack, modules in the order of slots, tasks in the order of the file.

    ``sources`` by the tasks' names replace their files, which are then not read. If a source could be read when the
    rack file was loaded and cannot be read now, that is an error of its task (AMX6306).
    """
    commons = commons_of(config)
    checked = [_check_task(module, task, commons, config, sources) for module, task in config.placed_tasks]
    programs = {item.task.name: item.result.program for item in checked if item.result.program is not None}
    found = findings_by_task(config, programs)
    return [item._replace(result=with_findings(item.result, found.get(item.task.name, ()))) for item in checked]


def forgotten(config: RackConfig, checked: Sequence[CheckedTask]) -> list[Diagnostic]:
    """Return warnings about omissions in the rack file; none while a task has errors, which may hide a use."""
    programs = {item.task.name: item.result.program for item in checked if item.result.program is not None}
    return rack_warnings(config, programs) if len(programs) == len(checked) else []


def _check_task(
    module: ModuleConfig,
    task: TaskConfig,
    commons: Mapping[str, CommonSpec],
    config: RackConfig,
    sources: Mapping[str, SourceText] | None,
) -> CheckedTask:
    try:
        source = read_task_source(task.file) if sources is None else sources[task.name]
    except FileFault as fault:
        place = SourceText(str(config.path), config.text)
        gone = Diagnostic("AMX6306", f"the source {task.file.name} of task {task.name} {fault}", Span(task.line, 1, 2))
        return CheckedTask(task, place, CheckResult(None, [gone]))
    return CheckedTask(task, source, check_source(source, task.name, module.tick_ns, commons, module.times))


def check_source(
    source: SourceText,
    name: str,
    tick_ns: int,
    commons: Mapping[str, CommonSpec],
    model: Model = Model.NONE,
) -> CheckResult:
    """Check the text of one task against a rack's commons and the tick and model of the module that runs it."""
    target = PLATFORMS.get(model, Platform.AUTOMAX)
    return check(source, name=name, catalogue=CATALOGUE, target=target, tick_ns=tick_ns, commons=commons)


def with_findings(result: CheckResult, findings: Sequence[Diagnostic]) -> CheckResult:
    """Return a check's result with the rack's findings about the task: no program if these are errors."""
    if not findings:
        return result
    diagnostics = in_order([*result.diagnostics, *findings])
    return replace(result, program=None if has_errors(findings) else result.program, diagnostics=diagnostics)


def findings_by_task(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return the findings of all rules, by task."""
    found: dict[str, list[Diagnostic]] = {}
    for rule in RULES:
        for name, diagnostics in rule(config, programs).items():
            found.setdefault(name, []).extend(diagnostics)
    return found
