"""Analog modules: two inputs (57C409) or four outputs (57C410), 4095 counts at full scale (57C409 manual p. 3-3).

A 57C409 has its two inputs in the registers 0 and 1, their status in 4 and a control register for each in 5 and 6; that
2 and 3 are their update periods is ours (decision). Each channel has an interrupt, at which its input freezes. The
module drives the common clock while bit 6 is set in one of the control registers, of which the manual sets both
(decision). The registers of a 57C410 are ours too (decision): four outputs in 0 to 3.
"""

from __future__ import annotations

from automax_ros.rack.modules.configured import Interrupt, Registers
from automax_ros.rack.modules.io_config import IoKind, IoModel

_ANALOG_INPUTS = Registers(
    7,
    outputs=frozenset({2, 3, 5, 6}),
    interrupts=(
        Interrupt(status=5, period=2, inputs=range(1)),
        Interrupt(status=6, period=3, inputs=range(1, 2)),
    ),
    clock_status=((4, 0x0500),),
)

ANALOG_IO = IoKind(
    "analog I/O",
    "analog_io",
    {
        "57C409": IoModel("2-channel analog input module", _ANALOG_INPUTS),
        "57C410": IoModel("analog output module", Registers(4, outputs=range(4))),
    },
)
