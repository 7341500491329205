"""DINT and REAL of the Logix controllers."""

from __future__ import annotations

import math
import struct

from automax_ros.core.numbers import INT32_MAX, INT32_MIN

_SINGLE = struct.Struct("<f")


def require_dint(member: str, value: object) -> None:
    """Refuse a value that a DINT member cannot hold: it holds a whole number of 32 bits, two's complement.

    Raises:
        ValueError: ``value`` is not an int or lies beyond 32 bits; the message names the member.
    """
    if not isinstance(value, int) or not INT32_MIN <= value <= INT32_MAX:
        raise ValueError(f"{member} is a DINT, a whole number from {INT32_MIN} to {INT32_MAX}, not {value!r}")


def require_real(member: str, value: object) -> None:
    """Refuse a value for a REAL member that is not a number; a number that is too large becomes Infinity there.

    Raises:
        ValueError: ``value`` is not a number; the message names the member.
    """
    if not isinstance(value, (int, float)):
        raise ValueError(f"{member} is a REAL, a number, not {value!r}")


def single(value: float) -> float:
    """Return a number as a REAL holds it: the nearest IEEE 754 single, +-Infinity beyond the largest."""
    try:
        held: float = _SINGLE.unpack(_SINGLE.pack(value))[0]
    except (OverflowError, struct.error):  # the latter for an int that is too large for any float
        return math.inf if value > 0 else -math.inf
    return held
