"""Collects the generated statements of a function: suites, temporaries, memory accesses, costs, logging.

One emitter makes one function. Operations with an effect, or that can fail, are hoisted in the order of the source into
statements before the statement that uses them; so expressions are pure and both forms of a scan come from one lowering.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from automax_ros.blocks.declare.declaration import HELPERS
from automax_ros.compile.base import build
from automax_ros.compile.base.cost import CostModel
from automax_ros.compile.base.functions import BUILTINS, OPERATIONS
from automax_ros.core.types import DataType, bare_name, type_of_name
from automax_ros.language.program import Program, Symbol
from automax_ros.language.tree.tree import Scope

_LETTERS = {
    DataType.INTEGER: "i",
    DataType.DOUBLE: "d",
    DataType.REAL: "r",
    DataType.BOOLEAN: "b",
    DataType.STRING: "s",
}


def variable_name(full_name: str) -> str:
    """Return the Python name of a variable: ``SPEED_REF%`` is ``SPEED_REF_i``. Generated helpers are in lower case."""
    return f"{bare_name(full_name)}_{_LETTERS[type_of_name(full_name)]}"


def latched_name(full_name: str) -> str:
    """Return the Python name of a latched value, with which END compares."""
    return f"latched_{variable_name(full_name)}"


def forced_name(full_name: str) -> str:
    """Return the Python name of the flag that says whether a force holds a variable."""
    return f"forced_{variable_name(full_name)}"


def block_prefix(line: int, occurrence: int) -> str:
    """Return the prefix of the names of a block's locals; ``occurrence`` counts the calls of one line from 0."""
    return f"b{line}_" if occurrence == 0 else f"b{line}_{occurrence + 1}_"


def structure_prefix(full_name: str) -> str:
    """Return the prefix of the names of a data structure's states: ``QUEUE%`` gives ``QUEUE_i_``."""
    return f"{variable_name(full_name)}_"


OVER = "over"
"""The local that holds the number of a statement's first overflow."""
DROPPED = "dropped"
"""The local that receives values written to a held variable; nothing reads it."""


@dataclass
class Emitter:
    """Collects the body of one generated function.

    ``modeled`` makes the generator form, which yields the modeled cost in ns before each access to actual memory.
    ``views`` maps the full names of commons to their views. ``in_block`` is set inside a block statement, subscripts
    included: there a latched common is the value of the latch. ``forces`` are the latched commons that may be forced.
    ``held`` are the task's own simple variables that a force holds: values written to them are dropped.
    """

    program: Program
    views: Mapping[str, int]
    modeled: bool
    cost_model: CostModel
    body: list[ast.stmt] = field(default_factory=list)
    line: int = 0
    calls: set[str] = field(default_factory=set)
    extra_globals: dict[str, object] = field(default_factory=dict)
    pending_ns: int = 0
    in_block: bool = False
    forces: frozenset[str] = frozenset()
    held: frozenset[str] = frozenset()
    by_lines: bool = False
    lines: set[int] = field(default_factory=set)
    shown: ast.Tuple = field(default_factory=lambda: build.names(()))
    _temporaries: int = 0
    _overflows: bool = False

    def emit(self, *statements: ast.stmt) -> None:
        """Append statements to the current suite, as part of the current BASIC line."""
        for statement in statements:
            statement.lineno = self.line
        self.body.extend(statements)

    @contextmanager
    def suite(self) -> Iterator[list[ast.stmt]]:
        """Collect statements emitted inside into a separate suite, in which their cost is booked."""
        outer, self.body = self.body, []
        try:
            yield self.body
            self.book_cost()
        finally:
            self.body = outer

    @contextmanager
    def statement(self, line: int) -> Iterator[None]:
        """Frame one BASIC statement: temporaries restart, and its first overflow is logged at its end."""
        self.line, self._temporaries, self._overflows = line, 0, False
        target, position = self.body, len(self.body)
        yield
        if self._overflows:
            target.insert(position, build.assign(OVER, build.constant(0)))
            self.emit(build.when(build.name(OVER), [self.log_call(build.name(OVER))]))
            self._overflows = False

    @contextmanager
    def block(self) -> Iterator[None]:
        """Frame a block statement, in which latched commons have the values of the latch."""
        self.in_block = True
        yield
        self.in_block = False

    def temporary(self) -> str:
        """Return the name of a new temporary of this statement."""
        self._temporaries += 1
        return f"t{self._temporaries}"

    def keep(self, value: ast.expr, changing: frozenset[str] = frozenset()) -> ast.expr:
        """Return an expression that may be used twice: the value itself, or a temporary that holds it.

        ``changing`` are Python names that get another value before the expression is used.
        """
        if build.is_simple(value) and not (isinstance(value, ast.Name) and value.id in changing):
            return value
        name = self.temporary()
        self.emit(build.assign(name, value))
        return build.name(name)

    def member(self, name: str) -> ast.Attribute:
        """Return a member of ``io``."""
        return build.attribute("io", name)

    def operation(self, name: str, *arguments: ast.expr) -> ast.Call:
        """Return a call of an operation of ``runtime.functions`` or of a Python builtin."""
        self.calls.add(name)
        return build.call(name, *arguments)

    def log_call(self, code: ast.expr) -> ast.stmt:
        """Return the statement that logs a problem at the current BASIC line."""
        return build.do(build.call(self.member("log"), build.constant(self.line), code))

    def note_overflow(self, code: ast.expr) -> list[ast.stmt]:
        """Return statements that remember an overflow if it is the statement's first one."""
        self._overflows = True
        return [build.assign(OVER, build.either(build.name(OVER), code))]

    def fallible(self, call: ast.expr) -> ast.expr:
        """Emit a call that returns a result and a problem; log the problem, return the result."""
        result, problem = self.temporary(), self.temporary()
        self.emit(build.assign_all([result, problem], call))
        self.emit(build.when(build.name(problem), [self.log_call(build.name(problem))]))
        return build.name(result)

    def noting(self, call: ast.expr, *overflows: int) -> ast.expr:
        """Emit a call that returns a result and a problem; ``overflows`` count as the statement's overflow."""
        result, problem = self.temporary(), build.name(self.temporary())
        self.emit(build.assign_all([result, problem.id], call))
        tests = [build.compare(problem, "=", build.constant(code)) for code in overflows]
        other: list[ast.stmt] = [build.when(problem, [self.log_call(problem)])]
        self.emit(build.when(tests[0] if len(tests) == 1 else build.either(*tests), self.note_overflow(problem), other))
        return build.name(result)

    def symbol(self, name: str) -> Symbol:
        """Return the declaration of a variable."""
        return self.program.symbols[name]

    def read(self, name: str, element: ast.expr | None = None) -> ast.expr:
        """Return a variable's present value; a common is read from actual memory, in a block from the latch (3.3)."""
        symbol = self.symbol(name)
        if symbol.scope is Scope.LOCAL:
            return build.name(variable_name(name)) if element is None else build.item(variable_name(name), element)
        if self.in_block and symbol.latched:
            return build.name(variable_name(name))
        self.checkpoint()
        arguments: list[ast.expr] = [build.constant(self.views[name])]
        if element is not None:
            arguments.append(element)
        result = self.temporary()
        self.emit(build.assign(result, build.call(self.member("read_now"), *arguments)))
        return build.name(result)

    def element_reader(self, name: str) -> Callable[[ast.expr], ast.expr]:
        """Return a function that makes the read of an array's element from its flat index, which must be in range."""
        if self.symbol(name).scope is Scope.LOCAL:
            return lambda index: build.item(variable_name(name), index)
        view = build.constant(self.views[name])
        return lambda index: build.call(self.member("read_now"), view, index)

    def write(self, name: str, value: ast.expr, element: ast.expr | None = None) -> None:
        """Emit a BASIC statement's store of a value, already within the type, into a variable."""
        symbol = self.symbol(name)
        if symbol.scope is Scope.LOCAL:
            if element is None:
                self.emit(build.assign(DROPPED if name in self.held else variable_name(name), value))
            else:
                self.emit(build.set_item(variable_name(name), element, value))
            return
        value = self.keep(value)
        self.checkpoint()
        arguments: list[ast.expr] = [build.constant(self.views[name]), value]
        if element is not None:
            arguments.append(element)
        self.emit(build.do(build.call(self.member("write_now"), *arguments)))

    def mark_line(self, line: int | None) -> None:
        """Emit the yield at the beginning of a BASIC line; ``shown`` gets its names when all of them are known."""
        if self.by_lines and line is not None:
            self.lines.add(line)
            self.emit(build.do(ast.Yield(ast.Tuple([build.constant(line), self.shown], build.LOAD))))

    def add_cost(self, nanoseconds: int) -> None:
        """Add modeled execution time to the pending cost."""
        if self.modeled:
            self.pending_ns += nanoseconds

    def book_cost(self) -> None:
        """Emit the pending cost: before the flow of control divides or joins."""
        if self.pending_ns:
            self.emit(build.add_to("cost", build.constant(self.pending_ns)))
            self.pending_ns = 0

    def checkpoint(self) -> None:
        """Emit the yield of the cost so far: before an access to actual memory."""
        if not self.modeled:
            return
        self.book_cost()
        self.emit(build.do(ast.Yield(build.name("cost"))), build.assign("cost", build.constant(0)))


def assigned(body: list[ast.stmt]) -> frozenset[str]:
    """Return the names that statements set."""
    return frozenset(
        node.id for node in build.nodes(*body) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    )


def called(emitter: Emitter) -> dict[str, object]:
    """Return the functions that the lowered statements call, by name."""
    functions: dict[str, object] = dict(OPERATIONS)
    functions.update({builtin.carry_out.__name__: builtin.carry_out for builtin in BUILTINS.values()})
    functions.update(HELPERS)
    return {**HELPERS, **{name: functions[name] for name in sorted(emitter.calls)}}


def stores(fields: list[str], body: list[ast.stmt]) -> list[ast.stmt]:
    """Return the stores of the fields that a body sets, one by one, which is faster than all at once."""
    set_there = assigned(body)
    return [
        build.set_item("state", build.constant(position), build.name(name))
        for position, name in enumerate(fields)
        if name in set_there
    ]
