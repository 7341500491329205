"""Arithmetic of the rack: 16 and 32 bit integers, REAL with a 24-bit mantissa.

All of it uses only + - * /, comparisons and integers, so that it gives the same bits on every machine.
"""

from __future__ import annotations

import math
import struct

INT16_MIN, INT16_MAX = -32768, 32767
INT32_MIN, INT32_MAX = -(2**31), 2**31 - 1
REAL_LIMIT = 9.2233717e18
"""Largest magnitude of a REAL (2.4.2)."""
REAL_MAX: float = struct.unpack("<f", struct.pack("<f", REAL_LIMIT))[0]
"""Largest value of a REAL variable: the single-precision value nearest to it, which is a little smaller."""
REAL_MIN_POSITIVE = 5.4210107e-20
REAL_MIN_NEGATIVE = 2.7105054e-20
"""Smallest magnitude of a negative REAL (2.4.2); below it a value becomes 0 (decision)."""

_SINGLE = struct.Struct("<f")


def clamp16(value: int) -> int:
    """Limit a number to the range of an INTEGER."""
    return INT16_MIN if value < INT16_MIN else INT16_MAX if value > INT16_MAX else value


def clamp32(value: int) -> int:
    """Limit a number to the range of a DOUBLE INTEGER."""
    return INT32_MIN if value < INT32_MIN else INT32_MAX if value > INT32_MAX else value


def truncated_quotient(numerator: int, denominator: int) -> int:
    """Divide two integers, truncating toward zero; ``denominator`` must not be 0 (semantics, Numbers)."""
    quotient = abs(numerator) // abs(denominator)
    return quotient if (numerator < 0) == (denominator < 0) else -quotient


def round_count(value: float) -> int:
    """Round to the nearest count, halves away from zero (decision): so a filter settles on its input exactly."""
    return int(value + 0.5) if value >= 0.0 else int(value - 0.5)


def nearest(value: float) -> int:
    """Round to the nearest whole number, halves up (decision): as samples of waves and cells of tables are."""
    return math.floor(value + 0.5)


def sign_extended(value: int, bits: int) -> int:
    """Keep the low ``bits`` (1 to 32) of a number and extend their sign."""
    half = 1 << (bits - 1)
    return ((value + half) & ((1 << bits) - 1)) - half


def stored_real(value: float) -> tuple[float, bool]:
    """Return the value of a REAL variable after it was given ``value``, and whether it had to be clamped.

    The nearest single-precision value; clamped at +-9.2233717E18; 0 below the smallest magnitude (decision).
    """
    if math.isnan(value):
        return 0.0, True
    if value > REAL_MAX:
        return REAL_MAX, value > REAL_LIMIT
    if value < -REAL_MAX:
        return -REAL_MAX, value < -REAL_LIMIT
    if -REAL_MIN_NEGATIVE < value < REAL_MIN_POSITIVE:
        return 0.0, False
    single: float = _SINGLE.unpack(_SINGLE.pack(value))[0]
    return single, False
