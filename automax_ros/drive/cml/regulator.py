"""The current regulator: P + I with gains that follow the conduction time (52.1.2, 52.2.1).

All that is between the published end points is a decision: the tables stand here.
"""

from __future__ import annotations

from automax_ros.drive.state import Stateful

GAIN_CONTINUOUS, GAIN_LOWEST = 1280, 512
"""FDBK_GAIN without and with nothing but zero current, in 1/1024; between them it falls in proportion to DC_TIME."""
FEEDBACK_LIMIT = 10238
"""Largest I_FDBK (52.2.1)."""
RAW_LIMIT = 8190
"""Largest raw feedback: twice LIM_BAR (decision: 8190 x 1.25 is the largest I_FDBK)."""


class Regulator(Stateful):
    """P + I from counts of error to DELTA in us.

    Attributes:
        integral_us: the integrator, us of DELTA.
        delta_us: DELTA of the last scan, us.
        fdbk_gain: FDBK_GAIN of the last scan.
        integral_gain: INTEGRAL_GAIN of the last scan: us of DELTA a count of error and scan, in 1/1024.
    """

    _kept = ("integral_us", "delta_us", "fdbk_gain", "integral_gain")

    def __init__(self) -> None:
        """Begin at DELTA 0."""
        self.integral_us = self.delta_us = 0.0
        self.fdbk_gain = self.integral_gain = 0

    def begin(self, delta_us: float) -> None:
        """Begin at a DELTA, us."""
        self.integral_us = self.delta_us = delta_us

    def feedback(self, counts: float, zero_us: int, interval_us: float) -> int:
        """Return I_FDBK, counts: the mean current of the scan, limited as the raw signal is."""
        part = min(1.0, zero_us / interval_us)
        self.fdbk_gain = gain = round(GAIN_CONTINUOUS + (GAIN_LOWEST - GAIN_CONTINUOUS) * part)
        raw = max(-RAW_LIMIT, min(RAW_LIMIT, counts * 1024 / gain))
        return round(raw * gain / 1024)

    def scan(
        self,
        error: float,
        kp: float,
        lead_rad_s: float,
        factor: float,
        interval_s: float,
        highest_us: float,
    ) -> float:
        """Move on by a scan and return DELTA, us.

        Args:
            error: counts, positive where the bridge in use must carry more.
            kp: KP, us a count.
            lead_rad_s: PI_W_LEAD, rad/s.
            factor: by how much the integral gain is raised, 1 or more.
            interval_s: the time of a scan.
            highest_us: largest DELTA, us.
        """
        self.integral_gain = min(32767, round(kp * lead_rad_s * interval_s * factor * 1024))
        self.integral_us += self.integral_gain / 1024 * error
        self.integral_us = max(0.0, min(highest_us, self.integral_us))
        self.delta_us = max(0.0, min(highest_us, self.integral_us + kp * error))
        return self.delta_us
