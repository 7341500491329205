"""The reference chain: rate limit, then lag (52.1.2)."""

from __future__ import annotations

from typing import Final

from automax_ros.drive.state import Stateful

FULL: Final = 4095
"""Counts of LIM_BAR."""
LIMIT: Final = 32767


class ReferenceChain(Stateful):
    """REFERENCE -> rate limit -> first order lag, in counts.

    Attributes:
        rate_out: output of the rate limit; fractions of a count are kept.
        lag_out: output of the lag.
    """

    _kept = ("rate_out", "lag_out")

    def __init__(self) -> None:
        """Begin at 0."""
        self.rate_out = self.lag_out = 0.0

    def begin(self) -> None:
        """Begin at 0 again."""
        self.rate_out = self.lag_out = 0.0

    def scan(self, reference: int, rate_s: float, lag_rad_s: float, interval_s: float) -> float:
        """Move on by a scan and return the lag's output.

        Args:
            reference: counts.
            rate_s: REF_RATE, seconds from 0 to LIM_BAR; 0 for no limit.
            lag_rad_s: REF_LAG, rad/s.
            interval_s: the time of a scan.
        """
        if rate_s > 0.0:
            step = min(FULL / rate_s * interval_s, float(LIMIT))
            way = reference - self.rate_out
            self.rate_out += step if way > step else -step if way < -step else way
        else:
            self.rate_out = float(reference)
        x = 0.5 * lag_rad_s * interval_s
        part = 2.0 * x / (1.0 + x)
        self.lag_out += (part if part < 1.0 else 1.0) * (self.rate_out - self.lag_out)
        return self.lag_out
