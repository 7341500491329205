"""What the instructions of the Logix controllers share: DINT and REAL, and the enable members."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field

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


@dataclass
class Instruction:
    """The members of a tag that each instruction has. The first scan is that of a new tag or after a prescan."""

    EnableIn: bool = True
    EnableOut: bool = field(default=False, init=False)
    _first_scan: bool = field(default=True, init=False, repr=False)

    def prescan(self) -> None:
        """Do what the controller does before its first scan in Run: EnableIn and EnableOut are cleared.

        The next execution is a first scan. It needs EnableIn set again: by its wire in a function block diagram, by the
        controller in structured text, by you here.
        """
        self.postscan()
        self._first_scan = True

    def postscan(self) -> None:
        """Do what the controller does after a sequential function chart's last scan: clear EnableIn and EnableOut."""
        self.EnableIn = False
        self.EnableOut = False
