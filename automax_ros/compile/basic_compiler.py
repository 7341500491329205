"""Compiles BASIC tasks to Python functions that execute a burst: the statements from one suspension to the next.

Two functions come from one lowering of the statements:

- ``burst(state, io)``: a burst at one instant;
- ``burst_steps(state, io)``: the same as a generator, which yields the modeled time in ns that has passed before each
  access to shared data, and before the burst ends.

Both begin at the ``PC`` of the state and return a ``Suspension`` with its number, for which the task then waits. All
values that must outlast a suspension are in the state: the PC, GOSUB's stack, limits and steps of FOR, and which files
are open. So a waiting task can be saved, loaded and executed again.
"""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Mapping
from typing import cast

from automax_ros.compile.base import build
from automax_ros.compile.base.assembly import Form, called, local_field, made, stores
from automax_ros.compile.base.cost import CostModel
from automax_ros.compile.base.emitter import Emitter
from automax_ros.compile.base.layout import Layout, Role, StateField
from automax_ros.compile.base.pynames import variable_name
from automax_ros.compile.base.scan_io import LineForm, ScanLines, Suspension
from automax_ros.compile.lowering.basic_statements import EVERY, GOSUB, WaitingLowering
from automax_ros.compile.lowering.flow import PC
from automax_ros.core.types import DataType
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import Scope


class BackgroundCompilation:
    """Compiles one BASIC task."""

    names: tuple[str, ...] = ("burst", "burst_steps")

    def __init__(self, program: Program, views: Mapping[str, int], cost_model: CostModel, held: frozenset[str]) -> None:
        """Create the compilation of a checked BASIC task; ``held`` are its own variables that a force holds."""
        self._program, self._held = program, held
        self._views = {name: views[name] for name, symbol in program.symbols.items() if symbol.scope is Scope.COMMON}
        self._cost = cost_model
        self._fields: dict[str, StateField] = {
            variable_name(symbol.name): local_field(symbol)
            for symbol in program.symbols.values()
            if symbol.scope is Scope.LOCAL
        }
        self._fields[PC] = StateField("PC", DataType.DOUBLE, Role.STACK, 0)
        self._globals: dict[str, object] = {}
        self.definitions("burst")
        self.layout = Layout(tuple(self._fields.values()))

    def functions(self, *names: str) -> dict[str, object]:
        """Compile ``burst``, ``burst_steps``, or both."""
        return made(self.definitions(*names), self._program.name, self._globals)

    def definitions(self, *names: str) -> list[ast.FunctionDef]:
        """Return the functions as trees."""
        return [self._function(name)[0] for name in names]

    def form(self, name: str) -> Form:
        """Return one of the functions for translation into another language."""
        return Form(self.definitions(name)[0], dict(self._globals), self._views)

    def line_form(self) -> LineForm:
        """Compile the form that yields before each BASIC line."""
        name = "burst_lines"
        function, lines = self._function(name)
        functions = made([function], self._program.name, self._globals)
        return LineForm(cast(ScanLines, functions[name]), lines)

    def _function(self, name: str) -> tuple[ast.FunctionDef, frozenset[int]]:
        """Return a function, and the lines that it yields, if any."""
        modeled = name == "burst_steps"
        by_lines = name == "burst_lines"
        emitter = Emitter(self._program, self._views, modeled, self._cost, by_lines=by_lines, held=self._held)
        lowering = WaitingLowering(emitter, {})
        lowering.lower_all(self._program.scan)
        self._fields.update(lowering.fields)
        self._fields[PC] = dataclasses.replace(self._fields[PC], below=lowering.blocks + 1)
        body = [*emitter.body, *self._end(emitter)]
        self._globals.update(called(emitter))
        self._globals.update(emitter.extra_globals)
        opening = [build.assign_all(list(self._fields), build.name("state")), build.assign("steps", build.constant(0))]
        if modeled:
            opening.append(build.assign("cost", build.constant(0)))
        kept = stores(list(self._fields), body)
        emitter.shown.elts += [build.name(known) for known in self._fields]
        return build.function(name, ["state", "io"], [*opening, build.finally_do(body, kept)]), frozenset(emitter.lines)

    def _end(self, emitter: Emitter) -> list[ast.stmt]:
        """Return END, which also leaves a subroutine; the next run begins after the START EVERY, if there is one."""
        emitter.body = []
        emitter.checkpoint()
        if GOSUB in self._fields:
            emitter.emit(build.assign(GOSUB, build.constant(0)))
        if EVERY in self._fields:
            emitter.emit(build.when(build.name(EVERY), [build.assign(PC, build.name(EVERY))]))
        again = build.name(EVERY) if EVERY in self._fields else build.constant(0)
        pair = ast.Tuple([build.constant(int(Suspension.END)), again], build.LOAD)
        return [*emitter.body, ast.Return(pair)]
