"""Single operations as C: translated from Python functions, called over arrays, held against Python."""

from __future__ import annotations

import ast
import ctypes
import itertools
import math
import random
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from automax_ros.compile.native.run.build import library
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.translate.calls import called
from automax_ros.compile.native.translate.environment import Environment
from automax_ros.compile.native.translate.frame import Frame, Unit
from automax_ros.compile.native.translate.ranges import ANY_BOOL, ANY_REAL, NumberKind, Range
from automax_ros.compile.native.translate.translation import fixed_parts
from automax_ros.compile.native.translate.typed import WIDE, bare, c_type
from automax_ros.core import numbers

FAULT = 5
"""AUTOMAX_FAULT: Python raises an exception."""
PYTHON_RAISES = (ZeroDivisionError, OverflowError, ValueError)


def whole(low: int, high: int) -> Range:
    """Integers from one to another."""
    return Range(NumberKind.INT, low, high)


def real(low: float, high: float) -> Range:
    """REALs from one to another."""
    return Range(NumberKind.REAL, low, high)


WORD, LONG, EXACT = whole(-32768, 32767), whole(-(2**31), 2**31 - 1), whole(-(2**53), 2**53)
BIG, ANY = whole(-(2**63) + 1, 2**63 - 1), ANY_REAL
FLAG = ANY_BOOL


@dataclass(frozen=True)
class Operation:
    """A Python function, and what its arguments can be."""

    function: Callable[..., Any]
    arguments: tuple[Range, ...]

    @property
    def name(self) -> str:
        """What messages call it."""
        kinds = [f"{item.kind.name} {item.low:g} to {item.high:g}" for item in self.arguments if item.kind]
        return f"{self.function.__name__} of {', '.join(kinds)}"


@dataclass(frozen=True)
class Translated:
    """An operation in C: the name of a function that applies it to arrays, its text, the kinds of its results."""

    name: str
    text: str
    results: tuple[str, ...]


def translated(operation: Operation, unit: Unit, name: str = "run") -> Translated:
    """The function of C that applies an operation to arrays: ``ends`` says where it ends the scan.

    Raises:
        NotNative: C cannot give what Python gives.
    """
    parameters = "abc"[: len(operation.arguments)]
    frame = Frame(unit, {}, called)
    known = Environment(dict(zip(parameters, operation.arguments, strict=True)))
    for parameter, item in known.items():
        frame.parameter(parameter, item)
    call = ast.parse(f"f({', '.join(parameters)})", mode="eval").body
    assert isinstance(call, ast.Call)
    results = called(frame, operation.function, call, known)
    kinds = tuple(c_type(item.range) for item in results)
    lines = [f"void {name}(int64_t count, int64_t *ends"]
    lines += [f", const {_column(c_type(item))} *all_{parameter}" for parameter, item in known.items()]
    lines += [f", {_column(kind)} *out_{place}" for place, kind in enumerate(kinds)]
    lines += [") {\nfor (int64_t k = 0; k < count; k++) {\nint ended_by = AUTOMAX_DONE, *const ended = &ended_by;\n"]
    lines += [f"{kind} {local};\n" for local, kind in frame.locals.items()]
    lines += [f"{parameter} = all_{parameter}[k];\n" for parameter in parameters]
    lines += [f"{kinds[0]} result = {bare(results[0].text)};\n"]
    for place, (kind, item) in enumerate(zip(kinds, results, strict=True)):
        value = "result" if place == 0 else item.text
        if kind == WIDE:
            lines += [f"out_{place}[2 * k] = (int64_t){value}; out_{place}[2 * k + 1] = (int64_t)({value} >> 64);\n"]
        else:
            lines += [f"out_{place}[k] = {value};\n"]
    lines += ["(void)ended; ends[k] = ended_by;\n}\n}\n"]
    return Translated(name, "".join(lines), kinds)


def _column(kind: str) -> str:
    return "double" if kind == "double" else "int64_t"


class Built:
    """Operations built together."""

    def __init__(self, operations: Iterable[Operation], cache: NativeCache) -> None:
        unit = Unit()
        self.translated = {
            operation: translated(operation, unit, f"run_{number}") for number, operation in enumerate(operations)
        }
        *before, _ = fixed_parts()
        text = "\n".join([*before, *unit.parts, *(item.text for item in self.translated.values())])
        self.folder = cache.folder
        self._library = ctypes.CDLL(str(library(text, cache)))

    def applied(self, operation: Operation, arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
        """The results in C for each row of arguments: a value or several, or FAULT where the scan ends."""
        made, count = self.translated[operation], len(arguments)
        ends = np.zeros(count, np.int64)
        columns = [
            np.array([row[place] for row in arguments], np.float64 if item.kind is NumberKind.REAL else np.int64)
            for place, item in enumerate(operation.arguments)
        ]
        outs = [np.zeros(2 * count, np.float64 if kind == "double" else np.int64) for kind in made.results]
        pointers = [ctypes.c_void_p(column.ctypes.data) for column in (ends, *columns, *outs)]
        self._library[made.name](ctypes.c_int64(count), *pointers)
        values = [_values(out, kind, count) for out, kind in zip(outs, made.results, strict=True)]
        rows = values[0] if len(values) == 1 else list(zip(*values, strict=True))
        return [end if end else row for row, end in zip(rows, ends.tolist(), strict=True)]


def _values(out: np.ndarray, kind: str, count: int) -> list[Any]:
    if kind == WIDE:
        low, high = out[: 2 * count : 2].tolist(), out[1 : 2 * count : 2].tolist()
        return [(top << 64) + (bottom & (2**64 - 1)) for bottom, top in zip(low, high, strict=True)]
    values = out[:count].tolist()
    return [bool(value) for value in values] if kind == "bool" else values


def in_python(operation: Operation, arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
    """The same by Python."""
    results = []
    for row in arguments:
        try:
            results.append(operation.function(*row))
        except PYTHON_RAISES:
            results.append(FAULT)
    return results


def first_difference(operation: Operation, built: Built, arguments: Sequence[tuple[Any, ...]]) -> str:
    """Where C and Python differ: in a bit, or in the type of a result; '' where they do not."""
    native, python = built.applied(operation, arguments), in_python(operation, arguments)
    if list(map(_bits, native)) == list(map(_bits, python)):
        return ""
    for row, one, other in zip(arguments, native, python, strict=True):
        if _bits(one) != _bits(other):
            return f"{operation.name}, {row!r}: C gives {one!r}, Python gives {other!r}"
    return ""


def _bits(result: Any) -> Any:
    """A result by which equal bits of equal types are equal; of what is not a number nobody asks the sign."""
    if isinstance(result, tuple):
        return tuple(map(_bits, result))
    if isinstance(result, float):
        return "nan" if math.isnan(result) else struct.pack("<d", result)
    return type(result), result


WHOLE_EDGES = sorted(
    {sign * value + step for sign in (1, -1) for step in (-1, 0, 1)
     for value in (0, 2, 7, 15, 31, 100, 2**15, 2**16, 2**31, 2**32, 2**53, 2**62, 2**63)}
)  # fmt: skip
REAL_EDGES = sorted(
    {
        sign * value
        for sign in (1.0, -1.0)
        for near in (
            5e-324, 2.7105054e-20, 5.4210107e-20, 1e-3, 0.5, 1.0, 1.5, 2.0, 2.5, 7.0, 709.0, 32767.5, 2.0**24, 2.0**31,
            2.0**53, 2.0**62, 2.0**63, 9.2233717e18, numbers.REAL_MAX, 1e30, 2.0**126, 1e300,
        )
        for value in (near, math.nextafter(near, 0.0), math.nextafter(near, math.inf))
    }
)  # fmt: skip
REAL_EDGES = [*REAL_EDGES, 0.0, -0.0, math.inf, -math.inf, math.nan]


def edges(known: Range) -> list[Any]:
    """The values of a range at which operations change their ways."""
    if known.kind is NumberKind.BOOL:
        return [False, True]
    if known.kind is NumberKind.REAL:
        return [value for value in REAL_EDGES if math.isnan(value) or known.low <= value <= known.high]
    return [value for value in WHOLE_EDGES if known.low <= value <= known.high]


def some(known: Range, draw: random.Random) -> Any:
    """A value of a range, of any size."""
    if known.kind is NumberKind.BOOL:
        return draw.random() < 0.5
    if known.kind is NumberKind.REAL:
        value = math.ldexp(draw.uniform(-1.0, 1.0), draw.choice((0, 1, 8, 31, 63, draw.randint(-80, 1024))))
        if draw.random() < 0.3 and abs(value) < 1e15:
            value = round(value * 2) / 2
        return value if known.low <= value <= known.high else draw.uniform(max(known.low, -1e9), min(known.high, 1e9))
    low, high = int(known.low), int(known.high)
    bits = draw.randint(1, max(-low, high).bit_length())
    return min(max(draw.randint(-(2**bits), 2**bits), low), high)


def rows(operation: Operation, count: int, seed: int) -> list[tuple[Any, ...]]:
    """All edges with all edges, and ``count`` rows of random values."""
    draw = random.Random(f"{operation.name} {seed}")
    grid = list(itertools.product(*map(edges, operation.arguments)))
    return [*grid, *(tuple(some(item, draw) for item in operation.arguments) for _ in range(count))]
