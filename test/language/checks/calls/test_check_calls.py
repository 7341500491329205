"""CALL: blocks, keywords, what a parameter takes, rules, coefficients (3.1, section 51)."""

import math

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Span
from automax_ros.core.numbers import stored_real
from automax_ros.language.program import BoundCall
from automax_ros.language.tree.tree import BooleanLiteral, IntegerLiteral, RealLiteral, Reference, Unary
from language.check_support import codes, one, problems, program, task

DECLARE = "LOCAL A%, B%, C%, D!, R, X@, Y@, S$, T%(10), Z@(3), Q(2)"


UNPROTECTED = "AMX4097"
"""The warning that a UDC task has no THERMAL_OVERLOAD."""


def call(text: str) -> str:
    return task(f"CALL {text}", declare=DECLARE)


def bound(text: str) -> BoundCall:
    found = program(call(text)).calls
    return next(item for item in found.values() if item.block.name != "SCAN_LOOP")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("DIFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=C%)", "AMX4070"),
        ("DIFFERENCE(INPUT1=A%, INPT2=B%, OUTPUT=C%)", "AMX4072"),
        ("DIFFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=C%, GAIN=A%)", "AMX4072"),
        ("DIFFERENCE(INPUT1=A%, INPUT2=B%, INPUT2=B%, OUTPUT=C%)", "AMX4073"),
        ("DIFFERENCE(INPUT1=A%, OUTPUT=C%)", "AMX4074"),
        ("DIFFERENCE(INPUT1=A%, INPUT2=B%)", "AMX4074"),
        ("DIFFERENCE(INPUT1=D!, INPUT2=B%, OUTPUT=C%)", "AMX2015"),
        ("DIFFERENCE(INPUT1=R, INPUT2=B%, OUTPUT=C%)", "AMX2015"),
        ("DIFFERENCE(INPUT1=X@, INPUT2=B%, OUTPUT=C%)", "AMX2015"),
        ("DIFFERENCE(INPUT1=1.0, INPUT2=B%, OUTPUT=C%)", "AMX2015"),
        ("DIFFERENCE(INPUT1=TRUE, INPUT2=B%, OUTPUT=C%)", "AMX2015"),
        ("DIFFERENCE(INPUT1='A', INPUT2=B%, OUTPUT=C%)", "AMX2015"),
        ("DIFFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=D!)", "AMX2015"),
        ("DIFFERENCE(INPUT1=32768, INPUT2=B%, OUTPUT=C%)", "AMX2007"),
        ("DIFFERENCE(INPUT1=0FFFFH, INPUT2=B%, OUTPUT=C%)", "AMX2007"),
        ("DIFFERENCE(INPUT1=A%+1, INPUT2=B%, OUTPUT=C%)", "AMX4077"),
        ("DIFFERENCE(INPUT1=-A%, INPUT2=B%, OUTPUT=C%)", "AMX4077"),
        ("DIFFERENCE(INPUT1=(1+1), INPUT2=B%, OUTPUT=C%)", "AMX4077"),
        ("DIFFERENCE(INPUT1=ABS(A%), INPUT2=B%, OUTPUT=C%)", "AMX4077"),
        ("DIFFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=0)", "AMX4078"),
        ("DIFFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=-C%)", "AMX4077"),
        ("DIFFERENCE(INPUT1=T%, INPUT2=B%, OUTPUT=C%)", "AMX4020"),
        ("DIFFERENCE(INPUT1=T%(11), INPUT2=B%, OUTPUT=C%)", "AMX4023"),
        ("DIFFERENCE(INPUT1=T%(1,1), INPUT2=B%, OUTPUT=C%)", "AMX4022"),
        ("DIFFERENCE(INPUT1=A%(1), INPUT2=B%, OUTPUT=C%)", "AMX4021"),
        ("DIFFERENCE(INPUT1=E%, INPUT2=B%, OUTPUT=C%)", "AMX4001"),
        ("DIFFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=E%)", "AMX4001"),
        ("LAG(INPUT=1, WLG=1.0, OUTPUT=B%)", "AMX4075"),
        ("LAG(INPUT=A%, WLG=1, OUTPUT=B%)", "AMX2016"),
        ("LAG(INPUT=A%, WLG=1E1, OUTPUT=B%)", "AMX2016"),
        ("LAG(INPUT=A%, WLG=-1, OUTPUT=B%)", "AMX2016"),
        ("LAG(INPUT=A%, WLG=A%, OUTPUT=B%)", "AMX2015"),
        ("LAG(INPUT=A%, WLG=1.0, WM=R, OUTPUT=B%)", "AMX4076"),
        ("LAG(INPUT=A%, WLG=1.0, RESET=1, OUTPUT=B%)", "AMX2015"),
        ("LAG(INPUT=A%, WLG=1.0, RESET=A%, OUTPUT=B%)", "AMX2015"),
        ("LAG(INPUT=A%, WLG=1.0, RESET=-A%, OUTPUT=B%)", "AMX4077"),
        ("LAG(INPUT=A%, WLG=1.0, RESET=NOT X@, OUTPUT=B%)", "AMX4077"),
        ("LAG(INPUT=A%, WLG=1.0, RESET=-TRUE, OUTPUT=B%)", "AMX4077"),
        ("LAG(INPUT=A%, WLG=1.0, RESET=A% > 1, OUTPUT=B%)", "AMX4077"),
        ("LAG(INPUT=A%, WLG=1.0, RESET=-E@, OUTPUT=B%)", "AMX4001"),
        ("AND(INPUT1=X@, INPUT2=Y@, OUTPUT=-Y@)", "AMX4079"),
        ("AND(INPUT1=X@, INPUT3=Y@, OUTPUT=Y@)", "AMX4081"),
        ("INTEGRATE(INPUT=A%, KI=1.0, WM=0.0099999, OUTPUT=B%)", "AMX4084"),
        ("LATCH(SET=X@, OUTPUT=Y@)", "AMX4082"),
        ("LATCH(SET=X@, SET=X@, OUTPUT=Y@)", "AMX4073"),
    ],
)
def test_each_is_one_error(text: str, code: str) -> None:
    found = one(call(text))
    assert found.code == code
    assert (found.span.line, found.statement) == (3, 30)


@pytest.mark.parametrize(
    "text",
    [
        "DIFFERENCE(INPUT1=-32768, INPUT2=32767, OUTPUT=C%)",
        "DIFFERENCE(INPUT1=0FFFFFFFFH, INPUT2=7FFFH, OUTPUT=T%(A%))",
        "DIFFERENCE(INPUT1=T%(3), INPUT2=T%(A% + 1), OUTPUT=C%)",
        "LAG(INPUT=A%, WLG=R, OUTPUT=B%)",
        "INTEGRATE(INPUT=A%, KI=1.0, WM=0.01, OUTPUT=B%)",
        "PROP_INT(INPUT=A%, KP=0.001, WLD=2.0, OUTPUT=B%)",
        "PROP_INT(INPUT=A%, KP=128.0, WLD=2.0, OUTPUT=B%)",
        "LAG(INPUT=A%, WLG=Q(1), RESET=-X@, INITIAL_VALUE=-5, OUTPUT=B%)",
        "LAG(INPUT=A%, WLG=1.5E1, RESET=-Z@(1), OUTPUT=B%)",
        "AND(INPUT1=TRUE, INPUT2=OFF, OUTPUT=Z@(3))",
    ],
)
def test_right_calls(text: str) -> None:
    assert codes(call(text)) == []


def test_caret_and_hint_stand_at_the_fault() -> None:
    found = one(
        "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL DIFFERENCE(INPUT1=A%, &\n   INPUT2=C%, OUTPUT=B%)\n40 END"
    )
    assert (found.span, found.statement) == (Span(4, 11, 13), 30)
    assert one(call("DIFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=C%)")).hint == "did you mean DIFFERENCE?"
    assert one(call("LAG(INPT=A%, WLG=1.0, OUTPUT=B%)")).hint == "did you mean INPUT?"
    assert one(call("LAG(INPUT=A%, WLG=1.0, RESET=NOT X@, OUTPUT=B%)")).hint == "write -X@"
    assert one(call("LAG(INPUT=A%, WLG=120E-3, OUTPUT=B%)")).hint == "write 120.0E-3"


def test_all_faults_of_a_call_in_one_pass() -> None:
    found = problems(call("LAG(INPUT=3, WLG=5, RESET=A%, GAIN=1.0, OUTPUT=TRUE)"))
    assert [item.code for item in found] == ["AMX4075", "AMX2016", "AMX2015", "AMX4072", "AMX4078"]


def test_bound_arguments_are_ready_for_use() -> None:
    found = bound("LAG(INPUT=A%, WLG=0.1, RESET=-X@, OUTPUT=B%)")
    assert found.block is CATALOGUE["LAG"]
    assert found.line == 30
    assert found.arguments == {
        "INPUT": Reference("A%"),
        "WLG": RealLiteral(stored_real(0.1)[0]),
        "RESET": Unary("-", Reference("X@")),
        "OUTPUT": Reference("B%"),
    }
    assert found.defaults == {"INITIAL_VALUE": 0}
    negative = bound("LAG(INPUT=A%, WLG=R, INITIAL_VALUE=-5, RESET=ON, OUTPUT=B%)")
    assert negative.arguments["INITIAL_VALUE"] == IntegerLiteral(-5)
    assert negative.arguments["RESET"] == BooleanLiteral(True)
    assert negative.defaults == {}


def test_every_call_of_a_task_is_bound() -> None:
    found = program(task("CALL TRANSITION(INPUT=X@, OUTPUT=Y@) \\ CALL TRANSITION(INPUT=Y@, OUTPUT=X@)"))
    assert [(item.block.name, item.line) for item in found.calls.values()] == [
        ("SCAN_LOOP", 20),
        ("TRANSITION", 30),
        ("TRANSITION", 30),
    ]


# Section 43 at TICKS = 4 of 5.5 ms: WM defaults to (2 pi / T) / 20, C = WM / tan(WM T / 2), WLG at most 0.71 C.
PERIOD = 4 * 0.0055
HIGHEST = 0.71 * (math.pi / (10 * PERIOD)) / math.tan(math.pi / 20)


@pytest.mark.parametrize(("wlg", "good"), [(HIGHEST * 0.999, True), (HIGHEST * 1.001, False), (0.0001, False)])
def test_limits_of_a_coefficient(wlg: float, good: bool) -> None:
    assert codes(call(f"LAG(INPUT=A%, WLG={wlg:.5f}, OUTPUT=B%)")) == ([] if good else ["AMX4084"])


def test_limit_is_stated_as_number_and_formula() -> None:
    found = one(call("LAG(INPUT=A%, WLG=1000.0, OUTPUT=B%)"))
    assert f"{HIGHEST:.4f}"[:6] in found.message
    assert "0.71 C" in found.message
    assert "T = 22 ms" in found.message
    assert found.span == Span(3, 27, 33)


def test_limits_depend_on_the_tick() -> None:
    text = call("LAG(INPUT=A%, WLG=100.0, OUTPUT=B%)")
    assert codes(text) == ["AMX4084"]
    assert codes(text, tick_ns=1_000_000) == []


def test_a_limit_needs_what_it_reads() -> None:
    """WLG's limit reads WM: one that is wrong itself causes no second error."""
    assert codes(call("LAG(INPUT=A%, WLG=1000.0, WM=1000.0, OUTPUT=B%)")) == ["AMX4084"]
    assert codes(call("LAG(INPUT=A%, WLG=R, WM=1000.0, OUTPUT=B%)")) == ["AMX4084"]


def loop(arguments: str) -> str:
    return f"10 LOCAL A%\n20 CALL SCAN_LOOP({arguments})\n30 END\n"


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ("", "AMX4074"),
        ("TICKS=0", "AMX4080"),
        ("TICKS=-1", "AMX4080"),
        ("TICKS=32768", "AMX2007"),
        ("TICKS=A%", "AMX4076"),
        ("TICKS=4.0", "AMX2015"),
        ("TICK=4", "AMX4072"),
    ],
)
def test_ticks(arguments: str, code: str) -> None:
    assert codes(loop(arguments)) == [code]


def test_ticks_of_a_udc() -> None:
    assert codes(loop("TICKS=20"), target=Platform.UDC, tick_ns=500_000) == [UNPROTECTED]
    assert codes(loop("TICKS=21"), target=Platform.UDC, tick_ns=500_000) == [UNPROTECTED, "AMX4085"]
    assert codes(loop("TICKS=32768"), target=Platform.UDC, tick_ns=500_000) == [UNPROTECTED, "AMX2007"]
    assert codes(loop("TICKS=32767")) == []


@pytest.mark.parametrize("statement", ["A% = IOREAD%(5, 0)", "IOWRITE 5, 0, A%"])
def test_io_of_a_udc(statement: str) -> None:
    assert codes(task(statement), target=Platform.UDC, tick_ns=500_000) == [UNPROTECTED, "AMX4027"]
    assert codes(task(statement), target=Platform.PC3000) == []


def test_a_common_shared_by_blocks_and_basic() -> None:
    declare = "COMMON REF%, T%(3), R, RUN@ \\ LOCAL A%, B%"
    text = task(
        "A% = REF% + B%",
        "CALL DIFFERENCE(INPUT1=REF%, INPUT2=T%(1), OUTPUT=A%)",
        "T%(1) = REF%",
        "CALL LAG(INPUT=A%, WLG=R, OUTPUT=B%)",
        "R = 1.0",
        declare=declare,
    )
    found = one(text)
    assert found.code == "AMX4086"
    assert (found.span, found.notes[0].span) == (Span(3, 9, 13), Span(4, 27, 31))
    assert "line 30" in found.message
    assert "line 40" in found.message


def test_initial_values_before_scan_loop_are_no_conflict() -> None:
    text = (
        "10 COMMON REF% \\ LOCAL A%\n20 REF% = 5\n30 CALL SCAN_LOOP(TICKS=4)\n"
        "40 CALL DIFFERENCE(INPUT1=REF%, INPUT2=A%, OUTPUT=A%)\n50 END\n"
    )
    assert codes(text) == []


def test_hexadecimal_constant_without_its_0_gets_a_hint():
    assert one(task("A% = FFH", declare=DECLARE)).hint == "a hexadecimal constant begins with a digit: 0FFH"


@pytest.mark.parametrize(
    ("call", "hint"),
    [
        ("LAGN(INPUT=A%, OUTPUT=B%)", "LOW_PASS_FILTER is meant"),
        ("LEADN(INPUT=A%, OUTPUT=B%)", "HIGH_PASS_FILTER is meant"),
        ("MULDIV(INPUT1=A%, OUTPUT=B%)", "MULTIPLY_DIVIDE is meant"),
        ("DIFERENCE(INPUT1=A%, OUTPUT=B%)", "did you mean DIFFERENCE?"),
        ("FOO(INPUT1=A%, OUTPUT=B%)", "`automax blocks` lists all blocks"),
        ("NOTCHN(INPUT=A%, Q_FACTOR=1.0, WN=5.0, ORDER=2, OUTPUT=B%)", "it runs in UDC tasks: call it in one of these"),
        ("LIMIT(INPUT=A%, LIMIT_PLUS=1.5, OUTPUT=B%)", "write a whole number"),
        ("AND(INPUT1=X@, INPUT2=1, OUTPUT=Y@)", "write TRUE or FALSE"),
    ],
)
def test_hints_say_what_to_do(call: str, hint: str) -> None:
    assert (one(task(f"CALL {call}")).hint or "").startswith(hint)


def test_what_moves_a_boolean() -> None:
    found = problems(task("CALL MOVE(INPUT1=X@, OUTPUT1=Y@)"))
    assert [item.code for item in found] == ["AMX2015", "AMX2015"]
    assert all((item.hint or "").startswith("OR with INPUT1 alone passes a BOOLEAN on") for item in found)
    assert codes(task("CALL OR(INPUT1=X@, OUTPUT=Y@)")) == []


def test_a_number_that_does_not_fit_names_the_type_that_holds_it() -> None:
    hint = "a DOUBLE INTEGER, which ends with !, is -2147483648 to 2147483647"
    assert one(task("A% = 40000")).hint == hint
    assert one(task("A% = 0FFFFH")).hint != hint
    assert "at most 2147483647" in (problems(task("R = 99999999999"))[0].hint or "")
