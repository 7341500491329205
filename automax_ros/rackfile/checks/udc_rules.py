"""Rules among the tasks of a UDC, the rack's other tasks and the UDC's drives (2.3, 36, S-3056 p. 3-50)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from automax_ros.core.diagnostics import Diagnostic, Note
from automax_ros.core.kinds import Direction
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.types import DataType
from automax_ros.drive.pmi.pmi import USUAL_RATIO
from automax_ros.language.program import BoundCall, Place, Program, places_that_write
from automax_ros.language.tree.tree import BooleanLiteral, IntegerLiteral, RealLiteral, Scope
from automax_ros.rackfile.checks.register_writes import constant_writes
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.modules.udc import (
    APPLICATION,
    ISCR,
    MAX_BYTES,
    SCANS_PER_INTERRUPT,
    UdcConfig,
    estimated_bytes,
)

_USUAL = {"motor_overload_ratio": USUAL_RATIO}
"""Parameters of a drive's PMI if the rack file has none."""
_Found = tuple[str, Diagnostic]


def udc_findings(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return the diagnostics of the tasks of each UDC, and of others that share its registers, by task."""
    found: dict[str, list[Diagnostic]] = {}
    for module in config.modules:
        if isinstance(module, UdcConfig):
            own = _Udc(config, module, programs)
            rules = (own.foreign_commons, own.sizes, own.ticks, own.boolean_pairs, own.double_outputs)
            for rule in (*rules, own.drive_parameters, own.interrupts):
                for name, diagnostic in rule():
                    found.setdefault(name, []).append(diagnostic)
    return found


@dataclass(frozen=True)
class _Written:
    task: str
    variable: CommonVariable
    at: Place


@dataclass(frozen=True)
class _Udc:
    config: RackConfig
    module: UdcConfig
    programs: Mapping[str, Program]

    @cached_property
    def own(self) -> list[Program]:
        return [self.programs[task.name] for task in self.module.tasks if task.name in self.programs]

    @cached_property
    def points(self) -> dict[str, CommonVariable]:
        slot = self.module.slot
        return {item.name: item for item in self.config.declared if item.point is not None and item.point.slot == slot}

    @cached_property
    def written(self) -> list[_Written]:
        return [item for program in self.own for item in self._written_by(program)]

    def foreign_commons(self) -> Iterator[_Found]:
        """A UDC task reaches only its own module's dual port (S-3006 p. 4-2)."""
        for program in self.own:
            for symbol in program.symbols.values():
                if symbol.scope is Scope.COMMON and symbol.name not in self.points:
                    message = f"{symbol.name} does not stand in the dual port of {self.module.name}"
                    hint = f"a UDC task reaches no other commons: give it `slot: {self.module.slot}` and a register"
                    yield program.name, Diagnostic("AMX6480", message, symbol.span, hint=hint)

    def sizes(self) -> Iterator[_Found]:
        """A UDC task has at most 20 Kbytes (2.3)."""
        for program in self.own:
            size = estimated_bytes(program)
            if size > MAX_BYTES:
                message = f"task {program.name} takes about {size} bytes; a UDC task has at most {MAX_BYTES}"
                yield program.name, Diagnostic("AMX6481", message, _scan_loop(program).call.span)

    def ticks(self) -> Iterator[_Found]:
        """Both tasks have the same TICKS (2.3)."""
        if len(self.own) == 2 and self.own[0].ticks != self.own[1].ticks:
            first, second = self.own
            message = f"TICKS is {second.ticks} here and {first.ticks} in task {first.name} of the same UDC"
            hint = "the tasks of a UDC scan together: they need the same TICKS"
            call = _scan_loop(second)
            yield second.name, Diagnostic("AMX6482", message, call.call.span, call.line, hint)

    def boolean_pairs(self) -> Iterator[_Found]:
        """If the UDC writes a boolean, all of an even pair of application registers are its outputs."""
        outputs = {item.variable.name for item in self.written}
        reported: set[int] = set()
        for item in self.written:
            place = item.variable.point
            assert place is not None
            pair = place.register & ~1
            if item.variable.type is not DataType.BOOLEAN or place.register not in APPLICATION or pair in reported:
                continue
            others = [
                other
                for other in self.points.values()
                if other.name not in outputs and pair in (register & ~1 for register in _occupied_registers(other))
            ]
            if others:
                reported.add(pair)
                names = ", ".join(f"{other.name} (line {other.line})" for other in others[:4])
                message = f"writing {item.variable.name} writes the registers {pair} and {pair + 1} whole, with {names}"
                hint = "the UDC writes booleans 32 bits at a time: keep its inputs in other even pairs of registers"
                line, span = item.at
                yield item.task, Diagnostic("AMX6483", message, span, line, hint)

    def double_outputs(self) -> Iterator[_Found]:
        """No bit or register is an output of a UDC task and of a Processor's (S-3056 p. 3-50)."""
        taken: dict[tuple[int, int], _Written] = {}
        for item in self.written:
            taken.update(dict.fromkeys(_bits(item.variable), item))
        names = {program.name for program in self.own}
        for program in self.programs.values():
            if program.name in names:
                continue
            for item in self._written_by(program):
                other = next((taken[bit] for bit in _bits(item.variable) if bit in taken), None)
                if other is not None and _occupied_registers(other.variable)[0] in APPLICATION:
                    message = (
                        f"{item.variable.name} is written here, {other.variable.name} by the UDC's task {other.task}"
                    )
                    hint = "an application register is an output of the UDC or of a Processor, not of both"
                    line, span = item.at
                    yield program.name, Diagnostic("AMX6484", message, span, line, hint)

    def drive_parameters(self) -> Iterator[_Found]:
        """A constant that must equal a parameter of the drive does (36)."""
        for task in self.module.tasks:
            plant, program = self.module.plants.get(task.drive), self.programs.get(task.name)
            if plant is None or program is None:
                continue
            for bound in program.calls.values():
                for name, key, value in _drive_constants(bound):
                    wanted = getattr(plant, key)
                    if wanted is None and plant.motor is not None:
                        wanted = _USUAL[key]
                    if wanted is not None and value != wanted:
                        message = f"{name} of {bound.block.name} is {value}; {key} of plant {plant.name} is {wanted}"
                        notes = (
                            Note(f"{key} stands in line {plant.line} of {self.config.path.name}", bound.call.span),
                        )
                        yield task.name, Diagnostic("AMX6485", message, bound.call.span, bound.line, notes=notes)

    def interrupts(self) -> Iterator[_Found]:
        """A task that scans on the UDC's interrupt uses a period that N scans of the UDC can have."""
        periods = self._periods_ns()
        for program in self.programs.values():
            event = next((item for item in program.events if item.name == program.event), None)
            if event is None or event.interrupt_status is None or not periods or program.period_ns in periods:
                continue
            variable = self.points.get(event.interrupt_status.name)
            if variable is not None and variable.point is not None and variable.point.register == ISCR:
                every = " or ".join(f"{period / NS_PER_MS:g} ms" for period in sorted(periods))
                tick = f"TICKS={program.ticks} x {program.tick_ns / NS_PER_MS:g} ms"
                message = f"{event.name} comes every {every}, but the blocks of this task count with {tick}"
                hint = f"the UDC interrupts every N of its scans, N being register {SCANS_PER_INTERRUPT}"
                yield program.name, Diagnostic("AMX6445", message, event.span, event.number, hint)

    def _periods_ns(self) -> set[int]:
        """Return the periods of the interrupt as far as the tasks show, empty if they cannot be known."""
        place = (self.module.slot, SCANS_PER_INTERRUPT)
        values = list(constant_writes(self.config, self.programs.values()).get(place, []))
        for variable in self.points.values():
            if variable.point is not None and variable.point.register == SCANS_PER_INTERRUPT:
                values += [int(value) for value in variable.presets if not isinstance(value, str)]
                values += [None] if variable.direction is Direction.IN else []
        if not self.own or None in values:
            return set()
        return {value * self.own[0].period_ns for value in values if value is not None and value > 0}

    def _written_by(self, program: Program) -> Iterator[_Written]:
        for name, places in places_that_write(program).items():
            if name in self.points:
                yield _Written(program.name, self.points[name], places[0])


def _scan_loop(program: Program) -> BoundCall:
    return next(bound for bound in program.calls.values() if bound.block.begins_scan)


def _drive_constants(bound: BoundCall) -> Iterator[tuple[str, str, object]]:
    for item in bound.block.inputs:
        if not item.drive_parameter:
            continue
        given = bound.arguments.get(item.name)
        if given is None:
            yield item.name, item.drive_parameter, item.default
        elif isinstance(given, (IntegerLiteral, RealLiteral, BooleanLiteral)):
            yield item.name, item.drive_parameter, given.value


def _occupied_registers(variable: CommonVariable) -> range:
    assert variable.point is not None
    first = variable.point.register
    return range(first, first + (2 if variable.type in (DataType.DOUBLE, DataType.REAL) else 1))


def _bits(variable: CommonVariable) -> Iterable[tuple[int, int]]:
    assert variable.point is not None
    bits = range(16) if variable.point.bit is None else (variable.point.bit,)
    return [(register, bit) for register in _occupied_registers(variable) for bit in bits]
