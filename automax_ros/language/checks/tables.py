"""Checks of tables: one-dimensional INTEGER arrays given whole to a block (sections 13 and 29)."""

from __future__ import annotations

from automax_ros.blocks.declaration import Input, Output
from automax_ros.core.types import DataType
from automax_ros.language.checks.constant_values import literal_of
from automax_ros.language.checks.context import Context
from automax_ros.language.checks.expressions import check_variable
from automax_ros.language.program import Symbol
from automax_ros.language.syntax.tree import Argument, Element, Expression, Reference


def checked_table(context: Context, parameter: Input, argument: Argument) -> Expression | None:
    """Report what is wrong in an array given to a block, and return it."""
    whole = _whole_array(context, parameter, argument)
    if whole is None:
        return None
    value, symbol = whole
    if len(symbol.dimensions) != 1:
        what = f"an array of {len(symbol.dimensions)} dimensions" if symbol.dimensions else "a simple variable"
        hint = f"{symbol.scope.value} {value.name}(16) makes an array of 17 elements"
        context.report(
            "AMX4092", f"{parameter.name} takes an array of one dimension, {value.name} is {what}", value.span, hint
        )
        return None
    return value


def checked_array(context: Context, parameter: Output, argument: Argument) -> Expression | None:
    """Report what is wrong in an array of certain dimensions that a block writes, and return it."""
    whole = _whole_array(context, parameter, argument)
    if whole is None:
        return None
    value, symbol = whole
    if symbol.dimensions == parameter.dimensions:
        return value
    wanted = ",".join(str(size - 1) for size in parameter.dimensions)
    found = ",".join(str(size - 1) for size in symbol.dimensions)
    what = f"an array ({found})" if found else "a simple variable"
    hint = f"declare it as {symbol.scope.value} {value.name}({wanted})"
    context.report("AMX4092", f"{parameter.name} takes an array ({wanted}), {value.name} is {what}", value.span, hint)
    return None


def _whole_array(context: Context, parameter: Input | Output, argument: Argument) -> tuple[Reference, Symbol] | None:
    """Report anything but the name of an INTEGER variable without subscripts; return it with its declaration."""
    value = argument.value
    if literal_of(value) is not None:
        context.report("AMX4075", f"{parameter.name} takes an array, no constant", value.span)
        return None
    if not isinstance(value, (Reference, Element)):
        context.report("AMX4077", f"{parameter.name} takes an array, no expression", value.span)
        return None
    symbol = context.symbols.get(value.name)
    if symbol is None:
        check_variable(context, value)
    elif isinstance(value, Element):
        context.report("AMX4092", f"{parameter.name} takes the whole array", value.span, f"write {value.name}")
    elif symbol.type is not DataType.INTEGER:
        context.report("AMX2015", f"{parameter.name} is INTEGER, {value.name} is {symbol.type.word}", value.span)
    else:
        return value, symbol
    return None


def elements_of(context: Context, table: Reference) -> int | None:
    """Return the number of elements of a one-dimensional array, None for anything else or one that is too large."""
    symbol = context.symbols.get(table.name)
    if symbol is None or len(symbol.dimensions) != 1:
        return None
    at_fault = any(item.code == "AMX4007" and item.span == symbol.span for item in context.diagnostics)
    return None if at_fault else symbol.dimensions[0]
