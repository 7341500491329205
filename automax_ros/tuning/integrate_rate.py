"""The result of ``automax tune-info --ki``: the KI of an INTEGRATE for a number of counts per second (42.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from automax_ros.blocks.declare.coefficients import TWO_TO_MINUS_18
from automax_ros.core.numbers import INT16_MAX, INT16_MIN, stored_real
from automax_ros.core.ticks import MAX_TICK_NS, MAX_TICKS, MIN_TICK_NS, NS_PER_S
from automax_ros.core.user_error import UserError
from automax_ros.tuning.tuning import IntegratorRange, LimitVerdict, range_of, verdict_of

RATE_FACTOR = (math.pi / 20.0) / math.tan(math.pi / 20.0)
"""KI x / y of section 42.3: 0.99176; the manual prints 0.99179."""
_DIGITS = 7
"""Digits of the constant to write: a REAL has no more."""
_SLOWEST, _FASTEST = 1e-9, 1e9
_SHORTEST_S, _LONGEST_S = MIN_TICK_NS / NS_PER_S, MAX_TICKS * MAX_TICK_NS / NS_PER_S


def rate_gain(counts_per_s: float, input_counts: float) -> float:
    """Return the KI of an INTEGRATE that gains ``counts_per_s`` at a constant INPUT, with WM not programmed (42.3).

    KI = Kx C with Kx = y T / (2 x) and C = (pi / 10 T) / tan(pi / 20): T drops out.
    """
    return RATE_FACTOR * counts_per_s / input_counts


def rate_limits(period_s: float) -> tuple[float, float]:
    """Return the limits of INTEGRATE's KI with WM not programmed (42.2): 2**-18 C and 0.9 pi / T."""
    return TWO_TO_MINUS_18 * 2.0 * RATE_FACTOR / period_s, 0.9 * math.pi / period_s


class RateFault(UserError):
    """A rate that no KI gives."""


@dataclass(frozen=True)
class Rate:
    """A rate of ``y`` counts/s at a constant INPUT of ``x`` counts, and the KI for it; ``period_s`` may be None."""

    y: float
    x: float
    ki: float
    period_s: float | None

    @classmethod
    def of(cls, y: float, x: float, period_s: float | None) -> Rate:
        """Return the rate with its KI, checked against the limits at the scan time, without one against those at any.

        Raises:
            RateFault: not numbers, Y or INPUT 0, INPUT beyond 16 bits, KI not above 0, or beyond its limits.
        """
        _require(y, x)
        ki = rate_gain(y, x)
        rate = cls(y, x, ki, period_s)
        rate._require_possible(period_s)
        return rate

    @property
    def constant(self) -> float:
        """KI as it is to be written."""
        return float(f"{self.ki:.{_DIGITS}g}")

    @property
    def text(self) -> str:
        """The REAL constant to write, without an exponent if that is readable."""
        text = f"{self.constant:.{_DIGITS}g}"
        if "e" in text:
            return text.upper().replace("E", ".0E") if "." not in text else text.upper()
        return text if "." in text else f"{text}.0"

    @property
    def range(self) -> IntegratorRange | None:
        """Section 51 at the scan time, None without one."""
        return None if self.period_s is None else range_of(self.ki * self.period_s / (2.0 * RATE_FACTOR), "KI / C")

    def report(self) -> str:
        """Return the result as text."""
        lines = [
            f"INTEGRATE, {self.y:g} counts/s at a constant INPUT of {self.x:g} counts, WM not programmed",
            f"  KI            (pi/20) / tan(pi/20) Y/X = {RATE_FACTOR:.7f} x {self.y / self.x:.7g} = {self.ki:.7g}",
            f"  write         KI={self.text}",
        ]
        found = self.range
        if self.period_s is None or found is None:
            low, high = rate_limits(1.0)
            lines.append(f"  limits        {low:.6g} / T to {high:.6g} / T (C x 2**-18 to 0.9 pi / T)")
            lines.append("  scan time     not known: give FILE, or --ticks and --tick-ms, to check limits and range")
            return "\n".join(lines) + "\n"
        low, high = rate_limits(self.period_s)
        near = {
            LimitVerdict.NEAR_LOW: "  ! within 10 % of the low limit",
            LimitVerdict.NEAR_HIGH: "  ! within 10 % of the high limit",
        }
        edge = (
            "" if found.near_edge is None else f"  ! Kx is within 10 % of {found.near_edge:g}, where the range changes"
        )
        time_s = found.counts / abs(self.y)
        end = found.counts if self.y > 0.0 else -found.counts
        lines += [
            f"  limits        {low:.6g} to {high:.6g} at T = {self.period_s * 1e3:g} ms{near.get(self._verdict(), '')}",
            f"  Kx            KI / C = Y T / (2 X) = {found.kx:.6g}, range +-{found.counts} (section 51){edge}",
            f"  a scan        {self.y * self.period_s:.6g} counts; from 0 to {end} takes {time_s:.4g} s",
        ]
        return "\n".join(lines) + "\n"

    def record(self) -> dict[str, object]:
        """Return the result for ``--json``."""
        found = self.range
        limits = None if self.period_s is None else rate_limits(self.period_s)
        return {
            "y_counts_per_s": self.y,
            "x_counts": self.x,
            "factor": RATE_FACTOR,
            "ki": self.ki,
            "constant": self.text,
            "period_s": self.period_s,
            "low": None if limits is None else limits[0],
            "high": None if limits is None else limits[1],
            "verdict": self._verdict().value,
            "kx": None if found is None else found.kx,
            "range_counts": None if found is None else found.counts,
            "near_edge": None if found is None else found.near_edge,
            "counts_per_scan": None if self.period_s is None else self.y * self.period_s,
        }

    def _verdict(self) -> LimitVerdict:
        limits = (None, None) if self.period_s is None else rate_limits(self.period_s)
        return verdict_of(stored_real(self.constant)[0], *limits)

    def _require_possible(self, period_s: float | None) -> None:
        """Refuse a KI beyond its limits; without a scan time, those of the longest and of the shortest scan."""
        when = "at any scan time"
        low, high = rate_limits(_LONGEST_S)[0], rate_limits(_SHORTEST_S)[1]
        if period_s is not None:
            when = f"at T = {period_s * 1e3:g} ms"
            low, high = rate_limits(period_s)
        verdict = verdict_of(stored_real(self.constant)[0], low, high)
        if verdict not in (LimitVerdict.ABOVE, LimitVerdict.BELOW):
            return
        side = f"above its high limit {high:.6g} (0.9 pi / T)"
        if verdict is LimitVerdict.BELOW:
            side = f"below its low limit {low:.6g} (C x 2**-18)"
        slow, fast = sorted(limit * self.x / RATE_FACTOR for limit in (low, high))
        raise RateFault(
            f"KI = {self.ki:.7g} is {side} {when}",
            f"with INPUT = {self.x:g} it can be {slow:.6g} to {fast:.6g} counts/s; take another INPUT or scan time"
            if period_s is not None
            else f"with INPUT = {self.x:g} it can be {slow:.6g} to {fast:.6g} counts/s",
        )


def _require(y: float, x: float) -> None:
    if not math.isfinite(y) or not math.isfinite(x):
        raise RateFault(f"Y = {y:g} and X = {x:g}: both must be numbers")
    if x == 0.0:
        raise RateFault("X is 0, and an integrator of 0 does not move", "X is the constant INPUT in counts")
    if not INT16_MIN <= x <= INT16_MAX or x != int(x):
        raise RateFault(f"X = {x:g} cannot be an INPUT, which is a whole number from {INT16_MIN} to {INT16_MAX}")
    if y == 0.0:
        raise RateFault("Y is 0, and OUTPUT would not move", "Y is the change of OUTPUT in counts per second")
    if not _SLOWEST <= abs(y) <= _FASTEST:
        raise RateFault(f"Y = {y:g} counts/s is {'more' if abs(y) > 1.0 else 'less'} than any scan time allows")
    if y / x <= 0.0:
        what = "OUTPUT moves in the direction of INPUT"
        raise RateFault(f"KI = {rate_gain(y, x):.7g}, but KI must be above 0: {what}", "turn the sign of INPUT")
