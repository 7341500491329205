"""Checks of CALL: the block, its keywords, the value of each, and the block's rules for them (2.4.3, 3.1)."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from automax_ros.blocks.declare.declaration import Block, Form, Given, Input, Output, Platform, Special
from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.ticks import MAX_TICKS, NS_PER_MS, UDC_MAX_TICKS
from automax_ros.core.types import DataType
from automax_ros.core.values import range_text, value_text
from automax_ros.language.checks.calls.coefficients import check_coefficients
from automax_ros.language.checks.calls.data_structures import (
    check_channels,
    checked_array,
    checked_structure,
    checked_table,
    elements_of,
    structure_of,
)
from automax_ros.language.checks.rules.constant_values import Literal, fits, hex_hint, literal_of
from automax_ros.language.checks.rules.context import Context
from automax_ros.language.checks.rules.expressions import check_expression, check_variable
from automax_ros.language.checks.rules.statements import check_written
from automax_ros.language.program import BoundCall
from automax_ros.language.tree import tree
from automax_ros.language.tree.tree import Argument, Call, Expression, IntegerLiteral, Reference
from automax_ros.language.tree.walk import variables_in


def checked_value(context: Context, block: Block, parameter: Input | Output, argument: Argument) -> Expression | None:
    """Report the faults of a parameter's value and return it, a constant with its sign included and rounded.

    A value at fault gives None.
    """
    before = context.errors
    if isinstance(parameter, Output):
        value: Expression | None
        if parameter.dimensions:
            value = checked_array(context, parameter, argument)
        else:
            value = _checked_output(context, block, parameter, argument)
    elif context.target not in parameter.runs_on:
        message = f"{parameter.name} of {block.name} cannot be used in {context.task_words}"
        context.report("AMX4027", message, argument.span)
        return None
    elif parameter.type is Special.EVENT:
        value = _checked_event(context, argument)
    elif parameter.type is Special.TABLE:
        value = checked_table(context, parameter, argument)
    elif isinstance(parameter.type, Special):
        value = checked_structure(context, block, parameter, argument)
    else:
        value = _checked_input(context, block, parameter, parameter.type, argument)
    return value if context.errors == before else None


def _checked_input(
    context: Context, block: Block, parameter: Input, kind: DataType, argument: Argument
) -> Expression | None:
    value = argument.value
    literal = literal_of(value)
    if literal is not None:
        _check_literal(context, parameter, kind, literal, value)
        return literal
    variable = _inverted_variable(value) if kind is DataType.BOOLEAN else None
    if variable is None and isinstance(value, (tree.Reference, tree.Element)):
        variable = value
    if variable is None:
        _report_expression(context, parameter, kind, value)
        return None
    if parameter.form is Form.LITERAL:
        context.report("AMX4076", f"{parameter.name} takes a constant only, no variable", value.span)
    else:
        _check_type(context, block, parameter, kind, check_variable(context, variable), variable)
    return value


def _checked_output(context: Context, block: Block, parameter: Output, argument: Argument) -> Expression | None:
    value = argument.value
    if literal_of(value) is not None:
        context.report("AMX4078", f"the output {parameter.name} needs a variable, not a constant", value.span)
    elif _inverted_variable(value) is not None:
        hint = "a boolean is inverted where it is used as an input"
        context.report("AMX4079", f"the output {parameter.name} cannot be inverted", value.span, hint)
    elif not isinstance(value, (tree.Reference, tree.Element)):
        _report_expression(context, parameter, parameter.type, value)
    else:
        _check_type(context, block, parameter, parameter.type, check_written(context, value), value)
    return value


def _checked_event(context: Context, argument: Argument) -> Expression | None:
    value = argument.value
    if not isinstance(value, tree.Reference):
        context.report("AMX4060", f"{argument.keyword} takes the name of an event", value.span)
        return None
    event = context.events.get(value.name)
    if event is None:
        if not context.broken.may_declare(value.name):
            hint = context.suggest.hint(value.name, context.events) or "declare it before with EVENT NAME = ..."
            context.report("AMX4060", f"the event {value.name} is not declared", value.span, hint)
    elif event.interrupt_status is None:
        hint = "EVENT NAME = ..., INTERRUPT_STATUS = variable, TIMEOUT = count makes a hardware event"
        context.report("AMX4061", f"{value.name} is a software event: no module raises it", value.span, hint)
    return value


def _check_type(
    context: Context,
    block: Block,
    parameter: Input | Output,
    wanted: DataType,
    kind: DataType | None,
    variable: tree.Reference | tree.Element,
) -> None:
    also = parameter.also if isinstance(parameter, Input) else None
    if kind is not None and kind is not wanted and kind is not also:
        words = wanted.word if also is None else f"{wanted.word} or {also.word}"
        message = f"{parameter.name} is {words}, {variable.name} is {kind.word}"
        instead = block.for_booleans if kind is DataType.BOOLEAN else ""
        context.report("AMX2015", message, variable.span, instead or _type_hint(wanted))
        return
    symbol = context.symbols.get(variable.name)
    if parameter.wants_common and symbol is not None and symbol.scope is not tree.Scope.COMMON:
        message = f"{parameter.name} should be a COMMON variable, {variable.name} is LOCAL"
        context.report("AMX4096", message, variable.span, "the rack's other tasks and the drive use it")


_CONSTANTS = {
    DataType.BOOLEAN: "write TRUE or FALSE",
    DataType.INTEGER: "write a whole number",
    DataType.DOUBLE: "write a whole number",
    DataType.REAL: "write a number with a decimal point, such as 1.5",
    DataType.STRING: "write a text in quotes",
}
"""Hint on how to write a constant of each type."""


def _check_literal(context: Context, parameter: Input, kind: DataType, literal: Literal, written: Expression) -> None:
    if parameter.form is Form.VARIABLE:
        context.report("AMX4075", f"{parameter.name} takes a variable only, no constant", written.span)
        return
    if kind is DataType.REAL and "." not in _spelling(literal):
        mantissa, mark, exponent = _spelling(literal).partition("E")
        hint = f"write {mantissa}.0{mark}{exponent}"
        context.report("AMX2016", f"{parameter.name} is REAL: its constant needs a decimal point", written.span, hint)
        return
    if not _is_of(literal, kind):
        message = f"{parameter.name} is {kind.word}, {_describe(literal)} is given"
        context.report("AMX2015", message, written.span, _CONSTANTS[kind])
    elif not fits(literal.value, kind):
        message = f"{literal.value} does not fit {parameter.name}: {kind.word} is {range_text(kind)}"
        context.report("AMX2007", message, written.span, hex_hint(literal, kind))
    else:
        _check_range(context, parameter, literal, written)


def _check_range(context: Context, parameter: Input, literal: Literal, written: Expression) -> None:
    value = literal.value
    if isinstance(value, (bool, str)):
        return
    if parameter.one_of:
        if value not in parameter.one_of:
            near = sorted(sorted(parameter.one_of, key=lambda item: abs(item - value))[:2])
            hint = f"the nearest are {' and '.join(str(item) for item in near)}"
            message = f"{parameter.name} = {value} is none of {', '.join(str(item) for item in parameter.one_of)}"
            context.report("AMX4080", message, written.span, hint)
        return
    low, high = parameter.low, parameter.high
    if (low is None or low <= value) and (high is None or value <= high):
        return
    if low is not None and high is not None:
        bounds = f"{low} to {high}"
    else:
        bounds = f"{low} or more" if low is not None else f"{high} or less"
    context.report("AMX4080", f"{parameter.name} = {value_text(value)} is out of range: {bounds}", written.span)


def _report_expression(context: Context, parameter: Input | Output, kind: object, value: Expression) -> None:
    operand = value.operand if isinstance(value, tree.Unary) else None
    hint = "assign it to a LOCAL variable first"
    if isinstance(operand, (tree.Reference, tree.Element)) and operand.type is DataType.BOOLEAN:
        if isinstance(parameter, Output):
            hint = "an output cannot be inverted"
        elif kind is DataType.BOOLEAN:
            hint = f"write -{operand.name}"
    check_expression(context, value if operand is None else operand)
    what = "a variable" if isinstance(parameter, Output) else "a variable or a constant"
    if isinstance(parameter, Input) and parameter.form is Form.LITERAL:
        what, hint = "a constant only", "write the value as a number"
    elif isinstance(parameter, Input) and parameter.form is Form.VARIABLE:
        what = "a variable"
    context.report("AMX4077", f"{parameter.name} takes {what}, no expression", value.span, hint)


def _inverted_variable(value: Expression) -> tree.Reference | tree.Element | None:
    """Return the boolean variable of ``-NAME@``, None where the value is something else."""
    if not isinstance(value, tree.Unary) or value.operator != "-":
        return None
    operand = value.operand
    return operand if isinstance(operand, (tree.Reference, tree.Element)) and operand.type is DataType.BOOLEAN else None


def _is_of(literal: Literal, kind: DataType) -> bool:
    if isinstance(literal, tree.IntegerLiteral):
        return kind.is_integer
    if isinstance(literal, tree.RealLiteral):
        return kind is DataType.REAL
    return kind is (DataType.BOOLEAN if isinstance(literal, tree.BooleanLiteral) else DataType.STRING)


def _spelling(literal: Literal) -> str:
    """Return how a number is written, ``.`` for a constant that is not a number or has no known spelling."""
    if isinstance(literal, tree.IntegerLiteral):
        return str(literal.value)
    return literal.text or "." if isinstance(literal, tree.RealLiteral) else "."


def _describe(literal: Literal) -> str:
    if isinstance(literal, tree.StringLiteral):
        return "a string"
    if isinstance(literal, tree.BooleanLiteral):
        return "TRUE" if literal.value else "FALSE"
    return str(literal.value)


def _type_hint(wanted: DataType) -> str | None:
    mark = wanted.value
    return f"a variable of that type ends with {mark}" if mark else "a REAL variable has no type character"


Arguments = dict[str, "tuple[Input | Output, Argument]"]
"""The arguments of a CALL by keyword, with their parameters."""


def check_call(context: Context, call: Call) -> None:
    """Report the faults of a CALL; bind it to its block if there are none."""
    block = context.catalogue.get(call.block)
    if block is None:
        message = f"there is no block {call.block}"
        meant = [item.name for item in context.catalogue.values() if call.block in item.also_called]
        hint = f"{meant[0]} is meant" if meant else context.suggest.hint(call.block, context.catalogue)
        hint = hint or "`automax blocks` lists all blocks by the names that the manual gives them"
        context.report("AMX4070", message, context.place_of(call.block, call.span), hint)
        return
    before = context.errors
    if context.target not in block.runs_on:
        message = f"{block.name} cannot be used in {context.task_words}"
        places = " and ".join(sorted(item.value.upper() for item in block.runs_on))
        hint = f"it runs in {places} tasks: call it in one of these, and share its outputs as commons"
        context.report("AMX4071", message, context.place_of(call.block, call.span), hint)
    given = _arguments_by_keyword(context, block, call)
    values: dict[str, Expression] = {}
    for keyword, (parameter, argument) in given.items():
        value = checked_value(context, block, parameter, argument)
        if value is not None:
            values[keyword] = value
    if _check_keywords(context, block, call, given.keys()) and len(given) == len(call.arguments):
        _check_rules(context, block, call, given, values)
    check_channels(context, block, call, given.keys())
    check_coefficients(context, block, values, given.keys())
    if context.errors == before:
        defaults = {
            item.name: item.default for item in block.inputs if item.default is not None and item.name not in values
        }
        structure = structure_of(context, call) if block.structure is not None else None
        elements = _elements(context, block, values)
        context.calls[call.span] = BoundCall(call, block, context.line or 0, values, defaults, structure, elements)


def _elements(context: Context, block: Block, values: Mapping[str, Expression]) -> int:
    tables = [values[item.name] for item in block.inputs if item.type is Special.TABLE and item.name in values]
    sizes = [elements_of(context, table) for table in tables if isinstance(table, Reference)]
    return sizes[0] or 0 if sizes else 0


def check_scan_loop(context: Context, call: Call) -> None:
    """Check the CALL that begins the scan and store its TICKS, on which the limits of coefficients depend."""
    check_call(context, call)
    block = context.catalogue.get(call.block)
    follows = block.line_scan if block is not None and context.target in block.runs_on else None
    if block is not None and follows is not None and context.tick_ns != follows.tick_ns:
        message = f"{block.name} needs a Processor with the tick of {follows.tick_ns / NS_PER_MS:g} ms"
        hint = f"here the tick is {context.tick_ns / NS_PER_MS:g} ms (52.0)"
        context.report("AMX4181", message, context.place_of(call.block, call.span), hint)
    ticks = next((item.value for item in call.arguments if item.keyword == "TICKS"), None)
    if not isinstance(ticks, IntegerLiteral):
        return
    if context.target is Platform.UDC and UDC_MAX_TICKS < ticks.value <= MAX_TICKS:
        message = f"TICKS = {ticks.value} is above {UDC_MAX_TICKS}, the maximum of a UDC task"
        context.report("AMX4085", message, ticks.span, "a UDC's tick is 0.5 ms, its longest scan 10 ms")
    elif 1 <= ticks.value <= MAX_TICKS:
        context.ticks = ticks.value


def event_name(call: Call) -> str | None:
    """Return the event that a SCAN_LOOP waits for, None where the clock starts the scan."""
    value = next((item.value for item in call.arguments if item.keyword == "EVENT"), None)
    return getattr(value, "name", None)


def _arguments_by_keyword(context: Context, block: Block, call: Call) -> Arguments:
    given: Arguments = {}
    for argument in call.arguments:
        parameter = block.parameter(argument.keyword)
        name = argument.keyword if parameter is None else parameter.name
        if name in given:
            note = (Note("it is first given here", _keyword(context, given[name][1])),)
            context.report("AMX4073", f"{name} is given twice", _keyword(context, argument), notes=note)
        elif parameter is not None:
            given[name] = (parameter, argument)
            if name != argument.keyword:
                message = f"{argument.keyword} is a misprint of the manual: the parameter is {name}"
                context.report("AMX4186", message, _keyword(context, argument), f"write {name}")
    return given


def _check_keywords(context: Context, block: Block, call: Call, given: Collection[str]) -> bool:
    """Report unknown keywords and missing parameters; return whether there are none."""
    strangers = [argument for argument in call.arguments if block.parameter(argument.keyword) is None]
    missing = [item.name for item in block.parameters if item.required and item.name not in given]
    free = [item.name for item in block.parameters if item.name not in given]
    meant = set()
    for argument in strangers:
        name = context.suggest.nearest(argument.keyword, free)
        hint = f"did you mean {name}?" if name else f"its parameters: {', '.join(p.name for p in block.parameters)}"
        message = f"{block.name} has no parameter {argument.keyword}"
        context.report("AMX4072", message, _keyword(context, argument), hint)
        meant.add(name)
        for variable in variables_in(argument.value):
            if isinstance(variable, Reference) and not _may_stand_whole(context, variable.name):
                check_variable(context, variable)
    for name in missing:
        if name not in meant:
            place, item = context.place_of(call.block, call.span), block.parameter(name)
            meaning = f"{name}: {item.text}" if isinstance(item, Input) else None
            context.report("AMX4074", f"{block.name} needs {name}", place, meaning)
    return not missing and not strangers


def _may_stand_whole(context: Context, name: str) -> bool:
    """Return whether a name without subscripts is an event or an array, which some parameters accept."""
    symbol = context.symbols.get(name)
    return name in context.events or (symbol is not None and bool(symbol.dimensions))


def _keyword(context: Context, argument: Argument) -> Span:
    return context.place_of(argument.keyword, argument.span)


def _check_rules(
    context: Context, block: Block, call: Call, given: Arguments, values: Mapping[str, Expression]
) -> None:
    """Report broken rules of the block; a parameter that is itself at fault is hidden from the rules."""
    block_name = context.place_of(call.block, call.span)
    seen = {keyword: _seen_by_rules(context, values.get(keyword)) for keyword in given}
    for rule in block.rules:
        fault = rule.fault(seen)
        if fault is not None:
            at_fault = given[fault.keyword][1].span if fault.keyword in given else None
            context.report(fault.code, f"{block.name}: {fault.message}", at_fault or block_name, rule.text)


def _seen_by_rules(context: Context, value: Expression | None) -> Given:
    literal = None if value is None else literal_of(value)
    if literal is not None:
        return Given(value=literal.value)
    return Given(size=elements_of(context, value) if isinstance(value, Reference) else None)
