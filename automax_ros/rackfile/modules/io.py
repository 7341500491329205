"""I/O modules in a rack file: digital, analog, pulsetach and resolver. They have tables of registers and no keys.

Digital modules. No source at hand gives their register maps; these are ours (decision): a 57C402 or 57C403 has 16
outputs in register 0, a 57C408 16 inputs in register 0 and 16 outputs in register 1. In a drive's 57C408 bit 0 of the
inputs is the run permissive and bit 1 the external instantaneous electronic trip (IET, TRUE trips); bits 0, 1 and 2 of
the outputs are FMCR, RMCR and drive OK, which its 57C406 sets at each CML scan (decision). A 57C419 has 32 inputs in
the registers 0 and 1, which freeze at its interrupt (4.0), its interrupt status and control register in 2 and its
update period in 3.

Analog modules: two inputs (57C409) or four outputs (57C410), 4095 counts at full scale (57C409 manual p. 3-3). A 57C409
has its two inputs in the registers 0 and 1, their status in 4 and a control register for each in 5 and 6; that 2 and 3
are their update periods is ours (decision). Each channel has an interrupt, at which its input freezes. The module
drives the common clock while bit 6 is set in one of the control registers; the manual sets both (decision). The
registers of a 57C410 are ours too (decision): four outputs in 0 to 3.

The pulsetach input module 57C421: a 24-bit counter, a comparator, a timer interrupt (57C421B manual p. 4-4, 4-5). The
counter is in the registers 0 and 1, high word first with its sign extended, to be read as a DOUBLE INTEGER; the update
period in 2, (value + 1) x 0.5 ms; the comparator in 3 and 4, like the counter; the interrupt status and control
register is 5, with the timer interrupt enable in bit 5, 6 defines the mode, 7 is the module's status. No source gives
the contents of 6 and 7, nor the effect of reaching the comparator: 6 can be written and does nothing, 7 stays 0, and
the comparator only stores a number (decision). The counter comes from outside and keeps its low 24 bits, as a counter
that overflows does (decision).

The resolver input module 57C411: position, position at the external strobe, interrupt (57C411 manual p. 4-1). Register
0 is the position, 1 that at the last edge of EXTERNAL STROBE, 2 a copy of the interrupt status and control register 3,
4 the update period. The unit of the period is ours, after the 57C421: 0.5 ms, less one (decision). The registers 0 and
1 come from outside, in the converter's format: bits 2 to 13 within a turn, 14 and 15 turns. No source describes bit 12
of register 3: it can be set and does nothing (decision).
"""

from __future__ import annotations

from collections.abc import Mapping

from automax_ros.rackfile.model.module import Interrupt, ModuleConfig, Registers
from automax_ros.rackfile.modules.kind import ModuleKind, ModuleSection

DRIVE_MODEL = "57C408"
"""The drive digital I/O module."""
DRIVE_INPUTS, DRIVE_OUTPUTS = 0, 1
"""The registers of a drive's 57C408."""
PERMISSIVE_BIT, EXTERNAL_TRIP_BIT = 0, 1
FMCR_BIT, RMCR_BIT, DRIVE_OK_BIT = 0, 1, 2
_OUTPUTS = Registers(1, outputs=range(1))
_DRIVE = Registers(2, outputs=range(1, 2))
_INPUTS = Registers(4, outputs=range(2, 4), interrupts=(Interrupt(status=2, period=3, inputs=range(2)),))
_ANALOG_INPUTS = Registers(
    7,
    outputs=frozenset({2, 3, 5, 6}),
    interrupts=(
        Interrupt(status=5, period=2, inputs=range(1)),
        Interrupt(status=6, period=3, inputs=range(1, 2)),
    ),
    clock_status=((4, 0x0500),),
)
_RESOLVER_REGISTERS = Registers(
    5,
    outputs=range(3, 5),
    interrupts=(Interrupt(status=3, period=4, inputs=range(2)),),
    copies=((3, 2),),
)
TIMER_ENABLE = 5
"""The bit of register 5 that enables the timer interrupt."""
_COUNTER_REGISTERS = Registers(
    8,
    outputs=range(2, 7),
    interrupts=(Interrupt(status=5, period=2, inputs=range(2), enable=TIMER_ENABLE),),
    counters=(0,),
)


class IoConfig(ModuleConfig):
    """An I/O module in any slot."""


class IoKind(ModuleKind):
    """A kind of module for which a rack file gives only number and slot; its modules' names begin with ``node``.

    ``modules`` are the titles and registers of its catalogue numbers.
    """

    def __init__(self, word: str, node: str, modules: Mapping[str, tuple[str, Registers]]) -> None:
        self.word, self.node = word, node
        self.models = {number: title for number, (title, _) in modules.items()}
        self.table = {number: registers for number, (_, registers) in modules.items()}

    def read(self, found: ModuleSection) -> IoConfig:
        """Read the section, which has no keys of its own."""
        return IoConfig(**found.placed(self.node), registers=self.table[found.model])


DIGITAL_IO = IoKind(
    "digital I/O",
    "digital_io",
    {
        "57C402": ("digital output module", _OUTPUTS),
        "57C403": ("digital output module", _OUTPUTS),
        DRIVE_MODEL: ("drive digital I/O module", _DRIVE),
        "57C419": ("32-channel digital input module", _INPUTS),
    },
)
ANALOG_IO = IoKind(
    "analog I/O",
    "analog_io",
    {
        "57C409": ("2-channel analog input module", _ANALOG_INPUTS),
        "57C410": ("analog output module", Registers(4, outputs=range(4))),
    },
)
RESOLVER = IoKind("resolver input", "resolver", {"57C411": ("resolver input module", _RESOLVER_REGISTERS)})
PULSETACH = IoKind("pulsetach input", "pulsetach", {"57C421": ("pulsetach input module", _COUNTER_REGISTERS)})
