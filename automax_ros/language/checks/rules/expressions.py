"""Checks of expressions, including calls of built-in functions.

Every name is declared and used as declared, every operator has types that it accepts. A function is known and allowed,
with the right number and kinds of arguments. A type of None means that an error inside was reported and hides the type;
so it causes no second report.
"""

from __future__ import annotations

import re
from math import inf

from automax_ros.core.diagnostics import Note
from automax_ros.core.numbers import INT32_MAX
from automax_ros.core.types import DataType, bare_name
from automax_ros.language.checks.rules.constant_values import constant_value
from automax_ros.language.checks.rules.context import Context
from automax_ros.language.checks.rules.typing_rules import (
    LOGICAL,
    RELATIONAL,
    binary_type,
    literal_integer_type,
    spine,
    unary_type,
)
from automax_ros.language.program import Symbol
from automax_ros.language.tree import tree
from automax_ros.language.tree.functions import FUNCTIONS, ArgumentKind, Function, Result

_SMALLEST = 5e-324
_BITS = (1, 0, 15, "bits 0 to 15")
_PLACES = (1, 0, 15, "0 to 15 places")
_RANGES: dict[str, tuple[int, float, float, str]] = {
    "SQRT": (0, 0, inf, "0 or more"),
    "LN": (0, _SMALLEST, inf, "more than 0"),
    "CHR$": (0, 0, 255, "0 to 255"),
    "BIT_SET%": _BITS,
    "BIT_CLR%": _BITS,
    "BIT_TST@": (1, 0, 31, "bits 0 to 31"),
    "SHIFTL%": _PLACES,
    "SHIFTR%": _PLACES,
    "ROTATEL%": _PLACES,
    "ROTATER%": _PLACES,
}
"""Functions with a limited argument: its place, its limits, and these in words (see ``tree/functions``)."""
_WORDS = {
    ArgumentKind.NUMBER: "a number",
    ArgumentKind.INTEGER: "an integer",
    ArgumentKind.STRING: "a string",
}
_HEXADECIMAL = re.compile(r"[A-F][0-9A-F]{0,7}H")
"""A name that looks like a hexadecimal constant without its leading 0."""
_LITERAL_TYPES: dict[type, DataType] = {
    tree.RealLiteral: DataType.REAL,
    tree.StringLiteral: DataType.STRING,
    tree.BooleanLiteral: DataType.BOOLEAN,
}


def check_function(context: Context, call: tree.FunctionCall, types: list[DataType | None]) -> DataType | None:
    """Report the faults of a call whose arguments have these types, and return the type of its value."""
    function = FUNCTIONS[call.name]
    if context.target.value not in function.targets:
        message = f"{call.name} cannot be used in {context.task_words}"
        context.report("AMX4027", message, call.span)
    if not len(function.arguments) <= len(types) <= function.most:
        context.report("AMX2013", f"{call.name} takes {_count(function)}, {len(types)} given", call.span)
        return function.result.of(()) if function.result is not Result.SAME else None
    kinds = function.arguments + function.arguments[-1:] * (len(types) - len(function.arguments))
    for expression, kind, wanted in zip(call.arguments, types, kinds, strict=True):
        if kind is not None and not _takes(wanted, kind):
            hint = "INT(x) gives the integer part of a REAL" if kind is DataType.REAL else None
            message = f"{call.name} takes {_WORDS[wanted]} here, not {kind.word}"
            context.report("AMX2014", message, expression.span, hint)
        elif kind is not None:
            _check_range(context, call, expression)
    if None in types and function.result is Result.SAME:
        return None
    return function.result.of(tuple(kind for kind in types if kind is not None))


def _takes(wanted: ArgumentKind, kind: DataType) -> bool:
    if wanted is ArgumentKind.STRING:
        return kind is DataType.STRING
    return kind.is_integer if wanted is ArgumentKind.INTEGER else kind.is_numeric


def _check_range(context: Context, call: tree.FunctionCall, argument: tree.Expression) -> None:
    place, low, high, text = _RANGES.get(call.name, (-1, 0, 0, ""))
    if place < 0 or call.arguments[place] is not argument:
        return
    value = constant_value(argument)
    if isinstance(value, (int, float)) and not low <= value <= high:
        context.report("AMX2019", f"{value} is not an argument of {call.name}: it takes {text}", argument.span)


def _count(function: Function) -> str:
    least = len(function.arguments)
    if function.repeats:
        return f"{least} to {function.most} arguments"
    return "no arguments" if least == 0 else "1 argument" if least == 1 else f"{least} arguments"


def check_expression(context: Context, expression: tree.Expression) -> DataType | None:
    """Report the faults of an expression and return its type."""
    if isinstance(expression, tree.Binary):
        return _check_chain(context, expression)
    if isinstance(expression, tree.Unary):
        return _check_unary(context, expression)
    if isinstance(expression, (tree.Reference, tree.Element)):
        return check_variable(context, expression)
    if isinstance(expression, tree.IntegerLiteral):
        return _check_integer(context, expression, INT32_MAX)
    if isinstance(expression, tree.FunctionCall):
        types = [check_expression(context, argument) for argument in expression.arguments]
        return check_function(context, expression, types)
    return _LITERAL_TYPES[type(expression)]


def _report_structure(context: Context, target: tree.Reference | tree.Element) -> None:
    message = f"{target.name} is a data structure: only SHIFT, READ and WRITE blocks can use it"
    note = Note("it is made here", context.structures[target.name][1])
    context.report("AMX4093", message, target.span, notes=(note,))


def check_variable(context: Context, target: tree.Reference | tree.Element) -> DataType | None:
    """Report a variable that is not declared, or not used as declared, and return its type.

    The type counts as not known where a whole array is used as a value, and where the variable is not declared but one
    with another type character is: that one was probably meant.
    """
    if target.name in context.structures:
        _report_structure(context, target)
        return target.type
    symbol = context.symbols.get(target.name)
    for subscript in target.subscripts if isinstance(target, tree.Element) else ():
        if symbol is None:
            check_expression(context, subscript)
        else:
            check_integer(context, subscript, "AMX2010", f"a subscript of {target.name}")
    if symbol is None:
        _report_undeclared(context, target)
        return None if _has_twin(context, target.name) else target.type
    if isinstance(target, tree.Element):
        _check_subscripts(context, target, symbol)
    elif symbol.dimensions:
        hint = f"name one element, such as {target.name}({','.join('0' * len(symbol.dimensions))})"
        context.report("AMX4020", f"{target.name} is an array, a value is needed here", target.span, hint)
        return None
    return target.type


def check_integer(context: Context, expression: tree.Expression, code: str, what: str) -> None:
    """Report an expression that is not an integer; ``what`` begins the message."""
    kind = check_expression(context, expression)
    if kind is not None and not kind.is_integer:
        hint = "INT(x) gives the integer part of a REAL" if kind is DataType.REAL else None
        context.report(code, f"{what} must be an integer, not {kind.word}", expression.span, hint)


def check_boolean(context: Context, condition: tree.Expression) -> None:
    """Report a condition that is not boolean."""
    kind = check_expression(context, condition)
    if kind is not None and kind is not DataType.BOOLEAN:
        hint = "compare it: A% <> 0" if kind.is_numeric else None
        context.report("AMX2005", f"a condition must be BOOLEAN, this is {kind.word}", condition.span, hint)


def _check_integer(context: Context, literal: tree.IntegerLiteral, highest: int) -> DataType | None:
    if literal.value > highest:
        message = f"{literal.value} does not fit in 32 bits"
        context.report("AMX2008", message, literal.span, "an integer is -2147483648 to 2147483647; 2.0E10 is a REAL")
        return None
    return literal_integer_type(literal)


def _check_unary(context: Context, expression: tree.Unary) -> DataType | None:
    operator, operand = expression.operator, expression.operand
    if operator == "-" and isinstance(operand, tree.IntegerLiteral):
        kind = _check_integer(context, operand, INT32_MAX + 1)
    else:
        kind = check_expression(context, operand)
    if kind is None:
        return None
    result = unary_type(operator, kind)
    if result is not None:
        return result
    if operator == "NOT":
        context.report("AMX2003", f"NOT takes a BOOLEAN or an integer, not {kind.word}", expression.span)
    else:
        hint = None
        if kind is DataType.BOOLEAN:
            hint = "write NOT; a minus sign inverts a boolean only in the parameters of a block"
        context.report("AMX2004", f"a sign cannot stand before a {kind.word}", expression.span, hint)
    return None


def _check_chain(context: Context, expression: tree.Binary) -> DataType | None:
    first, operations = spine(expression)
    result = check_expression(context, first)
    for operation in operations:
        right = check_expression(context, operation.right)
        result = _check_operation(context, operation, result, right)
    return result


def _check_operation(
    context: Context, operation: tree.Binary, left: DataType | None, right: DataType | None
) -> DataType | None:
    operator = operation.operator
    if left is None or right is None:
        return DataType.BOOLEAN if operator in RELATIONAL else None
    result = binary_type(operator, left, right)
    if result is None:
        _report_operation(context, operation, left, right)
        return DataType.BOOLEAN if operator in RELATIONAL else None
    if operator == "/" and constant_value(operation.right) in (0, 0.0) and right is not DataType.BOOLEAN:
        context.report("AMX4024", "division by 0", operation.right.span)
    return result


def _report_operation(context: Context, operation: tree.Binary, left: DataType, right: DataType) -> None:
    operator, span = operation.operator, operation.span
    if operator in RELATIONAL:
        hint = None
        if left is right:
            message = f"{operator} cannot compare two {left.word}s, only = and <> can"
        else:
            message = f"{operator} cannot compare {left.word} with {right.word}"
            if DataType.BOOLEAN in (left, right) and DataType.STRING not in (left, right):
                hint = "a boolean is compared with TRUE, FALSE or another boolean"
        context.report("AMX2002", message, span, hint)
    elif operator in LOGICAL:
        wrong = left if left in (DataType.REAL, DataType.STRING) else right
        message = f"{operator} takes BOOLEANs and integers, not {wrong.word}"
        context.report("AMX2003", message, span)
    else:
        hint = "STR$(x) makes a string of a number" if operator == "+" else None
        context.report("AMX2001", f"{operator} cannot join {left.word} and {right.word}", span, hint)


def _report_undeclared(context: Context, target: tree.Reference | tree.Element) -> None:
    if context.broken.may_declare(target.name):
        return
    if target.name in context.events:
        context.report("AMX4001", f"{target.name} is an event, not a variable", target.span)
        return
    known = set(context.symbols) | FUNCTIONS.keys() if isinstance(target, tree.Element) else context.symbols
    hint = context.suggest.hint(target.name, known)
    context.report("AMX4001", f"{target.name} is not declared", target.span, hint or _undeclared_hint(target.name))


def _undeclared_hint(name: str) -> str:
    if _HEXADECIMAL.fullmatch(name):
        return f"a hexadecimal constant begins with a digit: 0{name}"
    return "declare it with LOCAL or COMMON"


def _has_twin(context: Context, name: str) -> bool:
    bare = bare_name(name)
    return any(bare + kind.value in context.symbols for kind in DataType)


def _check_subscripts(context: Context, element: tree.Element, symbol: Symbol) -> None:
    if not symbol.dimensions:
        context.report("AMX4021", f"{element.name} is a simple variable and has no subscripts", element.span)
        return
    if len(element.subscripts) != len(symbol.dimensions):
        plural = "" if len(symbol.dimensions) == 1 else "s"
        message = f"{element.name} has {len(symbol.dimensions)} subscript{plural}, {len(element.subscripts)} given"
        context.report("AMX4022", message, element.span)
        return
    for subscript, size in zip(element.subscripts, symbol.dimensions, strict=True):
        value = constant_value(subscript)
        if isinstance(value, int) and not isinstance(value, bool) and not 0 <= value < size:
            message = f"the subscript {value} of {element.name} is not 0 to {size - 1}"
            context.report("AMX4023", message, subscript.span)
