"""The pulsetach input module 57C421: a 24-bit counter, a comparator, a timer interrupt (57C421B manual p. 4-4, 4-5).

The counter is in the registers 0 and 1, high word first with its sign extended, to be read as a DOUBLE INTEGER; the
update period in 2, (value + 1) x 0.5 ms; the comparator in 3 and 4, like the counter; the interrupt status and control
register is 5, with the timer interrupt enable in bit 5, 6 defines the mode, 7 is the module's status. No source says
what 6 and 7 hold, nor what the comparator does when it is reached: 6 can be written and does nothing, 7 stays 0, and
the comparator is a place for a number (decision). The counter comes from outside and keeps its low 24 bits, as a
counter that runs over does (decision).
"""

from __future__ import annotations

from automax_ros.rack.modules.configured import Interrupt, Registers
from automax_ros.rack.modules.io_config import IoKind, IoModel

TIMER_ENABLE = 5
"""The bit of register 5 without which there is no timer interrupt."""
_COUNTER_REGISTERS = Registers(
    8,
    outputs=range(2, 7),
    interrupts=(Interrupt(status=5, period=2, inputs=range(2), enable=TIMER_ENABLE),),
    counters=(0,),
)

PULSETACH = IoKind("pulsetach input", "pulsetach", {"57C421": IoModel("pulsetach input module", _COUNTER_REGISTERS)})
