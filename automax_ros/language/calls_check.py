"""Checks of CALL: the block, its keywords, and what the block's own rules say of them (3.1)."""

from __future__ import annotations

from collections.abc import Collection

from automax_ros.blocks.catalogue import NOT_YET
from automax_ros.blocks.declaration import Block, Input, Output, Processor
from automax_ros.blocks.rules import Contiguous
from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.ticks import MAX_TICKS, UDC_MAX_TICKS
from automax_ros.language.check_context import Context
from automax_ros.language.coefficients_check import check_coefficients
from automax_ros.language.expressions_check import check_variable
from automax_ros.language.parameters_check import checked_value
from automax_ros.language.program import BoundCall
from automax_ros.language.tree import Argument, Call, Expression, IntegerLiteral, Variable
from automax_ros.language.walk import variables_in

Given = dict[str, "tuple[Input | Output, Argument]"]
"""The arguments of a CALL by keyword, with their parameters."""


def check_call(context: Context, call: Call) -> None:
    """Report what is wrong in a CALL; bind it to its block where nothing is."""
    block = context.catalogue.get(call.block)
    if block is None:
        message = f"there is no block {call.block}"
        hint = context.suggest.hint(call.block, context.catalogue)
        if call.block in NOT_YET:
            message = f"the emulator does not have the block {call.block} yet"
            hint = "`automax blocks` lists those it has"
        context.report("AMX4070", message, context.place_of(call.block, call.span), hint)
        return
    before = len(context.diagnostics)
    if context.target not in block.runs_on:
        message = f"{block.name} cannot be used in a {context.target.value.upper()} task"
        context.report("AMX4071", message, context.place_of(call.block, call.span))
    given = _arguments_by_keyword(context, block, call)
    values: dict[str, Expression] = {}
    for keyword, (parameter, argument) in given.items():
        value = checked_value(context, block, parameter, argument)
        if value is not None:
            values[keyword] = value
    if _check_keywords(context, block, call, given.keys()) and len(given) == len(call.arguments):
        _check_rules(context, block, call, given)
    check_coefficients(context, block, values, given.keys())
    if len(context.diagnostics) == before:
        defaults = {
            item.name: item.default for item in block.inputs if item.default is not None and item.name not in values
        }
        context.calls[call.span] = BoundCall(call, block, context.line or 0, values, defaults)


def check_scan_loop(context: Context, call: Call) -> None:
    """Check the task's SCAN_LOOP and keep its TICKS, on which the limits of coefficients depend."""
    check_call(context, call)
    ticks = next((item.value for item in call.arguments if item.keyword == "TICKS"), None)
    if not isinstance(ticks, IntegerLiteral):
        return
    if context.target is Processor.UDC and UDC_MAX_TICKS < ticks.value <= MAX_TICKS:
        message = f"TICKS = {ticks.value} is above {UDC_MAX_TICKS}, the maximum of a UDC task"
        context.report("AMX4085", message, ticks.span, "a UDC's tick is 0.5 ms, its longest scan 10 ms")
    elif 1 <= ticks.value <= MAX_TICKS:
        context.ticks = ticks.value


def event_name(call: Call) -> str | None:
    """Return the event that a SCAN_LOOP waits for, None where the clock starts the scan."""
    value = next((item.value for item in call.arguments if item.keyword == "EVENT"), None)
    return getattr(value, "name", None)


def _arguments_by_keyword(context: Context, block: Block, call: Call) -> Given:
    """Return the arguments with a known keyword and report those given twice."""
    given: Given = {}
    for argument in call.arguments:
        parameter = block.parameter(argument.keyword)
        if argument.keyword in given:
            note = (Note("it is first given here", _keyword(context, given[argument.keyword][1])),)
            context.report("AMX4073", f"{argument.keyword} is given twice", _keyword(context, argument), notes=note)
        elif parameter is not None:
            given[argument.keyword] = (parameter, argument)
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
            if isinstance(variable, Variable) and variable.name not in context.events:
                check_variable(context, variable)
    for name in missing:
        if name not in meant:
            place = context.place_of(call.block, call.span)
            context.report("AMX4074", f"{block.name} needs {name}", place, _missing_hint(block, name))
    return not missing and not strangers


def _keyword(context: Context, argument: Argument) -> Span:
    return context.place_of(argument.keyword, argument.span)


def _missing_hint(block: Block, name: str) -> str | None:
    parameter = block.parameter(name)
    if not isinstance(parameter, Input):
        return None
    return f"{name}: {parameter.text}"


def _check_rules(context: Context, block: Block, call: Call, given: Given) -> None:
    block_name = context.place_of(call.block, call.span)
    for rule in block.rules:
        for fault in rule.faults({keyword: argument.value for keyword, (_, argument) in given.items()}):
            at_fault = given[fault.keyword][1].span if fault.keyword in given else None
            code = "AMX4081" if isinstance(rule, Contiguous) else "AMX4082"
            context.report(code, f"{block.name}: {fault.message}", at_fault or block_name, rule.text)
