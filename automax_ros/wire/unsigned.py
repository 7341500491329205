"""Unsigned numbers as the signed ones of the same bits, which is what is written into bytes one by one.

Raises:
    OverflowError: the number is negative, or has more bits.
"""

from __future__ import annotations

from typing import Final

_PLAIN: Final = (1 << 62) - 1
"""Up to here a number is compared at once where this is compiled."""


def as_i16(number: int) -> int:
    """Return the int16 with the bits of a uint16."""
    return number if 0 <= number < 1 << 15 else _wrapped(number, 16)


def as_i32(number: int) -> int:
    """Return the int32 with the bits of a uint32."""
    return number if 0 <= number < 1 << 31 else _wrapped(number, 32)


def as_i64(number: int) -> int:
    """Return the int64 with the bits of a uint64."""
    return number if 0 <= number <= _PLAIN else _wrapped(number, 64)


def _wrapped(number: int, bits: int) -> int:
    if not 0 <= number < 1 << bits:
        raise OverflowError(f"{number} does not fit an unsigned number of {bits} bits")
    return number - (1 << bits) if number >> (bits - 1) else number
