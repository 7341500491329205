"""The dual-port registers of a UDC module (S-3056 p. 3-50, SB3000 p. 3-8): which they are and who writes them.

Of what no source gives (decision): 2002 counts the scans since the last interrupt, bit 6 of 2000 drives the common
clock and its other bits mean nothing, the test I/O of the module (1000 to 1017) may be inputs or outputs. Registers
that are not listed belong to the module's operating system (S-3006 p. 4-2).
"""

from __future__ import annotations

from automax_ros.rack.modules.configured import Interrupt, Registers

COUNT = 2048
RAIL = range(24)
"""Rail and Flex I/O ports of the PMI: 0 to 11 of drive A, 12 to 23 of drive B."""
RAIL_COUNTERS = {"A": (5, 11), "B": (17, 23)}
"""The check-bit fault counters of each drive's rail ports (SB3000 p. 3-8)."""
STATUS = (*range(80, 90), *range(1080, 1090))
"""UDC-PMI communication status of the drives A and B."""
COMMAND = (*range(100, 200), *range(1100, 1200))
"""Commands to the PMI: outputs."""
FEEDBACK = (*range(200, 300), *range(1200, 1300))
"""What the PMI sends back: inputs."""
TEST = range(1000, 1018)
"""Test switches and meter ports of the module."""
EVERY_SCAN = range(300, 600)
"""Application registers that the UDC copies every scan."""
NTH_SCAN = range(1300, 1600)
"""Application registers that the UDC copies every Nth scan."""
APPLICATION = frozenset((*EVERY_SCAN, *NTH_SCAN))
ISCR = 2000
SCANS_PER_INTERRUPT = 2001
SCAN_COUNTER = 2002

_INPUTS = (*RAIL, *STATUS, *FEEDBACK, SCAN_COUNTER)
_OUTPUTS = (*COMMAND, ISCR, SCANS_PER_INTERRUPT)
_USED = frozenset((*_INPUTS, *_OUTPUTS, *TEST, *APPLICATION))
RETAINED = frozenset((*RAIL, *STATUS, *FEEDBACK, *TEST))
"""What STOP ALL and a power cycle leave: inputs, feedback, communication status, test switches, D/A set-up (2.4.5)."""

UDC_REGISTERS = Registers(
    COUNT,
    outputs=frozenset(_OUTPUTS),
    either=frozenset((*TEST, *APPLICATION)),
    reserved=frozenset(range(COUNT)) - _USED,
    reals=APPLICATION,
    interrupts=(Interrupt(ISCR),),
    commands=frozenset(COMMAND),
)
