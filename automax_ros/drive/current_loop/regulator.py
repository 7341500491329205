"""The reference chain, rate limit then lag, and the P + I current regulator (52.1.2, 52.2.1).

The regulator's gains follow the conduction time; only their end points are published. In continuous conduction the
integral gain is KP x PI_W_LEAD x the scan's time (decision). The proportional part allows for the share of its last
push that the mean of a scan does not show yet: an SCR is fired up to a scan after the interrupt (decision). In
discontinuous conduction the current depends on DELTA alone, with the cube of the part of the scan that conducts: the
integral gain is the one that corrects ``INTEGRAL_STEP`` of an error in a scan, at most AG_FACTOR times the continuous
one (decision). While nothing conducts, DELTA moves by steps (decision).

Where a scan computes for a time, as in modeled execution, the 57C406 fires with the previous DELTA meanwhile. The loop
knows how long that was, and allows for commands whose effect it has not measured yet: it keeps its damping (decision).
"""

from __future__ import annotations

from typing import Final

from automax_ros.drive.base.state import Stateful

FULL: Final = 4095
"""Counts of LIM_BAR."""
LIMIT: Final = 32767


GAIN_CONTINUOUS: Final = 1280
GAIN_LOWEST: Final = 512
"""FDBK_GAIN without and with nothing but zero current, in 1/1024; between them it falls in proportion to DC_TIME
(decision)."""
RAW_LIMIT: Final = 8190
"""Largest raw feedback: twice LIM_BAR (decision: 8190 x 1.25 is the largest I_FDBK, 10238)."""
STEPS: Final = 1024
"""Steps of KP, and of the gains that are shown, in 1."""
LARGEST_GAIN: Final = 32767
BOUNDARY_WAY: Final = 1 / 12
"""From the first current to continuous conduction DELTA moves by about this part of a period (decision)."""
INTEGRAL_STEP: Final = 0.55
"""Part of an error that the integral corrects in a scan, in discontinuous conduction (decision)."""
LEAST_PART: Final = 0.05
"""Conducting part of a scan below which the integral gain rises no more (decision)."""
RAISED: Final = 0.13
FALL: Final = 0.88
"""After discontinuous conduction the continuous integral gain is greater by this part of an error, which falls by this
factor each scan: the drop over the resistance comes with the current (decision)."""
RISE: Final = 0.30
"""Largest rise of DELTA in a scan of discontinuous conduction, as part of a scan: with a larger one the conducting part
would not show the effect (decision)."""
LATE_RAISED: Final = 0.05
LATE_RISE: Final = 0.15
"""RAISED and RISE where commands come after their interrupt: the conducting part shows the effect a scan later
(decision)."""
AHEAD: Final = 0.4
"""Part of the last proportional push that the mean of a scan does not show if the SCR is fired at the scan's end
(decision)."""
SLOW_PUSH: Final = 0.2
SLOW_MOVE: Final = 0.06
"""Proportional gain, and integral gain each scan, over KP where pulses are missing in each cycle (decision)."""
PENDING: Final = 0.65
"""Part of the last push that is still to come where it was too late for its pulse: the loop gain that the proposed KP
has (decision)."""
SEARCH_LEAST: Final = 0.018
SEARCH_MOST: Final = 0.040
"""Step of DELTA while nothing conducts, over the period: for the smallest reference and for LIM_BAR (decision)."""


class ReferenceChain(Stateful):
    """REFERENCE -> rate limit -> first order lag, in counts.

    Attributes:
        rate_out: output of the rate limit; fractions of a count are kept.
        lag_out: output of the lag.
    """

    _kept = ("rate_out", "lag_out")

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Start at 0 again."""
        self.rate_out = self.lag_out = 0.0

    def scan(self, reference: int, rate_s: float, lag_rad_s: float, interval_s: float) -> float:
        """Execute a scan and return the lag's output.

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


class Regulator(Stateful):
    """P + I from counts of error to DELTA in us.

    Attributes:
        integral_us: the integrator, us of DELTA.
        push_us: the proportional part, us.
        delta_us: DELTA of the last scan, us.
        before_us: DELTA of the scan before that, us.
        raised: rest of the raise of the integral gain, us per count and scan.
        fdbk_gain: FDBK_GAIN of the last scan.
        integral_gain: INTEGRAL_GAIN of the last scan: us of DELTA per count of error and scan, in 1/1024.
    """

    _kept = ("integral_us", "push_us", "delta_us", "before_us", "raised", "fdbk_gain", "integral_gain")

    def __init__(self) -> None:
        self.late = self.missed = False
        self.begin(0.0)
        self.fdbk_gain = self.integral_gain = 0

    def begin(self, delta_us: float) -> None:
        """Start at a DELTA, us."""
        self.integral_us = self.delta_us = self.before_us = delta_us
        self.push_us = self.raised = 0.0

    def feedback(self, counts: float, part: float) -> int:
        """Return I_FDBK, counts: the mean current of the scan, limited like the raw signal.

        Args:
            counts: the mean current.
            part: the part of the scan that conducted, 0 to 1.
        """
        self.fdbk_gain = gain = int(GAIN_LOWEST + (GAIN_CONTINUOUS - GAIN_LOWEST) * part + 0.5)
        limit = RAW_LIMIT * gain / STEPS
        return round(limit if counts > limit else -limit if counts < -limit else counts)

    def see_late(self, late_us: int, period_us: float) -> None:
        """Determine whether the last scan's DELTA came too late for that scan's pulse: the previous one has fired it.

        Args:
            late_us: how long after the interrupt it came.
            period_us: the line's period.
        """
        fired_us = (0.5 * period_us - self.before_us) % (period_us / 6.0)
        self.late = late_us > 0
        self.missed = self.late and fired_us <= late_us

    def search(self, error: float, kp: float, wanted: float, period_us: float) -> None:
        """Raise DELTA by a step while nothing conducts: the greater the reference (over LIM_BAR), the larger."""
        step = (SEARCH_LEAST + (SEARCH_MOST - SEARCH_LEAST) * min(1.0, wanted)) * period_us
        self.before_us = self.delta_us
        self.delta_us = min(self.delta_us + step, 0.5 * period_us)
        self.push_us = kp * error
        self.integral_us = self.delta_us - self.push_us

    def continuous(self, error: float, kp: float, gain: float, period_us: float, lowest_us: float) -> None:
        """Execute a scan after one in which current flowed all the time.

        Args:
            error: counts, positive where the bridge in use must carry more.
            kp: KP, us per count.
            gain: integral gain, us per count and scan.
            period_us: the line's period.
            lowest_us: least DELTA.
        """
        if self.raised > 0.0:
            gain += self.raised
            self.raised = self.raised * FALL if self.raised > 0.01 * gain else 0.0
        fired = (0.5 * period_us - self.delta_us) * 6.0 / period_us % 1.0
        unseen_us = AHEAD * fired * self.push_us
        if self.late and kp > 0.0:
            pending_us = fired * self.push_us
            if self.missed:  # the push before takes effect in place of the last one, which is still to come as a whole
                pending_us = self.push_us + fired * (self.before_us - self.integral_us)
            error -= PENDING * pending_us / kp
            unseen_us = 0.0
        self.push_us = kp * error - unseen_us
        self._move(gain, gain * error, lowest_us, 0.5 * period_us)

    def discontinuous(
        self, error: float, kp: float, gain: float, factor: float, thresh: int, part: float, period_us: float
    ) -> None:
        """Execute a scan after one in which no current flowed for a part of the time.

        Args:
            error: counts, positive where the bridge in use must carry more.
            kp: KP, us per count.
            gain: integral gain in continuous conduction, us per count and scan.
            factor: AG_FACTOR.
            thresh: CC_THRESH, counts; 0 leaves the integral gain as it is.
            part: the part of the scan that conducted, below 1.
            period_us: the line's period.
        """
        move = gain * error
        if thresh > 0:
            # I = thresh x part^3, and part grows by 1 on the way to the boundary.
            steepest = 3.0 / (BOUNDARY_WAY * period_us) * thresh
            x = part if part > LEAST_PART else LEAST_PART
            self.raised = min((LATE_RAISED if self.late else RAISED) / steepest, gain * (factor - 1.0))
            gain = min(max(gain, INTEGRAL_STEP / (steepest * x * x)), gain * factor)
            fed_us = self.before_us if self.missed else 0.5 * (self.delta_us + self.before_us)
            boundary = fed_us + (1.0 - part) * BOUNDARY_WAY * period_us
            move = min(gain * error, max(move, boundary - self.integral_us))
        self.push_us = kp * error
        rise = RISE if not self.late else LATE_RISE
        self._move(gain, move, 0.0, min(0.5, self.delta_us / period_us + rise / 6.0) * period_us)
        # AHEAD applies to a push in continuous conduction, PENDING to all that drives the current up.
        self.push_us = max(0.0, self.delta_us - self.integral_us) if self.late else 0.0

    def slow(self, error: float, kp: float, lowest_us: float, highest_us: float) -> None:
        """Execute a scan of a cycle in which pulses are missing, with the mean error of the cycle in counts."""
        self._move(SLOW_MOVE * kp, SLOW_MOVE * kp * error, lowest_us, highest_us)
        self.push_us = 0.0
        delta = self.integral_us + SLOW_PUSH * kp * error
        self.delta_us = lowest_us if delta < lowest_us else highest_us if delta > highest_us else delta

    def _move(self, gain: float, move_us: float, lowest_us: float, highest_us: float) -> None:
        shown = int(gain * STEPS + 0.5)
        self.integral_gain = shown if shown < LARGEST_GAIN else LARGEST_GAIN
        integral = self.integral_us + move_us
        if integral < lowest_us:  # noqa: PLR1730 - max() costs a call
            integral = lowest_us
        if integral > highest_us:  # noqa: PLR1730
            integral = highest_us
        self.integral_us = integral
        self.before_us = self.delta_us
        delta = integral + self.push_us
        if delta < lowest_us:  # noqa: PLR1730
            delta = lowest_us
        self.delta_us = delta if delta < highest_us else highest_us
