"""Rules among the current minor loop tasks of a rack, its Processors and its drive modules (J-3675 p. C-1)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import floor

from automax_ros.core.diagnostics import Diagnostic
from automax_ros.language.program import BoundCall, Program, Symbol
from automax_ros.language.tree.tree import Scope
from automax_ros.rackfile.model.config import IoPoint, RackConfig
from automax_ros.rackfile.model.module import ModuleConfig, TaskConfig
from automax_ros.rackfile.modules.drive import DRIVE_CONTROLLER, DriveConfig
from automax_ros.rackfile.modules.io import DRIVE_MODEL

MAX_LOOPS = 2
"""Most current minor loop tasks of one rack (J-3675 p. C-1)."""
LINES = 4
"""Interrupt lines of the backplane: one for the hardware events of a Processor, one for a loop (J-3675 p. C-1)."""
CONTROLLER = next(iter(DRIVE_CONTROLLER.models))

_Found = tuple[str, Diagnostic]


def drive_findings(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return the diagnostics of the current minor loop tasks, and of others that access their 57C406, by task."""
    found: dict[str, list[Diagnostic]] = {}
    loops = _Loops(config, programs)
    rules = (
        *(loops.slots, loops.own_modules, loops.counts, loops.lines),
        *(loops.frequencies, loops.priorities, loops.registers),
    )
    for rule in rules:
        for name, diagnostic in rule():
            found.setdefault(name, []).append(diagnostic)
    return found


@dataclass(frozen=True)
class _Loop:
    module: ModuleConfig
    task: TaskConfig
    bound: BoundCall

    def slot(self, keyword: str) -> int:
        return int(self.bound.facts[keyword.lower()])

    def found(self, code: str, message: str, hint: str | None = None, keyword: str = "") -> _Found:
        given = self.bound.arguments.get(keyword)
        span = self.bound.call.span if given is None else given.span
        return self.task.name, Diagnostic(code, message, span, self.bound.line, hint)


@dataclass(frozen=True)
class _Loops:
    config: RackConfig
    programs: Mapping[str, Program]

    @cached_property
    def all(self) -> list[_Loop]:
        found = ((module, task, self.programs.get(task.name)) for module, task in self.config.placed_tasks)
        return [_Loop(module, task, program.cml) for module, task, program in found if program and program.cml]

    @cached_property
    def modules(self) -> Mapping[int, ModuleConfig]:
        return {module.slot: module for module in self.config.modules}

    def slots(self) -> Iterator[_Found]:
        """A loop names the slots of a 57C406 and of a drive digital I/O module (52.1.1)."""
        wanted = {"IO_CNTL_SLOT": ("AMX6486", CONTROLLER), "DIG_IO_SLOT": ("AMX6487", DRIVE_MODEL)}
        for loop in self.all:
            for keyword, (code, model) in wanted.items():
                module = self.modules.get(loop.slot(keyword))
                if module is None or module.model != model:
                    place = f"({self.config.path.name}:{module.line})" if module else f"in {self.config.path.name}"
                    there = f"the {module.model} {place}" if module else f"no module {place}"
                    slots = [str(slot) for slot, item in sorted(self.modules.items()) if item.model == model]
                    hint = f"the rack has one in slot {' and '.join(slots)}" if slots else f"put a {model} there"
                    message = f"{keyword} must name a {model}; slot {loop.slot(keyword)} holds {there}"
                    yield loop.found(code, message, hint, keyword)

    def own_modules(self) -> Iterator[_Found]:
        """Each loop has a 57C406 and a drive digital I/O module of its own, since these serve one drive (decision)."""
        for keyword in ("IO_CNTL_SLOT", "DIG_IO_SLOT"):
            first: dict[int, _Loop] = {}
            for loop in self.all:
                other = first.setdefault(loop.slot(keyword), loop)
                if other is not loop:
                    message = f"slot {loop.slot(keyword)} serves the drive of task {other.task.name} already"
                    yield loop.found("AMX6488", message, "each drive has modules of its own", keyword)

    def counts(self) -> Iterator[_Found]:
        """One loop per Processor (decision), two per rack."""
        first: dict[int, _Loop] = {}
        for loop in self.all:
            other = first.setdefault(loop.module.slot, loop)
            if other is not loop:
                message = f"{loop.module.name} has the current minor loop of task {other.task.name} already"
                yield loop.found("AMX6489", message, "let a task of another Processor have it")
        for loop in self.all[MAX_LOOPS:]:
            message = f"the rack has {len(self.all)} current minor loop tasks; it may have at most {MAX_LOOPS}"
            yield loop.found("AMX6490", message)

    def lines(self) -> Iterator[_Found]:
        """A loop takes an interrupt line, and so does a Processor with hardware events."""
        with_events = {
            module.slot
            for module, task in self.config.placed_tasks
            if (program := self.programs.get(task.name)) and any(item.interrupt_status for item in program.events)
        }
        for loop in self.all[:MAX_LOOPS][max(0, LINES - len(with_events)) :]:
            message = f"{len(with_events)} Processors have hardware events and take the lines of the backplane"
            hint = f"it has {LINES} interrupt lines: one for the events of a Processor, one for a loop"
            yield loop.found("AMX6491", f"no interrupt line is left for this task: {message}", hint)

    def frequencies(self) -> Iterator[_Found]:
        """AC_LINE_FREQ is the lowest frequency that the line has (52.1.1): not above that of the plant."""
        for loop in self.all:
            module = self.modules.get(loop.slot("IO_CNTL_SLOT"))
            plant = module.plants.get("") if isinstance(module, DriveConfig) else None
            line_hz, given = plant.line_hz if plant is not None else None, int(loop.bound.facts["ac_line_freq"])
            if plant is not None and line_hz is not None and given > line_hz:
                place = f"({self.config.path.name}:{plant.line})"
                message = f"AC_LINE_FREQ is {given} Hz, but the line of plant {plant.name} {place} has {line_hz:g} Hz"
                hint = f"AC_LINE_FREQ is the lowest frequency that is expected: write {max(48, floor(line_hz))} or less"
                yield loop.found("AMX6788", message, hint, "AC_LINE_FREQ")

    def priorities(self) -> Iterator[_Found]:
        """No task has priority over the loop on its Processor (52.4.1: it normally has the highest priority)."""
        for loop in self.all:
            before = [task.name for task in loop.module.tasks if task.priority < loop.task.priority]
            if before:
                names = ", ".join(before[:4])
                message = (
                    f"{names} of the same Processor goes before the current minor loop (priority {loop.task.priority})"
                )
                hint = "give this task the highest priority: its scans are due 360 times per second at 60 Hz"
                yield loop.found("AMX6492", message, hint)

    def registers(self) -> Iterator[_Found]:
        """A control-block task latches all commons that it declares, and so delays the 57C406 in each scan (52.7)."""
        for name, program in self.programs.items():
            for symbol, point, line in latched_registers(self.config, program):
                message = (
                    f"{symbol.name} is register {point.register} of the {CONTROLLER} ({self.config.path.name}:{line})"
                )
                message += f": task {name} reads it at each scan, which delays that module"
                hint = "declare it only in a BASIC task (.BAS), and write it there once"
                yield name, Diagnostic("AMX6493", message, symbol.span, hint=hint)


def latched_registers(config: RackConfig, program: Program) -> Iterator[tuple[Symbol, IoPoint, int]]:
    """Yield the registers of any 57C406 that a control-block task latches: variable, point, line of the rack file."""
    slots = {module.slot for module in config.modules if isinstance(module, DriveConfig)}
    points = {item.name: item for item in config.declared if item.point is not None and item.point.slot in slots}
    for symbol in () if program.is_basic else program.symbols.values():
        variable = points.get(symbol.name) if symbol.scope is Scope.COMMON else None
        if variable is not None and variable.point is not None:
            yield symbol, variable.point, variable.line
