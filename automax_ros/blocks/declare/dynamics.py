"""The dynamics of a block as a function of frequency (sections 36 and 41 to 51): a part of its declaration.

They describe what the step function executes, so that tuning tools can show, drive and measure a block without knowing
it. Each block has two transfer functions: Laplace, and the discrete one that runs (sections 41 to 50).
"""

from __future__ import annotations

import cmath
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.core.types import Value

Polynomial = tuple[float, ...]


Parameters = Mapping[str, float]
"""The parameters of coefficients that are in force, by keyword."""
Inputs = Mapping[str, Value]
"""The values of inputs, by keyword."""


@dataclass(frozen=True)
class Transfer:
    """A transfer function as the manual prints it, and as it runs at a scan period.

    ``numerator`` and ``denominator`` are polynomials of s, highest power first; ``b`` and ``a`` those of the discrete
    function in z**-1, from z**0 on, a[0] = 1. ``period_s`` is the time between executions in s, ``mapping`` the C of
    s = C (z - 1)/(z + 1) in 1/s, None where the block has no such mapping (PID).
    """

    numerator: Polynomial
    denominator: Polynomial
    b: Polynomial
    a: Polynomial
    period_s: float
    mapping: float | None

    @property
    def integrates(self) -> bool:
        """Whether it has a pole at s = 0: a constant signal keeps the output moving."""
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
    b, a = _substitute(numerator, order, c), _substitute(denominator, order, c)
    return tuple(value / a[0] for value in b), tuple(value / a[0] for value in a)


def _substitute(polynomial: Sequence[float], order: int, c: float) -> list[float]:
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
    total = complex(0.0)
    for factor in polynomial:
        total = total * at + factor
    return total


@dataclass(frozen=True)
class Integrator:
    """The integrator inside a block: the REAL ``state`` that holds it; ``what`` is its name in a sentence.

    ``rate`` in 1/s is Kx x C, and ``formula`` is Kx as text: section 51 limits its range in counts by Kx, and the
    block has that range as its coefficient ``span``. Without a rate only LIMIT_PLUS and LIMIT_MINUS bound it. One that
    is ``in_feedback`` follows the signal and is subtracted from it, so that beyond its range the rest stays in the
    output.
    """

    state: str
    rate: Callable[[Parameters], float] | None = None
    formula: str = ""
    what: str = "the integrator"
    in_feedback: bool = False


def input_carries(_inputs: Inputs) -> tuple[str, int]:
    """Return INPUT, not inverted, as the signal input."""
    return "INPUT", 1


def no_remarks(_inputs: Inputs) -> list[str]:
    """Return no remarks about a measurement."""
    return []


def corners_at(*names: str) -> Callable[[Parameters], Sequence[tuple[str, float]]]:
    """Return the function that gives the corners of a block whose corners are parameters in rad/s."""
    return lambda values: [(name, values[name]) for name in names]


@dataclass(frozen=True)
class Dynamics:
    """A block as a function of frequency.

    ``transfer(period_s, values)`` is its transfer function at a scan period; ``laplace`` its Laplace function with the
    numbers put in, ``equation`` what it executes in terms of its coefficients, and ``corners`` its corner frequencies
    in rad/s with their names, each from the parameters in force. The corners of a band have no ``time_constants``.
    ``exact_at`` names the parameter at whose frequency the discrete function is the Laplace function itself, empty
    where the mapping is plain bilinear; ``steps`` says how a block without a mapping is discretized.

    ``signals`` are the inputs that carry a signal through it; ``carrier(inputs)`` is the one to drive, and 1 or -1 for
    its sign. ``output`` is the output of the signal. ``stopped_by`` are inputs that block the signal while TRUE, with
    what the output does then. ``remarks(inputs)`` are remarks for the reader of a measurement. ``not_measured`` says
    why the block has no frequency response, empty where it has one.
    """

    transfer: Callable[[float, Parameters], Transfer]
    laplace: Callable[[Parameters], str]
    equation: Callable[[Parameters], str]
    corners: Callable[[Parameters], Sequence[tuple[str, float]]]
    time_constants: bool = True
    exact_at: str = "WM"
    steps: str = ""
    integrator: Integrator | None = None
    signals: tuple[str, ...] = ("INPUT",)
    carrier: Callable[[Inputs], tuple[str, int]] = input_carries
    output: str = "OUTPUT"
    stopped_by: tuple[tuple[str, str], ...] = (("RESET", "OUTPUT stays where it is"),)
    remarks: Callable[[Inputs], list[str]] = no_remarks
    not_measured: str = ""
