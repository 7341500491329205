"""Lowering of BASIC expressions to pure Python expressions (J-3675 chapter 5; semantics, BASIC).

Integers are computed in 32 bits with clamping; static bounds show where no clamp is needed. There is no short circuit:
the emitter hoists operations that can fail, so the operands of Python's ``and`` are always pure.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass, replace

from automax_ros.compile.base import build
from automax_ros.compile.base.emitter import Emitter
from automax_ros.compile.base.functions import BUILTINS, OVERFLOW
from automax_ros.core.numbers import INT32_MAX, INT32_MIN, clamp32
from automax_ros.core.types import DataType
from automax_ros.language.checks.rules.typing_rules import spine
from automax_ros.language.tree.functions import FUNCTIONS
from automax_ros.language.tree.tree import (
    Binary,
    BooleanLiteral,
    Element,
    Expression,
    FunctionCall,
    IntegerLiteral,
    RealLiteral,
    Reference,
    StringLiteral,
    Unary,
)

DEPTH_LIMIT = 40
"""Depth at which the value of a chain is stored in a temporary, so that no Python tree gets too deep to compile."""
SUBSCRIPT = 7026


@dataclass(frozen=True)
class Lowered:
    """A pure Python expression with its type; ``low`` and ``high`` bound an integer, ``depth`` is that of the tree."""

    node: ast.expr
    type: DataType
    low: int = 0
    high: int = 0
    depth: int = 0


_BOUNDS = {
    kind: (int(kind.range[0]), int(kind.range[1])) for kind in (DataType.INTEGER, DataType.DOUBLE, DataType.BOOLEAN)
}


def of_type(node: ast.expr, kind: DataType) -> Lowered:
    """Return a value of a variable's type, with that type's bounds."""
    return Lowered(node, kind, *_BOUNDS.get(kind, (0, 0)))


def lower(emitter: Emitter, expression: Expression) -> Lowered:
    """Return the Python form of a checked expression; statements that it needs before it are emitted."""
    if isinstance(expression, Binary):
        return _lower_chain(emitter, expression)
    if isinstance(expression, Reference):
        return of_type(emitter.read(expression.name), expression.type)
    if isinstance(expression, Element):
        return lower_element(emitter, expression)
    if isinstance(expression, IntegerLiteral):
        value = clamp32(expression.value)
        return Lowered(build.constant(value), DataType.DOUBLE, value, value)
    if isinstance(expression, RealLiteral):
        return Lowered(build.constant(expression.value), DataType.REAL)
    if isinstance(expression, BooleanLiteral):
        return of_type(build.constant(expression.value), DataType.BOOLEAN)
    if isinstance(expression, StringLiteral):
        return Lowered(build.constant(expression.value), DataType.STRING)
    if isinstance(expression, FunctionCall):
        return _lower_call(emitter, expression)
    return _lower_unary(emitter, expression)


def lower_element(emitter: Emitter, element: Element) -> Lowered:
    """Return an array element's present value; an index out of range is logged and gives the type's zero."""
    index, in_range = lower_index(emitter, element)
    if in_range is None:
        return of_type(emitter.keep(emitter.read(element.name, index)), element.type)
    result = emitter.temporary()
    emitter.book_cost()
    with emitter.suite() as inside:
        emitter.emit(build.assign(result, emitter.read(element.name, index)))
    outside = [emitter.log_call(build.constant(SUBSCRIPT)), build.assign(result, build.constant(element.type.zero))]
    emitter.emit(build.when(in_range, inside, outside))
    return of_type(build.name(result), element.type)


def lower_index(
    emitter: Emitter, element: Element, changing: frozenset[str] = frozenset()
) -> tuple[ast.expr, ast.expr | None]:
    """Return an element's flat index, last subscript fastest, and the test that it is in range, if one is needed.

    ``changing`` are Python names that get another value before the index is used.
    """
    dimensions = emitter.symbol(element.name).dimensions
    flat: ast.expr | None = None
    tests: list[ast.expr] = []
    for subscript, size in zip(element.subscripts, dimensions, strict=True):
        lowered = lower(emitter, subscript)
        index = emitter.keep(lowered.node, changing)
        if lowered.low < 0 or lowered.high >= size:
            tests.append(ast.Compare(build.constant(0), [ast.LtE(), ast.Lt()], [index, build.constant(size)]))
        flat = index if flat is None else build.binary(build.binary(flat, "*", build.constant(size)), "+", index)
    assert flat is not None
    if not tests:
        return flat, None
    return flat, tests[0] if len(tests) == 1 else build.both(*tests)


def clamped(emitter: Emitter, value: Lowered, kind: DataType, code: int) -> Lowered:
    """Return an integer clamped to a type, with an overflow noted, where its bounds allow one."""
    low, high = _BOUNDS[kind]
    if low <= value.low and value.high <= high:
        return Lowered(value.node, kind, value.low, value.high)
    name = emitter.temporary()
    emitter.emit(build.assign(name, value.node))
    above = [build.assign(name, build.constant(high)), *emitter.note_overflow(build.constant(code))]
    below = [build.assign(name, build.constant(low)), *emitter.note_overflow(build.constant(code))]
    branches: list[ast.stmt] = []
    if value.low < low:
        branches = [build.when(build.compare(build.name(name), "<", build.constant(low)), below)]
    if value.high > high:
        branches = [build.when(build.compare(build.name(name), ">", build.constant(high)), above, branches)]
    emitter.emit(*branches)
    return Lowered(build.name(name), kind, max(low, value.low), min(high, value.high))


def _lower_unary(emitter: Emitter, expression: Unary) -> Lowered:
    literal = expression.operand
    if expression.operator == "-" and isinstance(literal, IntegerLiteral) and literal.value >= 0:
        # the sign is part of the constant: -2147483648 is valid, 2147483648 is not
        return Lowered(build.constant(-literal.value), DataType.DOUBLE, -literal.value, -literal.value)
    operand = lower(emitter, expression.operand)
    return _shallow(emitter, _lower_sign(emitter, expression, operand), operand)


def _lower_sign(emitter: Emitter, expression: Unary, operand: Lowered) -> Lowered:
    if expression.operator == "NOT":
        if operand.type is DataType.BOOLEAN:
            return of_type(build.inverse(operand.node), DataType.BOOLEAN)
        return Lowered(ast.UnaryOp(ast.Invert(), operand.node), DataType.DOUBLE, ~operand.high, ~operand.low)
    if expression.operator == "+":
        return operand
    if operand.type is DataType.REAL:
        return Lowered(build.negative(operand.node), DataType.REAL)
    value = Lowered(build.negative(operand.node), DataType.DOUBLE, -operand.high, -operand.low)
    return clamped(emitter, value, DataType.DOUBLE, OVERFLOW)


def _lower_chain(emitter: Emitter, expression: Binary) -> Lowered:
    first, operations = spine(expression)
    result = lower(emitter, first)
    for operation in operations:
        right = lower(emitter, operation.right)
        result = _shallow(
            emitter, _OPERATIONS[operation.operator](emitter, operation.operator, result, right), result, right
        )
    return result


def _shallow(emitter: Emitter, result: Lowered, *operands: Lowered) -> Lowered:
    """Return the result of an operation with its depth, from that of its operands; a deep one goes into a temporary."""
    depth = 0 if build.is_simple(result.node) else 1 + max((operand.depth for operand in operands), default=0)
    if depth < DEPTH_LIMIT:
        return replace(result, depth=depth)
    return replace(result, node=emitter.keep(result.node), depth=0)


def _lower_sum(emitter: Emitter, operator: str, left: Lowered, right: Lowered) -> Lowered:
    """Lower + - * of numbers (booleans count as 0 and 1) and + of strings."""
    if left.type is DataType.STRING:
        return Lowered(emitter.operation("joined", left.node, right.node), DataType.STRING)
    node = build.binary(left.node, operator, right.node)
    if DataType.REAL in (left.type, right.type):
        return Lowered(node, DataType.REAL)
    if operator == "+":
        low, high = left.low + right.low, left.high + right.high
    elif operator == "-":
        low, high = left.low - right.high, left.high - right.low
    else:
        corners = [a * b for a in (left.low, left.high) for b in (right.low, right.high)]
        low, high = min(corners), max(corners)
    return clamped(emitter, Lowered(node, DataType.DOUBLE, low, high), DataType.DOUBLE, OVERFLOW)


def _lower_quotient(emitter: Emitter, _: str, left: Lowered, right: Lowered) -> Lowered:
    if DataType.REAL in (left.type, right.type):
        return Lowered(emitter.fallible(emitter.operation("real_quotient", left.node, right.node)), DataType.REAL)
    node = emitter.fallible(emitter.operation("integer_quotient", left.node, right.node))
    # -2147483648 / -1 is the only quotient beyond 32 bits
    value = Lowered(node, DataType.DOUBLE, INT32_MIN, INT32_MAX + 1)
    return clamped(emitter, value, DataType.DOUBLE, OVERFLOW)


def _lower_power(emitter: Emitter, _: str, left: Lowered, right: Lowered) -> Lowered:
    name = "real_power" if DataType.REAL in (left.type, right.type) else "integer_power"
    node = emitter.noting(emitter.operation(name, left.node, right.node), OVERFLOW)
    if name == "real_power":
        return Lowered(node, DataType.REAL)
    return Lowered(node, DataType.DOUBLE, INT32_MIN, INT32_MAX)


def _lower_relation(_: Emitter, operator: str, left: Lowered, right: Lowered) -> Lowered:
    return of_type(build.compare(left.node, operator, right.node), DataType.BOOLEAN)


def _lower_logic(_: Emitter, operator: str, left: Lowered, right: Lowered) -> Lowered:
    if left.type is DataType.BOOLEAN and right.type is DataType.BOOLEAN:
        if operator == "XOR":
            return of_type(build.compare(left.node, "<>", right.node), DataType.BOOLEAN)
        joined = build.both if operator == "AND" else build.either
        return of_type(joined(left.node, right.node), DataType.BOOLEAN)
    return of_type(build.binary(left.node, operator, right.node), DataType.DOUBLE)


_OPERATIONS: dict[str, Callable[[Emitter, str, Lowered, Lowered], Lowered]] = {
    **dict.fromkeys("+-*", _lower_sum),
    "/": _lower_quotient,
    "**": _lower_power,
    **dict.fromkeys(("=", "<>", "<", ">", "<=", ">="), _lower_relation),
    **dict.fromkeys(("AND", "OR", "XOR"), _lower_logic),
}


def _lower_call(emitter: Emitter, call: FunctionCall) -> Lowered:
    arguments = [lower(emitter, argument) for argument in call.arguments]
    kind = FUNCTIONS[call.name].result.of(tuple(argument.type for argument in arguments))
    carry_out = _SPECIAL.get(call.name)
    result = carry_out(emitter, kind, arguments) if carry_out else _lower_builtin(emitter, call.name, kind, arguments)
    return _shallow(emitter, result, *arguments)


def _lower_builtin(emitter: Emitter, name: str, kind: DataType, arguments: list[Lowered]) -> Lowered:
    builtin = BUILTINS[name]
    node: ast.expr = emitter.operation(builtin.carry_out.__name__, *(argument.node for argument in arguments))
    if builtin.fallible:
        node = emitter.noting(node, OVERFLOW)
    if kind is DataType.REAL or kind is DataType.STRING:
        return Lowered(node, kind)
    if kind is DataType.BOOLEAN:
        return of_type(node, kind)
    return Lowered(node, DataType.DOUBLE, builtin.low, builtin.high)


def _lower_abs(emitter: Emitter, kind: DataType, arguments: list[Lowered]) -> Lowered:
    value = arguments[0]
    node = emitter.operation("abs", value.node)
    if kind is DataType.REAL:
        return Lowered(node, kind)
    bounds = Lowered(node, DataType.DOUBLE, 0, max(abs(value.low), abs(value.high)))
    return clamped(emitter, bounds, DataType.DOUBLE, OVERFLOW)


def _lower_int(emitter: Emitter, _: DataType, arguments: list[Lowered]) -> Lowered:
    value = arguments[0]
    if value.type is not DataType.REAL:
        return value
    node = emitter.operation("whole", value.node)
    return clamped(emitter, Lowered(node, DataType.DOUBLE, -(10**18), 10**18), DataType.DOUBLE, OVERFLOW)


def _lower_extreme(name: str) -> Callable[[Emitter, DataType, list[Lowered]], Lowered]:
    def lower_extreme(emitter: Emitter, kind: DataType, arguments: list[Lowered]) -> Lowered:
        node: ast.expr = emitter.operation(name, *(argument.node for argument in arguments))
        if kind is DataType.REAL:
            return Lowered(build.binary(node, "+", build.constant(0.0)), kind)
        low, high = min(argument.low for argument in arguments), max(argument.high for argument in arguments)
        return Lowered(node, DataType.DOUBLE, low, high)

    return lower_extreme


def _lower_errors_logged(emitter: Emitter, _: DataType, __: list[Lowered]) -> Lowered:
    result = emitter.temporary()
    emitter.emit(build.assign(result, build.call(emitter.member("errors_logged"))))
    return of_type(build.name(result), DataType.BOOLEAN)


def _lower_io_read(emitter: Emitter, _: DataType, arguments: list[Lowered]) -> Lowered:
    emitter.checkpoint()
    nodes = [argument.node for argument in arguments]
    node = emitter.fallible(build.call(emitter.member("io_read"), *nodes))
    return of_type(node, DataType.INTEGER)


_SPECIAL: dict[str, Callable[[Emitter, DataType, list[Lowered]], Lowered]] = {
    "ABS": _lower_abs,
    "INT": _lower_int,
    "MIN": _lower_extreme("min"),
    "MAX": _lower_extreme("max"),
    "TST_ERRLOG@": _lower_errors_logged,
    "IOREAD%": _lower_io_read,
}
