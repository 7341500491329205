"""The frequency response of a dynamic block as it runs, measured with sines of whole counts."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, repeat

from automax_ros.blocks.declare.declaration import Block
from automax_ros.blocks.declare.dynamics import Integrator, Transfer
from automax_ros.core.types import Value
from automax_ros.tuning.driven import DrivenBlock

NORMAL_AMPLITUDE = 4095
"""Amplitude of the sine in counts unless the block's limits require less: 1 PN."""
UNRELIABLE_DB = 0.5
"""A point is marked unreliable if the rounding of OUTPUT makes its gain this uncertain, dB (decision)."""
MOST_SCANS = 3_000_000
"""Most scans for one frequency, transient and window together; a slower one is not measured."""
MOST_SCANS_IN_ALL = 8_000_000
_WINDOW = 1000
"""Fewest scans in the window: enough different phases that the roundings average out."""
_SHARE = 0.9
"""Share of the distance to a limit that a chosen amplitude uses."""
_LEFT = 1e-6
"""Share of a transient that may remain when the window starts."""


@dataclass(frozen=True)
class MeasuredResponse:
    """The gain at one frequency: ``amplitude`` of the sine in counts, ``gain`` from it to OUTPUT.

    ``uncertainty`` is the greatest error that the rounding of OUTPUT can make, as a gain. ``touched`` lists the limits
    that the block reached: then the point is not that of the linear function.
    """

    rad_s: float
    amplitude: int
    gain: complex
    uncertainty: float
    touched: tuple[str, ...]

    @property
    def uncertainty_db(self) -> float:
        """The uncertainty upwards in dB, infinite for a gain of 0."""
        return 20.0 * math.log10(1.0 + self.uncertainty / abs(self.gain)) if self.gain else math.inf

    @property
    def uncertainty_deg(self) -> float:
        """The uncertainty of the phase in degrees, 180 if it is not known at all."""
        share = self.uncertainty / abs(self.gain) if self.gain else 1.0
        return math.degrees(math.asin(share)) if share < 1.0 else 180.0

    @property
    def reliable(self) -> bool:
        """Whether the point can be compared with the design: enough counts, and no limit reached."""
        return self.uncertainty_db < UNRELIABLE_DB and not self.touched


class Sweep:
    """Measures a block at one frequency after the other, from high to low, while its scans last."""

    def __init__(
        self, block: Block, period_ns: int, parameters: Mapping[str, Value], transfer: Transfer, amplitude: int | None
    ) -> None:
        """Create from the block, its parameters by keyword, and an amplitude in counts, None to choose it by frequency.

        ``transfer`` is the block's own, for the length of transients and for amplitudes.
        """
        self._driven = DrivenBlock(block, period_ns, parameters)
        self._transfer = transfer
        self._amplitude = amplitude
        self._settling = settling_scans(transfer)

    def measure(self, frequencies: Iterable[float]) -> list[MeasuredResponse | None]:
        """Return the gain at each frequency in rad/s, above 0 and below Nyquist, in the order given.

        None means that it would take too many scans. The frequency measured at is the nearest with whole periods in the
        window, at most 1/1000 away.
        """
        wanted = list(frequencies)
        found: dict[int, MeasuredResponse | None] = {}
        left = MOST_SCANS_IN_ALL
        for place in sorted(range(len(wanted)), key=lambda number: -wanted[number]):
            turns, window = whole_periods(wanted[place], self._transfer.period_s)
            scans = self._settling + window
            if scans > min(MOST_SCANS, left):
                found[place] = None
                continue
            left -= scans
            found[place] = self._at(turns, window)
        return [found[place] for place in range(len(wanted))]

    def _at(self, turns: int, window: int) -> MeasuredResponse:
        rad_s = 2.0 * math.pi * turns / (window * self._transfer.period_s)
        amplitude = self._amplitude or self._fitting_amplitude(rad_s)
        wave = whole_counts(amplitude, turns, window, window // 4 + turns * self._settling)
        driven = self._driven
        driven.begin()
        before = driven.run(_before(wave, self._settling))[-1]
        driven.forget()
        outputs = driven.run(wave)
        drift = (outputs[-1] - before) / window
        given, came = _components(wave, [value - drift * n for n, value in enumerate(outputs)], turns)
        return MeasuredResponse(
            rad_s=rad_s,
            amplitude=amplitude,
            gain=came / given,
            uncertainty=rounding_error(2.0 * abs(came) / window, window) / (2.0 * abs(given) / window),
            touched=driven.touched,
        )

    def _fitting_amplitude(self, rad_s: float) -> int:
        most = float(NORMAL_AMPLITUDE)
        gain = abs(self._transfer.discrete_response(rad_s))
        if gain > 0.0:
            most = min(most, _SHARE * self._driven.room / (gain + start_offset(self._transfer)))
            change = 2.0 * math.sin(rad_s * self._transfer.period_s / 2.0)
            most = min(most, _SHARE * self._driven.most_change / (gain * change))
        integrator, inner = self._driven.integrator, self._driven.inner_room
        if integrator is not None and inner is not None:
            inner_gain = integrator_gain(integrator, self._transfer, rad_s)
            most = min(most, _SHARE * inner / inner_gain) if inner_gain > 0.0 else most
        return max(1, int(most))


def _before(wave: list[int], scans: int) -> Iterator[int]:
    """Return the scans before a window, in which the sine is continued backwards."""
    whole, rest = divmod(scans, len(wave))
    return chain(wave[len(wave) - rest :], chain.from_iterable(repeat(wave, whole)))


def integrator_gain(integrator: Integrator, transfer: Transfer, rad_s: float) -> float:
    """Return the greatest gain to the integrator inside a block, for a cosine that starts at rest."""
    response = transfer.discrete_response(rad_s)
    if integrator.in_feedback:
        return abs(1.0 - response)
    if not transfer.integrates:
        return abs(response)
    kx = integral_gain(transfer)
    return kx / math.tan(rad_s * transfer.period_s / 2.0) + start_offset(transfer)


def start_offset(transfer: Transfer) -> float:
    """Return how far a start from rest shifts a sine, as a gain: an integrator's first trapezoid lacks a half."""
    return integral_gain(transfer) if transfer.integrates else 0.0


def integral_gain(transfer: Transfer) -> float:
    """Return the gain of INPUT + INPUT(n-1) in the integrator of a function that integrates."""
    rate = transfer.numerator[-1]
    return rate / transfer.mapping if transfer.mapping is not None else rate * transfer.period_s / 2.0


def rounding_error(amplitude: float, scans: int) -> float:
    """Return the greatest error in counts of the fundamental of a sine rounded to whole counts, over this many scans.

    The roundings of a sine of ``a`` counts have the fundamental sum over k of 2 J1(2 pi k a) / (pi k), at most 0.53 /
    sqrt(a); a finite number of scans adds 1.22 / sqrt(scans), three standard deviations. That of any error within half
    a count is at most 2 / pi.
    """
    most = 2.0 / math.pi
    return min(most, 0.53 / math.sqrt(amplitude) + 1.22 / math.sqrt(scans)) if amplitude > 0.0 else most


def whole_periods(rad_s: float, period_s: float) -> tuple[int, int]:
    """Return periods and scans of a window in which a sine ends where it started, without an earlier repetition."""
    turns_a_scan = rad_s * period_s / (2.0 * math.pi)
    turns = _prime_from(math.ceil(turns_a_scan * _WINDOW))
    window = max(round(turns / turns_a_scan), 2 * turns + 1)
    return turns, window if turns == 1 or window % turns else window + 1


def _prime_from(number: int) -> int:
    """Return the first prime that is not below a number of at most a few hundred; 1 for 1."""
    while any(number % factor == 0 for factor in range(2, math.isqrt(number) + 1)):
        number += 1
    return max(1, number)


def whole_counts(amplitude: int, turns: int, window: int, first: int) -> list[int]:
    """Return a window of a sine in whole counts, whose sum is exactly 0, so that no integrator drifts away.

    ``first`` is the phase at its start, as a part of ``window``.
    """
    half = [round(amplitude * math.sin(2.0 * math.pi * place / window)) for place in range((window + 1) // 2)]
    middle = [0] if window % 2 == 0 else []
    table = [*half, *middle, *(-value for value in half[:0:-1])]
    return [table[(first + turns * n) % window] for n in range(window)]


def settling_scans(transfer: Transfer) -> int:
    """Return the scans until a transient has died out; an integrator keeps its offset, which no sine contains."""
    c = transfer.mapping
    poles = [root for root in roots(transfer.denominator) if root] if c is not None else []
    slowest = max((abs((c + pole) / (c - pole)) for pole in poles if c is not None), default=0.0)
    return 4 + (math.ceil(math.log(_LEFT) / math.log(slowest)) if 0.0 < slowest < 1.0 else 0)


def roots(polynomial: Sequence[float]) -> list[complex]:
    """Return the zeros of a polynomial of degree 0 to 4, highest power first (Durand and Kerner); 0 is exact."""
    factors = list(polynomial)
    while factors and factors[0] == 0.0:
        del factors[0]
    zeros = _zeros_at_0(factors)
    monic = [factor / factors[0] for factor in factors[: len(factors) - zeros]]
    degree = max(0, len(monic) - 1)
    size = max((abs(factor) ** (1.0 / power) for power, factor in enumerate(monic) if power), default=0.0)
    found = [size * cmath.exp(complex(0.0, 2.0 * math.pi * (number + 0.3) / degree)) for number in range(degree)]
    for _ in range(200):
        for number, at in enumerate(found):
            value = complex(0.0)
            for factor in monic:
                value = value * at + factor
            for other, place in enumerate(found):
                if other != number:
                    value /= at - place or size * 1e-12
            found[number] = at - value
    return found + [complex(0.0)] * zeros


def logarithmic(low: float, high: float, points: int) -> list[float]:
    """Return frequencies from ``low`` to ``high``, equally far apart on a logarithmic scale."""
    if points == 1:
        return [low]
    step = math.log(high / low) / (points - 1)
    return [low * math.exp(step * number) for number in range(points - 1)] + [high]


def decibels(gain: complex) -> float | None:
    """Return a gain in dB, None for 0."""
    return 20.0 * math.log10(abs(gain)) if gain else None


def phases(gains: Sequence[complex], start_deg: float | None) -> list[float]:
    """Return phases in degrees of gains in the order of frequency, without jumps, starting near ``start_deg``.

    None leaves each between -180 and 180, as for a notch, whose phase jumps.
    """
    found: list[float] = []
    last = start_deg
    for gain in gains:
        angle = math.degrees(cmath.phase(gain))
        found.append(angle if last is None else nearest_phase(angle, last))
        last = None if last is None else found[-1]
    return found


def nearest_phase(angle: float, to: float) -> float:
    """Return an angle in degrees plus whole turns, as near as possible to another."""
    return angle - 360.0 * round((angle - to) / 360.0)


def first_phase(transfer: Transfer) -> float | None:
    """Return the phase in degrees at frequency 0, where ``phases`` starts: 90 for each zero at s = 0 less each pole."""
    if any(abs(root.real) < 1e-6 * abs(root) for root in roots(transfer.numerator) if abs(root) > 0.0):
        return None
    return 90.0 * (_zeros_at_0(transfer.numerator) - _zeros_at_0(transfer.denominator))


def _zeros_at_0(polynomial: Sequence[float]) -> int:
    return next((count for count, factor in enumerate(reversed(polynomial)) if factor), 0)


def _components(given: Sequence[float], came: Sequence[float], turns: int) -> tuple[complex, complex]:
    """Return the sums of two signals over their window times exp(-j w n); a mean does not contribute."""
    window = len(given)
    table = [2.0 * math.pi * place / window for place in range(window)]
    real = imaginary = real_out = imaginary_out = 0.0
    for n, (value, output) in enumerate(zip(given, came, strict=True)):
        angle = table[turns * n % window]
        cosine, sine = math.cos(angle), math.sin(angle)
        real += value * cosine
        imaginary -= value * sine
        real_out += output * cosine
        imaginary_out -= output * sine
    return complex(real, imaginary), complex(real_out, imaginary_out)
