"""The catalogue of control blocks: all blocks by name, and their families in the order of the documentation."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.blocks.analog.arithmetic import ABSOLUTE_VALUE, DIFFERENCE, INVERTER, MULTIPLY_DIVIDE, SUMMER
from automax_ros.blocks.analog.averages import RUNNING_AVERAGE, SAMPLED_AVERAGE
from automax_ros.blocks.analog.mixing import AMPLIFIER, SELECT
from automax_ros.blocks.analog.ramp import RAMP
from automax_ros.blocks.analog.s_curve import S_CURVE
from automax_ros.blocks.analog.selection import LIMIT, MOVE, SCALE, SWITCH
from automax_ros.blocks.cml import DC_DRIVE_CML
from automax_ros.blocks.declare.declaration import Block
from automax_ros.blocks.discrete.bits import BIT_SELECT, PACK_BITS, UNPACK_BITS
from automax_ros.blocks.discrete.columns import READ_BITS, READ_WORDS, WRITE_BITS, WRITE_WORDS
from automax_ros.blocks.discrete.comparison import ALARM, COMPARE
from automax_ros.blocks.discrete.logic import AND, LATCH, OR, TRANSITION
from automax_ros.blocks.discrete.pulse import COUNTER, PULSE_MULT
from automax_ros.blocks.discrete.shift import SHIFT_BITS, SHIFT_WORDS
from automax_ros.blocks.discrete.tables import FUNCTION, SEARCH
from automax_ros.blocks.dynamic.filters import DIFF_LAG, LAG, LEAD_LAG
from automax_ros.blocks.dynamic.integrators import INTEGRATE, PROP_INT
from automax_ros.blocks.dynamic.notches import NOTCH, NOTCHN
from automax_ros.blocks.dynamic.pass_filters import HIGH_PASS_FILTER, LOW_PASS_FILTER
from automax_ros.blocks.dynamic.pid import PID
from automax_ros.blocks.dynamic.protection import TACHLOSS_OVERSPEED, THERMAL_OVERLOAD
from automax_ros.blocks.scan_loop import SCAN_LOOP


@dataclass(frozen=True)
class Family:
    """Blocks that belong together; ``name`` is the documentation's file name, ``about`` a sentence or two."""

    name: str
    title: str
    about: str
    blocks: tuple[Block, ...]


FAMILIES: tuple[Family, ...] = (
    Family(
        "scan",
        "The scan",
        "Every task but that of a drive begins its scan with SCAN_LOOP, and each ends it with END.",
        (SCAN_LOOP,),
    ),
    Family(
        "arithmetic",
        "Arithmetic",
        "Whole numbers of 16 bits; sums and products are made in 32 bits, quotients truncate toward zero.",
        (ABSOLUTE_VALUE, AMPLIFIER, DIFFERENCE, INVERTER, MULTIPLY_DIVIDE, SELECT, SUMMER),
    ),
    Family("selection", "Selection and scaling", "What passes of a signal, and how.", (LIMIT, MOVE, SCALE, SWITCH)),
    Family("comparison", "Comparison", "Booleans from numbers.", (ALARM, COMPARE)),
    Family("logic", "Logic", "Booleans from booleans.", (AND, LATCH, OR, TRANSITION)),
    Family("bits", "Bits", "Sixteen booleans and the number they make.", (BIT_SELECT, PACK_BITS, UNPACK_BITS)),
    Family("counting", "Counting", "Pulses and counts, none of which is lost.", (COUNTER, PULSE_MULT)),
    Family("ramps", "Ramps", "Signals that move at a limited rate.", (RAMP, S_CURVE)),
    Family("tables", "Tables", "Arrays that a block looks up.", (FUNCTION, SEARCH)),
    Family("averages", "Averages", "Means of samples, with their extremes.", (RUNNING_AVERAGE, SAMPLED_AVERAGE)),
    Family(
        "data_structures",
        "Data structures",
        "Columns of up to eight channels. A SHIFT block makes a data structure and moves it; READ and WRITE blocks of"
        " the task reach single columns.",
        (READ_BITS, READ_WORDS, SHIFT_BITS, SHIFT_WORDS, WRITE_BITS, WRITE_WORDS),
    ),
    Family(
        "filters",
        "Filters and controllers",
        "Laplace functions, whose coefficients depend on the scan period.",
        (DIFF_LAG, HIGH_PASS_FILTER, INTEGRATE, LAG, LEAD_LAG, LOW_PASS_FILTER, NOTCH, NOTCHN, PID, PROP_INT),
    ),
    Family(
        "drive",
        "The current loop of a drive",
        "One block is a task of its own: it fires the bridge of a DC motor at the interrupts of a 57C406.",
        (DC_DRIVE_CML,),
    ),
    Family("protection", "Protection of a drive", "For UDC tasks.", (TACHLOSS_OVERSPEED, THERMAL_OVERLOAD)),
)
"""All families; every block belongs to one."""


CATALOGUE: dict[str, Block] = {
    block.name: block
    for block in sorted((block for family in FAMILIES for block in family.blocks), key=lambda block: block.name)
}
"""Every control block, in alphabetical order."""
