"""Checks of CALL: the block, its keywords, and the block's rules for them (3.1)."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from automax_ros.blocks.declare.declaration import Block, Given, Input, Output, Platform, Special
from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.ticks import MAX_TICKS, NS_PER_MS, UDC_MAX_TICKS
from automax_ros.language.checks.calls.coefficients import check_coefficients
from automax_ros.language.checks.calls.data_structures import check_channels, elements_of, structure_of
from automax_ros.language.checks.calls.parameters import checked_value
from automax_ros.language.checks.rules.constant_values import literal_of
from automax_ros.language.checks.rules.context import Context
from automax_ros.language.checks.rules.expressions import check_variable
from automax_ros.language.program import BoundCall
from automax_ros.language.tree.tree import Argument, Call, Expression, IntegerLiteral, Reference
from automax_ros.language.tree.walk import variables_in

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
