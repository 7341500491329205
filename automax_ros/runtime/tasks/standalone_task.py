"""A task without a rack: its declarations define its common memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from automax_ros.compile.compiler import CompiledTask, compile_program
from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms
from automax_ros.core.names import Element, element
from automax_ros.core.types import Value
from automax_ros.language.program import Program, Symbol
from automax_ros.language.tree.tree import Scope
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import ViewSpec, fitting
from automax_ros.runtime.tasks.task import Task

_TASK, _OUTSIDE = 1, 2
"""Writers of the memory: the task, and the program that sets variables between scans."""


@dataclass(frozen=True)
class LoneVariable:
    """A simple variable or an array's element of a lone task; ``write`` raises ValueError if it does not fit."""

    label: str
    symbol: Symbol
    read: Callable[[], Value]
    write: Callable[[Value], None]


class StandaloneTask:
    """A task without a rack, whose variables may all be read and set between scans."""

    def __init__(self, program: Program, native: NativeForms = IN_PYTHON) -> None:
        """Compile and install the task; its memory is all 0. ``native`` decides whether it scans as machine code."""
        self.program = program
        self._views = {spec.name: view for view, spec in enumerate(views_of(program))}
        self.memory = CommonMemory(views_of(program))
        self.native = native.form(compiled_alone(program))
        self.task = Task(self.native.compiled, self.memory, writer=_TASK)

    def simple_variables(self) -> list[LoneVariable]:
        """Return every simple variable in the order of declaration."""
        return [self._variable(Element(item)) for item in self.program.symbols.values() if not item.dimensions]

    def variable(self, text: str) -> LoneVariable:
        """Return the value that a text such as ``REF%`` or ``TABLE%(3)`` names; NameFault if the task has none."""
        return self._variable(element(text, self.program.symbols, "the task has no variable"))

    def _variable(self, meant: Element[Symbol]) -> LoneVariable:
        symbol, label, index = meant.variable, meant.label, meant.index
        if symbol.scope is Scope.COMMON:
            view = self._views[symbol.name]
            read = partial(self.memory.read_now, view, index)
            write = partial(self.memory.write_from_outside, view, writer=_OUTSIDE, element=index)
            return LoneVariable(label, symbol, read, write)
        position = self.task.compiled.layout.index(symbol.name)
        read = partial(self._read_local, position, index)
        if symbol.tuning is not None:
            return LoneVariable(label, symbol, read, partial(self._tune, _spec(symbol)))
        return LoneVariable(label, symbol, read, partial(self._write_local, position, index, _spec(symbol)))

    def _tune(self, spec: ViewSpec, value: Value) -> None:
        self.task.tune(spec.name, fitting(spec, value))

    def _read_local(self, position: int, element: int) -> Value:
        held = self.task.state[position]
        return held[element] if isinstance(held, list) else held

    def _write_local(self, position: int, element: int, spec: ViewSpec, value: Value) -> None:
        fit = fitting(spec, value)
        held = self.task.state[position]
        if isinstance(held, list):
            held[element] = fit
        else:
            self.task.state[position] = fit


def views_of(program: Program) -> list[ViewSpec]:
    """Return the commons that a task declares, in the order of declaration."""
    return [_spec(symbol) for symbol in program.symbols.values() if symbol.scope is Scope.COMMON]


def compiled_alone(program: Program) -> CompiledTask:
    """Compile a task for a memory with the views of ``views_of``."""
    return compile_program(program, {spec.name: view for view, spec in enumerate(views_of(program))})


def _spec(symbol: Symbol) -> ViewSpec:
    return ViewSpec(symbol.name, symbol.type, symbol.elements, bool(symbol.dimensions), symbol.length)
