"""Checks of whole arrays and of data structures that a CALL names.

Tables are one-dimensional INTEGER arrays (sections 13 and 29). A data structure is made once, by a SHIFT block of the
task, and used by blocks of its kind (23, 24, 30 ...).
"""

from __future__ import annotations

from collections.abc import Collection

from automax_ros.blocks.declare.channels import MOST_CHANNELS
from automax_ros.blocks.declare.declaration import Access, Block, Input, Output, Special
from automax_ros.blocks.declare.rules import STRUCTURE_BYTES
from automax_ros.core.diagnostics import Note
from automax_ros.core.types import NAME_LIMIT, DataType, bare_name
from automax_ros.language.checks.rules.constant_values import literal_of
from automax_ros.language.checks.rules.context import Context, TaskLayout
from automax_ros.language.checks.rules.expressions import check_variable
from automax_ros.language.program import DataStructure, Symbol
from automax_ros.language.tree.tree import Argument, Call, Element, Expression, IntegerLiteral, Reference, Scope


def find_structures(context: Context, layout: TaskLayout) -> None:
    """Find the task's data structures in advance: a block may use one that a later SHIFT block makes."""
    for statement, _, _ in layout.numbered():
        block = context.catalogue.get(statement.block) if isinstance(statement, Call) else None
        if isinstance(statement, Call) and block is not None and block.structure is Access.MAKES:
            given = {argument.keyword: argument.value for argument in statement.arguments}
            name = given.get("STRUCTURE_NAME")
            if isinstance(name, Reference) and name.name not in context.structures:
                channels = sum(f"INPUT{channel}" in given for channel in range(1, MOST_CHANNELS + 1))
                made = DataStructure(name.name, name.type, _columns(given.get("MAX_COLUMNS")), max(channels, 1))
                context.structures[name.name] = (made, name.span)


def _columns(value: Expression | None) -> int:
    """Return the number of columns; one that is out of range is reported where the block is checked."""
    literal = None if value is None else literal_of(value)
    if isinstance(literal, IntegerLiteral) and 1 <= literal.value <= STRUCTURE_BYTES:
        return literal.value
    return 1


def checked_structure(context: Context, block: Block, parameter: Input, argument: Argument) -> Expression | None:
    """Report the faults of a data structure's name, and return it."""
    assert isinstance(parameter.type, Special)
    wanted, value = parameter.type.element, argument.value
    assert wanted is not None
    if not isinstance(value, Reference):
        message = f"{parameter.name} takes the name of a data structure, such as QUEUE{wanted.value}"
        context.report("AMX4087", message, value.span)
        return None
    if value.type is not wanted:
        hint = f"its name ends with {wanted.value}"
        message = f"{block.name} needs a data structure of type {wanted.word}, {value.name} is {value.type.word}"
        context.report("AMX4087", message, value.span, hint)
        return None
    _check_declaration(context, value)
    if block.structure is Access.MAKES:
        first = context.structures[value.name][1]
        if first != value.span:
            note = Note("the first SHIFT block is here", first)
            context.report("AMX4089", f"a second SHIFT block makes {value.name}", value.span, notes=(note,))
    elif value.name not in context.structures:
        hint = context.suggest.hint(value.name, context.structures) or "a SHIFT block of the task must make it"
        context.report("AMX4088", f"no SHIFT block makes the data structure {value.name}", value.span, hint)
    if len(bare_name(value.name)) == NAME_LIMIT:
        message = f"the name {value.name} has {NAME_LIMIT} characters"
        context.report("AMX4095", message, value.span, "sections 23, 24, 30, 39 and 40 of the manual allow only 15")
    return value


def _check_declaration(context: Context, name: Reference) -> None:
    symbol = context.symbols.get(name.name)
    if symbol is not None and (symbol.scope is not Scope.LOCAL or symbol.tuning is not None):
        note = Note("it is declared here", symbol.span)
        message = f"{name.name} cannot be a data structure: it is declared as a variable of another kind"
        hint = "a data structure is local to the task and need not be declared"
        context.report("AMX4093", message, name.span, hint, (note,))


def check_channels(context: Context, block: Block, call: Call, given: Collection[str]) -> None:
    """Report channels programmed in a READ or WRITE block that its data structure does not have."""
    if block.structure is not Access.USES:
        return
    structure = structure_of(context, call)
    if structure is None:
        return
    for argument in call.arguments:
        stem = "OUTPUT" if argument.keyword.startswith("OUTPUT") else "INPUT"
        number = argument.keyword.removeprefix(stem)
        if argument.keyword in given and number.isdigit() and int(number) > structure.channels:
            channels = "channel 1 only" if structure.channels == 1 else f"channels 1 to {structure.channels}"
            message = f"{structure.name} has no channel {number}: its SHIFT block programs {channels}"
            note = Note("the data structure is made here", context.structures[structure.name][1])
            place = context.place_of(argument.keyword, argument.span)
            context.report("AMX4090", message, place, notes=(note,))


def structure_of(context: Context, call: Call) -> DataStructure | None:
    """Return the data structure that a CALL names, None where it names no known one."""
    name = next((item.value for item in call.arguments if item.keyword == "STRUCTURE_NAME"), None)
    found = context.structures.get(name.name) if isinstance(name, Reference) else None
    return None if found is None else found[0]


def checked_table(context: Context, parameter: Input, argument: Argument) -> Expression | None:
    """Report the faults of a table given to a block, and return it."""
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
    """Report the faults of an array of fixed dimensions that a block writes, and return it."""
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
