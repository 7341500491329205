"""A task without a rack: its own declarations define the common memory it works on."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from automax_ros.compile.compiler import CompiledTask, compile_program
from automax_ros.core.types import Value
from automax_ros.language.checks.suggestions import Suggester
from automax_ros.language.program import Program, Symbol
from automax_ros.language.syntax.tree import Scope
from automax_ros.rack.findings import quoted
from automax_ros.running.memory import CommonMemory
from automax_ros.running.task import Task
from automax_ros.running.views import ViewSpec, fitting

_NAME = re.compile(
    r"(?P<name>[A-Z_][A-Z0-9_]{0,63}[%!@$]?)(?:[(\[](?P<subscripts>[0-9]{1,6}(?:,[0-9]{1,6}){0,3})[)\]])?"
)
_TASK, _OUTSIDE = 1, 2
"""Writers of the memory: the task, and whoever sets variables between scans."""


class UnknownVariableError(ValueError):
    """A text names no value of the task; ``code`` is AMX6911 (no such variable) or AMX6913 (subscripts)."""

    def __init__(self, code: str, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.hint = hint


@dataclass(frozen=True)
class LoneVariable:
    """One value of a lone task: a simple variable or an array's element, with how to read and how to set it.

    ``write`` takes a value of the variable's own type and raises ValueError if the variable cannot hold it.
    """

    label: str
    symbol: Symbol
    read: Callable[[], Value]
    write: Callable[[Value], None]


class LoneTask:
    """A task in a rack of its own, where everybody may read and set all its variables between scans."""

    def __init__(self, program: Program) -> None:
        """Compile and install the task; its memory is all 0."""
        self.program = program
        self._views = {spec.name: view for view, spec in enumerate(views_of(program))}
        self.memory = CommonMemory(views_of(program))
        self.task = Task(compiled_alone(program), self.memory, writer=_TASK)

    def simple_variables(self) -> list[LoneVariable]:
        """Return every simple variable in the order of declaration."""
        return [self._variable(item, item.name, 0) for item in self.program.symbols.values() if not item.dimensions]

    def variable(self, text: str) -> LoneVariable:
        """Return the value that a text such as ``REF%`` or ``TABLE%(3)`` names; case and blanks do not matter.

        Raises:
            UnknownVariableError: the task has no such variable or element.
        """
        plain = "".join(text.split())
        match = _NAME.fullmatch(plain.upper()) if plain.isascii() else None
        symbols = self.program.symbols
        symbol = symbols.get(match["name"]) if match else None
        if match is None or symbol is None:
            name = match["name"] if match else plain[:80].upper()
            raise UnknownVariableError(
                "AMX6911", f"the task has no variable {quoted(text)}", _suggestion(name, symbols)
            )
        subscripts = tuple(map(int, match["subscripts"].split(","))) if match["subscripts"] else ()
        return self._variable(symbol, _label(symbol, subscripts), _element(symbol, subscripts, text))

    def _variable(self, symbol: Symbol, label: str, element: int) -> LoneVariable:
        if symbol.scope is Scope.COMMON:
            view = self._views[symbol.name]
            read = partial(self.memory.read_now, view, element)
            return LoneVariable(label, symbol, read, partial(self._write_common, view, element))
        position = self.task.compiled.layout.index(symbol.name)
        read = partial(self._read_local, position, element)
        if symbol.tuning is not None:
            return LoneVariable(label, symbol, read, partial(self._tune, _spec(symbol)))
        return LoneVariable(label, symbol, read, partial(self._write_local, position, element, _spec(symbol)))

    def _write_common(self, view: int, element: int, value: Value) -> None:
        self.memory.write_from_outside(view, value, _OUTSIDE, element)

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


def _label(symbol: Symbol, subscripts: tuple[int, ...]) -> str:
    return f"{symbol.name}({','.join(map(str, subscripts))})" if subscripts else symbol.name


def _element(symbol: Symbol, subscripts: tuple[int, ...], text: str) -> int:
    """Return the flat index of an element, last subscript fastest; 0 for a simple variable."""
    name, sizes = symbol.name, symbol.dimensions
    if len(subscripts) != len(sizes):
        if not sizes:
            raise UnknownVariableError("AMX6913", f"{quoted(text)}: {name} is a simple variable", f"write {name}")
        last = ",".join(str(size - 1) for size in sizes)
        wanted = f"has {len(sizes)} subscripts" if len(sizes) > 1 else "is an array"
        raise UnknownVariableError(
            "AMX6913", f"{quoted(text)}: {name} {wanted}", f"name one element, the last is {name}({last})"
        )
    index = 0
    for subscript, size in zip(subscripts, sizes, strict=True):
        if subscript >= size:
            message = f"{quoted(text)}: the subscript {subscript} is not 0 to {size - 1}"
            raise UnknownVariableError("AMX6913", message)
        index = index * size + subscript
    return index


def _suggestion(name: str, symbols: dict[str, Symbol]) -> str | None:
    if "(" in name and ")" not in name:
        return 'a name with several subscripts needs quotes in a CSV table: "TABLE%(1,2)"'
    if ";" in name or "\t" in name:
        return "columns are separated by commas"
    return Suggester().hint(name, symbols)
