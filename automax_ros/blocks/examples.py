"""Examples of the control blocks for the documentation: inputs scan by scan; the outputs are computed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Access
from automax_ros.blocks.declare.instance import Instance
from automax_ros.core.ticks import DEFAULT_TICK_NS, UDC_TICK_NS
from automax_ros.core.types import Value

Column = Sequence[Value]


@dataclass(frozen=True)
class Example:
    """Some scans of one block, at 4 ticks of the default tick, or at 20 of a UDC's for a block of the UDC alone.

    ``fixed`` are constant inputs, ``varied`` those that change from scan to scan, all of one length; ``fixed`` tables
    are tuples. ``shown`` are the outputs in the table. ``every`` shows only one in that many scans. ``shift`` are the
    inputs of the SHIFT block that runs before a READ or WRITE block in each scan.
    """

    block: str
    about: str
    varied: Mapping[str, Column]
    fixed: Mapping[str, Value | tuple[int, ...]] = field(default_factory=dict)
    shown: tuple[str, ...] = ("OUTPUT",)
    every: int = 1
    shift: Mapping[str, Column] = field(default_factory=dict)

    @property
    def scans(self) -> int:
        """Number of scans."""
        return len(next(iter(self.varied.values())))


def table_of(example: Example) -> list[list[str]]:
    """Run an example and return its table: a header of names, then one row per scan."""
    shift_names = [f"SHIFT: {name}" for name in example.shift]
    rows = [["scan", *shift_names, *example.varied, *example.shown]]
    instance, maker = _instances(example)
    for scan in range(example.scans):
        moved = {name: column[scan] for name, column in example.shift.items()}
        if maker is not None:
            maker.scan(**{name.lower(): value for name, value in moved.items()})
        given = {name: column[scan] for name, column in example.varied.items()}
        tables = {name.lower(): value for name, value in example.fixed.items() if isinstance(value, tuple)}
        outputs = instance.scan(**{name.lower(): value for name, value in given.items()}, **tables)
        if (scan + 1) % example.every == 0 or scan == 0:
            values = [*moved.values(), *given.values(), *(outputs[name.lower()] for name in example.shown)]
            rows.append([str(scan + 1), *(_text(value) for value in values)])
    return rows


def _instances(example: Example) -> tuple[Instance, Instance | None]:
    block = CATALOGUE[example.block]
    period_ns = 20 * UDC_TICK_NS if block.times.model_7010 is None else 4 * DEFAULT_TICK_NS
    fixed = {name.lower(): value for name, value in example.fixed.items() if not isinstance(value, tuple)}
    if block.structure is not Access.USES:
        return Instance(block, period_ns, **fixed), None
    columns = fixed.pop("max_columns")
    maker = Instance(CATALOGUE[f"SHIFT_{example.block.partition('_')[2]}"], period_ns, max_columns=columns)
    return Instance(block, period_ns, maker, **fixed), maker


def _text(value: Value) -> str:
    return str(value).upper() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)


def _steps(*pairs: tuple[Value, int]) -> Column:
    """Return values that each stay for a number of scans."""
    return tuple(value for value, scans in pairs for _ in range(scans))


def _wave(amplitude: int, scans_a_period: int, scans: int) -> Column:
    """Return a wave whose peaks are at whole periods from its start."""
    angles = (2.0 * math.pi * (scan + 1) / scans_a_period for scan in range(scans))
    return tuple(round(amplitude * math.cos(angle)) for angle in angles)


T, F = True, False
EXAMPLES: tuple[Example, ...] = (
    Example("ABSOLUTE_VALUE", "The magnitude.", {"INPUT": (1200, -1200, 0, -32768)}),
    Example(
        "AMPLIFIER",
        "Two signals with gains of 0.5 and -1.",
        {"INPUT1": (1000, 2000, 3000, 32767), "INPUT2": (0, 500, 4000, -32768)},
        {"GAIN1": 5000, "GAIN2": -10000},
    ),
    Example("DIFFERENCE", "", {"INPUT1": (10, 10, 32767), "INPUT2": (3, -3, -1)}),
    Example("INVERTER", "", {"INPUT": (5, 5, -32768), "ENABLE": (T, F, T)}),
    Example(
        "MULTIPLY_DIVIDE",
        "A speed times a draw of 1050 / 1000; the quotient truncates; a division by zero gives the clamp.",
        {"INPUT1": (1001, -1001, 1001), "INPUT3": (1000, 1000, 0)},
        {"INPUT2": 1050},
    ),
    Example(
        "SELECT", "", {"INPUT1": (100, 100, 100), "SELECT1": (F, T, T), "INPUT2": (20, 20, 20), "SELECT2": (F, F, T)}
    ),
    Example("SUMMER", "", {"INPUT1": (10, -10, 32767), "INPUT2": (3, 3, 1)}),
    Example(
        "LIMIT",
        "",
        {"INPUT": (0, 1500, 1000, -1500)},
        {"LIMIT_PLUS": 1000, "LIMIT_MINUS": -1000},
        shown=("SATURATED_PLUS", "OUTPUT", "SATURATED_MINUS"),
    ),
    Example("MOVE", "", {"ENABLE": (T, F, T), "INPUT1": (7, 8, 9)}, shown=("OUTPUT1",)),
    Example(
        "SCALE",
        "4 to 20 mA, which a 57C409 reads as 819 to 4095 counts, to 0 to 10000 counts (28.2).",
        {"INPUT": (819, 2457, 4095, 500)},
        {"INPUT_MAX": 4095, "INPUT_MIN": 819, "OUTPUT_IMAX": 10000, "OUTPUT_IMIN": 0},
    ),
    Example("SWITCH", "", {"SELECT": (T, F), "INPUT1": (1, 1), "INPUT2": (2, 2)}),
    Example(
        "ALARM",
        "",
        {"INPUT": (50, 90, 99, 100)},
        {"HIGH_LIMIT": 90, "HIGH_HIGH_LIMIT": 100},
        shown=("ALARM_HIGH", "ALARM_HIGH_HIGH"),
    ),
    Example(
        "COMPARE", "", {"INPUT1": (5, 5, 5), "INPUT2": (4, 5, 6)}, shown=("OUTPUT_GTR", "OUTPUT_EQU", "OUTPUT_LES")
    ),
    Example("AND", "", {"INPUT1": (F, T, T), "INPUT2": (T, F, T)}),
    Example("LATCH", "RESET is stronger than SET.", {"SET": (T, F, T, F), "RESET": (F, F, T, F)}),
    Example("OR", "", {"INPUT1": (F, T, F), "INPUT2": (F, F, T)}),
    Example("TRANSITION", "", {"INPUT": (F, T, T, F, T)}),
    Example("BIT_SELECT", "", {"INPUT": (10, 11, 12, 13)}, {"OFFSET": 10}, shown=("OUTPUT0", "OUTPUT1", "OUTPUT2")),
    Example("PACK_BITS", "", {"INPUT0": (T, F, T), "INPUT3": (F, T, T), "INPUT15": (F, F, T)}),
    Example("UNPACK_BITS", "", {"INPUT": (1, 8, -32759)}, shown=("OUTPUT0", "OUTPUT3", "OUTPUT15")),
    Example("COUNTER", "", {"INPUT_PLUS": (5, 5, 0, 0), "INPUT_MINUS": (0, 0, 3, 0), "RESET": (F, F, F, T)}),
    Example(
        "PULSE_MULT",
        "A 12-bit resolver rolls over; a quarter of each count is passed on, and none is lost.",
        {"INPUT": (2040, 2045, -2046, -2041, -2036)},
        {"WORD_SIZE": 12, "MULTIPLIER": 8192},
    ),
    Example(
        "RAMP",
        "The absolute-value ramp decelerates toward zero, stops there for a scan, and accelerates away from it.",
        {"INPUT": _steps((700, 2), (-500, 7))},
        {"ACCEL_RATE": 400, "DECEL_RATE": 300},
        shown=("OUTPUT", "RATE"),
    ),
    Example(
        "S_CURVE",
        "The rate grows by the jerk rate up to ACCEL_RATE and comes down again before INPUT is reached.",
        {"INPUT": _steps((1000, 15))},
        {"ACCEL_RATE": 120, "JERK_RATE": 30},
        shown=("OUTPUT", "RATE"),
    ),
    Example(
        "FUNCTION",
        "A table of five points over 0 to 4095: a square, folded into the third quadrant.",
        {"INPUT": (0, 512, 1024, 2048, 3072, 4095, -2048)},
        {"MAX_INPUT": 4095, "TABLE1": (0, 256, 1024, 2304, 4096)},
    ),
    Example(
        "SEARCH",
        "Example 1 of section 29: the first element that INPUT is greater than.",
        {"INPUT": (15, 35, 45, 5)},
        {"COMPARE_GTR": True, "TABLE1": (40, 30, 20, 10)},
        shown=("FOUND", "OUTPUT"),
    ),
    Example(
        "RUNNING_AVERAGE",
        "",
        {"INPUT": (400, 400, 400, 400, 800, 0)},
        {"REQUIRED_SAMPLES": 4},
        shown=("DATA_VALID", "MAX_VALUE", "MIN_VALUE", "OUTPUT"),
    ),
    Example(
        "SAMPLED_AVERAGE",
        "",
        {"INPUT": (10, 20, 60, 1, 2, 3)},
        {"REQUIRED_SAMPLES": 3},
        shown=("DATA_VALID", "MAX_VALUE", "MIN_VALUE", "OUTPUT"),
    ),
    Example(
        "READ_BITS",
        "",
        {"COLUMN": (0, 1, 1, 3)},
        {"ENABLE": True, "MAX_COLUMNS": 3},
        shown=("ERROR", "OUTPUT1"),
        shift={"SHIFT": (T, T, T, F), "INPUT1": (T, F, F, F)},
    ),
    Example(
        "READ_WORDS",
        "Column 1 holds what came in one shift ago; column 3 does not exist.",
        {"COLUMN": (0, 1, 1, 3)},
        {"ENABLE": True, "MAX_COLUMNS": 3},
        shown=("ERROR", "OUTPUT1"),
        shift={"SHIFT": (T, T, T, F), "INPUT1": (11, 22, 33, 44)},
    ),
    Example(
        "SHIFT_BITS",
        "What enters on one shift leaves two shifts later.",
        {"SHIFT": (T, T, T, F, T), "INPUT1": (T, F, F, F, F)},
        {"MAX_COLUMNS": 3},
        shown=("DATA_VALID", "OUTPUT1"),
    ),
    Example(
        "SHIFT_WORDS",
        "What enters on one shift leaves two shifts later.",
        {"SHIFT": (T, T, T, F, T), "INPUT1": (11, 22, 33, 44, 55)},
        {"MAX_COLUMNS": 3},
        shown=("DATA_VALID", "OUTPUT1"),
    ),
    Example(
        "WRITE_BITS",
        "Column 1 is not loaded before the second shift.",
        {"COLUMN": (1, 1, 3), "INPUT1": (T, T, T)},
        {"ENABLE": True, "MAX_COLUMNS": 3},
        shown=("ERROR",),
        shift={"SHIFT": (T, T, T), "INPUT1": (F, F, F)},
    ),
    Example(
        "WRITE_WORDS",
        "Column 1 is not loaded before the second shift.",
        {"COLUMN": (1, 1, 3), "INPUT1": (99, 99, 99)},
        {"ENABLE": True, "MAX_COLUMNS": 3},
        shown=("ERROR",),
        shift={"SHIFT": (T, T, T), "INPUT1": (11, 22, 33)},
    ),
    Example(
        "DIFF_LAG",
        "A step: OUTPUT jumps and decays with 10 rad/s; every 5th scan is shown, 0.11 s apart.",
        {"INPUT": _steps((1000, 30))},
        {"WLG": 10.0},
        every=5,
    ),
    Example(
        "HIGH_PASS_FILTER",
        "A step through second order at 10 rad/s; every 10th scan is shown, 0.1 s apart.",
        {"INPUT": _steps((1000, 60))},
        {"WLD": 10.0, "ORDER": 2},
        every=10,
    ),
    Example(
        "INTEGRATE",
        "1200 counts/s from an INPUT of 2000 (42.3); every 10th scan is shown, 0.22 s apart.",
        {"INPUT": _steps((2000, 50))},
        {"KI": 0.59507},
        every=10,
    ),
    Example(
        "LAG",
        "A step through a lag of 10 rad/s; every 5th scan is shown, 0.11 s apart.",
        {"INPUT": _steps((1000, 30))},
        {"WLG": 10.0},
        every=5,
    ),
    Example(
        "LEAD_LAG",
        "A step: OUTPUT jumps to nearly WLG / WLD = 4 times INPUT and settles on it; every 10th scan is shown.",
        {"INPUT": _steps((1000, 60))},
        {"WLD": 2.5, "WLG": 10.0},
        every=10,
    ),
    Example(
        "LOW_PASS_FILTER",
        "A step through third order at 20 rad/s; every 10th scan is shown, 0.1 s apart.",
        {"INPUT": _steps((1000, 60))},
        {"WLG": 20.0, "ORDER": 3},
        every=10,
    ),
    Example(
        "NOTCH",
        "A sine of 20 scans a period at the notch frequency dies out; every 3rd peak is shown.",
        {"INPUT": _wave(1000, 20, 300)},
        {"WN": 14.27997, "Q_FACTOR": 2.0},
        every=60,
    ),
    Example(
        "NOTCHN",
        "A sine of 20 scans a period at the notch frequency dies out; every 3rd peak is shown.",
        {"INPUT": _wave(1000, 20, 300)},
        {"WN": 31.41593, "Q_FACTOR": 2.0, "ORDER": 4},
        every=60,
    ),
    Example(
        "PID",
        "A constant error of 10: OUTPUT starts at KP x 10 and gains KI x 10 a second; every 25th scan, 0.55 s.",
        {"INPUT": _steps((1010, 100)), "FEEDBACK": _steps((1000, 100))},
        {"KP": 2.0, "KI": 1.0, "LOOP_TIME": 0.022},
        shown=("ERROR", "OUTPUT"),
        every=25,
    ),
    Example(
        "PROP_INT",
        "A step into a controller with a gain of 2 and a lead of 1 rad/s; every 10th scan is shown, 0.22 s apart.",
        {"INPUT": _steps((100, 50))},
        {"KP": 2.0, "WLD": 1.0},
        every=10,
    ),
    Example(
        "TACHLOSS_OVERSPEED",
        "",
        {"SPEED_FDBK": (4095, 4600, 0, 2000), "ARM_VOLTAGE_FDBK": (3000, 3000, 2000, 0)},
        shown=("SPEED_FAULT", "OVERSPEED", "TACH_LOSS", "ARM_VFB_LOSS"),
    ),
    Example(
        "THERMAL_OVERLOAD",
        "150 % of current from cold, at LIM_BAR 150 and a trip time of 10 s; every 500th scan is shown, 5 s apart.",
        {"I_FDBK": _steps((4095, 3500))},
        {"TRIP_TIME": 10},
        shown=("CALC_RISE", "OVERLOAD"),
        every=500,
    ),
)
"""An example of each block that a task can call, except SCAN_LOOP, in the order of the families."""
