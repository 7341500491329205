"""FUNCTION and SEARCH: blocks that read a table (sections 13 and 29)."""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.blocks.declare.declaration import Block, BlockTimes, Form, Input, Output, Special, Time
from automax_ros.blocks.declare.rules import MostElements, Needs, NumberTrue, SameSize, TableOfPowers
from automax_ros.core.numbers import INT16_MAX
from automax_ros.core.types import DataType

MAX_INPUTS = tuple(2**n - 1 for n in range(1, 16))
"""The values that MAX_INPUT may have (13)."""
MOST_SEARCHED = INT16_MAX + 1
"""Most elements of SEARCH's table (decision): OUTPUT, an INTEGER, must be able to name the last one."""


def function_step(
    input: int, max_input: int, select: bool, table1: Sequence[int], table2: Sequence[int], elements: int
) -> tuple[int]:
    """Interpolate between the two points around |INPUT|, and give the result INPUT's sign (13).

    |INPUT| is clamped to MAX_INPUT; the share of the upper point truncates toward zero; the clamp of a result of 32768
    is not logged (decisions).
    """
    magnitude = input if input >= 0 else -input
    if magnitude > max_input:
        magnitude = max_input
    product = magnitude * (elements - 1)
    subscript = product // (max_input + 1)
    remainder = product - subscript * (max_input + 1)
    lower = table2[subscript] if select else table1[subscript]
    upper = table2[subscript + 1] if select else table1[subscript + 1]
    share = (upper - lower) * remainder
    output = lower + share // (max_input + 1) if share >= 0 else lower - -share // (max_input + 1)
    if input < 0:
        output = -output
        if output > INT16_MAX:
            output = INT16_MAX
    return (output,)


FUNCTION = Block(
    name="FUNCTION",
    section="13",
    title="Function generator",
    function="OUTPUT = TABLE(s) + (TABLE(s + 1) - TABLE(s)) * r, with s.r = |INPUT| * (size - 1) / (MAX_INPUT + 1)",
    inputs=(
        Input.integer("INPUT", "I", "signal input", form=Form.VARIABLE),
        Input.integer(
            "MAX_INPUT",
            "MI",
            "the largest magnitude of INPUT, 2**n - 1 with n from 1 to 15",
            form=Form.LITERAL,
            one_of=MAX_INPUTS,
            sample=4095,
        ),
        Input.boolean("SELECT", "SE", "FALSE selects TABLE1, TRUE selects TABLE2", default=False),
        Input("TABLE1", Special.TABLE, "T1", "look-up table 1, of 2**m + 1 elements", required=True),
        Input("TABLE2", Special.TABLE, "T2", "look-up table 2, as large as table 1"),
    ),
    outputs=(Output("OUTPUT", DataType.INTEGER, "O", "interpolated between two points of the table, INPUT's sign"),),
    rules=(
        TableOfPowers("TABLE1", "MAX_INPUT"),
        SameSize("TABLE1", "TABLE2"),
        Needs("SELECT", "TABLE2"),
        Needs("TABLE2", "SELECT", "AMX4094"),
    ),
    times=BlockTimes(Time(23.56), Time(93.0), Time(20.30), Time(16.48)),
    notes=(
        "LOCAL T%(16) has 17 elements, from T%(0) to T%(16): 2**4 + 1.",
        "A negative INPUT gives the negated result: the function is folded into the third quadrant.",
        "The table is read in the present state of memory, not as latched.",
    ),
    step=function_step,
)


def search_step(
    compare_gtr: bool,
    compare_equ: bool,
    compare_les: bool,
    input: int,
    select: bool,
    table1: Sequence[int],
    table2: Sequence[int],
    elements: int,
) -> tuple[bool, int]:
    """Find the first element that INPUT is greater than, equal to or less than, as requested; -1 without one (29).

    The comparison is known when the task is compiled: two joined by OR are one (``>=``, ``<=``, ``!=``).
    """
    index = 0
    if select:
        while index < elements and not (
            (
                input >= table2[index]
                if compare_equ
                else input != table2[index]
                if compare_les
                else input > table2[index]
            )
            if compare_gtr
            else (input <= table2[index] if compare_les else input == table2[index])
            if compare_equ
            else input < table2[index]
        ):
            index = index + 1
    else:
        while index < elements and not (
            (
                input >= table1[index]
                if compare_equ
                else input != table1[index]
                if compare_les
                else input > table1[index]
            )
            if compare_gtr
            else (input <= table1[index] if compare_les else input == table1[index])
            if compare_equ
            else input < table1[index]
        ):
            index = index + 1
    found = index < elements
    output = index if index < elements else -1
    return found, output


SEARCH = Block(
    name="SEARCH",
    section="29",
    title="Search",
    function="OUTPUT = index of the first element of the table that INPUT matches, -1 if none",
    inputs=(
        Input.boolean(
            "COMPARE_GTR", "GT", "TRUE looks for INPUT > element", default=False, form=Form.LITERAL, sample=True
        ),
        Input.boolean("COMPARE_EQU", "EQ", "TRUE looks for INPUT = element", default=False, form=Form.LITERAL),
        Input.boolean("COMPARE_LES", "LT", "TRUE looks for INPUT < element", default=False, form=Form.LITERAL),
        Input.integer("INPUT", "I", "data input", form=Form.VARIABLE),
        Input.boolean("SELECT", "SE", "FALSE searches TABLE1, TRUE searches TABLE2", default=False),
        Input("TABLE1", Special.TABLE, "T1", "search table 1", required=True),
        Input("TABLE2", Special.TABLE, "T2", "search table 2, as large as table 1"),
    ),
    outputs=(
        Output("FOUND", DataType.BOOLEAN, "F", "TRUE if an element matched", required=False),
        Output("OUTPUT", DataType.INTEGER, "O", "index of the first element that matched, -1 without one"),
    ),
    rules=(
        NumberTrue(("COMPARE_GTR", "COMPARE_EQU", "COMPARE_LES"), 1, 2),
        MostElements("TABLE1", MOST_SEARCHED),
        SameSize("TABLE1", "TABLE2"),
        Needs("SELECT", "TABLE2"),
        Needs("TABLE2", "SELECT"),
    ),
    # Table 5 omits SEARCH: the UDC's time is ours, in the ratio of its other blocks to the 7010's (decision)
    times=BlockTimes(Time(19.80, m=0.68), Time(74.0, m=3.0), Time(15.84, m=0.544), Time(13.88, m=0.48)),
    notes=(
        "Two comparisons that are TRUE are joined by OR: greater than or equal to, for example.",
        "With COMPARE_GTR sort the table in descending order, with COMPARE_LES in ascending order.",
        "The table is read in the present state of memory, not as latched. The UDC's time is an estimate.",
    ),
    step=search_step,
    searched_to="OUTPUT",
)
