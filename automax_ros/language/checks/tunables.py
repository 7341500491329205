"""Checks of a tunable's bracket: constants of its type, CURRENT inside LOW and HIGH, a positive STEP (2.4.5)."""

from __future__ import annotations

from automax_ros.core.numbers import REAL_MIN_POSITIVE, stored_real
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import range_text
from automax_ros.language.checks.constant_values import constant_value, fits, hex_hint, is_constant
from automax_ros.language.checks.context import Context
from automax_ros.language.program import TuningLimits
from automax_ros.language.syntax.tree import Declared, Expression, Scope


def tuning_limits(context: Context, scope: Scope, declared: Declared) -> TuningLimits | None:
    """Return the tuning of a declared tunable, None where its bracket is at fault, which is reported.

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
