"""Checks of LOCAL, COMMON and EVENT, and of tunables.

Every name is declared once, with sizes in bounds and in agreement with the rack (2.4). The bracket of a tunable has
constants of its type, CURRENT between LOW and HIGH, and a positive STEP (2.4.5).
"""

from __future__ import annotations

from collections.abc import Mapping

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Note
from automax_ros.core.numbers import REAL_MIN_POSITIVE, stored_real
from automax_ros.core.types import (
    DEFAULT_STRING_LENGTH,
    MAX_ARRAY_ELEMENTS,
    MAX_DIMENSIONS,
    MAX_STRING_LENGTH,
    MAX_SUBSCRIPT,
    DataType,
    Value,
    bare_name,
    declaration_text,
)
from automax_ros.core.values import range_text
from automax_ros.language.checks.rules.constant_values import constant_value, fits, hex_hint, is_constant
from automax_ros.language.checks.rules.context import Context, TaskLayout
from automax_ros.language.program import CommonSpec, Symbol, TuningLimits
from automax_ros.language.tree.tree import Declaration, Declared, Event, Expression, Scope

MAX_TASK_ELEMENTS = 4_000_000
"""Most values that the variables and blocks of a task hold together (decision: a bound on memory for any source)."""
MAX_TIMEOUT = 32767


def tuning_limits(context: Context, scope: Scope, declared: Declared) -> TuningLimits | None:
    """Return the tuning of a declared tunable; report a bracket at fault and return None.

    A tunable's HIGH and LOW default to its type's range, STEP to 1, for a REAL to the smallest magnitude (decision).
    """
    tuning, kind = declared.tuning, declared.type
    if tuning is None:
        return None
    if scope is not Scope.LOCAL or not kind.is_numeric or declared.subscripts:
        hint = "a tunable is a simple LOCAL variable of type INTEGER, DOUBLE INTEGER or REAL"
        context.report("AMX4012", f"{declared.name} cannot be tunable", declared.span, hint)
        return None
    before = len(context.diagnostics)
    lowest, highest = kind.range
    current = _value(context, declared, "CURRENT", tuning.current)
    low = _value(context, declared, "LOW", tuning.low)
    high = _value(context, declared, "HIGH", tuning.high)
    step = _value(context, declared, "STEP", tuning.step)
    if tuning.current is None:
        context.report("AMX4013", f"the tunable {declared.name} has no CURRENT value", tuning.span)
    if step is not None and step <= 0:
        place = tuning.step.span if tuning.step is not None else tuning.span
        context.report("AMX4015", f"STEP = {_text(step)} of {declared.name} is not above 0", place)
    if current is None or len(context.diagnostics) > before:
        return None
    limits = TuningLimits(
        current=current,
        low=low if low is not None else lowest,
        high=high if high is not None else highest,
        step=step if step is not None else 1 if kind.is_integer else REAL_MIN_POSITIVE,
    )
    if not limits.low <= current <= limits.high:  # type: ignore[operator]
        place = tuning.current.span if tuning.current is not None else tuning.span
        low_text, high_text = _text(limits.low), _text(limits.high)
        message = f"CURRENT = {_text(current)} of {declared.name} is not inside LOW = {low_text} to HIGH = {high_text}"
        context.report("AMX4014", message, place)
        return None
    return limits


def _text(value: Value) -> str:
    return f"{value:.8g}" if isinstance(value, float) else str(value)


def _value(context: Context, declared: Declared, key: str, expression: Expression | None) -> int | float | None:
    """Return the number after a key of the bracket in the tunable's type, None where it is absent or at fault."""
    if expression is None:
        return None
    kind = declared.type
    value: Value | None = constant_value(expression) if is_constant(expression) else None
    if value is None or isinstance(value, (bool, str)) or (kind.is_integer and isinstance(value, float)):
        wanted = "an integer constant" if kind.is_integer else "a number"
        context.report("AMX2018", f"{key} of the {kind.word} tunable {declared.name} must be {wanted}", expression.span)
        return None
    if not fits(value, kind):
        message = f"{key} = {value} does not fit {declared.name}: {kind.word} is {range_text(kind)}"
        context.report("AMX2007", message, expression.span, hex_hint(expression, kind))
        return None
    return stored_real(float(value))[0] if kind is DataType.REAL else value


def check_declarations(context: Context, layout: TaskLayout) -> None:
    """Enter the declared symbols and events into the context, and report the faults of their declarations."""
    top = {id(statement) for statement in (*layout.startup, *layout.scan)}
    events: list[tuple[Event, int | None]] = []
    for statement, line, after in layout.numbered():
        context.line = line
        if isinstance(statement, Declaration):
            _check_place(context, statement, after, id(statement) in top)
            for declared in statement.variables:
                _declare(context, statement.scope, declared)
        elif isinstance(statement, Event):
            events.append((statement, line))
            _declare_event(context, statement, after)
    _check_total(context)
    for event, line in events:
        context.line = line
        _check_event(context, event)


def _check_place(context: Context, statement: Declaration, after: bool, top: bool) -> None:
    if after:
        hint = f"all variables are declared before the {context.scan_block} block"
        context.report("AMX4003", f"{statement.scope.value} stands after {context.scan_block}", statement.span, hint)
    elif not top:
        hint = "a declaration holds for the whole task and cannot depend on a condition"
        context.report("AMX4004", f"{statement.scope.value} stands inside an IF or FOR block", statement.span, hint)


def _declare(context: Context, scope: Scope, declared: Declared) -> None:
    name = declared.name
    earlier = context.symbols.get(name)
    event = context.events.get(name)
    if earlier is not None or event is not None:
        place = earlier.span if earlier is not None else event.span  # type: ignore[union-attr]
        note = Note(f"{name} is first declared here", place)
        context.report("AMX4002", f"{name} is declared twice", declared.span, notes=(note,))
        return
    symbol = Symbol(
        name=name,
        type=declared.type,
        scope=scope,
        span=declared.span,
        dimensions=_dimensions(context, declared),
        length=_length(context, declared),
        tuning=tuning_limits(context, scope, declared) if declared.tuning is not None else None,
    )
    context.symbols[name] = symbol
    if scope is Scope.COMMON and context.commons is not None:
        _compare_with_rack(context, symbol, context.commons)


def _dimensions(context: Context, declared: Declared) -> tuple[int, ...]:
    """Return the numbers of elements; a dimension that is out of bounds counts as the largest allowed."""
    name, subscripts = declared.name, declared.subscripts
    if len(subscripts) > MAX_DIMENSIONS:
        context.report(
            "AMX4006", f"{name} has {len(subscripts)} dimensions, at most {MAX_DIMENSIONS} are allowed", declared.span
        )
        subscripts = subscripts[:MAX_DIMENSIONS]
    elements = 1
    for subscript in subscripts:
        elements *= subscript + 1
        if not 0 <= subscript <= MAX_SUBSCRIPT:
            message = f"the subscript {subscript} of {name} is not 0 to {MAX_SUBSCRIPT}"
            context.report("AMX4007", message, declared.span, "a dimension has at most 65535 elements, from 0 on")
            return tuple(max(0, min(item, MAX_SUBSCRIPT)) + 1 for item in subscripts)
    if elements > MAX_ARRAY_ELEMENTS:
        message = f"{name} has {elements} elements, at most {MAX_ARRAY_ELEMENTS} are allowed"
        context.report("AMX4007", message, declared.span)
    return tuple(subscript + 1 for subscript in subscripts)


def _length(context: Context, declared: Declared) -> int:
    if declared.type is not DataType.STRING:
        if declared.length is not None:
            context.report("AMX4008", f"{declared.name} is not a string and has no length", declared.span)
        return 0
    length = DEFAULT_STRING_LENGTH if declared.length is None else declared.length
    if not 1 <= length <= MAX_STRING_LENGTH:
        context.report(
            "AMX4008", f"the length {length} of {declared.name} is not 1 to {MAX_STRING_LENGTH}", declared.span
        )
        return DEFAULT_STRING_LENGTH
    return length


def check_storage(context: Context) -> None:
    """Report the block whose samples or data structure make the task's data too large (25, 30, 31)."""
    total = sum(min(symbol.elements, MAX_ARRAY_ELEMENTS) for symbol in context.symbols.values())
    if total > MAX_TASK_ELEMENTS:
        return
    for call in context.calls.values():
        facts = call.facts
        total += sum(state.size(facts) for state in call.block.states if state.size is not None)
        if total > MAX_TASK_ELEMENTS:
            context.line = call.line
            message = (
                f"with this {call.block.name} the task's variables and blocks hold more than {MAX_TASK_ELEMENTS} values"
            )
            context.report("AMX4009", message, call.call.span)
            return


def _check_total(context: Context) -> None:
    total = 0
    for symbol in context.symbols.values():
        total += min(symbol.elements, MAX_ARRAY_ELEMENTS)
        if total > MAX_TASK_ELEMENTS:
            context.line = None
            message = f"with {symbol.name} the task's variables hold more than {MAX_TASK_ELEMENTS} values"
            context.report("AMX4009", message, symbol.span)
            return


def _compare_with_rack(context: Context, symbol: Symbol, commons: Mapping[str, CommonSpec]) -> None:
    """Report a COMMON that the rack lacks or defines differently: the hardware's E0."""
    spec = commons.get(symbol.name)
    if spec is None:
        twins = [item for name, item in sorted(commons.items()) if bare_name(name) == bare_name(symbol.name)]
        if twins:
            message = (
                f"{symbol.name} is {symbol.type.word} here, {twins[0].name} at {twins[0].place} is {twins[0].type.word}"
            )
            context.report("AMX4011", message, symbol.span)
        else:
            line = declaration_text(symbol.name, symbol.dimensions, symbol.length)
            near = context.suggest.hint(symbol.name, commons)
            add = f"add to `common:` of the rack file:  {line}: {{}}"
            hint = f"{near} If not, {add}" if near else add
            context.report("AMX4010", f"the rack does not define the common {symbol.name}", symbol.span, hint)
    elif spec.dimensions != symbol.dimensions:
        message = f"{symbol.name} is {_shape(symbol.dimensions)} here, {_shape(spec.dimensions)} at {spec.place}"
        context.report("AMX4011", message, symbol.span)
    elif spec.length and spec.length != symbol.length:
        message = f"{symbol.name} has the length {symbol.length} here, {spec.length} at {spec.place}"
        context.report("AMX4011", message, symbol.span)


def _shape(dimensions: tuple[int, ...]) -> str:
    return f"an array ({','.join(str(size - 1) for size in dimensions)})" if dimensions else "a simple variable"


def _declare_event(context: Context, event: Event, after: bool) -> None:
    if after:
        context.report("AMX4064", f"the event {event.name} is declared after {context.scan_block}", event.span)
    earlier = context.events.get(event.name) or context.symbols.get(event.name)
    if earlier is not None:
        note = Note(f"{event.name} is first declared here", earlier.span)
        context.report("AMX4002", f"{event.name} is declared twice", event.span, notes=(note,))
        return
    context.events[event.name] = event


def _check_event(context: Context, event: Event) -> None:
    if context.target is Platform.UDC:
        context.report("AMX4027", "EVENT cannot be used in a UDC task", event.span)
        return
    if event.interrupt_status is None:
        return
    if context.target is Platform.PC3000:
        context.report("AMX4027", "a PC3000 task has no hardware events", event.span)
        return
    variable = event.interrupt_status
    symbol = context.symbols.get(variable.name)
    if symbol is None:
        if not context.broken.may_declare(variable.name):
            hint = context.suggest.hint(variable.name, context.symbols)
            context.report("AMX4001", f"{variable.name} is not declared", variable.span, hint)
    elif symbol.scope is not Scope.COMMON or symbol.type is not DataType.INTEGER or symbol.dimensions:
        message = f"{variable.name} must be a simple common INTEGER: the interrupt status register of a module"
        context.report("AMX4062", message, variable.span)
    if event.timeout is not None and not 1 <= event.timeout <= MAX_TIMEOUT:
        context.report("AMX4063", f"TIMEOUT = {event.timeout} is not 1 to {MAX_TIMEOUT}", event.span)
