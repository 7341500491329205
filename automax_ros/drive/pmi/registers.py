"""The registers of an SD3000 drive in the dual port of its UDC (decision: the manual's chapter on them is not known).

Known are 207 (4095 at the Motor Overload Ratio), bit 9 of 100 (resets the counters of the rail ports), and the count of
messages in 81; all others are ours. Numbers are those of drive A; those of drive B are 1000 higher.
"""

from __future__ import annotations

from dataclasses import dataclass

DRIVE_B = 1000
"""Offset of a number for drive B."""


LINK, MESSAGES = 80, 81
CONTROL, REFERENCE, ALPHA = 100, 101, 102
STATUS, INPUTS, FAULTS, WARNINGS = 200, 201, 202, 203
SPEED, POSITION, VOLTAGE, CURRENT, VOLTS, DELTA, DC_TIME = 204, 205, 206, 207, 208, 209, 210
LINE_PERIOD, BAD_SCR_NUM, REF_LAG_OUT = 212, 213, 214
NO_CLOCK = 1 << 0
"""Bit of ``LINK``: there is no common clock, nothing is exchanged."""
LAST_MESSAGE = 32_000
"""Value at which the count of messages rolls over to 0."""
(RUN, TEST, COAST, REVERSE_CONTACTOR, TEST_BRIDGE_2, FAST_CHANGE, ANY_ROTATION) = (1 << bit for bit in range(7))
FAULT_RESET, COUNTER_RESET = 1 << 8, 1 << 9
"""Bits of ``CONTROL``."""
(RUNNING, LOCKED, READY, FORWARD_ON, REVERSE_ON, ON_BRIDGE_2) = (1 << bit for bit in range(6))
FAULT, WARNING = 1 << 8, 1 << 9
"""Bits of ``STATUS``."""
PERMITTED, TRIPPED = 1 << 0, 1 << 1
"""Bits of ``INPUTS``."""
(OVERCURRENT, SYNC_LOSS, EXTERNAL_TRIP, ROTATION, BAD_SCR) = (1 << bit for bit in range(5))
UDC_RUN, COMMUNICATION = 1 << 14, 1 << 15
"""Bits of ``FAULTS``."""
(NOT_PERMITTED, REFUSED, REFERENCE_LIMITED) = (1 << bit for bit in range(3))
"""Bits of ``WARNINGS``."""
FULL = 4095
"""Counts of current at the Motor Overload Ratio, and of speed at the motor's base speed."""
RATED_VOLTAGE = 3000
"""Counts of the rated armature voltage: the scaling of TACHLOSS_OVERSPEED (35)."""
TURN = 4096
"""Counts of a turn of the resolver."""


@dataclass(frozen=True)
class PmiRegister:
    """A register: its number for drive A, its content, and the meaning of each bit of a word of bits."""

    number: int
    meaning: str
    bits: tuple[tuple[int, str], ...] = ()


COMMAND_REGISTERS = (
    PmiRegister(
        CONTROL,
        "control",
        (
            (0, "run: a rising edge starts, FALSE stops"),
            (1, "test mode: fires at 102 without regulation; read in standby"),
            (2, "coast stop"),
            (3, "reverse contactor (RMCR) at the next start, else the forward one (FMCR)"),
            (4, "test mode fires bridge 2"),
            (5, "fast bridge change; read in standby"),
            (6, "the line may have either rotation"),
            (8, "fault reset, in standby"),
            (9, "sets the counters of the rail ports to 0"),
        ),
    ),
    PmiRegister(REFERENCE, "current reference, 4095 at the Motor Overload Ratio"),
    PmiRegister(ALPHA, "firing angle of test mode, 0 to 180 degrees"),
)
"""The registers that tasks write."""

FEEDBACK_REGISTERS = (
    PmiRegister(
        STATUS,
        "status",
        (
            (0, "the drive runs, until a stop has opened the contactor"),
            (1, "locked to the line"),
            (2, "ready: a start would be accepted"),
            (3, "FMCR is on"),
            (4, "RMCR is on"),
            (5, "bridge 2 is in use"),
            (8, "a fault is latched"),
            (9, "there is a warning"),
        ),
    ),
    PmiRegister(
        INPUTS,
        "inputs of the PMI, written by the process",
        (
            (0, "run permissive"),
            (1, "external trip"),
        ),
    ),
    PmiRegister(
        FAULTS,
        "faults, latched",
        (
            (0, "overcurrent: above Motor Overload Ratio + 75 % of rated current"),
            (1, "sync loss"),
            (2, "external trip"),
            (3, "phase rotation"),
            (4, "shorted SCR: 213 has its pair"),
            (14, "the UDC task was stopped while the drive ran"),
            (15, "communication lost while the drive ran: no common clock"),
        ),
    ),
    PmiRegister(
        WARNINGS,
        "warnings, while their cause is there",
        (
            (0, "run is wanted without run permissive"),
            (1, "run is wanted with a fault latched"),
            (2, "the reference is beyond 4095: it counts as 4095"),
        ),
    ),
    PmiRegister(SPEED, "speed by the tachometer, 4095 at base speed"),
    PmiRegister(POSITION, "position of the shaft by the resolver, 0 to 4095"),
    PmiRegister(VOLTAGE, "armature voltage, 3000 at rated voltage"),
    PmiRegister(CURRENT, "armature current, 4095 at the Motor Overload Ratio"),
    PmiRegister(VOLTS, "armature voltage, volts"),
    PmiRegister(DELTA, "DELTA, us; 0 in standby"),
    PmiRegister(DC_TIME, "time without current in the last sixth of a cycle, us"),
    PmiRegister(LINE_PERIOD, "period of the line, us"),
    PmiRegister(BAD_SCR_NUM, "pair of the shorted SCR, 1 to 6; 0 without one"),
    PmiRegister(REF_LAG_OUT, "reference after its lag, as 101; 0 in standby"),
)
"""The feedback: the PMI writes all of these but the inputs."""

LINK_REGISTERS = (
    PmiRegister(LINK, "communication status", ((0, "no common clock: nothing is exchanged"),)),
    PmiRegister(MESSAGES, "messages received from the PMI, 0 to 32000"),
)
"""The UDC's registers of its link."""

WRITTEN = tuple(item.number for item in (*FEEDBACK_REGISTERS, *LINK_REGISTERS) if item.number != INPUTS)
"""The registers of drive A that the module writes where the drive has a PMI."""
