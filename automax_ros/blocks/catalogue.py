"""The catalogue: every block by its name."""

from __future__ import annotations

from automax_ros.blocks.arithmetic import DIFFERENCE, SUMMER
from automax_ros.blocks.declaration import Block
from automax_ros.blocks.filters import LAG
from automax_ros.blocks.integrators import INTEGRATE, PROP_INT
from automax_ros.blocks.logic import AND, LATCH, OR, TRANSITION
from automax_ros.blocks.pulse import PULSE_MULT
from automax_ros.blocks.ramp import RAMP
from automax_ros.blocks.scan_loop import SCAN_LOOP
from automax_ros.blocks.selection import LIMIT, SCALE, SWITCH

_BLOCKS: tuple[Block, ...] = (
    AND,
    DIFFERENCE,
    INTEGRATE,
    LAG,
    LATCH,
    LIMIT,
    OR,
    PROP_INT,
    PULSE_MULT,
    RAMP,
    SCALE,
    SCAN_LOOP,
    SUMMER,
    SWITCH,
    TRANSITION,
)

CATALOGUE: dict[str, Block] = {block.name: block for block in sorted(_BLOCKS, key=lambda block: block.name)}
"""Every control block, in alphabetical order."""

NOT_YET: frozenset[str] = frozenset(
    {
        "ABSOLUTE_VALUE",
        "ALARM",
        "AMPLIFIER",
        "BIT_SELECT",
        "COMPARE",
        "COUNTER",
        "DC_DRIVE_CML",
        "DIFF_LAG",
        "FUNCTION",
        "HIGH_PASS_FILTER",
        "INVERTER",
        "LEAD_LAG",
        "LOW_PASS_FILTER",
        "MOVE",
        "MULTIPLY_DIVIDE",
        "NOTCH",
        "NOTCHN",
        "PACK_BITS",
        "PID",
        "READ_BITS",
        "READ_WORDS",
        "RUNNING_AVERAGE",
        "SAMPLED_AVERAGE",
        "SEARCH",
        "SELECT",
        "SHIFT_BITS",
        "SHIFT_WORDS",
        "S_CURVE",
        "TACHLOSS_OVERSPEED",
        "THERMAL_OVERLOAD",
        "UNPACK_BITS",
        "WRITE_BITS",
        "WRITE_WORDS",
    }
)
"""Blocks of the manual that the emulator does not have yet."""
