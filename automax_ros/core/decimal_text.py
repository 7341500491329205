"""Values as decimal texts for tables: exact times, and REALs with no more digits than they have."""

from __future__ import annotations

import struct

from automax_ros.core.ticks import NS_PER_S

_SINGLE = struct.Struct("<f")
_FEWEST, _MOST = 6, 9
"""Any decimal with 6 digits survives a single, 9 tell any two singles apart (IEEE 754)."""


def seconds_text(time_ns: int) -> str:
    """Return a time of 0 ns or more as seconds, exactly and without trailing zeros."""
    whole, rest = divmod(time_ns, NS_PER_S)
    return f"{whole}.{rest:09d}".rstrip("0").rstrip(".") if rest else str(whole)


def real_text(value: float) -> str:
    """Return the shortest text that gives the same single-precision value, as Python writes it: ``0.1``, ``2.0``.

    A number that is not a single is written as it is.
    """
    for digits in range(_FEWEST, _MOST + 1):
        candidate = float(f"{value:.{digits}g}")
        try:
            if _SINGLE.unpack(_SINGLE.pack(candidate))[0] == value:
                return repr(candidate)
        except OverflowError:
            break
    return repr(value)
