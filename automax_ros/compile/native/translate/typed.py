"""Pieces of C with the range of their value: literals, conversions, names."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.translate.ranges import INT64_MAX, NumberKind, Range, exactly

WIDE = "__int128"
INT128_MAX = 2**127 - 1
_PARENTHESES = re.compile("[()]")


@dataclass(frozen=True, slots=True)
class CExpression:
    """A C expression without effects, usable as any operand, and the range of its value.

    A ``mixed`` one is in Python an integer or a REAL, depending on the values; as a REAL it is the same number.
    """

    text: str
    range: Range
    mixed: bool = False

    @property
    def whole(self) -> CExpression:
        """The same as an integer operand: a boolean counts as 0 and 1."""
        if self.range.kind is NumberKind.INT:
            return self
        return replace(self, text=f"(int64_t){self.text}", range=replace(self.range, kind=NumberKind.INT))

    @property
    def signed(self) -> str:
        """The text of an integer in 64 bits or more: in C a literal, or a boolean, has 32."""
        is_literal = self.text.strip("(-)").isdigit()
        return f"(int64_t){self.text}" if is_literal or self.range.kind is NumberKind.BOOL else self.text


def literal(value: object) -> CExpression:
    """Return a Python literal.

    Raises:
        NotNative: it is not a number or boolean.
    """
    if isinstance(value, bool):
        return CExpression("true" if value else "false", exactly(value))
    if isinstance(value, int):
        return CExpression(whole_text(value), exactly(value))
    if isinstance(value, float):
        return CExpression(real_text(value), exactly(value))
    raise NotNative("a string" if isinstance(value, str) else f"a value {value!r}")


def whole_text(value: int) -> str:
    """Return an integer as C text."""
    if abs(value) > INT64_MAX:
        raise NotNative("an integer beyond 64 bits")
    text = f"{abs(value)}" if abs(value) < 2**31 else f"{abs(value)}LL"
    return f"(-{text})" if value < 0 else text


def real_text(value: float) -> str:
    """Return a double as C text: the shortest decimals that give its bits."""
    if math.isnan(value):
        return "NAN"
    text = "INFINITY" if math.isinf(value) else repr(abs(value))
    return f"(-{text})" if math.copysign(1.0, value) < 0 else text


def c_type(known: Range) -> str:
    """Return the type in C for a range.

    Raises:
        NotNative: there is none, or the kind differs from path to path.
    """
    if known.kind is None:
        raise NotNative("a value that is an integer on one path and a REAL on another")
    if not known.is_wide:
        return known.kind.c_type
    if known.low < -INT128_MAX or known.high > INT128_MAX:
        raise NotNative("an integer that cannot be shown to fit 128 bits")
    return WIDE


def as_real(value: CExpression) -> CExpression:
    """Return a value as an operand of Python's arithmetic with a REAL."""
    if value.range.kind is NumberKind.REAL:
        return value
    low, high = float(value.range.low), float(value.range.high)
    return CExpression(f"(double){value.text}", Range(NumberKind.REAL, low, high, never_nan=True))


def widened(value: CExpression) -> str:
    """Return an integer's text in 128 bits."""
    return value.text if value.range.is_wide else f"({WIDE}){value.text}"


def bare(text: str) -> str:
    """Return an expression without the parentheses around all of it."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    if text.find(")") == len(text) - 1:
        return text[1:-1]
    depth = 0
    for found in _PARENTHESES.finditer(text):
        depth += 1 if found[0] == "(" else -1
        if depth == 0:
            return text[1:-1] if found.end() == len(text) else text
    return text
