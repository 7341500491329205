"""The twelve SCRs: the one table of their numbers, places and directions.

The anti-parallel pairs 1-14, 2-15, 3-16, 4-11, 5-12, 6-13 are the manual's (52.3.1). No manual says which phase a pair
is on; here it follows from firing in the order 1-2-3-4-5-6 on a line that rotates A, B, C (decision).

Internally, an SCR is a bit: ``2 * leg`` for the one that conducts from the phase to the rail, the next for its partner.
A leg is a place for a pair, ``2 * phase + rail``: phases A, B, C are 0, 1, 2, the rails P (armature A1) and M (A2) are
0, 1.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Final

from automax_ros.drive.base.errors import GateError

PHASES: Final = "ABC"
P: Final = 0
M: Final = 1

FORWARD: Final = (1, 2, 3, 4, 5, 6)
"""The SCRs of bridge 1 in firing order on a line that rotates A, B, C; they carry positive armature current."""
REVERSE: Final = (11, 12, 13, 14, 15, 16)
"""The SCRs of bridge 2, likewise; they carry negative armature current."""

# number: phase, rail, direction (+1: conducts from the phase to the rail)
_PLACES: Final = {
    1: (0, P, 1), 3: (1, P, 1), 5: (2, P, 1),
    4: (0, M, -1), 6: (1, M, -1), 2: (2, M, -1),
    11: (0, M, 1), 13: (1, M, 1), 15: (2, M, 1),
    14: (0, P, -1), 16: (1, P, -1), 12: (2, P, -1),
}  # fmt: skip

BIT: Final = {number: 2 * (2 * phase + rail) + (direction < 0) for number, (phase, rail, direction) in _PLACES.items()}
"""The bit of each SCR."""
NUMBER: Final = tuple(sorted(BIT, key=lambda number: BIT[number]))
"""The number of the SCR of each bit."""
PARTNER: Final = {number: NUMBER[bit ^ 1] for number, bit in BIT.items()}
"""The SCR anti-parallel to each."""
MASK: Final = {number: 1 << bit for number, bit in BIT.items()}
FORWARD_MASK: Final = sum(MASK[number] for number in FORWARD)
REVERSE_MASK: Final = sum(MASK[number] for number in REVERSE)


RAIL_MASKS: Final = tuple(sum(MASK[number] for number, place in _PLACES.items() if place[1] == rail) for rail in (P, M))
"""The SCRs on each rail."""


def phase_of(number: int) -> int:
    """Return the phase of an SCR: 0, 1, 2 for A, B, C."""
    return _PLACES[number][0]


def direction_of(number: int) -> int:
    """Return +1 for an SCR that conducts from its phase to its rail, -1 for one from the rail to the phase."""
    return _PLACES[number][2]


def mask_of(numbers: Iterable[int]) -> int:
    """Return the mask of SCRs; raises GateError if there is no SCR of a number."""
    return _mask_of(tuple(numbers))


@lru_cache(maxsize=4096)
def _mask_of(numbers: tuple[int, ...]) -> int:
    mask = 0
    for number in numbers:
        if number not in MASK:
            raise GateError(f"there is no SCR {number}; bridge 1 has 1 to 6, bridge 2 has 11 to 16")
        mask |= MASK[number]
    return mask


@lru_cache(maxsize=4096)
def numbers_of(mask: int) -> tuple[int, ...]:
    """Return the numbers of the SCRs of a mask, ascending."""
    return tuple(sorted(NUMBER[bit] for bit in range(12) if mask >> bit & 1))
