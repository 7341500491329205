"""DC_DRIVE_CML: the current minor loop of a DC drive (section 52).

Declares the parameters in the order of the manual's CALL, the limits of the inputs (table 1 and 52.1), and the rules
over several parameters (52.1). The loop itself is in ``drive/current_loop``.

The CALL latches the simple commons of its task as SCAN_LOOP does, and a scan goes from it to END (decision). KP is
microseconds of DELTA per count of error (decision). No dynamic block stands in the task (decision).

Both ends of a limit are allowed; one that depends on the line's frequency is a function of it. The checker compares
literals with the limits, the loop the values of variables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, floor
from typing import Any

from automax_ros.blocks.declare.coefficients import is_within
from automax_ros.blocks.declare.declaration import (
    Block,
    Fault,
    Form,
    Given,
    Input,
    LineScan,
    Output,
    Platform,
    Rule,
    Times,
)
from automax_ros.blocks.declare.rules import Needs
from automax_ros.core.ticks import DEFAULT_TICK_NS
from automax_ros.core.types import DataType

LIMITS: dict[str, tuple[float, float]] = {
    "IO_CNTL_SLOT": (0, 15),
    "DIG_IO_SLOT": (0, 15),
    "AC_LINE_FREQ": (48, 62),
    "KP": (0.0, 4.0),
    "PI_W_LEAD": (10.0, 500.0),
    "AG_FACTOR": (1, 300),
    "CC_THRESH": (0, 32767),
    "MAX_M_DROPOUT": (0.1, 1.0),
    "TEST_ALPHA": (0, 180),
    "IOC_THRESH": (100, 400),
    "LIM_BAR": (100, 400),
    "OSV_THRESH": (0, 32767),
}
"""Lowest and highest value of each input with limits that do not depend on the line."""

FULL_COUNTS = 4095
"""Counts of LIM_BAR."""
MOST_COUNTS = 32767
"""Largest rate limit, counts per scan."""
SCANS_PER_CYCLE = 6
LOWEST_LAG = 1.0
"""Lowest REF_LAG, rad/s."""
LAG_AT_50_HZ, LAG_AT_60_HZ = 400.0, 500.0
"""Highest REF_LAG on a 50 Hz line and on a 60 Hz line, rad/s."""
BETWEEN_HZ = 55.0
"""A line of this frequency or more counts as one of 60 Hz, else of 50 Hz, for REF_LAG (decision)."""


LINE_HZ = 60
"""AC_LINE_FREQ by default, Hz."""


def limits_at(name: str, line_hz: float) -> tuple[float, float]:
    """Return the lowest and highest value of an input at a line frequency in Hz; REF_RATE may also be 0.0."""
    if name == "REF_RATE":
        return ref_rate_limits(line_hz)
    return ref_lag_limits(line_hz) if name == "REF_LAG" else LIMITS[name]


def is_good(name: str, value: float, line_hz: float) -> bool:
    """Return whether a value is within an input's limits at a line frequency in Hz, to the precision of a REAL."""
    return (name == "REF_RATE" and value == 0.0) or is_within(value, *limits_at(name, line_hz))


def ref_rate_limits(line_hz: float) -> tuple[float, float]:
    """Return the lowest and highest REF_RATE in s at a line frequency, apart from 0.0, which turns the limit off.

    They are those of a rate of 32767 and of 1 count per scan, rounded inward as table 1 prints them: 0.00035 to 11.37 s
    at 60 Hz, 0.00042 to 13.65 s at 50 Hz (decision: to five and two decimals at any frequency).
    """
    one_count_s = FULL_COUNTS / (SCANS_PER_CYCLE * line_hz)
    return ceil(one_count_s / MOST_COUNTS * 1e5) / 1e5, floor(one_count_s * 100.0 + 1e-9) / 100.0


def ref_lag_limits(line_hz: float) -> tuple[float, float]:
    """Return the lowest and highest REF_LAG in rad/s at a line frequency (table 1)."""
    return LOWEST_LAG, LAG_AT_60_HZ if line_hz >= BETWEEN_HZ else LAG_AT_50_HZ


def ioc_is_possible(ioc_thresh: int, lim_bar: int) -> bool:
    """Return whether an IOC level can be calculated: IOC_THRESH less than 1.8 LIM_BAR (52.1.5)."""
    return 5 * ioc_thresh < 9 * lim_bar


@dataclass(frozen=True)
class Advised(Rule):
    """A parameter without which the manual warns of a CALL; ``without`` says what the CALL then lacks."""

    parameter: str
    without: str
    code: str
    sentence = "In a speed regulator {rule.parameter} must be programmed: without it there is {rule.without} (52.1.5)."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the warning of a CALL without the parameter."""
        if self.parameter in given:
            return None
        return Fault(f"there is {self.without} without {self.parameter}", None, self.code)


@dataclass(frozen=True)
class WithinAtLine(Rule):
    """A literal's limits follow the line's frequency: the literal ``frequency`` or its default in Hz."""

    parameter: str
    frequency: str
    default_hz: int

    @property
    def text(self) -> str:
        """The rule as a sentence."""
        at = " and ".join(f"{_range(self.parameter, hz)} at {hz} Hz" for hz in (60, 50))
        return f"{self.parameter} must be {at}."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of a literal beyond its limits; none where the frequency itself is at fault."""
        value = given[self.parameter].value if self.parameter in given else None
        line_hz = given[self.frequency].value if self.frequency in given else self.default_hz
        if not isinstance(value, (int, float)) or not isinstance(line_hz, int):
            return None
        if not is_good(self.frequency, line_hz, line_hz) or is_good(self.parameter, value, line_hz):
            return None
        message = f"{self.parameter} = {value:g} is out of range: {_range(self.parameter, line_hz)} at {line_hz} Hz"
        return Fault(message, self.parameter, "AMX4080")


@dataclass(frozen=True)
class OvercurrentLevel(Rule):
    """The overcurrent level must be less than 1.8 times the largest current, both in % of the rated one (52.1.5)."""

    level: str
    largest: str
    sentence = "{rule.level} must be less than 1.8 x {rule.largest}."

    def fault(self, given: Mapping[str, Given]) -> Fault | None:
        """Return the fault of two literals that do not fit together."""
        level, largest = (given[name].value if name in given else None for name in (self.level, self.largest))
        if not isinstance(level, int) or not isinstance(largest, int) or ioc_is_possible(level, largest):
            return None
        message = f"{self.level} = {level} is not less than {9 * largest / 5:g}, which is 1.8 x {self.largest}"
        return Fault(message, self.level, "AMX4185")


def _range(name: str, line_hz: float) -> str:
    """Return the limits of an input at a line frequency as part of a sentence."""
    low, high = limits_at(name, line_hz)
    zero = "0 or " if is_good(name, 0.0, line_hz) and low > 0.0 else ""
    return f"{zero}{low:g} to {high:g}"


def _integer(name: str, text: str, default: int | None = None, **more: Any) -> Input:
    low, high = LIMITS.get(name, (None, None))
    return Input.integer(name, name, text, default, low=low, high=high, **more)


def _real(name: str, text: str, default: float | None = None) -> Input:
    low, high = LIMITS.get(name, (None, None))
    return Input.real(name, name, text, default, low=low, high=high)


def _boolean(name: str, text: str, *, default: bool | None = False, form: Form = Form.ANY) -> Input:
    return Input.boolean(name, name, text, default=default, form=form)


def _boolean_output(name: str, text: str, alias: str = "") -> Output:
    return Output(name, DataType.BOOLEAN, name, text, required=False, holds=True, alias=alias)


def _number(name: str, text: str) -> Output:
    return Output(name, DataType.INTEGER, name, text, required=False, holds=True)


INPUTS = (
    _integer("IO_CNTL_SLOT", "slot of the drive I/O controller 57C406", module="57C406", form=Form.LITERAL),
    _integer("DIG_IO_SLOT", "slot of the drive digital I/O module 57C408", module="57C408", form=Form.LITERAL),
    _integer(
        "AC_LINE_FREQ",
        "frequency of the AC line in Hz, the lowest expected one if it varies",
        LINE_HZ,
        form=Form.LITERAL,
    ),
    _integer(
        "REFERENCE",
        "current reference, 4095 counts = LIM_BAR; plus: bridge 1, minus: bridge 2; read each scan; the block does not"
        " limit it",
        form=Form.VARIABLE,
    ),
    _real("REF_RATE", "seconds from 0 to LIM_BAR that the reference takes at least, 0.0: no limit; read in run", 0.0),
    _real("REF_LAG", "break frequency of the reference's lag in rad/s; fixed", 200.0),
    _real("KP", "proportional gain, us of DELTA per count of error; read in run"),
    _real("PI_W_LEAD", "lead break frequency of the P+I in rad/s; fixed"),
    _integer("AG_FACTOR", "largest integral gain over that of continuous conduction, 1: not adaptive; fixed", 1),
    _integer("CC_THRESH", "threshold of continuous conduction of the adaptive gain", 0),
    _boolean("CML_RUN", "TRUE runs the loop, FALSE stops it; read each tick", default=None, form=Form.VARIABLE),
    _boolean("CML_COAST_STOP", "TRUE: coast stop; read in run", form=Form.VARIABLE),
    _boolean("MCR_SELECT", "FALSE: FMCR, TRUE: RMCR; read as CML_RUN rises"),
    _real("MAX_M_DROPOUT", "longest time in s from the stop to the opening of the M-contactor; fixed", 0.1),
    _boolean("CML_TEST", "TRUE: test mode, open loop at TEST_ALPHA; read in standby"),
    _boolean("TEST_BRPOL", "bridge in test mode, FALSE: 1, TRUE: 2; read in standby"),
    _integer("TEST_ALPHA", "firing angle in test mode in degrees; read in run", 180),
    _integer("IOC_THRESH", "instantaneous overcurrent in % of the rated current; fixed"),
    _integer("LIM_BAR", "largest current in % of the rated current; fixed"),
    _boolean("DIGITAL_TACH", "TRUE: digital tachometer; the hardware watches its speed; fixed", default=True),
    Input(
        "SPEED_FDBK",
        DataType.INTEGER,
        "SPEED_FDBK",
        "speed for the tach loss fault, 4095 = 100 %; cannot be forced",
        form=Form.VARIABLE,
    ),
    _boolean("TACH_LOSS_STOP", "TRUE: tach loss stops the drive, FALSE: it is shown alone; fixed", default=True),
    Input(
        "OSV_FDBK",
        DataType.INTEGER,
        "OSV_FDBK",
        "speed or voltage for the overspeed fault; cannot be forced",
        form=Form.VARIABLE,
    ),
    _integer("OSV_THRESH", "OSV_FDBK above it is overspeed or overvoltage; fixed", 0),
    _boolean("NONSTAND_PHROT", "phase rotation, FALSE: standard, C, B, A; TRUE: A, B, C"),
    _boolean("AUTO_PHROT", "TRUE: take whatever phase rotation there is; fixed"),
    _boolean("FAULT_RESET", "TRUE resets drive faults; read in standby", default=None, form=Form.VARIABLE),
)
OUTPUTS = (
    _boolean_output("DC_CML_STATE", "TRUE: run, FALSE: standby"),
    _boolean_output("SYNC_LOCKED", "TRUE while the loop keeps step with the line"),
    _number("LINE_PERIOD", "period of the line in us, 16129 to 20833"),
    _boolean_output("INSWITCH_POSA", "TRUE while the test switch of the 57C406 is in position A"),
    _boolean_output("INSWITCH_POSB", "TRUE while it is in position B"),
    _boolean_output("INFAULT_RESET", "TRUE while the fault reset switch of the 57C406 is closed", "INFALT_RESET"),
    _number("DC_TIME", "time without current since the last scan in us, 0 to 3472"),
    _boolean_output("BRIDGE_POL", "TRUE: bridge 2 is on, FALSE: bridge 1"),
    _number("REF_RATE_OUT", "reference after the rate limit"),
    _number("REF_LAG_OUT", "reference after the lag"),
    _number("FDBK_GAIN", "gain of the feedback x 1024, 512 to 1280"),
    _number("I_FDBK", "current feedback, 4095 counts = LIM_BAR"),
    _number("INTEGRAL_GAIN", "integral gain x 1024"),
    _number("DELTA", "180 degrees less the firing angle, in us, 0 to 10417"),
    _boolean_output("IOC_OUT", "fault: instantaneous overcurrent"),
    _boolean_output("SYNC_LOSS_OUT", "fault: the loop has lost the line"),
    _boolean_output("TACH_LOSS_OUT", "fault: voltage without speed"),
    _boolean_output("OSV_OUT", "fault: overspeed or overvoltage"),
    _boolean_output("EXT_IET_OUT", "fault: external instantaneous electronic trip"),
    _boolean_output("PHROT_FLT_OUT", "fault: wrong phase rotation"),
    _boolean_output("BAD_SCR_OUT", "fault: shorted SCR; programming it enables the test before each start"),
    _number("BAD_SCR_NUM", "pair of the shorted SCR, 1 to 6"),
    Output(
        "DIAG_DATA",
        DataType.INTEGER,
        "DIAG_DATA",
        "array (37,1) of the records of the scans, its name alone",
        required=False,
        holds=True,
        dimensions=(38, 2),
    ),
)

DC_DRIVE_CML = Block(
    name="DC_DRIVE_CML",
    section="52",
    title="DC drive current minor loop",
    function="Regulates the armature current of an S6R drive, sequences its contactor and watches for its faults",
    inputs=INPUTS,
    outputs=OUTPUTS,
    times=Times(None, None, None, None),
    rules=(
        WithinAtLine("REF_RATE", "AC_LINE_FREQ", LINE_HZ),
        WithinAtLine("REF_LAG", "AC_LINE_FREQ", LINE_HZ),
        OvercurrentLevel("IOC_THRESH", "LIM_BAR"),
        Advised("SPEED_FDBK", "no protection against the loss of the tachometer", "AMX4182"),
        Advised("OSV_FDBK", "no protection against overspeed", "AMX4183"),
        Needs("BAD_SCR_NUM", "BAD_SCR_OUT", "AMX4184"),
    ),
    runs_on=frozenset({Platform.AUTOMAX}),
    notes=(
        "The first block of its task, in place of SCAN_LOOP, called once; no GOTO may reach it or a line before it.",
        "Its scans begin at the interrupts of the 57C406, six in a cycle of the line.",
        "Statements before it run once, when the task is put into RUN.",
        "It latches the task's simple common variables as SCAN_LOOP does.",
        "The task may have no block with coefficients. Its Processor must have the tick of 5.5 ms.",
        "Without BAD_SCR_OUT the shorted SCR test is not made.",
        "A bad value of a variable is logged and the last good one stays; with a bad fixed one the drive never runs.",
    ),
    step=None,
    begins_scan=True,
    line_scan=LineScan("AC_LINE_FREQ", SCANS_PER_CYCLE, DEFAULT_TICK_NS),
)
