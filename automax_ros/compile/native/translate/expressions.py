"""Translation of Python expressions: the same value, bit for bit, for every operand that the ranges allow."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.blocks.folding import value_of
from automax_ros.compile.native.translate.environment import Environment
from automax_ros.compile.native.translate.ranges import (
    ANY_BOOL,
    ANY_REAL,
    EXACT_IN_DOUBLE,
    INFINITE,
    NumberKind,
    Range,
    corners,
    exactly,
    span,
)
from automax_ros.compile.native.translate.typed import WIDE, CExpression, as_real, bare, c_type, literal, widened

if TYPE_CHECKING:
    from automax_ros.compile.native.translate.frame import Frame

_SUMS: dict[type[ast.operator], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
}
_BITS: dict[type[ast.operator], str] = {ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^"}
_RELATIONS: dict[type[ast.cmpop], str] = {
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}


def value(frame: Frame, node: ast.expr, known: Environment) -> CExpression:
    """Return an expression in C.

    Raises:
        NotNative: C cannot give the same value as Python.
    """
    carry_out = _EXPRESSIONS.get(type(node))
    if carry_out is None:
        raise NotNative(f"an expression of the kind {type(node).__name__}")
    result = carry_out(frame, node, known)
    c_type(result.range)
    return result


def _constant(_: Frame, node: ast.Constant, __: Environment) -> CExpression:
    return literal(node.value)


def _name(frame: Frame, node: ast.Name, known: Environment) -> CExpression:
    return frame.read(node.id, known)


def _unary(frame: Frame, node: ast.UnaryOp, known: Environment) -> CExpression:
    number = value_of(node)
    if number is not None:
        return literal(number)
    operand = value(frame, node.operand, known)
    if isinstance(node.op, ast.Not):
        only = operand.range.only
        return CExpression(f"!{operand.text}", ANY_BOOL if only is None else exactly(not only))
    low, high = operand.range.low, operand.range.high
    if isinstance(node.op, ast.USub):
        if operand.range.kind is NumberKind.REAL:
            return CExpression(f"(-{operand.text})", Range(NumberKind.REAL, -high, -low, operand.range.never_nan))
        return _whole_result(f"-{operand.signed}", Range(NumberKind.INT, -high, -low), operand)
    if isinstance(node.op, ast.Invert) and operand.range.is_whole:
        return CExpression(f"(~{operand.signed})", Range(NumberKind.INT, -high - 1, -low - 1))
    raise NotNative(f"the sign {type(node.op).__name__}")


def _whole_result(text: str, result: Range, *operands: CExpression) -> CExpression:
    """Return an integer operation in as many bits as its operands and its result need."""
    wide_inside = any(item.range.is_wide for item in operands) or result.is_wide
    if wide_inside and not result.is_wide:
        return CExpression(f"(int64_t)({text})", result)
    return CExpression(f"({text})", result)


def _wide_or_signed(left: CExpression, result: Range, *others: CExpression) -> str:
    """Return the left operand in as many bits as the operation uses."""
    if result.is_wide or any(item.range.is_wide for item in (left, *others)):
        return widened(left)
    return left.signed


def _binary(frame: Frame, node: ast.BinOp, known: Environment) -> CExpression:
    left, right = value(frame, node.left, known), value(frame, node.right, known)
    kind = type(node.op)
    if kind is ast.Pow and left.range.only is not None and right.range.only is not None:
        return literal(int(left.range.only) ** int(right.range.only))
    real = NumberKind.REAL in (left.range.kind, right.range.kind)
    if (left.mixed or right.mixed) and not (kind is ast.Add and real):
        raise NotNative("arithmetic with what is an integer or a REAL")
    if kind in _SUMS:
        return _sum(left, right, *_SUMS[kind], real=real)
    if kind in _BITS and not real:
        return _bitwise(left, right, _BITS[kind])
    if kind is ast.Div:
        return _quotient(frame, left, right)
    if kind is ast.FloorDiv and not real:
        return _floor_quotient(frame, left.whole, right.whole)
    if kind is ast.Mod and not real:
        return _remainder(frame, left.whole, right.whole)
    if kind in (ast.LShift, ast.RShift) and not real:
        return _shift(left.whole, right.whole, left=kind is ast.LShift)
    raise NotNative(f"the operation {kind.__name__}")


def _sum(
    left: CExpression, right: CExpression, sign: str, carry_out: Callable[[Any, Any], Any], *, real: bool
) -> CExpression:
    if real:
        result = corners(as_real(left).range, as_real(right).range, carry_out, real=True)
        return CExpression(f"({_operand(left)} {sign} {_operand(right)})", result)
    result = corners(left.range, right.range, carry_out, real=False)
    return _whole_result(f"{_wide_or_signed(left, result, right)} {sign} {right.text}", result, left, right)


def _operand(item: CExpression) -> str:
    """Return an operand of arithmetic in doubles; C turns an integer into the nearest double, as Python does."""
    return item.text if item.range.kind is NumberKind.REAL else f"(double){item.text}"


def _bitwise(left: CExpression, right: CExpression, sign: str) -> CExpression:
    if left.range.kind is right.range.kind is NumberKind.BOOL:
        return CExpression(f"({left.text} {sign} {right.text})", ANY_BOOL)
    low, high = min(left.range.low, right.range.low), max(left.range.high, right.range.high)
    if INFINITE in (-low, high):
        raise NotNative("bits of an integer without bounds")
    bits = max((-int(low) - 1 if low < 0 else 0).bit_length(), int(high).bit_length() if high > 0 else 0)
    if low >= 0 or (sign == "&" and max(left.range.low, right.range.low) >= 0):
        positive = [item.range.high for item in (left, right) if item.range.low >= 0]
        result = Range(NumberKind.INT, 0, min(positive) if sign == "&" else 2**bits - 1)
    else:
        result = Range(NumberKind.INT, -(2**bits), 2**bits - 1)
    return _whole_result(f"{_wide_or_signed(left, result, right)} {sign} {right.text}", result, left, right)


def _quotient(frame: Frame, left: CExpression, right: CExpression) -> CExpression:
    if not (left.range.is_exact and right.range.is_exact):
        raise NotNative("the true quotient of integers beyond 53 bits")
    top, bottom = as_real(left), as_real(right)
    if bottom.range.low <= 0.0 <= bottom.range.high:
        return CExpression(f"divided({top.text}, {bottom.text}, {frame.ended()})", ANY_REAL)
    return CExpression(
        f"({_operand(left)} / {_operand(right)})", corners(top.range, bottom.range, operator.truediv, real=True)
    )


def _not_zero(frame: Frame, right: CExpression) -> CExpression:
    """Return a divisor that is not 0: where that cannot be proved, the scan ends if it is 0."""
    low, high = right.range.low, right.range.high
    if not low <= 0 <= high:
        return right
    if right.range.is_wide:
        raise NotNative("a divisor in 128 bits that may be 0")
    low, high = low + (low == 0), high - (high == 0)
    return CExpression(
        f"divisor({bare(right.text)}, {frame.ended()})", Range(NumberKind.INT, low, high) if low <= high else exactly(1)
    )


def _floor_quotient(frame: Frame, left: CExpression, right: CExpression) -> CExpression:
    right = _not_zero(frame, right)
    result = _quotients(left.range, right.range)
    if left.range.low >= 0 and right.range.low > 0:
        return _whole_result(f"{_wide_or_signed(left, result, right)} / {right.text}", result, left, right)
    if WIDE in (c_type(left.range), c_type(right.range), c_type(result)):
        raise NotNative("a floor division in 128 bits")
    return CExpression(f"floor_quotient({left.text}, {right.text})", result)


def _quotients(left: Range, right: Range) -> Range:
    """Return the range of a quotient rounded down; the divisors nearest to 0 give the largest."""
    parts = [
        corners(left, Range(NumberKind.INT, low, high), operator.floordiv, real=False)
        for low, high in ((right.low, min(right.high, -1)), (max(right.low, 1), right.high))
        if low <= high
    ]
    return span(parts)


def _remainder(frame: Frame, left: CExpression, right: CExpression) -> CExpression:
    right = _not_zero(frame, right)
    least = right.range.low + 1 if right.range.low < 0 else 0
    most = right.range.high - 1 if right.range.high > 0 else 0
    result = Range(NumberKind.INT, least, most)
    if left.range.low >= 0 and right.range.low > 0:
        return _whole_result(f"{_wide_or_signed(left, result, right)} % {right.text}", result, left, right)
    if WIDE in (c_type(left.range), c_type(right.range)):
        raise NotNative("a remainder in 128 bits")
    return CExpression(f"floor_remainder({left.text}, {right.text})", result)


def _shift(number: CExpression, count: CExpression, *, left: bool) -> CExpression:
    if count.range.low < 0 or count.range.high > 64:
        raise NotNative("a shift by a count that cannot be shown to be 0 to 64")
    carry_out = operator.lshift if left else operator.rshift
    result = corners(
        number.range, count.range, lambda a, b: a if abs(a) == INFINITE else carry_out(int(a), int(b)), real=False
    )
    if count.range.high > 62 and not result.is_wide:
        raise NotNative("a shift by more than 62 places")
    sign = "<<" if left else ">>"
    return _whole_result(f"{_wide_or_signed(number, result)} {sign} {count.text}", result, number)


def _compare(frame: Frame, node: ast.Compare, known: Environment) -> CExpression:
    operands = [value(frame, item, known) for item in (node.left, *node.comparators)]
    parts = [
        _relation(left, _RELATIONS[type(sign)], right)
        for left, sign, right in zip(operands, node.ops, operands[1:], strict=False)
    ]
    return CExpression(parts[0] if len(parts) == 1 else f"({' && '.join(parts)})", ANY_BOOL)


def _relation(left: CExpression, sign: str, right: CExpression) -> str:
    pairs = ((left.range, right.range), (right.range, left.range))
    if NumberKind.REAL in (left.range.kind, right.range.kind) and not any(_compares(*pair) for pair in pairs):
        raise NotNative("a REAL compared with an integer beyond 53 bits")
    return f"({left.text} {sign} {right.text})"


def _compares(whole: Range, real: Range) -> bool:
    """Return whether an integer compares with a REAL in the same way as the nearest double does."""
    if whole.is_exact:
        return real.is_exact
    return real.kind is NumberKind.REAL and real.low > -EXACT_IN_DOUBLE and real.high < EXACT_IN_DOUBLE


def _bool_op(frame: Frame, node: ast.BoolOp, known: Environment) -> CExpression:
    """Return ``and`` or ``or``: of booleans a boolean, of integers the operand that decides."""
    both = isinstance(node.op, ast.And)
    operands: list[CExpression] = []
    for item in node.values:
        operands.append(value(frame, item, known))
        after = frame.refined(item, known, truth=both)
        known = known if after is None else after
    if all(item.range.kind is NumberKind.BOOL for item in operands):
        return CExpression(f"({(' && ' if both else ' || ').join(item.text for item in operands)})", ANY_BOOL)
    text, result = _branch(operands[-1]), operands[-1].range
    for before in reversed(operands[:-1]):
        text = f"({before.text} ? {text} : {before.text})" if both else f"({before.text} ? {before.text} : {text})"
        result = result.joined(before.range)
    return CExpression(text, result)


def _if_exp(frame: Frame, node: ast.IfExp, known: Environment) -> CExpression:
    test = value(frame, node.test, known).text
    then, otherwise = (frame.refined(node.test, known, truth=truth) for truth in (True, False))
    if then is None:
        return value(frame, node.orelse, known if otherwise is None else otherwise)
    if otherwise is None:
        return value(frame, node.body, then)
    first, second = value(frame, node.body, then), value(frame, node.orelse, otherwise)
    return CExpression(f"({bare(test)} ? {_branch(first)} : {_branch(second)})", first.range.joined(second.range))


def _branch(item: CExpression) -> str:
    return item.signed if item.range.kind is NumberKind.INT else item.text


def _subscript(frame: Frame, node: ast.Subscript, known: Environment) -> CExpression:
    if isinstance(node.value, ast.Tuple):
        return frame.constants(
            [item.value for item in node.value.elts if isinstance(item, ast.Constant)], node.slice, known
        )
    if not isinstance(node.value, ast.Name):
        raise NotNative("an element of what has no name")
    return frame.element(node.value.id, node.slice, known)


def _call(frame: Frame, node: ast.Call, known: Environment) -> CExpression:
    results = frame.call(node, known)
    if len(results) != 1:
        raise NotNative("several results where one is used")
    return results[0]


def _attribute(frame: Frame, node: ast.Attribute, _: Environment) -> CExpression:
    return literal(frame.attribute(node))


def extreme(arguments: Sequence[CExpression], *, least: bool) -> CExpression:
    """Return Python's ``min`` or ``max``: of equal ones the first, and the first where the other is NaN."""
    result = arguments[0]
    for item in arguments[1:]:
        kinds = {result.range.kind, item.range.kind}
        if not (result.range.is_exact and item.range.is_exact) and NumberKind.REAL in kinds:
            raise NotNative("a REAL compared with an integer beyond 53 bits")
        kind = (
            NumberKind.REAL
            if NumberKind.REAL in kinds
            else NumberKind.INT
            if NumberKind.INT in kinds
            else NumberKind.BOOL
        )
        found = _extreme_range(kind, result.range, item.range, least=least)
        wide = result.range.is_wide or item.range.is_wide
        name = f"{'least' if least else 'most'}_{'real' if kind is NumberKind.REAL else 'wide' if wide else 'of'}"
        narrowed = "(int64_t)" * (wide and not found.is_wide)
        mixed = result.mixed or item.mixed or len(kinds) > 1
        result = CExpression(f"{narrowed}{name}({bare(result.text)}, {bare(item.text)})", found, mixed)
    return result


def _extreme_range(kind: NumberKind, first: Range, second: Range, *, least: bool) -> Range:
    """Return the range of the lesser or greater of two; it includes the first where the second may be NaN."""
    choose = min if least else max
    low, high = choose(first.low, second.low), choose(first.high, second.high)
    if not second.is_number:
        low, high = (low, first.high) if least else (first.low, high)
    return Range(kind, low, high, kind is NumberKind.REAL and first.is_number)


_EXPRESSIONS: dict[type[ast.expr], Callable[[Frame, Any, Environment], CExpression]] = {
    ast.Constant: _constant,
    ast.Name: _name,
    ast.UnaryOp: _unary,
    ast.BinOp: _binary,
    ast.Compare: _compare,
    ast.BoolOp: _bool_op,
    ast.IfExp: _if_exp,
    ast.Subscript: _subscript,
    ast.Call: _call,
    ast.Attribute: _attribute,
}
