"""The range of a value at a place of a task: its kind, and its least and greatest value.

A REAL's bounds do not include NaN: a conversion of a REAL to an integer checks for it at run time. It matters where a
comparison narrows the range of another value: one with NaN fails whatever that value is.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from automax_ros.core.numbers import REAL_LIMIT
from automax_ros.core.types import DataType


class NumberKind(enum.Enum):
    """The Python type of a value; ``c_type`` is the type in C."""

    BOOL = "bool"
    INT = "int64_t"
    REAL = "double"

    def __init__(self, c_type: str) -> None:
        self.c_type = c_type


_BOOL, _INT, _REAL = NumberKind
"""Module names: an enumeration's member is slow to read, and a long task reads them some million times."""
INT64_MAX = 2**63 - 1
EXACT_IN_DOUBLE = 2**53
"""Every whole number up to this is a double; beyond it, C and Python compare an integer with a double differently."""
INFINITE = math.inf


@dataclass(frozen=True, slots=True)
class Range:
    """The kind of a value, and its bounds; ``kind`` is None where it differs from path to path.

    ``never_nan`` says that a REAL cannot be NaN.
    """

    kind: NumberKind | None
    low: float
    high: float
    never_nan: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether Python computes with it as an integer."""
        return self.kind is _INT or self.kind is _BOOL

    @property
    def is_number(self) -> bool:
        """Whether it cannot be NaN, which fails every comparison."""
        return self.is_whole or self.never_nan

    @property
    def is_wide(self) -> bool:
        """Whether an integer of it needs more than 64 bits."""
        return self.kind is _INT and (self.low < -INT64_MAX or self.high > INT64_MAX)

    @property
    def is_exact(self) -> bool:
        """Whether each of its values is a double."""
        return self.kind is _REAL or (self.low >= -EXACT_IN_DOUBLE and self.high <= EXACT_IN_DOUBLE)

    @property
    def only(self) -> float | None:
        """The only integer or boolean that it can be, None where there are several."""
        return self.low if self.is_whole and self.low == self.high else None

    def holds(self, other: Range) -> bool:
        """Return whether another range is within this one."""
        may_be_nan = other.never_nan or not self.never_nan
        return self.kind is other.kind and self.low <= other.low and other.high <= self.high and may_be_nan

    def joined(self, other: Range) -> Range:
        """Return the range of a value that comes from one of two paths."""
        if self == other:
            return self
        kind = self.kind if self.kind is other.kind else None
        return Range(kind, min(self.low, other.low), max(self.high, other.high), self.never_nan and other.never_nan)

    def widened(self, new: Range) -> Range:
        """Return a range that contains both, with bounds that move in few steps only, so that loops converge."""
        both = self.joined(new)
        if both == self or both.kind is None or both.kind is NumberKind.BOOL:
            return both
        steps = _REAL_STEPS if both.kind is NumberKind.REAL else _INTEGER_STEPS
        low = self.low if both.low >= self.low else -_reaching(steps, -both.low)
        high = self.high if both.high <= self.high else _reaching(steps, both.high)
        return Range(both.kind, low, high, both.never_nan)


ANY_REAL = Range(NumberKind.REAL, -INFINITE, INFINITE)
ANY_BOOL = Range(NumberKind.BOOL, 0, 1)

_INTEGER_STEPS: tuple[float, ...] = (0, 1, 32768, 2**31 - 1, 2**31, 2**33, 2**40, 2**53, 2**62, 2**100, INFINITE)
_REAL_STEPS: tuple[float, ...] = (
    0.0, 1.0, 8191.0, 16383.0, 32767.0, 32768.0, 65536.0, 2.0**31, 2.0**40, 2.0**53, REAL_LIMIT, 1e30, 1e100, INFINITE,
)  # fmt: skip


def _reaching(steps: tuple[float, ...], bound: float) -> float:
    """Return the least step, or negated step, that is not below an upper bound."""
    if bound >= 0:
        return next(step for step in steps if step >= bound)
    return -next(step for step in reversed(steps) if step <= -bound)


def exactly(value: float) -> Range:
    """Return the range of a literal."""
    kind = _BOOL if isinstance(value, bool) else _INT if isinstance(value, int) else _REAL
    return ANY_REAL if math.isnan(value) else Range(kind, value, value, kind is _REAL)


def of_type(kind: DataType) -> Range:
    """Return the range of a variable of a type; not of a string."""
    if kind is DataType.BOOLEAN:
        return ANY_BOOL
    if kind is DataType.REAL:
        return ANY_REAL
    low, high = kind.range
    return Range(NumberKind.INT, int(low), int(high))


def corners(left: Range, right: Range, operation: Callable[[float, float], float], *, real: bool) -> Range:
    """Return the range of an operation that is monotonic in each of its operands."""
    pairs = [(a, b) for a in (left.low, left.high) for b in (right.low, right.high)]
    kind = NumberKind.REAL if real else NumberKind.INT
    try:
        results = [operation(float(a), float(b)) if real else operation(a, b) for a, b in pairs]
    except (OverflowError, ZeroDivisionError):
        return Range(kind, -INFINITE, INFINITE)
    if any(math.isnan(result) for result in results):
        return Range(kind, -INFINITE, INFINITE)
    low, high = min(results), max(results)
    is_finite = real and left.is_number and right.is_number and low > -INFINITE and high < INFINITE
    return Range(kind, low, high, is_finite)


def span(ranges: Iterable[Range]) -> Range:
    """Return the range that contains several ranges."""
    found: Range | None = None
    for item in ranges:
        found = item if found is None else found.joined(item)
    assert found is not None
    return found
