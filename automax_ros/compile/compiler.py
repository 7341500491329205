"""The compiler from a checked program to Python functions.

For a control-block task three functions come from one lowering of the same tree:

- ``startup(state, io)``: the statements before SCAN_LOOP;
- ``scans(state, io)``: a generator; each ``next`` is one scan from SCAN_LOOP to END, at one instant;
- ``scan_steps(state, io)``: one scan as a generator, which yields the modeled time in ns that has passed before each
  read or write of actual memory, for execution with modeled times.

``scans`` and ``scan_steps`` have a second form for tasks with forced commons: there a block's write to a forced common
is dropped in the scan's buffer, so that later blocks see the forced value (decision).

While the task's own variables are forced, ``CompiledTask.holding`` gives functions that drop what is written to these
variables, including the counting of a FOR: a loop whose variable is held within its limits ends by the limit of
statements, which faults the task (decision: on the hardware such a scan never ends either).

``startup`` and ``scan_steps`` return, and ``scans`` yields, True if the task executed STOP. ``state`` is the list of
the layout's fields: loaded into locals at the start, stored back at the end, also when a scan is aborted. ``scans``
ends when it is closed: between scans its locals hold the state, so that a scan neither loads nor stores it. ``io`` has
all other accesses of a scan: see ``ScanIo``.

A BASIC task has two functions that execute a burst, the statements from one suspension to the next:
``burst(state, io)`` at one instant, and the generator ``burst_steps(state, io)``, which yields the modeled time before
each access to shared data, and before the burst ends. Both begin at the ``PC`` of the state and return a ``Suspension``
with its number, for which the task then waits. All values that must outlast a suspension are in the state: the PC,
GOSUB's stack, limits and steps of FOR, and which files are open. So a waiting task can be saved, loaded and executed
again.

Functions other than ``startup``, ``scans`` and the printed source are made on first use: most runs need none.
"""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, ClassVar, cast

from automax_ros.compile.base import build
from automax_ros.compile.base.build import made
from automax_ros.compile.base.cost import CostModel
from automax_ros.compile.base.emitter import (
    Emitter,
    block_prefix,
    called,
    forced_name,
    latched_name,
    stores,
    variable_name,
)
from automax_ros.compile.base.layout import Layout, Role, StateField, local_field
from automax_ros.compile.base.native_source import Form
from automax_ros.compile.base.scan_io import (
    BackgroundIo,
    LineForm,
    ScanIo,
    ScanLines,
    ScanTooLong,
    StateValues,
    Suspension,
    Wish,
)
from automax_ros.compile.lowering.basic_statements import EVERY, GOSUB, WaitingLowering
from automax_ros.compile.lowering.calls import BlockInstance, instance_of, lower_minor_loop
from automax_ros.compile.lowering.flow import PC
from automax_ros.compile.lowering.statements import STOPPED, StatementLowering
from automax_ros.core.types import DataType
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import Call, Reference, Scope
from automax_ros.language.tree.walk import statements_in_order

Startup = Callable[[StateValues, ScanIo], bool]
Scans = Callable[[StateValues, ScanIo], Generator[bool, None, None]]
Burst = Callable[[StateValues, BackgroundIo], Wish]
BurstSteps = Callable[[StateValues, BackgroundIo], Generator[int, None, Wish]]
ScanSteps = Callable[[StateValues, ScanIo], Generator[int, None, bool]]


@dataclass(frozen=True)
class CompiledTask:
    """A task ready to run: a control-block task has scans, a BASIC task has bursts and no ``scans``.

    ``latched`` are the commons that a scan latches, with their views, ``written`` those that blocks can change;
    ``held`` are the task's own variables that keep their values whatever the functions write.
    """

    program: Program
    layout: Layout
    latched: tuple[str, ...]
    written: tuple[str, ...]
    startup: Startup
    scans: Scans
    _compilation: _Compilation = field(repr=False, compare=False)
    _again: Callable[[frozenset[str]], CompiledTask] = field(repr=False, compare=False)
    held: frozenset[str] = frozenset()
    latched_views: tuple[int, ...] = ()

    def with_scans(self, scans: Scans, scans_forced: Scans) -> CompiledTask:
        """Return the same task with other forms of ``scans`` and ``scans_forced``, which give the same bits.

        While variables are held the task scans in the compiler's own form (decision): nothing is built amid a run.
        """

        def again(held: frozenset[str]) -> CompiledTask:
            return replace(self._again(held), _again=again) if held else swapped

        swapped = replace(self, scans=scans, _again=again)
        vars(swapped)["scans_forced"] = scans_forced
        return swapped

    def holding(self, names: frozenset[str]) -> CompiledTask:
        """Return the same task with its own simple variables of these full names held; tunables cannot be."""
        return self if names == self.held else self._again(names)

    @cached_property
    def scans_forced(self) -> Scans:
        """The same as ``scans`` while commons that blocks write may be forced."""
        return cast(Scans, self._compilation.functions("scans_forced")["scans_forced"])

    @cached_property
    def scan_steps(self) -> ScanSteps:
        """One scan in steps of modeled time."""
        return cast(ScanSteps, self._compilation.functions("scan_steps")["scan_steps"])

    @cached_property
    def scan_steps_forced(self) -> ScanSteps:
        """The same as ``scan_steps`` while commons that blocks write may be forced."""
        return cast(ScanSteps, self._compilation.functions("scan_steps_forced")["scan_steps_forced"])

    @cached_property
    def burst(self) -> Burst:
        """The burst of a BASIC task from one suspension to the next, at one instant."""
        return cast(Burst, self._compilation.functions("burst")["burst"])

    @cached_property
    def burst_steps(self) -> BurstSteps:
        """The same in steps of modeled time."""
        return cast(BurstSteps, self._compilation.functions("burst_steps")["burst_steps"])

    @cached_property
    def scan_lines(self) -> LineForm:
        """One scan, or a BASIC task's burst, line by line, for stepping."""
        return self._compilation.line_form()

    def form(self, name: str) -> Form:
        """Return one of the functions for translation into another language."""
        return self._compilation.form(name)

    @cached_property
    def source(self) -> str:
        """The functions as text."""
        definitions = self._compilation.definitions(*self._compilation.names)
        return "\n\n\n".join(ast.unparse(item) for item in build.placed(definitions).body) + "\n"


def compile_program(program: Program, views: Mapping[str, int], cost_model: CostModel | None = None) -> CompiledTask:
    """Compile a checked program against a rack's views (full name -> view) of all commons it declares."""
    return _compile(program, views, cost_model or CostModel(), frozenset())


def _compile(program: Program, views: Mapping[str, int], cost_model: CostModel, held: frozenset[str]) -> CompiledTask:
    again = partial(_compile, program, views, cost_model)
    kind = _BasicCompilation if program.is_basic else _ScanCompilation
    return kind(program, views, cost_model, held).result(again)


def _no_startup(_: StateValues, __: ScanIo) -> bool:
    return False


def _no_scans(_: StateValues, __: ScanIo) -> Generator[bool, None, None]:
    yield from ()


_Part = tuple[str, Emitter, StatementLowering]
"""A function that is lowered, before its state is known: its name, its body, and what the body needs."""


class _Compilation(ABC):
    """Makes the functions of one task on demand; ``names`` are those of its printed source."""

    names: ClassVar[tuple[str, ...]]
    line_name: ClassVar[str]

    def __init__(self, program: Program, views: Mapping[str, int], cost_model: CostModel, held: frozenset[str]) -> None:
        self._program, self._cost, self._held = program, cost_model, held
        self._views = {name: views[name] for name, symbol in program.symbols.items() if symbol.scope is Scope.COMMON}
        self._fields: dict[str, StateField] = {
            variable_name(symbol.name): local_field(symbol)
            for symbol in program.symbols.values()
            if symbol.scope is Scope.LOCAL
        }
        self._globals: dict[str, object] = {"ScanTooLong": ScanTooLong}

    @abstractmethod
    def result(self, again: Callable[[frozenset[str]], CompiledTask]) -> CompiledTask:
        """Compile the task; ``again`` compiles it with other variables held."""

    def functions(self, *names: str) -> dict[str, Any]:
        return made(self.definitions(*names), self._program.name, self._globals)

    def definitions(self, *names: str) -> list[ast.FunctionDef]:
        """Return functions as trees; the state's fields are known once ``scans`` or ``burst`` is lowered."""
        parts = [self._lower(name) for name in names]
        return [self._wrap(*part) for part in parts]

    def form(self, name: str) -> Form:
        return Form(self.definitions(name)[0], dict(self._globals), self._views)

    def line_form(self) -> LineForm:
        """Compile the form that yields before each line; it applies forces."""
        part = self._lower(self.line_name)
        functions = made([self._wrap(*part)], self._program.name, self._globals)
        return LineForm(cast(ScanLines, functions[self.line_name]), frozenset(part[1].lines))

    @abstractmethod
    def _lower(self, name: str) -> _Part: ...

    @abstractmethod
    def _wrap(self, name: str, emitter: Emitter, lowering: StatementLowering) -> ast.FunctionDef: ...

    def _emitter(self, name: str) -> Emitter:
        modeled, by_lines = "_steps" in name, "_lines" in name
        return Emitter(self._program, self._views, modeled, self._cost, by_lines=by_lines, held=self._held)

    def _bind(self, emitter: Emitter) -> None:
        self._globals.update(called(emitter))
        self._globals.update(emitter.extra_globals)


class _BasicCompilation(_Compilation):
    names = ("burst", "burst_steps")
    line_name = "burst_lines"

    def result(self, again: Callable[[frozenset[str]], CompiledTask]) -> CompiledTask:
        self._fields[PC] = StateField("PC", DataType.DOUBLE, Role.STACK, 0)
        self.definitions("burst")
        layout = Layout(tuple(self._fields.values()))
        return CompiledTask(self._program, layout, (), (), _no_startup, _no_scans, self, again, self._held)

    def _lower(self, name: str) -> _Part:
        emitter = self._emitter(name)
        lowering = WaitingLowering(emitter, {})
        lowering.lower_all(self._program.scan)
        self._fields.update(lowering.fields)
        self._fields[PC] = replace(self._fields[PC], below=lowering.blocks + 1)
        self._end(emitter)
        return name, emitter, lowering

    def _wrap(self, name: str, emitter: Emitter, _: StatementLowering) -> ast.FunctionDef:
        self._bind(emitter)
        opening = [build.assign_all(list(self._fields), build.name("state")), build.assign("steps", build.constant(0))]
        if emitter.modeled:
            opening.append(build.assign("cost", build.constant(0)))
        kept = stores(list(self._fields), emitter.body)
        emitter.shown.elts += [build.name(known) for known in self._fields]
        return build.function(name, ["state", "io"], [*opening, build.finally_do(emitter.body, kept)])

    def _end(self, emitter: Emitter) -> None:
        """Emit END, which also leaves a subroutine; the next run begins after the START EVERY, if there is one."""
        emitter.checkpoint()
        if GOSUB in self._fields:
            emitter.emit(build.assign(GOSUB, build.constant(0)))
        if EVERY in self._fields:
            emitter.emit(build.when(build.name(EVERY), [build.assign(PC, build.name(EVERY))]))
        again = build.name(EVERY) if EVERY in self._fields else build.constant(0)
        emitter.emit(ast.Return(ast.Tuple([build.constant(int(Suspension.END)), again], build.LOAD)))


class _ScanCompilation(_Compilation):
    names = ("startup", "scans", "scan_steps")
    line_name = "scan_lines_forced"

    def __init__(self, program: Program, views: Mapping[str, int], cost_model: CostModel, held: frozenset[str]) -> None:
        super().__init__(program, views, cost_model, held)
        self._instances = _instances(program)
        self._latched = tuple(symbol.name for symbol in program.symbols.values() if symbol.latched)
        for instance in self._instances.values():
            self._fields.update(instance.fields)

    def result(self, again: Callable[[frozenset[str]], CompiledTask]) -> CompiledTask:
        functions = self.functions("startup", "scans")
        return CompiledTask(
            program=self._program,
            layout=Layout(tuple(self._fields.values())),
            latched=self._latched,
            written=self._written_names(),
            startup=functions["startup"],
            scans=functions["scans"],
            _compilation=self,
            _again=again,
            held=self._held,
            latched_views=tuple(self._views[name] for name in self._latched),
        )

    def _lower(self, name: str) -> _Part:
        emitter = self._emitter(name)
        emitter.forces = frozenset(self._written_names()) if name.endswith("_forced") else frozenset()
        lowering = StatementLowering(emitter, dict(self._instances.items()))
        if name == "startup":
            lowering.lower_all(self._program.startup)
        else:
            self._lower_scan(emitter, lowering)
        self._fields.update(lowering.fields)
        return name, emitter, lowering

    def _lower_scan(self, emitter: Emitter, lowering: StatementLowering) -> None:
        emitter.line = self._program.scan_loop_line
        emitter.add_cost(self._cost.scan_loop_ns(self._program))
        self._latch(emitter)
        if self._program.cml is not None:
            lower_minor_loop(emitter, self._program.cml)
        lowering.lower_all(self._program.scan)
        commit = self._commit(emitter)
        emitter.body += [build.when(build.inverse(build.name(STOPPED)), commit)] if lowering.can_stop else commit

    def _latch(self, emitter: Emitter) -> None:
        """Emit the latch; a task without latched commons still takes the time of SCAN_LOOP."""
        emitter.checkpoint()
        latch = build.call(emitter.member("latch"))
        if not self._latched:
            emitter.emit(build.do(latch))
            return
        written = self._written_names()
        kept = [name for name in self._latched if name in written]
        names = [latched_name(name) if name in written else variable_name(name) for name in self._latched]
        emitter.emit(build.assign_all(names, latch))
        for name in kept:
            emitter.emit(build.assign(variable_name(name), build.name(latched_name(name))))
        if emitter.forces:
            flags = [forced_name(name) for name in kept]
            emitter.emit(build.assign_all(flags, build.call(emitter.member("forces"))))

    def _written_names(self) -> tuple[str, ...]:
        bounds = [instance.bound for instance in self._instances.values()]
        if self._program.cml is not None:
            bounds.append(self._program.cml)
        outputs = {target.name for bound in bounds for target in bound.targets if isinstance(target, Reference)}
        return tuple(name for name in self._latched if name in outputs)

    def _commit(self, emitter: Emitter) -> list[ast.stmt]:
        """Return END: values that differ from the latch are written back."""
        outer, emitter.body = emitter.body, []
        emitter.add_cost(self._cost.end_ns(self._program))
        written = self._written_names()
        emitter.checkpoint()
        if written:
            emitter.emit(build.assign("changes", ast.List([], build.LOAD)))
        for name in self._latched:
            if name in written:
                pair = ast.Tuple([build.constant(self._views[name]), build.name(variable_name(name))], build.LOAD)
                append = build.do(build.call(build.attribute("changes", "append"), pair))
                changed = build.compare(build.name(variable_name(name)), "<>", build.name(latched_name(name)))
                emitter.emit(build.when(changed, [append]))
        if written:
            commit = build.do(build.call(emitter.member("commit"), build.name("changes")))
            emitter.emit(build.when(build.name("changes"), [commit]))
        body, emitter.body = emitter.body, outer
        return body

    def _wrap(self, name: str, emitter: Emitter, lowering: StatementLowering) -> ast.FunctionDef:
        """Return the whole function: load the state, bind the names in use, execute the body, store the state."""
        self._bind(emitter)
        body = emitter.body
        opening: list[ast.stmt] = []
        if self._fields:
            opening.append(build.assign_all(list(self._fields), build.name("state")))
        if lowering.block_lines:
            lines: list[ast.expr] = [build.constant(line) for line in lowering.block_lines]
            opening.append(build.assign("block_lines", ast.Tuple(lines, build.LOAD)))
        stored = stores(list(self._fields), body)
        body = [*self._start_values(emitter, lowering), *body]
        stopped = build.name(STOPPED) if lowering.can_stop else build.constant(False)
        if name.startswith("scans"):
            body.append(build.do(ast.Yield(stopped)))
            forever = build.loop(build.constant(True), body)
            return build.function(name, ["state", "io"], [*opening, build.finally_do([forever], stored)])
        emitter.shown.elts += [build.name(known) for known in (*self._fields, *map(variable_name, self._latched))]
        if lowering.counts_steps or emitter.modeled or emitter.by_lines:
            body = [build.finally_do(body, stored)]
        else:
            body += stored
        return build.function(name, ["state", "io"], [*opening, *body, ast.Return(stopped)])

    def _start_values(self, emitter: Emitter, lowering: StatementLowering) -> list[ast.stmt]:
        """Return the start of each execution: an empty GOSUB stack, no statements counted, no STOP, no time."""
        values = {
            "gosub_depth": (0, "gosub_depth" in self._fields),
            "steps": (0, lowering.counts_steps),
            STOPPED: (False, lowering.can_stop),
            "cost": (0, emitter.modeled),
        }
        return [build.assign(name, build.constant(value)) for name, (value, used) in values.items() if used]


def _instances(program: Program) -> dict[object, BlockInstance]:
    instances: dict[object, BlockInstance] = {}
    occurrences: dict[int, int] = {}
    for call, _ in statements_in_order(program.scan):
        if not isinstance(call, Call):
            continue
        bound = program.calls[call.span]
        occurrence = occurrences.get(bound.line, 0)
        occurrences[bound.line] = occurrence + 1
        instances[call.span] = instance_of(bound, block_prefix(bound.line, occurrence), occurrence, program.period_ns)
    return instances
