"""Lowering of stores: assignment, READ, the steps of FOR (J-3675 chapter 4; semantics, BASIC)."""

from __future__ import annotations

import ast

from automax_ros.compile.base import build
from automax_ros.compile.base.emitter import Emitter
from automax_ros.compile.base.functions import DOUBLE_CLAMPED, INTEGER_CLAMPED, REAL_CLAMPED
from automax_ros.compile.blocks.folding import value_of
from automax_ros.compile.lowering.expressions import SUBSCRIPT, Lowered, clamped, lower, lower_index
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType
from automax_ros.language.checks.rules.typing_rules import type_of
from automax_ros.language.tree.tree import Element, Expression, Target

_EXACT_IN_REAL = 2**24


def store(emitter: Emitter, target: Target, value: Lowered) -> None:
    """Emit ``target = value`` with the conversion of the types; a clamp is the statement's overflow."""
    node = converted(emitter, target.name, target.type, value)
    if isinstance(target, Element):
        node = emitter.keep(node)
        write_at(emitter, target.name, *lower_index(emitter, target), node)
    else:
        emitter.write(target.name, node)


def write_at(emitter: Emitter, name: str, index: ast.expr, in_range: ast.expr | None, value: ast.expr) -> None:
    """Emit the store of a value, which may be used twice, into an array's element at a flat index.

    Where the test ``in_range`` fails, this is logged and nothing is written.
    """
    if in_range is None:
        emitter.write(name, value, index)
        return
    emitter.book_cost()
    with emitter.suite() as inside:
        emitter.write(name, value, index)
    emitter.emit(build.when(in_range, inside, [emitter.log_call(build.constant(SUBSCRIPT))]))


def converted(emitter: Emitter, name: str, kind: DataType, value: Lowered) -> ast.expr:
    """Return a value converted for a variable: truncated, clamped, rounded to 24 bits or cut to its length."""
    return converted_to(emitter, kind, emitter.symbol(name).length, value)


def converted_to(emitter: Emitter, kind: DataType, length: int, value: Lowered) -> ast.expr:
    """Return a value converted for a variable of a type; ``length`` is a string's."""
    if kind is DataType.STRING:
        literal = value_of(value.node)
        if isinstance(literal, str):
            return build.constant(literal[:length])
        return ast.Subscript(value.node, ast.Slice(None, build.constant(length), None), build.LOAD)
    if kind is DataType.BOOLEAN:
        return value.node
    if kind is DataType.REAL:
        return _as_real(emitter, value)
    if value.type is DataType.REAL:
        value = Lowered(emitter.operation("whole", value.node), DataType.DOUBLE, -(10**18), 10**18)
    elif value.type is DataType.BOOLEAN:
        value = Lowered(build.binary(value.node, "+", build.constant(0)), DataType.DOUBLE, 0, 1)
    return clamped(emitter, value, kind, INTEGER_CLAMPED if kind is DataType.INTEGER else DOUBLE_CLAMPED).node


def _as_real(emitter: Emitter, value: Lowered) -> ast.expr:
    literal = value_of(value.node)
    if isinstance(literal, (int, float)):
        return build.constant(stored_real(float(literal))[0])
    if value.type is not DataType.REAL and value.low >= -_EXACT_IN_REAL and value.high <= _EXACT_IN_REAL:
        return build.binary(value.node, "+", build.constant(0.0))
    result, flag = emitter.temporary(), emitter.temporary()
    emitter.emit(build.assign_all([result, flag], emitter.operation("store_real", value.node)))
    emitter.emit(build.when(build.name(flag), emitter.note_overflow(build.constant(REAL_CLAMPED))))
    return build.name(result)


def printable(emitter: Emitter, item: Expression) -> ast.expr:
    """Return an expression's value for PRINT: a REAL stays a REAL, whatever its literal."""
    value = lower(emitter, item)
    if type_of(item) is DataType.REAL and isinstance(literal := value_of(value.node), int):
        return build.constant(float(literal))
    return value.node
