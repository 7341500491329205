"""What a diagram joins: the last writer above, feedback, the latch, what stands at the pins, what has no drawing."""

from __future__ import annotations

import pytest
from hypothesis import given

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.core.diagnostics import SourceText
from automax_ros.diagram.model import LINE_WIDTH, MOST_BOXES, MOST_LINES, Diagram, diagram_of
from automax_ros.language.checks.checker import check
from diagram.drawing import ROOT, checked, drawn, example, scan, tasks, wires

SPEED = ROOT / "config" / "section_drive" / "SPEED.BLK"


def nets(diagram: Diagram) -> set[tuple[str, int, bool]]:
    return {(net.name, net.line, net.kept) for net in diagram.nets}


def at_pins(diagram: Diagram) -> dict[str, str]:
    """What stands at the pins, by line and parameter: literals, and variables after a colon."""
    return {
        f"{diagram.boxes[pin.box].line} {pin.name}": f":{pin.var}" if pin.var else pin.value
        for pin in diagram.pins
        if pin.net is None
    }


def test_the_speed_regulator_of_the_section() -> None:
    diagram = diagram_of(*example(SPEED))
    assert [len(part) for part in (diagram.boxes, diagram.flags, diagram.wires)] == [18, 13, 39]
    assert [box.line for box in diagram.boxes if box.basic] == [2240]
    assert {wire for wire in wires(diagram) if "~>" in wire} == {
        "1420 SATURATED_PLUS ~> 1230 HOLD_PLUS",
        "1420 SATURATED_MINUS ~> 1230 HOLD_MINUS",
    }
    assert {("SPARE%", 2100, False), ("SPARE%", 2200, False), ("SPARE%", 2210, True)} <= nets(diagram)
    assert at_pins(diagram)["1230 KP"] == ":KP_SPEED"
    assert at_pins(diagram)["1230 LIMIT_MINUS"] == "-4095"
    assert at_pins(diagram)["2240 TACH_DELAY%"] == ":TACH_DELAY%"
    (proportional,) = (box for box in diagram.boxes if box.title == "PROP_INT")
    assert proportional.rows == (49, 57)


@given(tasks())
def test_each_call_is_one_box_in_the_order_of_execution(text: str) -> None:
    program, source = checked(text)
    boxes = diagram_of(program, source).boxes
    assert [box.line for box in boxes] == sorted(box.line for box in boxes)
    calls = [statement for statement in program.scan if statement.span in program.calls]
    assert [box.title for box in boxes if not box.basic] == [call.block for call in calls]


@given(tasks())
def test_a_wire_leads_from_the_last_writer_above_or_is_feedback(text: str) -> None:
    diagram = diagram_of(*checked(text))
    for wire in diagram.wires:
        target = diagram.boxes[diagram.pins[wire.target.number].box] if not wire.target.is_flag else None
        line = diagram.nets[wire.net].line
        if target is None or wire.feedback or line == 0:
            continue
        reader = diagram.pins[wire.target.number].box
        writer = diagram.pins[wire.source.number].box
        assert writer < reader
        between = [
            pin
            for pin in diagram.pins
            if pin.out
            and pin.net is not None
            and writer < pin.box < reader
            and diagram.nets[pin.net].name == diagram.nets[wire.net].name
        ]
        latched = diagram.nets[wire.net].name in ("A%", "B%", "C%", "P@", "Q@", "R@")
        assert all(latched and diagram.boxes[pin.box].basic is not target.basic for pin in between)


def test_a_local_that_is_used_again_is_a_net_for_each_writer() -> None:
    diagram = drawn(
        "CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=X%)",
        "CALL SUMMER(INPUT1=X%, INPUT2=2, OUTPUT=X%)",
        "CALL SUMMER(INPUT1=X%, INPUT2=3, OUTPUT=B%)",
    )
    assert wires(diagram) == {
        "A% -> 100 INPUT1",
        "100 OUTPUT -> 110 INPUT1",
        "110 OUTPUT -> 120 INPUT1",
        "120 OUTPUT -> B%",
    }
    assert nets(diagram) == {("X%", 100, False), ("X%", 110, True), ("B%", 120, True), ("A%", 0, True)}
    assert [net.watch for net in diagram.nets] == ["TASK.X%", "TASK.X%", "B%", "A%"]


def test_what_is_read_before_it_is_written_is_feedback_from_the_last_writer() -> None:
    diagram = drawn(
        "CALL SUMMER(INPUT1=X%, INPUT2=A%, OUTPUT=Y%)",
        "CALL SUMMER(INPUT1=Y%, INPUT2=1, OUTPUT=X%)",
        "CALL SUMMER(INPUT1=X%, INPUT2=1, OUTPUT=X%)",
    )
    assert {wire for wire in wires(diagram) if "~>" in wire} == {"120 OUTPUT ~> 100 INPUT1"}


def test_a_block_that_reads_what_it_writes_has_feedback_from_itself() -> None:
    assert "100 OUTPUT ~> 100 INPUT1" in wires(drawn("CALL OR(INPUT1=U@, INPUT2=P@, OUTPUT=U@)"))


def test_a_common_that_the_task_writes_below_is_feedback_unless_others_write_it() -> None:
    lines = ("CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=X%)", "CALL SUMMER(INPUT1=X%, INPUT2=1, OUTPUT=A%)")
    assert wires(drawn(*lines)) == {"110 OUTPUT ~> 100 INPUT1", "100 OUTPUT -> 110 INPUT1", "110 OUTPUT -> A%"}
    shared = drawn(*lines, elsewhere=("A%", "X%"))
    assert wires(shared) == {"A% -> 100 INPUT1", "100 OUTPUT -> 110 INPUT1", "110 OUTPUT -> A%"}
    assert nets(shared) == {("X%", 100, True), ("A%", 110, True), ("A%", 0, False)}


def test_basic_and_blocks_see_each_others_latched_commons_one_scan_later() -> None:
    diagram = drawn(
        "CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=B%)", "C% = B%", "CALL SUMMER(INPUT1=C%, INPUT2=1, OUTPUT=X%)"
    )
    assert {"100 OUTPUT ~> 110 B%", "110 C% ~> 120 INPUT1"} <= wires(diagram)


def test_a_latched_common_that_basic_and_blocks_write_comes_from_a_flag() -> None:
    diagram = drawn(
        "CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=X%)",
        "A% = X%",
        "CALL SUMMER(INPUT1=X%, INPUT2=1, OUTPUT=A%)",
    )
    assert wires(diagram) == {
        "A% -> 100 INPUT1",
        "100 OUTPUT -> 110 X%",
        "100 OUTPUT -> 120 INPUT1",
        "120 OUTPUT -> A%",
    }
    assert not any(kept for name, _, kept in nets(diagram) if name == "A%")


def test_other_variables_go_from_basic_to_blocks_and_back_in_the_same_scan() -> None:
    diagram = drawn("X% = A%", "CALL SUMMER(INPUT1=X%, INPUT2=1, OUTPUT=Y%)", "Z% = Y%")
    assert {"100 X% -> 110 INPUT1", "110 OUTPUT -> 120 Y%"} <= wires(diagram)


def test_consecutive_basic_is_one_box_with_its_lines() -> None:
    diagram = drawn("X% = A%", "REM a remark parts nothing", "IF U@ THEN", "X% = X% + 1", "END_IF", "Y% = X%")
    (box,) = diagram.boxes
    assert (box.title, box.line, box.rows, box.basic) == ("BASIC", 100, (5, 10), True)
    assert box.text == ("100 X% = A%", "120 IF U@ THEN", "130   X% = X% + 1", "140 END_IF", "150 Y% = X%")
    names = {(pin.name, pin.out) for pin in diagram.pins}
    assert names == {("A%", False), ("U@", False), ("X%", True), ("Y%", True)}


def test_basic_that_may_leave_a_variable_has_what_is_above_as_an_input() -> None:
    lines = (
        "CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=X%)",
        "IF U@ THEN X% = 0",
        "CALL SUMMER(INPUT1=X%, INPUT2=1, OUTPUT=B%)",
    )
    assert {"100 OUTPUT -> 110 X%", "110 X% -> 120 INPUT1"} <= wires(drawn(*lines))
    both = (lines[0], "IF U@ THEN X% = 0 ELSE X% = 1", lines[2])
    assert "100 OUTPUT -> 110 X%" not in wires(drawn(*both))


def test_basic_that_goes_on_from_its_own_value_has_an_output_alone() -> None:
    diagram = drawn("X% = X% + 1")
    assert ([(pin.name, pin.out) for pin in diagram.pins], diagram.wires) == ([("X%", True)], ())


def test_an_inverted_input_has_a_bubble() -> None:
    diagram = drawn("CALL AND(INPUT1=-P@, INPUT2=Q@, OUTPUT=R@)")
    assert {pin.name: pin.negated for pin in diagram.pins} == {"INPUT1": True, "INPUT2": False, "OUTPUT": False}


def test_literals_tunables_elements_and_arrays_stand_at_the_pins() -> None:
    diagram = drawn(
        "CALL SUMMER(INPUT1=TABLE%(2), INPUT2=GAIN%, OUTPUT=TABLE%(3))",
        "CALL SUMMER(INPUT1=-7, INPUT2=TABLE%(X%), OUTPUT=A%)",
        "CALL SUMMER(INPUT1=X%, INPUT2=0FH, OUTPUT=B%)",
    )
    assert at_pins(diagram) == {
        "100 INPUT1": ":TABLE%(2)",
        "100 INPUT2": ":GAIN%",
        "100 OUTPUT": ":TABLE%(3)",
        "110 INPUT1": "-7",
        "110 INPUT2": "TABLE%(X%)",
        "120 INPUT1": ":X%",
        "120 INPUT2": "0FH",
    }


def test_a_common_has_one_flag_for_all_its_readers() -> None:
    diagram = drawn(*("CALL SUMMER(INPUT1=A%, INPUT2=A%, OUTPUT=B%)" for _ in range(3)))
    assert [(flag.name, flag.out) for flag in diagram.flags] == [("A%", False), ("B%", True)]


def test_the_block_that_begins_the_scan_of_a_drive_is_a_box() -> None:
    diagram = diagram_of(*example(ROOT / "config" / "dc_drive" / "CML.BLK"))
    assert [box.title for box in diagram.boxes] == ["DC_DRIVE_CML"]
    assert "CUR_REF% -> 1000 REFERENCE" in wires(diagram)
    assert at_pins(diagram)["1000 DIAG_DATA"] == "DIAG%"


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        (["GOTO 9000"], "line 100: GOTO"),
        (["IF U@ THEN 9000"], "line 100: GOTO"),
        (["X% = 1", "FOR X% = 1 TO 3", "Y% = X%", "NEXT X%"], "line 110: FOR"),
        (["GOSUB 120", "IF U@ THEN END", "X% = 1", "RETURN"], "line 100: GOSUB"),
        (["ON X% GOTO 110, 120", "Y% = 1", "Y% = 2"], "line 100: ON"),
        (["READ X%", "DATA 1"], "line 100: READ"),
        (["IF U@ THEN END"], "line 100: END inside IF"),
        (["IF U@ THEN CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=X%)"], "line 100: CALL inside IF"),
    ],
)
def test_what_jumps_or_loops_is_not_drawn_but_its_source_is_there(lines: list[str], why: str) -> None:
    diagram = drawn(*lines)
    assert (diagram.why, diagram.boxes, diagram.wires) == (why, (), ())
    assert [row.text for row in diagram.source] == scan(lines).split("\n")


def test_a_basic_task_is_not_drawn() -> None:
    source = SourceText("TASK.BAS", "10 LOCAL X%\n20 X% = 1\n30 END\n")
    program = check(source, name="TASK", catalogue=CATALOGUE).program
    assert program is not None
    diagram = diagram_of(program, source)
    assert diagram.why.startswith("a BASIC task")
    assert [row.names for row in diagram.source] == [("X%",), ("X%",), (), ()]


def test_too_many_boxes_are_not_drawn() -> None:
    diagram = drawn(*(["CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=B%)"] * (MOST_BOXES + 1)))
    assert str(MOST_BOXES + 1) in diagram.why


def test_long_basic_is_wrapped_and_cut() -> None:
    diagram = drawn(*(f"X% = X% + Y% + Z% + {place} + A% + B% + C% + {place}" for place in range(40)))
    text = diagram.boxes[0].text
    assert len(text) == MOST_LINES
    assert all(len(line) <= LINE_WIDTH for line in text)
    assert text[0].startswith("100 X% = X% + Y%")
    assert text[-1] == "... 67 more lines"


def test_rows_of_the_source_have_lines_and_simple_variables() -> None:
    program, source = checked(scan(["CALL SUMMER(INPUT1=A%, &\n INPUT2=TABLE%(X%), OUTPUT=B%)", "IF U@ THEN X% = A%"]))
    rows = diagram_of(program, source).source
    assert [(row.line, row.names) for row in rows[:5]] == [
        (10, ("A%", "B%", "C%", "P@", "Q@", "R@")),
        (20, ("X%", "Y%", "Z%", "U@", "V@", "W@")),
        (30, ("GAIN%",)),
        (40, ()),
        (100, ("A%",)),
    ]
    assert [(row.line, row.names) for row in rows[5:7]] == [(0, ("X%", "B%")), (110, ("U@", "X%", "A%"))]
    assert diagram_of(program, source).boxes[0].rows == (5, 6)


def test_an_empty_scan_is_an_empty_drawing() -> None:
    assert (drawn().boxes, drawn().why) == ((), "")
