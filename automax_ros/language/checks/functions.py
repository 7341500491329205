"""Checks of calls of built-in functions: known, allowed, number and kinds of arguments."""

from __future__ import annotations

from math import inf

from automax_ros.core.types import DataType
from automax_ros.language.checks.constant_values import constant_value
from automax_ros.language.checks.context import Context
from automax_ros.language.syntax.functions import FUNCTIONS, Argument, Function, Result
from automax_ros.language.syntax.tree import Expression, FunctionCall


def check_function(context: Context, call: FunctionCall, types: list[DataType | None]) -> DataType | None:
    """Report what is wrong in a call whose arguments have these types, and return the type of its value."""
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


def _takes(wanted: Argument, kind: DataType) -> bool:
    if wanted is Argument.STRING:
        return kind is DataType.STRING
    return kind.is_integer if wanted is Argument.INTEGER else kind.is_numeric


def _check_range(context: Context, call: FunctionCall, argument: Expression) -> None:
    """Report a constant argument that would be logged at run time."""
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
"""Functions with a limited argument: its place, its limits, and what it takes (see functions.py)."""
_WORDS = {Argument.NUMBER: "a number", Argument.INTEGER: "an integer", Argument.STRING: "a string"}
