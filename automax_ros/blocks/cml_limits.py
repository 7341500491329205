"""The limits of DC_DRIVE_CML's inputs (table 1 and 52.1): check compares literals, the loop what variables hold.

Both ends are allowed. Where a limit follows the line's frequency it is a function of it.
"""

from __future__ import annotations

from math import ceil, floor

from automax_ros.blocks.coefficients import is_within

LIMITS: dict[str, tuple[float, float]] = {
    "IO_CNTL_SLOT": (0, 15),
    "DIG_IO_SLOT": (0, 15),
    "AC_LINE_FREQ": (48, 62),
    "KP": (0.0, 4.0),
    "PI_W_LEAD": (10.0, 500.0),
    "AG_FACTOR": (1, 300),
    "CC_THRESH": (0, 32767),
    "MAX_M_DROPOUT": (0.1, 1.0),
    "TEST_ALPHA": (0, 180),
    "IOC_THRESH": (100, 400),
    "LIM_BAR": (100, 400),
    "OSV_THRESH": (0, 32767),
}
"""Lowest and highest value of each input with limits that do not depend on the line."""

FULL_COUNTS = 4095
"""Counts of LIM_BAR."""
MOST_COUNTS = 32767
"""Largest rate limit, counts per scan."""
SCANS_PER_CYCLE = 6
LOWEST_LAG = 1.0
"""Lowest REF_LAG, rad/s."""
LAG_AT_50_HZ, LAG_AT_60_HZ = 400.0, 500.0
"""Highest REF_LAG on a 50 Hz line and on a 60 Hz line, rad/s."""
BETWEEN_HZ = 55.0
"""A line of this frequency or more counts as one of 60 Hz, else of 50 Hz, for REF_LAG (decision)."""


def limits_at(name: str, line_hz: float) -> tuple[float, float]:
    """Return the lowest and highest value of an input at a line frequency in Hz; of REF_RATE besides 0.0."""
    if name == "REF_RATE":
        return ref_rate_limits(line_hz)
    return ref_lag_limits(line_hz) if name == "REF_LAG" else LIMITS[name]


def is_good(name: str, value: float, line_hz: float) -> bool:
    """Return whether an input may have a value at a line frequency in Hz, as closely as a REAL variable holds it."""
    return (name == "REF_RATE" and value == 0.0) or is_within(value, *limits_at(name, line_hz))


def ref_rate_limits(line_hz: float) -> tuple[float, float]:
    """Return the lowest and highest REF_RATE in s at a line frequency, besides 0.0, which turns the limit off.

    They are those of a rate of 32767 and of 1 count per scan, rounded inward as table 1 prints them: 0.00035 to 11.37 s
    at 60 Hz, 0.00042 to 13.65 s at 50 Hz (decision: to five and two decimals at any frequency).
    """
    one_count_s = FULL_COUNTS / (SCANS_PER_CYCLE * line_hz)
    return ceil(one_count_s / MOST_COUNTS * 1e5) / 1e5, floor(one_count_s * 100.0 + 1e-9) / 100.0


def ref_lag_limits(line_hz: float) -> tuple[float, float]:
    """Return the lowest and highest REF_LAG in rad/s at a line frequency (table 1)."""
    return LOWEST_LAG, LAG_AT_60_HZ if line_hz >= BETWEEN_HZ else LAG_AT_50_HZ


def ioc_is_possible(ioc_thresh: int, lim_bar: int) -> bool:
    """Return whether an IOC level can be calculated: IOC_THRESH less than 1.8 LIM_BAR (52.1.5)."""
    return 5 * ioc_thresh < 9 * lim_bar
