"""The values of the runs of a sweep: all combinations of lists, or a Latin hypercube through them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from automax_ros.core.text import count_of, quoted
from automax_ros.core.types import Value
from automax_ros.core.user_error import UserError
from automax_ros.core.values import number
from automax_ros.rack.rack import Rack
from automax_ros.sweep.quantities import Quantity, Variable, variable_named

MOST_RUNS = 100_000
"""Most runs of one sweep (decision)."""
MOST_QUANTITIES = 20
"""Most quantities that vary in one sweep (decision)."""
_FORM = "write NAME=LOW:HIGH:N, NAME=LOW:HIGH with --sample, or NAME=VALUE,VALUE"
Point = tuple[Value, ...]
"""The values of one run, one per quantity."""


@dataclass(frozen=True)
class Varied:
    """A quantity with its values; without ``values``, allowed only in a sample, it is from ``low`` to ``high``."""

    variable: Variable
    values: tuple[Value, ...] = ()
    low: Fraction = Fraction(0)
    high: Fraction = Fraction(0)

    @property
    def quantity(self) -> Quantity:
        """The quantity that varies."""
        return self.variable.quantity

    def at(self, share: float) -> Value:
        """Return the value at a share from 0 to below 1: each value of a list, or whole number, is equally likely."""
        if self.values:
            return self.values[int(share * len(self.values))]
        if self.variable.is_whole:
            return self.variable.accepted(str(math.floor(self.low + Fraction(share) * (self.high - self.low + 1))))
        return self.variable.accepted(_text(self.low + Fraction(share) * (self.high - self.low)))


def read_varied(rack: Rack, text: str) -> Varied:
    """Return the quantity and values of ``NAME=LOW:HIGH:N``, ``NAME=LOW:HIGH`` or ``NAME=VALUE,VALUE`` in a rack.

    Raises:
        UserError: it cannot be read, there is no such quantity, or a value does not fit it.
    """
    name, equals, given = text.partition("=")
    if not equals or not given.strip():
        raise UserError(f"{quoted(text)} contains no values", _FORM)
    variable = variable_named(rack, name.strip())
    if not variable.is_number or ":" not in given:
        return Varied(variable, tuple(dict.fromkeys(variable.accepted(item.strip()) for item in given.split(","))))
    parts = given.split(":")
    if len(parts) > 3:
        raise UserError(f"{quoted(text)} has too many colons", _FORM)
    low, high = (_exact(variable, part) for part in parts[:2])
    if low >= high:
        raise UserError(f"{variable.quantity.label}: {parts[0]} is not below {parts[1]}", "write the lower end first")
    if len(parts) == 2:
        return Varied(variable, (), low, high)
    return Varied(variable, _spread(variable, low, high, _count(variable, parts[2])))


def grid(varied: Sequence[Varied]) -> list[Point]:
    """Return all combinations, the last quantity's values fastest.

    Raises:
        UserError: there are too many, or a quantity has no list of values.
    """
    _check_quantities(varied)
    for item in varied:
        if not item.values:
            label = item.quantity.label
            raise UserError(
                f"{label} has two ends and no number of values", f"write {label}=LOW:HIGH:N, or add --sample N"
            )
    _check_count(math.prod(len(item.values) for item in varied))
    return list(product(*(item.values for item in varied)))


def sample(varied: Sequence[Varied], count: int, seed: int) -> list[Point]:
    """Return the points of a Latin hypercube: each quantity's range in ``count`` parts, one point in each.

    Whole numbers and values of lists are equally likely. Equal points occur once (decision), so there may be fewer than
    ``count``.

    Raises:
        UserError: too many quantities or points are wanted, or scipy is missing.
    """
    _check_quantities(varied)
    _check_count(count)
    try:
        import numpy as np
        from scipy.stats import qmc
    except ImportError as error:
        raise UserError("--sample needs scipy", "pip install 'automax_ros[sweep]'") from error
    shares = qmc.LatinHypercube(d=len(varied), rng=np.random.default_rng(seed)).random(count)
    shares = np.minimum(shares, np.nextafter(1.0, 0.0))  # scipy's lie above 0, and may be 1
    points = (tuple(item.at(share) for item, share in zip(varied, row, strict=True)) for row in shares.tolist())
    return list(dict.fromkeys(points))


def _check_quantities(varied: Sequence[Varied]) -> None:
    if len(varied) > MOST_QUANTITIES:
        raise UserError(f"{len(varied)} quantities: a sweep has at most {MOST_QUANTITIES}", "leave some as they are")


def _check_count(count: int) -> None:
    if count > MOST_RUNS:
        raise UserError(
            f"{count_of(count, 'run')}: a sweep has at most {MOST_RUNS}", "give fewer values, or --sample N"
        )


def _exact(variable: Variable, text: str) -> Fraction:
    variable.accepted(text.strip())
    return Fraction(text.strip())


def _count(variable: Variable, text: str) -> int:
    label = variable.quantity.label
    try:
        found = number(text)
    except ValueError as error:
        raise UserError(f"{label}: {error}", _FORM) from None
    if found != int(found) or not 2 <= found <= MOST_RUNS:
        raise UserError(f"{label}: {quoted(text)} values: a range has 2 to {MOST_RUNS}", _FORM)
    return int(found)


def _spread(variable: Variable, low: Fraction, high: Fraction, count: int) -> tuple[Value, ...]:
    """Return values at equal distances, both ends included; whole numbers are rounded, each once."""
    exact = (low + (high - low) * number / (count - 1) for number in range(count))
    if variable.is_whole:
        return tuple(dict.fromkeys(variable.accepted(str(math.floor(item + Fraction(1, 2)))) for item in exact))
    return tuple(dict.fromkeys(variable.accepted(_text(item)) for item in exact))


def _text(value: Fraction) -> str:
    return repr(float(value))
