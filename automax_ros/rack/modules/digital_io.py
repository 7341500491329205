"""Digital input and output modules: registers of 16 points.

No source at hand gives their register maps; these are ours (decision): a 57C402 or 57C403 has 16 outputs in register 0,
a 57C408 16 inputs in register 0 and 16 outputs in register 1. Of a drive's 57C408 bit 0 of the inputs is the run
permissive and bit 1 the external instantaneous electronic trip (IET, TRUE trips); bits 0, 1 and 2 of the outputs are
FMCR, RMCR and drive OK, which its 57C406 sets at each CML scan (decision). A 57C419 has 32 inputs in the registers 0
and 1, which freeze at its interrupt (4.0), its interrupt status and control register in 2 and its update period in 3.
"""

from __future__ import annotations

from automax_ros.rack.modules.configured import Interrupt, Registers
from automax_ros.rack.modules.io_config import IoKind, IoModel

DRIVE_MODEL = "57C408"
"""The drive digital I/O module."""
DRIVE_INPUTS, DRIVE_OUTPUTS = 0, 1
"""The registers of a drive's 57C408."""
PERMISSIVE_BIT, EXTERNAL_TRIP_BIT = 0, 1
FMCR_BIT, RMCR_BIT, DRIVE_OK_BIT = 0, 1, 2
_OUTPUTS = Registers(1, outputs=range(1))
_DRIVE = Registers(2, outputs=range(1, 2))
_INPUTS = Registers(4, outputs=range(2, 4), interrupts=(Interrupt(status=2, period=3, inputs=range(2)),))

DIGITAL_IO = IoKind(
    "digital I/O",
    "digital_io",
    {
        "57C402": IoModel("digital output module", _OUTPUTS),
        "57C403": IoModel("digital output module", _OUTPUTS),
        DRIVE_MODEL: IoModel("drive digital I/O module", _DRIVE),
        "57C419": IoModel("32-channel digital input module", _INPUTS),
    },
)
