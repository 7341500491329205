"""Translation of calls in generated code: of helpers of the blocks, functions of BASIC, and Python's own functions.

Most functions are translated from their Python, once for each range of arguments that gives a different text; the few
that use integers of any size or bytes in Python are written in ``operations.h``, and tested against their Python.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Mapping
from functools import cache
from types import FunctionType

from automax_ros.compile.base import functions
from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.blocks.coefficients import FORMULAS, CoefficientFunction, coefficient_tree, raised
from automax_ros.compile.native.translate.environment import Environment
from automax_ros.compile.native.translate.expressions import extreme
from automax_ros.compile.native.translate.frame import Frame
from automax_ros.compile.native.translate.ranges import (
    ANY_BOOL,
    ANY_REAL,
    INFINITE,
    INT64_MAX,
    Kind,
    Range,
    span,
)
from automax_ros.compile.native.translate.statements import Body
from automax_ros.compile.native.translate.typed import Typed, as_real, bare, c_type, literal
from automax_ros.core.numbers import INT32_MAX, INT32_MIN, REAL_MAX, stored_real

_MOST = 2.0**126
"""Largest magnitude of a REAL whose integer is computed; one beyond it ends the scan. No REAL variable comes near."""
Carry = Callable[[Frame, list[Typed]], list[Typed]]


def called(frame: Frame, function: object, node: ast.Call, known: Environment) -> list[Typed]:
    """Return the results of a call of a Python function.

    Raises:
        NotNative: it cannot be translated.
    """
    if function is functions.data_value:
        return _data_value(frame, node, known)
    arguments = [frame.value(argument, known) for argument in node.args]
    try:
        carry_out = _BUILTINS.get(function)
    except TypeError:
        carry_out = None
    if carry_out is not None:
        return carry_out(frame, arguments)
    if isinstance(function, CoefficientFunction):
        arguments = [as_real(item) for item in arguments]
        return _translate(frame, frame.unit.tree(function, coefficient_tree), FORMULAS, arguments)
    if not isinstance(function, FunctionType):
        raise NotNative(f"a call of {function!r}")
    missing = function.__code__.co_argcount - len(arguments)
    arguments = [*arguments, *map(literal, (function.__defaults__ or ())[-missing:] if missing else ())]
    return _translate(frame, _parse(function), function.__globals__, arguments)


def _translate(
    frame: Frame, parsed: ast.FunctionDef, scope: Mapping[str, object], arguments: list[Typed]
) -> list[Typed]:
    parameters = [argument.arg for argument in parsed.args.args]
    arguments = [_of_annotation(item, given) for given, item in zip(parsed.args.args, arguments, strict=True)]
    exact = _frame_of(frame, parsed, scope, [item.range for item in arguments])
    results = _results(exact)
    try:
        general = _frame_of(frame, parsed, scope, [_general(item.range) for item in arguments])
    except NotNative:
        general = exact
    if [c_type(item) for item in _results(general)] != [c_type(item) for item in results]:
        general = exact
    name = _define(general, parsed.name, parameters, [item.range for item in arguments])
    return _deliver(frame, name, [bare(item.text) for item in arguments], results, can_end=general.can_end)


@cache
def _parse(function: FunctionType) -> ast.FunctionDef:
    parsed = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    if not isinstance(parsed, ast.FunctionDef):
        raise NotNative(f"a call of {function.__name__}")
    for node in ast.walk(parsed):
        if isinstance(node, ast.stmt):
            node.lineno = 0  # lines in messages are those of the task
    return parsed


def _of_annotation(item: Typed, parameter: ast.arg) -> Typed:
    """Return an argument converted to the parameter's annotation: an integer for a float is the same number."""
    annotation = parameter.annotation
    wanted = annotation.id if isinstance(annotation, ast.Name) else ""
    if wanted == "float":
        return as_real(item)
    return item.whole if wanted == "int" and item.range.kind is Kind.BOOL else item


def _general(known: Range) -> Range:
    """Return a wider range that many calls share, so that they share the function in C."""
    if known.kind is Kind.BOOL:
        return ANY_BOOL
    if known.kind is Kind.REAL:
        return ANY_REAL
    if known.is_wide or known.only is not None:
        return known
    for most in (32768, 2**32, 2**53, INT64_MAX // 2):
        if known.low >= -most and known.high <= most:
            return Range(Kind.INT, -most, most)
    return known


def _frame_of(frame: Frame, parsed: ast.FunctionDef, scope: Mapping[str, object], ranges: list[Range]) -> Frame:
    """Return a function translated for arguments of some ranges.

    Raises:
        NotNative: it cannot be translated for them.
    """
    made = Frame(frame.unit, scope, called)
    known = Environment(dict(zip((argument.arg for argument in parsed.args.args), ranges, strict=True)))
    for name, item in known.items():
        made.parameter(name, item)
    try:
        left = Body(made).execute(parsed.body, known)
    except NotNative as error:
        raise NotNative(f"{error.reason}, in {parsed.name}") from None
    if left is not None:
        raise NotNative(f"{parsed.name} ends without a result")
    return made


def _results(made: Frame) -> list[Range]:
    return [span(items) for items in zip(*made.returned, strict=True)]


def _define(made: Frame, name: str, parameters: list[str], ranges: list[Range]) -> str:
    results = [c_type(item) for item in _results(made)]
    given = [f"{c_type(item)} {parameter}" for parameter, item in zip(parameters, ranges, strict=True)]
    given += [f"{kind} *result_{number}" for number, kind in enumerate(results[1:], 1)]
    given += ["int *ended"] * made.can_end
    inner = {place: kind for place, kind in made.locals.items() if place not in parameters}
    declared = [f"    {kind} {place};\n" for place, kind in inner.items()]
    head = f"static inline {results[0]} @({', '.join(given)}) {{\n"
    return made.unit.function(name, head, "".join(declared) + "\n".join(made.lines) + "\n}")


def _deliver(frame: Frame, name: str, texts: list[str], results: list[Range], *, can_end: bool) -> list[Typed]:
    """Return a call whose second and further results are returned by pointers."""
    others = [Typed(frame.temporary(item), item) for item in results[1:]]
    arguments = [*texts, *(f"&{item.text}" for item in others)]
    if can_end:
        arguments.append(frame.ended())
    return [Typed(f"{name}({', '.join(arguments)})", results[0]), *others]


# Python's own functions


def _absolute(_: Frame, arguments: list[Typed]) -> list[Typed]:
    item = arguments[0]
    low, high = item.range.low, item.range.high
    least = 0 if low <= 0 <= high else min(abs(low), abs(high))
    most = max(abs(low), abs(high))
    if item.range.kind is Kind.REAL:
        return [Typed(f"fabs({bare(item.text)})", Range(Kind.REAL, least, most, item.range.never_nan))]
    width = "wide" if item.range.is_wide else "of"
    return [Typed(f"magnitude_{width}({bare(item.text)})", Range(Kind.INT, least, most))]


def _real(_: Frame, arguments: list[Typed]) -> list[Typed]:
    return [as_real(arguments[0])]


def _rounding(carry_out: Callable[[float], int], function: str) -> Carry:
    def rounded(frame: Frame, arguments: list[Typed]) -> list[Typed]:
        item = arguments[0]
        if item.range.is_whole:
            return [item.whole]
        if item.range.low < -_MOST or item.range.high > _MOST:
            known = Range(Kind.INT, -int(_MOST), int(_MOST))
            return [Typed(f"{function}_wide({bare(item.text)}, {frame.ended()})", known)]
        result = Range(Kind.INT, carry_out(item.range.low), carry_out(item.range.high))
        wide = "_wide" * result.is_wide
        return [Typed(f"{function}{wide}({bare(item.text)}, {frame.ended()})", result)]

    return rounded


def _least_or_most(*, least: bool) -> Carry:
    return lambda _, arguments: [extreme(arguments, least=least)]


def _of_library(name: str, low: float = -INFINITE, high: float = INFINITE, result: Range = ANY_REAL) -> Carry:
    """Return the translation to a function of the C library, for arguments within bounds where Python never raises."""

    def library(frame: Frame, arguments: list[Typed]) -> list[Typed]:
        item = as_real(arguments[0])
        text = bare(item.text)
        if item.range.low < low or item.range.high > high:
            text = f"within({text}, {low!r}, {high!r}, {frame.ended()})".replace("inf", "INFINITY")
        return [Typed(f"{name}({text})", result)]

    return library


def _asking(name: str) -> Carry:
    return lambda _, arguments: [Typed(f"(bool){name}({bare(as_real(arguments[0]).text)})", ANY_BOOL)]


def _truth(_: Frame, arguments: list[Typed]) -> list[Typed]:
    return [Typed(f"({arguments[0].text} != 0)", ANY_BOOL)]


def _stored_real(frame: Frame, arguments: list[Typed]) -> list[Typed]:
    item = as_real(arguments[0])
    stored = [
        stored_real(bound)[0] if abs(bound) != INFINITE else math.copysign(REAL_MAX, bound)
        for bound in (item.range.low, item.range.high)
    ]
    # NaN becomes 0
    result = Range(Kind.REAL, min(0.0, stored[0]), max(0.0, stored[1]), never_nan=True)
    return _deliver(frame, "stored_real", [bare(item.text)], [result, ANY_BOOL], can_end=False)


def _data_value(frame: Frame, node: ast.Call, known: Environment) -> list[Typed]:
    """Return READ of a DATA value: the result of each value for a variable of the type is known."""
    item, suffix, limit = node.args
    data = frame.scope["data"]
    if not (isinstance(item, ast.Subscript) and isinstance(suffix, ast.Constant) and isinstance(data, tuple)):
        raise NotNative("READ")
    length = limit.value if isinstance(limit, ast.Constant) and isinstance(limit.value, int) else 0
    read = [functions.data_value(value, str(suffix.value), length) for value in data]
    return [frame.constants([result[place] for result in read], item.slice, known) for place in (0, 1)]


def _integer_power(frame: Frame, arguments: list[Typed]) -> list[Typed]:
    texts = [bare(item.whole.text) for item in arguments]
    results = [Range(Kind.INT, INT32_MIN, INT32_MAX), Range(Kind.INT, 0, functions.DIVISION_BY_ZERO)]
    return _deliver(frame, "integer_power", texts, results, can_end=False)


def _real_power(frame: Frame, arguments: list[Typed]) -> list[Typed]:
    texts = [bare(as_real(item).text) for item in arguments]
    results = [ANY_REAL, Range(Kind.INT, 0, functions.BAD_ARGUMENT)]
    return _deliver(frame, "real_power", texts, results, can_end=False)


def _call_raised(frame: Frame, arguments: list[Typed]) -> list[Typed]:
    base, exponent = (bare(as_real(item).text) for item in arguments)
    return [Typed(f"raised({base}, {exponent}, {frame.ended()})", ANY_REAL)]


_BUILTINS: dict[object, Carry] = {
    abs: _absolute,
    float: _real,
    int: _rounding(int, "truncated"),
    bool: _truth,
    min: _least_or_most(least=True),
    max: _least_or_most(least=False),
    math.floor: _rounding(math.floor, "floored"),
    math.isnan: _asking("isnan"),
    math.isfinite: _asking("isfinite"),
    math.sqrt: _of_library("sqrt", 0.0, result=Range(Kind.REAL, 0.0, INFINITE)),
    math.sin: _of_library("library_sin", result=Range(Kind.REAL, -1.0, 1.0)),
    math.cos: _of_library("library_cos", result=Range(Kind.REAL, -1.0, 1.0)),
    math.tan: _of_library("library_tan"),
    math.atan: _of_library("library_atan", result=Range(Kind.REAL, -2.0, 2.0)),
    math.log: _of_library("library_log", 5e-324),
    math.exp: _of_library("library_exp", high=709.0, result=Range(Kind.REAL, 0.0, INFINITE)),
    stored_real: _stored_real,
    functions.store_real: _stored_real,
    functions.integer_power: _integer_power,
    functions.real_power: _real_power,
    raised: _call_raised,
}
"""The translation of each function that is not translated from its Python."""
