"""Integer time: every instant and period outside of ``ros/`` is a whole number of nanoseconds."""

from __future__ import annotations

from fractions import Fraction
from typing import Final

from automax_ros.core.text import quoted
from automax_ros.core.values import is_number

NS_PER_US = 1_000
NS_PER_MS = 1_000_000
NS_PER_S: Final = 1_000_000_000

TICK_STEP_NS = NS_PER_MS // 2
MIN_TICK_NS = NS_PER_MS // 2
MAX_TICK_NS = 10 * NS_PER_MS
DEFAULT_TICK_NS = 5_500_000
"""Tick of a Processor unless the rack file sets another (section 4)."""
MOST_SECONDS = 1_000_000_000
"""Longest time in a file (decision: 31 years, far from the 63 bits of a count of ns)."""
UDC_TICK_NS = NS_PER_MS // 2
"""Tick of a UDC module (2.3)."""
CLOCK_PERIOD_NS = UDC_TICK_NS
"""One interval of the common clock of a backplane: 500 us (S-3056 p. 4-4; J2-3106-1 p. 2-5 prints ms)."""
UDC_MAX_TICKS = 20
MAX_TICKS = 32767


def tick_ns(milliseconds: float | str) -> int:
    """Return a Processor's tick in ns.

    Raises:
        ValueError: not 0.5 to 10 ms in steps of 0.5 ms (section 4, J2-3093 p. 1-7).
    """
    exact = _exact(milliseconds, "tick rate") * NS_PER_MS
    if exact.denominator != 1 or exact % TICK_STEP_NS or not MIN_TICK_NS <= exact <= MAX_TICK_NS:
        raise ValueError(f"tick rate {milliseconds} ms is not 0.5 to 10 ms in steps of 0.5 ms")
    return int(exact)


def seconds_ns(seconds: float | str) -> int:
    """Return a time given in seconds as whole ns, rounded to the nearest.

    Raises:
        ValueError: not a finite number, or negative.
    """
    exact = _exact(seconds, "time in seconds")
    if exact < 0:
        raise ValueError(f"{seconds} s is negative")
    return round(exact * NS_PER_S)


def exact_ns(seconds: str) -> int:
    """Return a time that a text gives in seconds as whole ns, exactly.

    Raises:
        ValueError: not a number, negative, above ``MOST_SECONDS``, or finer than 1 ns.
    """
    exact = _exact(seconds, "time in seconds")
    if exact < 0:
        raise ValueError(f"{seconds} s is negative")
    if exact > MOST_SECONDS:
        raise ValueError(f"{seconds} s is too long: at most {MOST_SECONDS} s")
    is_zero = not seconds.lower().partition("e")[0].strip(" +-.0")
    if (exact * NS_PER_S).denominator != 1 or (not exact and not is_zero):
        raise ValueError(f"{seconds} s is finer than 1 ns")
    return int(exact * NS_PER_S)


def seconds_text(time_ns: int) -> str:
    """Return a time of 0 ns or more as seconds, exactly and without trailing zeros."""
    whole, rest = divmod(time_ns, NS_PER_S)
    return f"{whole}.{rest:09d}".rstrip("0").rstrip(".") if rest else str(whole)


def time_text(time_ns: int) -> str:
    """Return a time of an axis as seconds, exactly; one before its 0 is negative."""
    return f"{'-' if time_ns < 0 else ''}{seconds_text(abs(time_ns))}"


def _exact(number: float | str, what: str) -> Fraction:
    """Return a number exactly as written; a huge exponent is refused before it uses memory."""
    text = str(number).strip()
    if not is_number(text):
        raise ValueError(f"{what} {quoted(text)} is not a number")
    magnitude = abs(float(text))
    if magnitude >= _LARGEST_NUMBER:
        raise ValueError(f"{what} {quoted(text, marks='')} is too large")
    return Fraction(text) if magnitude >= 1.0 / _LARGEST_NUMBER else Fraction(0)


_LARGEST_NUMBER = 1e12
