"""Checks of BASIC statements: their targets, and the types that they need."""

from __future__ import annotations

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.names import PREDEFINED
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import range_text
from automax_ros.language.checks.rules.constant_values import constant_value, fits, hex_hint, literal_of
from automax_ros.language.checks.rules.context import Context
from automax_ros.language.checks.rules.expressions import check_boolean, check_expression, check_integer, check_variable
from automax_ros.language.tree import tree

_KINDS = {DataType.STRING: "string", DataType.BOOLEAN: "boolean"}


def check_statement(context: Context, statement: tree.Statement) -> None:
    """Report the faults of one BASIC statement itself, not of those inside it."""
    if isinstance(statement, tree.Assignment):
        _check_assignment(context, statement)
    elif isinstance(statement, tree.If):
        check_boolean(context, statement.condition)
    elif isinstance(statement, tree.For):
        _check_for(context, statement)
    elif isinstance(statement, tree.OnJump):
        check_integer(context, statement.selector, "AMX2009", "the selector of ON")
    elif isinstance(statement, tree.Read):
        for target in statement.targets:
            check_written(context, target)
    elif isinstance(statement, (tree.Data, tree.Print)):
        if isinstance(statement, tree.Data):
            context.data.append((context.line or 0, statement))
        for item in statement.values if isinstance(statement, tree.Data) else statement.items:
            check_expression(context, item)
    elif isinstance(statement, tree.IoWrite):
        _check_io_write(context, statement)


def check_written(context: Context, target: tree.Reference | tree.Element) -> DataType | None:
    """Report a target that no task can write: tunable, input point, pre-defined variable; return its type."""
    kind = check_variable(context, target)
    symbol = context.symbols.get(target.name)
    if symbol is not None and symbol.tuning is not None:
        hint = "only the operator changes a tunable (2.4.5)"
        context.report("AMX4016", f"{target.name} is tunable: the task cannot write it", target.span, hint)
    if symbol is not None and symbol.scope is tree.Scope.COMMON and target.name in PREDEFINED:
        hint = "the rack keeps it true to what it shows (2.4.6): write a variable of another name"
        context.report("AMX4122", f"{target.name} is pre-defined: the task cannot write it", target.span, hint)
    if context.is_input_point(target.name) and context.commons is not None:
        place = context.commons[target.name].place
        context.report("AMX4017", f"{target.name} is an input point ({place}): the task cannot write it", target.span)
    return kind


def data_pool(context: Context) -> tuple[tuple[Value, ...], tuple[tuple[int, int], ...]]:
    """Return the DATA values of the task and the index at which each DATA line begins."""
    values: list[Value] = []
    lines: list[tuple[int, int]] = []
    for line, statement in context.data:
        if not lines or lines[-1][0] != line:
            lines.append((line, len(values)))
        for expression in statement.values:
            literal = literal_of(expression)
            if literal is not None:
                values.append(literal.value)
    return tuple(values), tuple(lines)


def check_reads(context: Context, reads: list[tuple[tree.Read, int | None]]) -> None:
    """Report READs for which the task's DATA have no value of the right kind."""
    values, _ = data_pool(context)
    if "DATA" in context.broken.words:
        return
    for statement, line in reads:
        context.line = line
        if not context.data:
            context.report("AMX4053", "READ in a task without DATA", statement.span)
            continue
        for target in statement.targets:
            if not any(_same_kind(value, target.type) for value in values):
                wanted = _KINDS.get(target.type, "number")
                message = f"no DATA value is a {wanted}, as {target.name} needs"
                context.report("AMX2017", message, target.span)


def assignable(target: DataType, value: DataType) -> bool:
    """Return whether a value can be assigned: any number to any number, strings and booleans only to their own.

    A boolean counts as 0 or 1 only as an operand of an arithmetic operator, not by itself (decision).
    """
    return target is value or (target.is_numeric and value.is_numeric)


def check_constant_fits(context: Context, expression: tree.Expression, kind: DataType, what: str) -> None:
    """Report a constant that a variable of a numeric type cannot hold; the parser reports those beyond every REAL."""
    value = constant_value(expression)
    if isinstance(value, float) and not fits(value, DataType.REAL):
        return
    if value is not None and not fits(value, kind):
        message = f"{value} does not fit {what}: {kind.word} is {range_text(kind)}"
        wider = f"a DOUBLE INTEGER, which ends with !, is {range_text(DataType.DOUBLE)}"
        hint = wider if kind is DataType.INTEGER and fits(value, DataType.DOUBLE) else None
        context.report("AMX2007", message, expression.span, hex_hint(expression, kind) or hint)


def _check_assignment(context: Context, statement: tree.Assignment) -> None:
    target = check_written(context, statement.target)
    value = check_expression(context, statement.value)
    if target is None or value is None:
        return
    name = statement.target.name
    if not assignable(target, value):
        hint = None
        if target.is_numeric and value is DataType.BOOLEAN:
            hint = "a boolean counts as 0 or 1 next to an operator: multiply it by 1"
        elif target is DataType.BOOLEAN and value.is_numeric:
            hint = "compare the number: A% <> 0"
        elif target is DataType.STRING:
            hint = "STR$(x) makes a string of a number" if value.is_numeric else None
        message = f"{value.word} cannot be assigned to {name}, which is {target.word}"
        context.report("AMX2006", message, statement.value.span, hint)
    else:
        check_constant_fits(context, statement.value, target, name)


def _check_for(context: Context, statement: tree.For) -> None:
    variable = statement.variable
    kind = check_written(context, variable)
    if kind is not None and not kind.is_numeric:
        context.report("AMX2012", f"{variable.name} is {kind.word}, a FOR loop counts with a number", variable.span)
        kind = None
    for limit in (statement.start, statement.stop, statement.step):
        limit_type = None if limit is None else check_expression(context, limit)
        if limit is None or limit_type is None:
            continue
        if not limit_type.is_numeric:
            context.report("AMX2011", f"a limit of a FOR loop must be a number, not {limit_type.word}", limit.span)
        elif kind is not None:
            check_constant_fits(context, limit, kind, variable.name)
    if statement.step is not None and kind is not None:
        _check_step(context, statement.step, kind)


def _check_step(context: Context, step: tree.Expression, kind: DataType) -> None:
    value = constant_value(step)
    if isinstance(value, (bool, str)) or value is None or not fits(value, kind):
        return
    if (int(value) if kind.is_integer else stored_real(float(value))[0]) == 0:
        hint = None if value == 0 else f"{value} counts as 0 for an integer variable"
        context.report("AMX4056", "the STEP of a FOR loop is 0", step.span, hint)


def _check_io_write(context: Context, statement: tree.IoWrite) -> None:
    if context.target is Platform.UDC:
        context.report("AMX4027", "IOWRITE cannot be used in a UDC task", statement.span)
    for what, operand in (("slot", statement.slot), ("register", statement.register), ("value", statement.value)):
        check_integer(context, operand, "AMX2009", f"the {what} of IOWRITE")


def _same_kind(value: Value, kind: DataType) -> bool:
    if isinstance(value, bool):
        return kind is DataType.BOOLEAN
    if isinstance(value, str):
        return kind is DataType.STRING
    return kind.is_numeric
