"""ALARM and COMPARE: booleans from numbers (sections 6 and 10)."""

from __future__ import annotations

from automax_ros.blocks.declare.declaration import Block, BlockTimes, Form, Input, Output, Time
from automax_ros.blocks.declare.rules import AtLeast
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType


def alarm_step(
    input: int, high_limit: int, low_limit: int, high_high_limit: int, low_low_limit: int
) -> tuple[bool, bool, bool, bool]:
    """Compare INPUT with each limit; reaching it is enough (6)."""
    alarm_high = input >= high_limit
    alarm_low = input <= low_limit
    alarm_high_high = input >= high_high_limit
    alarm_low_low = input <= low_low_limit
    return alarm_high, alarm_low, alarm_high_high, alarm_low_low


ALARM = Block(
    name="ALARM",
    section="6",
    title="Alarm",
    function="Each ALARM output is TRUE while INPUT has reached or passed its limit",
    inputs=(
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
        Input.integer("HIGH_LIMIT", "HL", "high limit", INT16_MAX),
        Input.integer("LOW_LIMIT", "LL", "low limit", INT16_MIN),
        Input.integer("HIGH_HIGH_LIMIT", "HHL", "high-high limit", INT16_MAX),
        Input.integer("LOW_LOW_LIMIT", "LLL", "low-low limit", INT16_MIN),
    ),
    outputs=(
        Output("ALARM_HIGH", DataType.BOOLEAN, "AH", "INPUT >= HIGH_LIMIT", required=False),
        Output("ALARM_LOW", DataType.BOOLEAN, "AL", "INPUT <= LOW_LIMIT", required=False),
        Output("ALARM_HIGH_HIGH", DataType.BOOLEAN, "AHH", "INPUT >= HIGH_HIGH_LIMIT", required=False),
        Output("ALARM_LOW_LOW", DataType.BOOLEAN, "ALL", "INPUT <= LOW_LOW_LIMIT", required=False),
    ),
    rules=(AtLeast(1, ("ALARM_HIGH", "ALARM_LOW", "ALARM_HIGH_HIGH", "ALARM_LOW_LOW"), "outputs"),),
    times=BlockTimes(Time(11.16, n=2.48), Time(44.0, n=11.0), Time(10.10, n=1.80), Time(7.8, n=1.76)),
    notes=("With the default limits an alarm still comes at 32767 or -32768.",),
    step=alarm_step,
)


def compare_step(input1: int, input2: int) -> tuple[bool, bool, bool]:
    """Compare the inputs (10)."""
    output_gtr = input1 > input2
    output_equ = input1 == input2
    output_les = input1 < input2
    return output_gtr, output_equ, output_les


COMPARE = Block(
    name="COMPARE",
    section="10",
    title="Compare",
    function="OUTPUT_GTR, OUTPUT_EQU, OUTPUT_LES tell whether INPUT1 is greater than, equal to, less than INPUT2",
    inputs=(Input.integer("INPUT1", "I1", "data input 1"), Input.integer("INPUT2", "I2", "data input 2")),
    outputs=(
        Output("OUTPUT_GTR", DataType.BOOLEAN, "GT", "INPUT1 > INPUT2", required=False),
        Output("OUTPUT_EQU", DataType.BOOLEAN, "EQ", "INPUT1 = INPUT2", required=False),
        Output("OUTPUT_LES", DataType.BOOLEAN, "LT", "INPUT1 < INPUT2", required=False),
    ),
    rules=(AtLeast(1, ("OUTPUT_GTR", "OUTPUT_EQU", "OUTPUT_LES"), "outputs"),),
    times=BlockTimes(Time(11.24, n=1.16), Time(45.0, n=5.5), Time(7.50, n=2.25), Time(7.88, n=0.80)),
    step=compare_step,
)
