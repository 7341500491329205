"""Transfer functions of the dynamic blocks: Laplace, and the discrete one that runs (sections 41 to 50)."""

from __future__ import annotations

import cmath
import functools
from collections.abc import Sequence
from dataclasses import dataclass

Polynomial = tuple[float, ...]


@dataclass(frozen=True)
class Transfer:
    """A transfer function: as the manual prints it, and as it runs at a scan period.

    ``numerator`` and ``denominator`` are polynomials of s, highest power first; ``b`` and ``a`` those of the discrete
    function in z**-1, from z**0 on, a[0] = 1. ``period_s`` is the time between executions in s, ``mapping`` the C of
    s = C (z - 1)/(z + 1) in 1/s, None where the block is not made that way (PID).
    """

    numerator: Polynomial
    denominator: Polynomial
    b: Polynomial
    a: Polynomial
    period_s: float
    mapping: float | None

    @property
    def integrates(self) -> bool:
        """Whether it has a pole at s = 0: a constant signal goes on moving the output."""
        return self.denominator[-1] == 0.0

    def laplace_response(self, rad_s: float) -> complex:
        """Return the Laplace function's value at an angular frequency; not at a pole."""
        s = complex(0.0, rad_s)
        return _value(self.numerator, s) / _value(self.denominator, s)

    def discrete_response(self, rad_s: float) -> complex:
        """Return the discrete function's value at an angular frequency; not at a pole."""
        z_inverse = cmath.exp(complex(0.0, -rad_s * self.period_s))
        return _value(self.b[::-1], z_inverse) / _value(self.a[::-1], z_inverse)


def mapped(numerator: Sequence[float], denominator: Sequence[float], c: float, period_s: float) -> Transfer:
    """Return a Laplace function under s = C (z - 1)/(z + 1); polynomials of s, highest power first, c in 1/s."""
    b, a = bilinear(numerator, denominator, c)
    return Transfer(tuple(numerator), tuple(denominator), b, a, period_s, c)


def bilinear(numerator: Sequence[float], denominator: Sequence[float], c: float) -> tuple[Polynomial, Polynomial]:
    """Return b and a of z**-1, a[0] = 1, of a Laplace function under s = C (z - 1)/(z + 1).

    The numerator's degree is at most the denominator's.
    """
    order = len(denominator) - 1
    b, a = _substituted(numerator, order, c), _substituted(denominator, order, c)
    return tuple(value / a[0] for value in b), tuple(value / a[0] for value in a)


def _substituted(polynomial: Sequence[float], order: int, c: float) -> list[float]:
    """Return the polynomial of z**-1 of p(s) (1 + z**-1)**order for s = c (1 - z**-1)/(1 + z**-1)."""
    total = [0.0] * (order + 1)
    for power, factor in enumerate(reversed(polynomial)):
        for place, count in enumerate(_product(power, order - power)):
            total[place] += factor * c**power * count
    return total


@functools.cache
def _product(minus: int, plus: int) -> tuple[int, ...]:
    """Return the coefficients of (1 - x)**minus (1 + x)**plus, from x**0 on."""
    coefficients = [1]
    for sign in (-1,) * minus + (1,) * plus:
        shifted = [0, *coefficients]
        coefficients = [low + sign * high for low, high in zip([*coefficients, 0], shifted, strict=True)]
    return tuple(coefficients)


def _value(polynomial: Sequence[float], at: complex) -> complex:
    """Return the value of a polynomial, highest power first."""
    total = complex(0.0)
    for factor in polynomial:
        total = total * at + factor
    return total
