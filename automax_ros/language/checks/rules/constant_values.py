"""Values of constant expressions, as far as the checker can compute them, and whether they fit a variable."""

from __future__ import annotations

from automax_ros.core.numbers import INT16_MAX, INT32_MAX, INT32_MIN, stored_real, truncated_quotient
from automax_ros.core.types import DataType, Value
from automax_ros.language.checks.rules.typing_rules import spine
from automax_ros.language.tree import tree

Literal = tree.IntegerLiteral | tree.RealLiteral | tree.StringLiteral | tree.BooleanLiteral


def constant_value(expression: tree.Expression) -> Value | None:
    """Return the value of an expression of constants, signs and ``+ - * /``, None where it is not known.

    Integers divide as at run time, truncating toward zero; a result outside of 32 bits counts as not known.
    """
    if isinstance(expression, tree.IntegerLiteral):
        return expression.value if abs(expression.value) <= -INT32_MIN else None
    if isinstance(expression, Literal):
        return expression.value
    if isinstance(expression, tree.Unary):
        value = constant_value(expression.operand)
        if expression.operator == "NOT" or isinstance(value, (bool, str)) or value is None:
            return None
        return -value if expression.operator == "-" else value
    if not isinstance(expression, tree.Binary):
        return None
    first, operations = spine(expression)
    result = constant_value(first)
    for operation in operations:
        if result is None:
            return None
        result = _operation(operation.operator, result, constant_value(operation.right))
    return result


def is_constant(expression: tree.Expression) -> bool:
    """Return whether an expression is a constant, possibly with a sign before a number."""
    if isinstance(expression, tree.Unary):
        return expression.operator != "NOT" and isinstance(expression.operand, (tree.IntegerLiteral, tree.RealLiteral))
    return isinstance(expression, Literal)


def literal_of(expression: tree.Expression) -> Literal | None:
    """Return the constant with its sign included (``-5`` becomes one literal), None where it is not a constant.

    A literal of a REAL parameter is rounded to what a REAL variable holds (decision).
    """
    inner, negative = expression, False
    if isinstance(expression, tree.Unary) and is_constant(expression):
        inner, negative = expression.operand, expression.operator == "-"
    if isinstance(inner, tree.IntegerLiteral):
        value = -inner.value if negative else inner.value
        return tree.IntegerLiteral(value, inner.hexadecimal, span=expression.span)
    if isinstance(inner, tree.RealLiteral):
        real = stored_real(-inner.value if negative else inner.value)[0]
        return tree.RealLiteral(real, ("-" if negative else "") + inner.text, span=expression.span)
    return inner if isinstance(inner, (tree.StringLiteral, tree.BooleanLiteral)) else None


def fits(value: Value, kind: DataType) -> bool:
    """Return whether a number, truncated for an integer, is in the range of a numeric type."""
    if isinstance(value, (bool, str)) or not kind.is_numeric:
        return True
    if kind is DataType.REAL:
        return not stored_real(float(value))[1]
    low, high = kind.range
    if isinstance(value, float):
        return low - 1 < value < high + 1
    return low <= value <= high


def hex_hint(expression: tree.Expression, kind: DataType) -> str | None:
    """Return how to write a negative hex constant where 16 bits were meant: a constant has 32 bits (decision)."""
    if not isinstance(expression, tree.IntegerLiteral) or not expression.hexadecimal or kind is not DataType.INTEGER:
        return None
    meant = expression.value - 0x10000 if INT16_MAX < expression.value <= 0xFFFF else -1
    return f"a hex constant is its 32-bit value and never sign-extended: write 0{meant & 0xFFFFFFFF:08X}H for {meant}"


def _operation(operator: str, left: Value, right: Value | None) -> Value | None:
    if right is None or isinstance(left, (bool, str)) or isinstance(right, (bool, str)):
        return None
    integers = isinstance(left, int) and isinstance(right, int)
    result: int | float
    if operator == "+":
        result = left + right
    elif operator == "-":
        result = left - right
    elif operator == "*":
        result = left * right
    elif operator == "/" and right:
        result = truncated_quotient(left, right) if integers else left / right  # type: ignore[arg-type]
    else:
        return None
    return None if integers and not INT32_MIN <= result <= INT32_MAX else result
