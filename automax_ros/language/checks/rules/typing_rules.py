"""Types of expressions: purely syntactic, from type characters, constants and the function table (J-3675 chapter 5).

Integers of both widths are computed in 32 bits, so every integer operation gives DOUBLE; with a REAL operand it gives
REAL. A boolean counts as 0 or 1 next to an arithmetic operator or next to an integer, and two booleans give a boolean
only with AND, OR, XOR and NOT. Nothing is converted to a string or a boolean implicitly.
"""

from __future__ import annotations

from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.types import DataType
from automax_ros.language.tree import tree
from automax_ros.language.tree.functions import FUNCTIONS

RELATIONAL = frozenset({"=", "<>", "<", ">", "<=", ">="})
LOGICAL = frozenset({"AND", "OR", "XOR"})


def type_of(expression: tree.Expression) -> DataType:
    """Return the type of a checked expression.

    A decimal or hex constant is INTEGER up to 32767, above that DOUBLE; a variable or element has the type of its name.

    Raises:
        ValueError: an operator has operands that it does not accept, which the checker refuses.
        KeyError: a function is not in the table, which the checker refuses too.
    """
    if isinstance(expression, tree.Binary):
        return _type_of_chain(expression)
    if isinstance(expression, (tree.Reference, tree.Element)):
        return expression.type
    if isinstance(expression, tree.IntegerLiteral):
        return literal_integer_type(expression)
    if isinstance(expression, tree.RealLiteral):
        return DataType.REAL
    if isinstance(expression, tree.BooleanLiteral):
        return DataType.BOOLEAN
    if isinstance(expression, tree.StringLiteral):
        return DataType.STRING
    if isinstance(expression, tree.FunctionCall):
        return FUNCTIONS[expression.name].result.of(tuple(type_of(argument) for argument in expression.arguments))
    return _known(unary_type(expression.operator, type_of(expression.operand)), expression.operator)


def literal_integer_type(literal: tree.IntegerLiteral) -> DataType:
    """Return INTEGER for a constant of 0 to 32767, DOUBLE for a larger one."""
    return DataType.INTEGER if 0 <= literal.value <= INT16_MAX else DataType.DOUBLE


def unary_type(operator: str, operand: DataType) -> DataType | None:
    """Return the type of ``-``, ``+`` or ``NOT`` before an operand, None where it is not allowed there.

    A sign of a REAL gives REAL, of an integer DOUBLE; NOT complements a boolean or, bit by bit, an integer.
    """
    if operator == "NOT":
        return DataType.BOOLEAN if operand is DataType.BOOLEAN else DataType.DOUBLE if operand.is_integer else None
    if operand is DataType.REAL:
        return DataType.REAL
    return DataType.DOUBLE if operand.is_integer else None


def binary_type(operator: str, left: DataType, right: DataType) -> DataType | None:
    """Return the type of an operation on two operands, None where the operator does not accept them.

    * ``+ - * / **``: REAL if an operand is REAL, else DOUBLE; booleans count as 0 or 1. ``+`` joins two strings.
    * relational: BOOLEAN, for two numbers; two strings or two booleans only with ``=`` and ``<>``.
    * AND, OR, XOR: BOOLEAN for two booleans, DOUBLE (bit by bit) for integers or an integer and a boolean.
    """
    types = (left, right)
    if operator in RELATIONAL:
        alike = left is right and operator in {"=", "<>"}
        return DataType.BOOLEAN if alike or (left.is_numeric and right.is_numeric) else None
    if DataType.STRING in types:
        return DataType.STRING if operator == "+" and left is right else None
    if operator in LOGICAL:
        if DataType.REAL in types:
            return None
        return DataType.BOOLEAN if left is right is DataType.BOOLEAN else DataType.DOUBLE
    return DataType.REAL if DataType.REAL in types else DataType.DOUBLE


def spine(expression: tree.Binary) -> tuple[tree.Expression, list[tree.Binary]]:
    """Return the leftmost operand of a chain ``a + b + c ...`` and its operations from left to right.

    The tree of a chain is as deep to the left as the chain is long; walking it in this way avoids deep recursion.
    """
    operations = []
    first: tree.Expression = expression
    while isinstance(first, tree.Binary):
        operations.append(first)
        first = first.left
    return first, operations[::-1]


def _type_of_chain(expression: tree.Binary) -> DataType:
    first, operations = spine(expression)
    result = type_of(first)
    for operation in operations:
        result = _known(binary_type(operation.operator, result, type_of(operation.right)), operation.operator)
    return result


def _known(result: DataType | None, operator: str) -> DataType:
    if result is None:
        raise ValueError(f"operator {operator} has operands that it cannot take")
    return result
