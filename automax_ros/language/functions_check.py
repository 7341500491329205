"""Checks of calls of built-in functions: known, allowed, number and kinds of arguments."""

from __future__ import annotations

from automax_ros.core.types import DataType
from automax_ros.language.check_context import Context
from automax_ros.language.functions import FUNCTIONS, Argument, Function, Result
from automax_ros.language.tree import FunctionCall


def check_function(context: Context, call: FunctionCall, types: list[DataType | None]) -> DataType | None:
    """Report what is wrong in a call whose arguments have these types, and return the type of its value."""
    function = FUNCTIONS[call.name]
    if context.target.value not in function.targets:
        message = f"{call.name} cannot be used in a {context.target.value.upper()} task"
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
    if None in types and function.result is Result.SAME:
        return None
    return function.result.of(tuple(kind for kind in types if kind is not None))


def _takes(wanted: Argument, kind: DataType) -> bool:
    if wanted is Argument.STRING:
        return kind is DataType.STRING
    return kind.is_integer if wanted is Argument.INTEGER else kind.is_numeric


def _count(function: Function) -> str:
    least = len(function.arguments)
    if function.repeats:
        return f"{least} to {function.most} arguments"
    return "no arguments" if least == 0 else "1 argument" if least == 1 else f"{least} arguments"


_WORDS = {Argument.NUMBER: "a number", Argument.INTEGER: "an integer", Argument.STRING: "a string"}
