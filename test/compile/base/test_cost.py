"""Modeled times: the sum of what a scan yields is the manual's (section 53)."""

from __future__ import annotations

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Access, Block, Form, Input, Output, Platform, Special
from automax_ros.blocks.declare.rules import AtLeast, Contiguous, NumberTrue
from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.core.types import DataType
from compile.support import ESTIMATES_US, lines, scan_in_steps, task_of

BLOCKS = """10 COMMON A%, B%, C%, D!, X@, Y@
20 LOCAL Z@
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SUMMER(INPUT1=A%, INPUT2=B%, OUTPUT=C%)
50 ! A REMARK
60 REM ANOTHER
70 CALL AND(INPUT1=X@, INPUT2=Y@, INPUT3=Z@, OUTPUT=Z@)
80 CALL LAG(INPUT=C%, WLG=2.0, OUTPUT=C%)
90 END
"""


def times(model: Model, text: str, target: Platform = Platform.AUTOMAX) -> list[int]:
    task, _ = task_of(text, cost_model=CostModel(model), target=target)
    task.run()
    return scan_in_steps(task, 0)


@pytest.mark.parametrize(
    ("model", "microseconds"),
    [
        # tables 4 to 6: 6 commons latched, of them 3 INTEGER, 2 BOOLEAN, 1 DOUBLE INTEGER; AND has 4 parameters
        (
            Model.MODEL_7010,
            (80.00 + 6 * 1.6 + 3 * 2.5 + 2 * 3.8 + 4.1)
            + 11.28
            + 9.88
            + (10.80 + 3 * 1.88)
            + 26.52
            + (13.82 + 6 * 2.0 + 3 * 1.6 + 2 * 2.2 + 2.5),
        ),
        (
            Model.MODEL_6010,
            (326.0 + 6 * 2.4 + 3 * 4.4 + 2 * 6.8 + 7.2)
            + 44.0
            + 40.0
            + (41.0 + 3 * 8.3)
            + 118.0
            + (60.0 + 6 * 3.2 + 3 * 2.8 + 2 * 4.3 + 4.9),
        ),
        (Model.NONE, 0.0),
    ],
)
def test_a_scan_of_blocks_takes_the_manuals_time(model, microseconds):
    assert sum(times(model, BLOCKS)) == pytest.approx(microseconds * 1000, abs=1)


def test_6011_has_the_times_of_6010():
    assert times(Model.MODEL_6011, BLOCKS) == times(Model.MODEL_6010, BLOCKS)


VARIABLES = {DataType.INTEGER: "A%", DataType.DOUBLE: "D!", DataType.BOOLEAN: "X@", DataType.REAL: "R"}


def value_of(item) -> str:
    """What a parameter is given: a variable where it may be one."""
    if item.type is Special.TABLE:
        return "T%"
    if isinstance(item.type, Special):
        return f"QUEUE{item.type.element.value}"
    if getattr(item, "form", None) is Form.LITERAL and item.type is DataType.REAL:
        return "0.022"
    if getattr(item, "form", None) is Form.LITERAL:
        return str(item.sample or item.default or 3).upper()
    return VARIABLES[item.type]


def call_of(block: Block) -> tuple[str, list[str]]:
    """A CALL with two channels where the block has channels, and the names of what it programs."""
    names = [item.name for item in block.parameters if item.required]
    for rule in block.rules:
        if isinstance(rule, AtLeast):
            names += [name for name in rule.group[:2] if name not in names]
        elif isinstance(rule, Contiguous):
            names += [f"{stem}2" for stem in rule.stems]
        elif isinstance(rule, NumberTrue):
            names.append(rule.group[0])
    parameters = ", ".join(f"{name}={value_of(block.parameter(name))}" for name in names)
    return f"CALL {block.name}({parameters})", names


@pytest.mark.parametrize("block", [block for block in CATALOGUE.values() if block.step], ids=lambda block: block.name)
def test_every_block_takes_its_printed_time(block):
    """The same task with and without the block differs by its time."""
    on_udc = Platform.AUTOMAX not in block.runs_on
    model, target = (Model.UDC, Platform.UDC) if on_udc else (Model.MODEL_7010, Platform.AUTOMAX)
    printed = block.times.udc if on_udc else block.times.model_7010
    head = "10 LOCAL A%, D!, X@, R, T%(16)\n20 CALL SCAN_LOOP(TICKS=4)\n"
    if block.structure is Access.USES:
        head += f"30 {call_of(CATALOGUE['SHIFT_' + block.name.partition('_')[2]])[0]}\n"
    call, names = call_of(block)
    given = [block.parameter(name) for name in names]
    outputs = sum(isinstance(item, Output) for item in given)
    channels = sum(isinstance(item, Input) and item.name[-1].isdigit() for item in given)
    pairs = sum(isinstance(item, Input) and item.name.startswith("INPUT") for item in given)
    expected = printed.base + printed.n * outputs + printed.j * channels + (printed.k + printed.p) * pairs
    order = block.parameter("ORDER")
    expected += printed.m * 17 + printed.o * (order.default if order else 0)
    without = sum(times(model, f"{head}90 END\n", target))
    assert sum(times(model, f"{head}40 {call}\n90 END\n", target)) - without == pytest.approx(expected * 1000, abs=1)


def test_a_filter_takes_longer_the_higher_its_order():
    """Table 5: NOTCHN takes 64.25 + o(20.00)."""
    call = "CALL NOTCHN(INPUT=A%, Q_FACTOR=1.0, WN=50.0, ORDER={}, OUTPUT=A%)"
    text = f"10 LOCAL A%\n20 CALL SCAN_LOOP(TICKS=4)\n30 {call}\n40 END\n"
    second, fourth = (sum(times(Model.UDC, text.format(order), Platform.UDC)) for order in (2, 4))
    assert fourth - second == pytest.approx(40_000, abs=1)


def test_cost_is_yielded_before_each_access_to_actual_memory():
    """Latch, read of KA%, write of KB%, commit: four steps, the block's time before the commit."""
    text = """10 COMMON KA%, KB%, KC%
20 CALL SCAN_LOOP(TICKS=4)
30 KB% = KA%
40 CALL SUMMER(INPUT1=KA%, INPUT2=1, OUTPUT=KC%)
50 END
"""
    scan_loop, end = 80.0 + 3 * (1.6 + 2.5), 13.82 + 3 * (2.0 + 1.6)
    steps = times(Model.MODEL_7010, text)
    expected = [scan_loop, ESTIMATES_US["Assignment"], 0.0, 11.28 + end]
    assert steps == [pytest.approx(value * 1000, abs=1) for value in expected]


@pytest.mark.parametrize("jump", ["", "50 IF A% > 100 THEN 20000"])
def test_only_what_is_executed_takes_time(jump):
    """In straight code and in basic blocks alike, also where a branch or a turn holds the block."""
    summer = "CALL SUMMER(INPUT1=A%, INPUT2=B%, OUTPUT=B%)"
    base = sum(times(Model.MODEL_7010, lines("A% = 3", "REM", jump or "REM", "20000 REM")))

    def extra(*statements: str) -> float:
        return (
            sum(times(Model.MODEL_7010, lines("A% = 3", "REM", jump or "REM", *statements, "20000 REM"))) - base
        ) / 1000

    condition = ESTIMATES_US["If"]
    assert extra("IF A% = 3 THEN", summer, "END_IF") == pytest.approx(condition + 11.28)
    assert extra("IF A% = 4 THEN", summer, "END_IF") == pytest.approx(condition)
    assert extra("IF A% = 4 THEN", summer, "ELSE", summer, summer, "END_IF") == pytest.approx(condition + 22.56)
    turns = extra("FOR B% = 1 TO 3", summer.replace("=B%)", "=C%)"), "NEXT B%")
    assert turns == pytest.approx(ESTIMATES_US["For"] + 3 * (11.28 + ESTIMATES_US["Next"]))
    empty = extra("FOR B% = 1 TO 3", "NEXT B%")
    assert empty == pytest.approx(ESTIMATES_US["For"] + 3 * ESTIMATES_US["Next"])
    read = extra("T%(A%) = T%(A% + 5)")
    assert read == pytest.approx(ESTIMATES_US["Assignment"])


def test_read_past_the_data_takes_its_time_too():
    reading = [sum(times(Model.MODEL_7010, lines(f"READ {names}", "DATA 1"))) for names in ("A%", "A%, B%, C%")]
    assert reading[0] == reading[1]
