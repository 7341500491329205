"""Quantities of a conduction interval in closed form: zeros, integrals and extremes.

Within an interval every current and voltage is one wave of the time t since its start::

    c cos(theta + omega t) + d sin(theta + omega t) + k + a exp(-decay t) + b exp(-decay_b t)

with the line's angle theta at the start (rad) and its angular frequency omega (rad/s), the armature's decay rate and
the source's decay rate (1/s).
"""

from __future__ import annotations

from math import cos, exp, expm1, hypot, inf, sin, sqrt
from typing import Final

from automax_ros.core.machine_code import mypyc_attr

STRIDE_S: Final = 1e-8
"""A dip below zero that is shorter than this may be skipped: its depth is below 1e-8 A in any real circuit."""
NEWTON_S: Final = 1e-6
NEWTON_LEFT: Final = 1e-4
"""Closer than this (s) to a zero, two Newton steps find it: they have if the first left at most this part."""
ZERO_A: Final = 1e-7
"""A current that falls and is below this (A) has ended: two orders above rounding in circuits without resistance."""


def first_zero(
    c: float,
    d: float,
    k: float,
    a: float,
    b: float,
    theta: float,
    omega: float,
    decay: float,
    decay_b: float,
    limit: float,
    curve: float = -1.0,
) -> float:
    """Return the first instant in [0, limit] (s) at which a wave that begins at or above 0 falls below; inf if none.

    The search never steps over a zero. The second derivative cannot be below -(omega^2 hypot(c, d) + the share of
    exponentials with a negative factor), so a parabola with that curvature stays under the wave, and its zero is a
    safe step. Near the wave's zero the steps become Newton's; where the wave only grazes zero their number grows with
    the logarithm of the clearance.

    ``curve`` is omega^2 hypot(c, d) where the caller has it; below 0 it is computed.
    """
    if curve < 0.0:
        curve = omega * omega * hypot(c, d)
    t = before = 0.0
    above = 0.0
    while True:
        angle = theta + omega * t
        sine, cosine = sin(angle), cos(angle)
        value = c * cosine + d * sine + k
        slope = omega * (d * cosine - c * sine)
        bend = curve
        if a:
            part = a * exp(-decay * t)
            value += part
            part *= decay
            slope -= part
            if part < 0.0:
                bend -= decay * part
        if b:
            part = b * exp(-decay_b * t)
            value += part
            part *= decay_b
            slope -= part
            if part < 0.0:
                bend -= decay_b * part
        if value < 0.0:
            if t > 0.0:
                return _find_zero(c, d, k, a, b, theta, omega, decay, decay_b, before, above, t, value)
            if value < -ZERO_A:
                return 0.0
            value = 0.0
        if t == 0.0 and value <= ZERO_A and slope < 0.0:
            return 0.0
        before, above = t, value
        reach = slope * slope + 2.0 * bend * value
        # Of the two formulas of the parabola's zero, the one without cancellation.
        if slope >= 0.0:
            step = (slope + sqrt(reach)) / bend if bend > 0.0 else inf
        else:
            step = 2.0 * value / (sqrt(reach) - slope)
            if step < NEWTON_S and bend * value < 1e-3 * slope * slope:
                zero = t - value / slope
                if zero > limit:
                    return inf
                angle = theta + omega * zero
                value = c * cos(angle) + d * sin(angle) + k + a * exp(-decay * zero)
                if b:
                    value += b * exp(-decay_b * zero)
                if abs(value) <= NEWTON_LEFT * above:
                    return zero - value / slope
        if t >= limit:
            return inf
        t += step if step > STRIDE_S else STRIDE_S
        if t > limit:
            if step > STRIDE_S:
                return inf
            t = limit


def _find_zero(
    c: float,
    d: float,
    k: float,
    a: float,
    b: float,
    theta: float,
    omega: float,
    decay: float,
    decay_b: float,
    low: float,
    low_value: float,
    high: float,
    high_value: float,
) -> float:
    """Return the zero between an instant with a value at or above 0 and a later one below (Illinois method)."""
    side = 0
    for _ in range(100):
        width = high - low
        t = low + width * low_value / (low_value - high_value)
        if not low < t < high:
            break
        angle = theta + omega * t
        value = c * cos(angle) + d * sin(angle) + k + a * exp(-decay * t) + (b * exp(-decay_b * t) if b else 0.0)
        if value >= 0.0:
            low, low_value = t, value
            high_value, side = (high_value / 2 if side > 0 else high_value), 1
        else:
            high, high_value = t, value
            low_value, side = (low_value / 2 if side < 0 else low_value), -1
        if abs(value) < 1e-12 or high - low < 1e-17:
            return t
    return low


@mypyc_attr(acyclic=True)
class WavePiece:
    """The armature current (A) over one conduction interval; immutable."""

    # Not a tuple: compiled, it contains its numbers, where a tuple has eight objects.
    __slots__ = ("_is_squared", "_square", "a", "c", "d", "decay", "duration_s", "k", "omega", "theta")

    def __init__(
        self, duration_s: float, theta: float, omega: float, c: float, d: float, k: float, a: float, decay: float
    ) -> None:
        self.duration_s = duration_s
        self.theta = theta
        self.omega = omega
        self.c = c
        self.d = d
        self.k = k
        self.a = a
        self.decay = decay
        self._square, self._is_squared = 0.0, False

    def numbers(self) -> list[float]:
        """Return the arguments that create an equal piece."""
        return [self.duration_s, self.theta, self.omega, self.c, self.d, self.k, self.a, self.decay]

    def value(self, t: float) -> float:
        """Return the current (A) at t seconds after the start."""
        angle = self.theta + self.omega * t
        return self.c * cos(angle) + self.d * sin(angle) + self.k + self.a * exp(-self.decay * t)

    def square(self) -> float:
        """Return the integral of the current's square (A^2 s); computed on the first call."""
        if not self._is_squared:
            moments = Moments(self.theta, self.omega, self.decay, inf, self.duration_s)
            self._square, self._is_squared = moments.square((self.c, self.d, self.k, self.a, 0.0)), True
        return self._square

    def extremes(self) -> tuple[float, float]:
        """Return the least and the greatest current (A) of the interval."""
        values = [self.value(0.0), self.value(self.duration_s)]
        slope = (self.omega * self.d, -self.omega * self.c, 0.0, -self.decay * self.a, 0.0)
        for first_sign in (1.0, -1.0):
            start, sign = 0.0, first_sign
            while start < self.duration_s:
                t = start + self._slope_zero(sign, slope, start)
                if t >= self.duration_s:
                    break
                values.append(self.value(t))
                start, sign = t + 1e-7, -sign
        return min(values), max(values)

    def _slope_zero(self, sign: float, slope: tuple[float, ...], start: float) -> float:
        """Return the time after ``start`` at which the slope, times sign, falls below zero."""
        c, d, k, a, _ = (sign * factor for factor in slope)
        angle = self.theta + self.omega * start
        a *= exp(-self.decay * start)
        return first_zero(c, d, k, a, 0.0, angle, self.omega, self.decay, 1.0, self.duration_s - start)


def bound(piece: WavePiece) -> float:
    """Return an upper bound of the magnitude of a piece's current (A), from its ends and its curvature between them."""
    duration, theta, omega = piece.duration_s, piece.theta, piece.omega
    c, d, k, a, decay = piece.c, piece.d, piece.k, piece.a, piece.decay
    end = theta + omega * duration
    first = abs(c * cos(theta) + d * sin(theta) + k + a)
    last = abs(c * cos(end) + d * sin(end) + k + a * exp(-decay * duration))
    bend = omega * omega * hypot(c, d) + decay * decay * abs(a)
    return (first if first > last else last) + 0.125 * bend * duration * duration


Wave = tuple[float, float, float, float, float]
"""The factors c, d, k, a, b of a wave."""


class Moments:
    """The integrals over one interval of all products of the five functions of which a wave consists."""

    def __init__(self, theta: float, omega: float, decay: float, decay_b: float, duration: float) -> None:
        """Compute the integrals; a decay_b of inf means that its part has vanished."""
        end = theta + omega * duration
        s0, c0, s1, c1 = sin(theta), cos(theta), sin(end), cos(end)
        half_swing = (s1 * c1 - s0 * c0) / (2 * omega)
        cross = (s1 * s1 - s0 * s0) / (2 * omega)
        self.cosine = (s1 - s0) / omega
        self.sine = (c0 - c1) / omega
        self.duration = duration
        self._cc, self._ss, self._cs = duration / 2 + half_swing, duration / 2 - half_swing, cross
        self.a, self._aa, self._ca, self._sa = _decaying(decay, omega, duration, s0, c0, s1, c1)
        self.b, self._bb, self._cb, self._sb = _decaying(decay_b, omega, duration, s0, c0, s1, c1)
        both = decay + decay_b
        self._ab = 0.0 if both == inf else -expm1(-both * duration) / both

    def single(self, wave: Wave) -> float:
        """Return the integral of a wave."""
        c, d, k, a, b = wave
        return c * self.cosine + d * self.sine + k * self.duration + a * self.a + b * self.b

    def square(self, wave: Wave) -> float:
        """Return the integral of a wave's square."""
        c, d, k, a, b = wave
        return (
            c * (c * self._cc + 2 * (d * self._cs + k * self.cosine + a * self._ca + b * self._cb))
            + d * (d * self._ss + 2 * (k * self.sine + a * self._sa + b * self._sb))
            + k * (k * self.duration + 2 * (a * self.a + b * self.b))
            + a * (a * self._aa + 2 * b * self._ab)
            + b * b * self._bb
        )

    def with_voltage(self, wave: Wave, by_c: float, by_d: float) -> float:
        """Return the integral of a wave times a sinusoidal voltage, whose factors c and d are given."""
        c, d, k, a, b = wave
        return by_c * (c * self._cc + d * self._cs + k * self.cosine + a * self._ca + b * self._cb) + by_d * (
            c * self._cs + d * self._ss + k * self.sine + a * self._sa + b * self._sb
        )


def _decaying(
    decay: float, omega: float, duration: float, s0: float, c0: float, s1: float, c1: float
) -> tuple[float, float, float, float]:
    """Return the integrals of e = exp(-decay t), e^2, e cos and e sin."""
    if decay == inf:
        return 0.0, 0.0, 0.0, 0.0
    end = exp(-decay * duration)
    single = -expm1(-decay * duration) / decay
    square = single * (1 + end) / 2
    norm = decay * decay + omega * omega
    cosine = (end * (omega * s1 - decay * c1) - (omega * s0 - decay * c0)) / norm
    sine = (decay * s0 + omega * c0 - end * (decay * s1 + omega * c1)) / norm
    return single, square, cosine, sine
