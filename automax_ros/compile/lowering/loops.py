"""Lowering of FOR and NEXT: FOR tests at the top; after the loop its variable holds the value that failed (decision).

An increment that leaves the variable's range is logged, clamped, and ends the loop (decision: or it would never end).
"""

from __future__ import annotations

import ast
from dataclasses import dataclass

from automax_ros.compile.base import build
from automax_ros.compile.base.emitter import OVER, Emitter
from automax_ros.compile.base.layout import Role, StateField
from automax_ros.compile.blocks.folding import value_of
from automax_ros.compile.lowering.expressions import Lowered, lower, of_type
from automax_ros.compile.lowering.stores import converted, store
from automax_ros.core.types import DataType
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import Call, For, Gosub, OnJump, Reference, Scope, Statement
from automax_ros.language.tree.walk import statements_in_order, targets_of

STEP_IS_ZERO = 7027


@dataclass(frozen=True)
class Loop:
    """A loop that has begun: its limit and step are literals or locals named after ``place``, its line.

    A second loop of one line has ``.2`` after the line, and so on.
    """

    statement: For
    place: str
    stop: ast.expr
    step: ast.expr
    stop_type: DataType
    step_type: DataType
    stop_bounds: tuple[int, int]
    step_bounds: tuple[int, int]

    @property
    def may_be_idle(self) -> bool:
        """Whether the step is known only at run time and may be 0."""
        return value_of(self.step) is None


def begin_loop(emitter: Emitter, statement: For, place: str) -> Loop:
    """Emit the start of a loop: the variable gets its first value, limit and step are evaluated once."""
    prefix = f"for{place.replace('.', '_')}"
    start = lower(emitter, statement.start)
    start = Lowered(emitter.keep(start.node), start.type, start.low, start.high)
    stop = lower(emitter, statement.stop)
    step = Lowered(build.constant(1), DataType.DOUBLE, 1, 1)
    if statement.step is not None:
        step = lower(emitter, statement.step)
    stop_node = _kept(emitter, f"{prefix}_stop", stop.node)
    step_node = _kept(emitter, f"{prefix}_step", step.node)
    store(emitter, statement.variable, start)
    bounds = (stop.low, stop.high), (step.low, step.high)
    loop = Loop(statement, place, stop_node, step_node, stop.type, step.type, *bounds)
    if loop.may_be_idle:
        is_zero = build.compare(step_node, "=", build.constant(0))
        emitter.emit(build.when(is_zero, [emitter.log_call(build.constant(STEP_IS_ZERO))]))
    return loop


def _kept(emitter: Emitter, name: str, node: ast.expr) -> ast.expr:
    if value_of(node) is not None:
        return node
    emitter.emit(build.assign(name, node))
    return build.name(name)


def loop_fields(loop: Loop) -> dict[str, StateField]:
    """Return the state fields of a loop's limit and step, by their Python names."""
    fields = {}
    for word, node, kind in (("stop", loop.stop, loop.stop_type), ("step", loop.step, loop.step_type)):
        if isinstance(node, ast.Name):
            stored = DataType.REAL if kind is DataType.REAL else DataType.DOUBLE
            fields[node.id] = StateField(f"{loop.place} FOR.{word}", stored, Role.STACK, stored.zero)
    return fields


def loop_test(emitter: Emitter, loop: Loop) -> ast.expr:
    """Return the test at the top of a turn; the variable is read as in any BASIC statement."""
    variable = emitter.read(loop.statement.variable.name)
    step = value_of(loop.step)
    if isinstance(step, (int, float)):
        return build.compare(variable, "<=" if step >= 0 else ">=", loop.stop)
    rising = build.compare(loop.step, ">=", build.constant(0))
    return build.choose(rising, build.compare(variable, "<=", loop.stop), build.compare(variable, ">=", loop.stop))


def end_turn(emitter: Emitter, loop: Loop) -> ast.expr | None:
    """Emit NEXT: add the step; return the test whether the sum left the variable's range, None where it cannot."""
    target = loop.statement.variable
    present = of_type(emitter.read(target.name), target.type)
    total = build.binary(present.node, "+", loop.step)
    if DataType.REAL in (target.type, loop.step_type):
        value = Lowered(total, DataType.REAL)
    else:
        value = Lowered(total, DataType.DOUBLE, *_bounds_of_sum(emitter, loop, present))
    before = len(emitter.body)
    node = converted(emitter, target.name, target.type, value)
    overflows = len(emitter.body) > before
    emitter.write(target.name, node)
    return build.name(OVER) if overflows else None


def _bounds_of_sum(emitter: Emitter, loop: Loop, present: Lowered) -> tuple[int, int]:
    """Return the bounds of variable + step; the loop's limit bounds a variable that nothing else sets."""
    low, high = present.low + loop.step_bounds[0], present.high + loop.step_bounds[1]
    if loop.stop_type is not DataType.REAL and counts_alone(emitter.program, loop.statement):
        if loop.step_bounds[0] >= 0:
            high = min(high, loop.stop_bounds[1] + loop.step_bounds[1])
        elif loop.step_bounds[1] < 0:
            low = max(low, loop.stop_bounds[0] + loop.step_bounds[0])
    return low, high


def counts_alone(program: Program, loop: For) -> bool:
    """Return whether only a loop itself can set its variable while it runs."""
    name = loop.variable.name
    return program.symbols[name].scope is Scope.LOCAL and not _sets(program, loop.body, name)


def _sets(program: Program, statements: tuple[Statement, ...], name: str) -> bool:
    """Return whether a loop's statements may set a variable, as a subroutine may. No jump leads back into a loop."""
    for statement, _ in statements_in_order(statements):
        if isinstance(statement, Gosub) or (isinstance(statement, OnJump) and statement.gosub):
            return True
        if any(target.name == name for target in targets_of(statement)):
            return True
        if isinstance(statement, Call) and Reference(name) in program.calls[statement.span].targets:
            return True
    return False
