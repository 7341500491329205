"""When two values are the same."""

from __future__ import annotations

import struct

from automax_ros.core.types import Value

_DOUBLE = struct.Struct("<d")


def same_bits(one: Value, other: Value) -> bool:
    """Whether two values are the same to the last bit: -0.0 is not 0.0, and NaN is NaN."""
    if isinstance(one, float) and isinstance(other, float):
        return (one == other and one != 0.0) or _DOUBLE.pack(one) == _DOUBLE.pack(other)
    return one == other and type(one) is type(other)
