"""Checks the hardware events of a rack's tasks against its modules: their interrupts, their number, their periods.

The backplane has four interrupt lines (J-3675 p. C-1). A Processor with hardware events takes one, which serves four of
them; so a rack of at most four Processors has one for each, as long as no current minor loop needs one
(``rackfile/checks/drive_rules``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from automax_ros.core.diagnostics import Diagnostic
from automax_ros.core.kinds import Direction
from automax_ros.core.ticks import CLOCK_PERIOD_NS, NS_PER_MS
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import Event
from automax_ros.rackfile.checks.register_writes import constant_writes
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.model.module import Interrupt, ModuleConfig

MAX_EVENTS = 4
"""Most hardware events of one Processor: those that its interrupt line serves (J-3675 p. C-1)."""

_Place = tuple[int, int]
"""Slot and register."""


class _Declared(NamedTuple):
    task: str
    event: Event
    place: _Place


def interrupt_findings(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return the diagnostics of tasks' hardware events, by task; ``programs`` are those without errors."""
    found: dict[str, list[Diagnostic]] = {name: [] for name in programs}
    variables = {variable.name: variable for variable in config.declared}
    modules = {module.slot: module for module in config.modules}
    declared = []
    for task, program in programs.items():
        for event in _hardware(program):
            assert event.interrupt_status is not None
            variable = variables[event.interrupt_status.name]
            wrong = _wrong_status(event, variable, modules, config.path.name)
            if wrong is not None:
                found[task].append(wrong)
            else:
                assert variable.point is not None
                declared.append(_Declared(task, event, (variable.point.slot, variable.point.register)))
    for task, diagnostic in (
        *_two_sources(declared),
        *_too_many(config, programs),
        *_periods(config, programs, declared),
    ):
        found[task].append(diagnostic)
    return found


def _hardware(program: Program) -> list[Event]:
    return [event for event in program.events if event.interrupt_status is not None]


def _wrong_status(
    event: Event, variable: CommonVariable, modules: Mapping[int, ModuleConfig], rack_file: str
) -> Diagnostic | None:
    assert event.interrupt_status is not None
    name, span = variable.name, event.interrupt_status.span
    place = f"({rack_file}:{variable.line})"
    able = ", ".join(
        f"slot {module.slot} register {item.status}"
        for module in modules.values()
        for item in module.registers.interrupts
    )
    hint = f"the rack has them at {able}" if able else "the rack has no module that interrupts"
    if variable.point is None:
        message = f"{name} is not an I/O point {place}: it must stand on the ISCR of a module that interrupts"
        return Diagnostic("AMX6440", message, span, event.number, hint)
    module = modules[variable.point.slot]
    if variable.point.register not in {item.status for item in module.registers.interrupts}:
        message = f"{name} is register {variable.point.register} of the {module.model} in slot {module.slot} {place}"
        return Diagnostic("AMX6441", f"{message}, which is not an interrupt status register", span, event.number, hint)
    return None


def _two_sources(declared: Iterable[_Declared]) -> Iterator[tuple[str, Diagnostic]]:
    """Yield events of one name that two interrupts would set."""
    first: dict[str, _Declared] = {}
    for item in declared:
        other = first.setdefault(item.event.name, item)
        if other.place != item.place:
            message = f"the event {item.event.name} is set by {_words(item.place)}, but by {_words(other.place)} in"
            hint = "an event is known by its name in the whole rack: give one of them another"
            yield item.task, _at(item.event, "AMX6442", f"{message} task {other.task}", hint)


def _too_many(config: RackConfig, programs: Mapping[str, Program]) -> Iterator[tuple[str, Diagnostic]]:
    for module in config.task_modules:
        present = [task.name for task in module.tasks if task.name in programs]
        events = [(name, item) for name in present for item in _hardware(programs[name])]
        for task, event in events[MAX_EVENTS:]:
            message = f"slot {module.slot} has {len(events)} hardware events; an interrupt line serves {MAX_EVENTS}"
            yield task, _at(event, "AMX6443", message, "let a task of another Processor have it")


def _periods(
    config: RackConfig, programs: Mapping[str, Program], declared: Iterable[_Declared]
) -> Iterator[tuple[str, Diagnostic]]:
    """Yield events whose module, as far as the tasks show, never has the period of the scan that they start."""
    interrupts = {(module.slot, item.status): item for module in config.modules for item in module.registers.interrupts}
    writes = constant_writes(config, programs.values())
    for task, event, place in declared:
        program, interrupt = programs[task], interrupts[place]
        if program.event != event.name or interrupt.period is None:
            continue
        periods = _possible(config, interrupt, place[0], writes.get((place[0], interrupt.period), []))
        if periods and program.period_ns not in periods:
            every = " or ".join(f"{period / NS_PER_MS:g} ms" for period in sorted(periods))
            tick = f"TICKS={program.ticks} x {program.tick_ns / NS_PER_MS:g} ms"
            message = f"{event.name} comes every {every}, but the blocks of this task count with {tick}"
            hint = f"write {program.period_ns // CLOCK_PERIOD_NS - 1} to register {interrupt.period} of slot {place[0]}"
            yield task, _at(event, "AMX6445", message, hint)


def _possible(config: RackConfig, interrupt: Interrupt, slot: int, written: list[int | None]) -> set[int]:
    """Return the periods in ns that the tasks set in a module, empty if they cannot be known."""
    values = list(written)
    for variable in config.declared:
        point = variable.point
        if point is not None and (point.slot, point.register) == (slot, interrupt.period):
            values += [int(value) for value in variable.presets if not isinstance(value, str)]
            values += [None] if variable.direction is Direction.IN else []
    known = [value for value in values or [0] if value is not None]
    return {((value & 0xFFFF) + 1) * CLOCK_PERIOD_NS for value in known} if None not in values else set()


def _at(event: Event, code: str, message: str, hint: str) -> Diagnostic:
    return Diagnostic(code, message, event.span, event.number, hint)


def _words(place: _Place) -> str:
    return f"slot {place[0]} register {place[1]}"
