"""The resolver input module 57C411: position, position at the external strobe, interrupt (57C411 manual p. 4-1).

Register 0 is the position, 1 that at the last edge of EXTERNAL STROBE, 2 a copy of the interrupt status and control
register 3, 4 the update period. The unit of the period is ours, after the 57C421: 0.5 ms, less one (decision). What
stands in the registers 0 and 1 comes from outside, as the converter would give it: bits 2 to 13 within a turn, 14 and
15 turns. No source says of bit 12 of register 3: it can be set and does nothing (decision).
"""

from __future__ import annotations

from automax_ros.rack.modules.configured import Interrupt, Registers
from automax_ros.rack.modules.io_config import IoKind, IoModel

_RESOLVER_REGISTERS = Registers(
    5,
    outputs=range(3, 5),
    interrupts=(Interrupt(status=3, period=4, inputs=range(2)),),
    copies=((3, 2),),
)

RESOLVER = IoKind("resolver input", "resolver", {"57C411": IoModel("resolver input module", _RESOLVER_REGISTERS)})
