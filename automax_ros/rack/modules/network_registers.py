"""The registers of a network module 57C404: 56 drop areas of 64 registers (57C570 manual p. 18-4 to 18-7).

Register 64 x drop + n of the module is register n of the drop's area, for IOREAD% and IOWRITE too (decision). Of the
area of a drop, 0 to 31 go from its slave to the master and 32 to 63 from the master to its slave. The area of drop 0
is the module's status; 32 to 39 of it are broadcast, written in the master and read in every slave. That the 57C404
has the map that is printed for the network part of a 57C570 is ours (decision); the manual of the 57C445 says the same
of its drops.
"""

from __future__ import annotations

from automax_ros.rack.modules.configured import Registers

AREA = 64
"""Registers of the area of one drop."""
HALF = 32
"""Registers that go one way; those from the master come second."""
MASTER = 0
"""The drop of the master."""
LAST_DROP = 55
COUNT = AREA * (LAST_DROP + 1)

STATUS = range(4, 8)
"""Which drops communicate: drops 0 to 15 in the bits of the first, and so on."""
OWN_DROP, RECEIVED, TIMEOUTS, CRC_ERRORS, OVERRUNS, TRANSMITTED, DEPTH = 12, 14, 15, 16, 17, 19, 20
"""Further registers of the area of drop 0; 18, abort errors, stays 0: nothing in DDS is like it (decision)."""
ABORTS = 18
VALID = 0x8000
"""The bit of ``OWN_DROP`` of a module whose drop number is valid."""
DONE, INVALID = 0x8000, 0x4000
"""Bits of ``DEPTH``: it was processed; it was wrong, and the last good one is used."""
BROADCAST = range(32, 40)
_SHOWN = (*STATUS, OWN_DROP, RECEIVED, TIMEOUTS, CRC_ERRORS, OVERRUNS, ABORTS, TRANSMITTED)


def greatest_depth(drop: int) -> int:
    """Return the most drops that the slave at a drop can represent (p. 18-7)."""
    return LAST_DROP + 1 - drop


def from_slave(drop: int) -> range:
    """Return the registers of a drop that its slave writes."""
    return range(AREA * drop, AREA * drop + HALF)


def from_master(drop: int) -> range:
    """Return the registers of a drop that the master writes, those of drop 0 being ``BROADCAST`` and reserved ones."""
    return range(AREA * drop + HALF, AREA * (drop + 1))


def registers_of(drop: int, depth: int) -> Registers:
    """Return the registers as the module of a drop has them, of a slave with ``depth`` drops.

    No point can stand on a register that the manual calls reserved, nor in a slave on drops that are not its own
    (decision: only the master has the areas of all drops).
    """
    own = range(drop, drop + depth)
    if drop == MASTER:
        areas = range(1, LAST_DROP + 1)
        outputs = {number for area in areas for number in from_master(area)} | set(BROADCAST)
        shown = frozenset(_SHOWN)
    else:
        areas = own
        outputs = {number for area in areas for number in from_slave(area)} | {DEPTH}
        shown = frozenset({*_SHOWN, *BROADCAST})
    data = {number for area in areas for number in range(AREA * area, AREA * (area + 1))}
    used = data | outputs | shown
    return Registers(
        COUNT,
        outputs=frozenset(outputs),
        reserved=frozenset(range(COUNT)) - used,
        by_itself=True,
        shown=shown,
        area=AREA,
        areas=frozenset({0, *areas}),
    )
