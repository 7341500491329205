"""Data between the current minor loop and its 57C406: whole numbers only, so that a record keeps them exactly.

The 57C406 interrupts six times in a line cycle. At each interrupt it supplies what it has ``Measured`` since the
previous one, and receives a ``Command`` for the time up to the next (decision: nothing is published of this interface).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

LINE: Final = 1 << 0
"""There is a sync voltage: the phase to which the 57C406 synchronizes is live."""
ROTATION_ABC: Final = 1 << 1
"""The phases pass in the order A, B, C: not the standard one, which is C, B, A (52.1.5)."""
OVERCURRENT: Final = 1 << 2
"""The armature current has been above the level of the last command at some instant since the last interrupt, or a
current of the line is at this one (decision: what the armature does not see must trip, too)."""
PERMISSIVE: Final = 1 << 3
"""The run permissive input of the drive digital I/O module."""
EXTERNAL_TRIP: Final = 1 << 4
"""The external instantaneous electronic trip (IET) input of the drive digital I/O module."""
SWITCH_A: Final = 1 << 5
SWITCH_B: Final = 1 << 6
"""The test switch of the 57C406 in position A, in position B; neither in the centre."""
RESET_SWITCH: Final = 1 << 7
"""The fault reset switch of the 57C406 is closed."""
VOLTAGE: Final = 1 << 8
"""A 57C405 supplies the armature voltage."""
OVERSPEED: Final = 1 << 9
"""The hardware's overspeed circuit, which DIGITAL_TACH sets up, has tripped since the last report, or still measures a
speed above OSV_THRESH (52.1.5)."""

LATE_BIT: Final = 16
"""First bit of the delay in ``Measured.status``, us: how long after its interrupt the last command came. That is the
time that a scan computes, 0 in ideal execution."""

LATEST_US: Final = 16_383
"""Largest delay in ``Measured.status``, us: the status stays within 31 bits, and in normal operation no command comes
that late."""

RATED: Final = 100_000
"""The rated armature current in the units of ``Measured.current`` (thousandths of a percent)."""

VOLTS: Final = 10_000
"""``Measured.voltage`` where armature voltage and nominal line-to-line voltage (rms) are equal (decision)."""

FMCR: Final = 1
RMCR: Final = 2
"""The contactor relays of the drive digital I/O module, as bits of ``Command.relays``."""


class Measured(NamedTuple):
    """The measurements of the 57C406 since the last interrupt, and the state of its inputs, switches and registers.

    Attributes:
        status: the bits above.
        current: mean armature current, thousandths of a percent of the rated one, signed.
        zero_us: time without current, us.
        tail_us: time without current up to this interrupt, without a break, us; 0 while it flows.
        since_sync_ns: time since phase T1 of the drive was last at its maximum, ns; 0 without LINE.
        voltage: armature voltage over the drive's nominal line-to-line voltage, ``VOLTS`` for 1, signed, scaled as in
            52.6.1, which follows the line; the EMF while no current flows; 0 without VOLTAGE.
        tach_threshold: register 4136, degrees.
        phase_step: register 4137, us.
        period_step: register 4138, us.
        options: register 4146.
        line: the greatest phase current of the line at this interrupt, thousandths of a percent of the rated armature
            current, without sign. It shows a short from phase to phase, which the armature current does not.
    """

    status: int
    current: int = 0
    zero_us: int = 0
    tail_us: int = 0
    since_sync_ns: int = 0
    voltage: int = 0
    tach_threshold: int = 109
    phase_step: int = 4
    period_step: int = 2
    options: int = 0
    line: int = 0


class Pulse(NamedTuple):
    """A gate window: it begins ``after_ns`` after the interrupt and is ``length_ns`` long; ``gates`` are gate bits.

    Bits 0 to 5 are the SCRs 1 to 6, bits 8 to 13 the SCRs 11 to 16 (decision: the gate command word of DIAG_DATA).
    """

    after_ns: int
    length_ns: int
    gates: int


class Command(NamedTuple):
    """The command for the 57C406 until the next interrupt.

    Attributes:
        next_ns: time from this interrupt to the next, ns.
        relays: the contactor relays that are on, FMCR and RMCR.
        pulses: the gate windows that begin before the next interrupt; those of earlier commands that have begun remain.
            Where scans compute for a time, one more follows for the time until the next command.
        level: current at which OVERCURRENT is set, % of rated.
    """

    next_ns: int
    relays: int = 0
    pulses: tuple[Pulse, ...] = ()
    level: int = 400
    block: bool = False
    """All earlier gate windows end at once (a coast stop, a bridge change)."""
    ok: bool = False
    """The drive OK output of the drive digital I/O module: good inputs and no drive fault (decision)."""


def late_us(status: int) -> int:
    """Return how long after its interrupt the last command came, us."""
    return status >> LATE_BIT


def gate_bits(*numbers: int) -> int:
    """Return the gate bits of SCRs 1 to 6 and 11 to 16."""
    word = 0
    for number in numbers:
        word |= 1 << (number - 1 if number < 10 else number - 3)
    return word


@lru_cache(maxsize=4096)
def gate_numbers(word: int) -> tuple[int, ...]:
    """Return the SCRs of gate bits, ascending."""
    low = [bit + 1 for bit in range(6) if word >> bit & 1]
    return (*low, *(bit + 3 for bit in range(8, 14) if word >> bit & 1))
