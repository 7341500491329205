"""The step response of a dynamic block: as it runs, its discrete design without rounding, and the Laplace function."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.blocks.declare.declaration import Block
from automax_ros.blocks.declare.dynamics import Polynomial, Transfer
from automax_ros.core.types import Value
from automax_ros.tuning.driven import DrivenBlock
from automax_ros.tuning.frequency import NORMAL_AMPLITUDE, integral_gain, roots

MOST_SCANS = 500_000
"""Longest step response, in executions of the block."""
SETTLED = 0.02
"""Share of its way by which a settled response may deviate from its final value; at least one count."""
_TIME_CONSTANTS = 8.0
_FEWEST_SCANS = 20
_SHARE = 0.9

Matrix = list[list[float]]


@dataclass(frozen=True)
class StepResponse:
    """The outputs from scan 0, in which the step comes, on: one value per ``period_s``, in counts.

    ``rest`` is OUTPUT before the step, ``final`` the end value of the discrete function, None if it has none (an
    integrator). ``touched`` lists the limits that the block reached, none if OUTPUT is the design's within a count:
    settling at a limit does not count.
    """

    counts: int
    period_s: float
    output: tuple[int, ...]
    design: tuple[float, ...]
    rest: int
    final: float | None
    touched: tuple[str, ...]

    @property
    def overshoot(self) -> float | None:
        """How far OUTPUT exceeds its final value, as a share of its way there; None if it ends where it started."""
        if self.final is None or abs(self.final - self.rest) < 0.5:
            return None
        return max(0.0, max((value - self.rest) / (self.final - self.rest) for value in self.output) - 1.0)

    @property
    def band(self) -> float:
        """The deviation in counts up to which the response counts as settled: a share of its way, or of its peak."""
        way = 0.0 if self.final is None else abs(self.final - self.rest)
        return max(1.0, SETTLED * (way if way >= 0.5 else max(abs(value - self.rest) for value in self.design)))

    @property
    def settling_s(self) -> float | None:
        """The time from which OUTPUT stays within the band, in s; None if it does not, or has no final value."""
        if self.final is None:
            return None
        band = self.band
        last = max((n for n, value in enumerate(self.output) if abs(value - self.final) > band), default=-1)
        return None if last == len(self.output) - 1 else (last + 1) * self.period_s

    @property
    def rate(self) -> float:
        """The change of OUTPUT over the second half of the response, in counts/s."""
        middle = len(self.output) // 2
        time_s = (len(self.output) - 1 - middle) * self.period_s
        return (self.output[-1] - self.output[middle]) / time_s if time_s else 0.0


def respond(
    block: Block,
    period_ns: int,
    parameters: Mapping[str, Value],
    transfer: Transfer,
    counts: int | None,
    scans: int,
) -> StepResponse:
    """Run a block from rest on a step of ``counts``, None for one that keeps it off its limits."""
    driven = DrivenBlock(block, period_ns, parameters)
    unit = filtered(transfer.b, transfer.a, [1.0] * scans)
    if counts is None:
        counts = _fitting_step(transfer, driven, unit)
    driven.begin()
    outputs = driven.run([counts] * scans)
    gain = _gain_at_0(transfer)
    design = tuple(driven.rest + counts * value for value in unit)
    as_designed = all(abs(value - wanted) <= 1.0 for value, wanted in zip(outputs, design, strict=True))
    return StepResponse(
        counts=counts,
        period_s=transfer.period_s,
        output=tuple(outputs),
        design=design,
        rest=driven.rest,
        final=None if gain is None else driven.rest + counts * gain,
        touched=() if as_designed else driven.touched,
    )


def default_scans(transfer: Transfer) -> int:
    """Return how many executions show the whole response: 8 of the slowest time constants, at least 20 executions."""
    return max(_FEWEST_SCANS, min(MOST_SCANS, math.ceil(_duration_s(transfer) / transfer.period_s))) + 1


def filtered(b: Sequence[float], a: Sequence[float], signal: Iterable[float]) -> list[float]:
    """Return a signal filtered from rest by b(z**-1) / a(z**-1), a[0] = 1, without any rounding to counts."""
    given, made = [0.0] * len(b), [0.0] * (len(a) - 1)
    found = []
    for value in signal:
        given = [value, *given[:-1]]
        output = sum(factor * past for factor, past in zip(b, given, strict=True))
        output -= sum(factor * past for factor, past in zip(a[1:], made, strict=True))
        made = [output, *made[:-1]]
        found.append(output)
    return found


def laplace_step(transfer: Transfer, times_s: Iterable[float]) -> list[float]:
    """Return the response of the Laplace function to a step of 1 at times above 0, in s, without impulses at 0.

    The state equation in companion form, solved by the exponential of its matrix.
    """
    direct, rest, monic = _proper(transfer.numerator, transfer.denominator)
    order = len(monic) - 1
    # Frequencies are relative to the function's own scale, so that no element is far larger than the others.
    scale = max((abs(root) for root in roots(monic)), default=0.0) or 1.0
    companion: Matrix = [[0.0] * (order + 1) for _ in range(order + 1)]
    for row in range(order - 1):
        companion[row][row + 1] = 1.0
    if order:
        companion[order - 1][:order] = [-monic[order - place] / scale ** (order - place) for place in range(order)]
        companion[order - 1][order] = 1.0
    weights = [rest[order - 1 - place] / scale ** (order - place) for place in range(order)]
    found = []
    for time_s in times_s:
        moved = _exponential([[value * scale * time_s for value in row] for row in companion])
        found.append(direct + sum(weight * moved[place][order] for place, weight in enumerate(weights)))
    return found


def _proper(numerator: Polynomial, denominator: Polynomial) -> tuple[float, Polynomial, Polynomial]:
    """Return direct gain, remainder (as many factors as the order) and monic denominator; powers above are impulses."""
    monic = tuple(factor / denominator[0] for factor in denominator)
    order = len(monic) - 1
    left = [0.0] * max(0, order + 1 - len(numerator)) + [factor / denominator[0] for factor in numerator]
    direct = 0.0
    while len(left) > order:
        direct = left.pop(0)
        for place in range(order):
            left[place] -= direct * monic[place + 1]
    return direct, tuple(left), monic


def _exponential(matrix: Matrix) -> Matrix:
    """Return the exponential of a small matrix: Taylor's series of a part of it, squared."""
    norm = max(sum(abs(value) for value in row) for row in matrix)
    halvings = max(0, math.ceil(math.log2(norm)) + 2) if norm > 0.0 else 0
    size = len(matrix)
    part = [[value / 2.0**halvings for value in row] for row in matrix]
    unit = [[1.0 if row == column else 0.0 for column in range(size)] for row in range(size)]
    total, term = [list(row) for row in unit], unit
    for number in range(1, 17):
        term = [[value / number for value in row] for row in _product(term, part)]
        total = [[one + two for one, two in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
    for _ in range(halvings):
        total = _product(total, total)
    return total


def _product(one: Matrix, two: Matrix) -> Matrix:
    columns = list(zip(*two, strict=True))
    return [[sum(a * b for a, b in zip(row, column, strict=True)) for column in columns] for row in one]


def _gain_at_0(transfer: Transfer) -> float | None:
    """Return the gain for a constant input, None for an integrator."""
    if transfer.denominator[-1] == 0.0:
        return None if transfer.numerator[-1] != 0.0 else transfer.numerator[-2]
    return transfer.numerator[-1] / transfer.denominator[-1]


def _duration_s(transfer: Transfer) -> float:
    """Return the time in s that shows a response: by the slowest pole, or by the rate of an integrator."""
    poles = [abs(root.real) for root in roots(transfer.denominator) if root]
    if poles:
        return _TIME_CONSTANTS / min(poles)
    rate = transfer.numerator[-1]
    proportional = transfer.numerator[-2] if len(transfer.numerator) > 1 else 0.0
    return 4.0 * (proportional or 1.0) / rate if rate > 0.0 else 0.0


def _fitting_step(transfer: Transfer, driven: DrivenBlock, unit: Sequence[float]) -> int:
    """Return the largest round step, at most 1 PN, with which neither output nor integrator reaches a limit."""
    most = float(NORMAL_AMPLITUDE)
    peak = max(abs(value) for value in unit)
    if peak > 0.0:
        most = min(most, _SHARE * driven.room / peak)
        jump = max(abs(after - before) for before, after in zip([0.0, *unit], unit, strict=False))
        most = min(most, _SHARE * driven.most_change / jump)
    inner = driven.inner_room
    if inner is not None:
        reach = 1.0
        if transfer.integrates:
            reach = integral_gain(transfer) * 2.0 * len(unit)
        most = min(most, _SHARE * inner / reach) if reach > 0.0 else most
    return NORMAL_AMPLITUDE if most >= NORMAL_AMPLITUDE else _round_below(max(1.0, most))


def _round_below(value: float) -> int:
    """Return the largest of 1, 2, 5, 10, 20 ... that is not above a value of 1 or more."""
    power: int = 10 ** int(math.log10(value))
    return max(factor * power for factor in (1, 2, 5) if factor * power <= value)
