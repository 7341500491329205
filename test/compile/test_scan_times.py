"""Least and most time of a scan: sums by hand from tables 4, 5 and 6, and random tasks that stay between the two."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.compile.scan_times import period_ns, scan_times
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import check
from compile.support import ESTIMATES_US, TICK, lines, program_of, repeatable, scan_in_steps, task_of

SUMMER = "CALL SUMMER(INPUT1=A%, INPUT2=B%, OUTPUT=B%)"
LAG = "CALL LAG(INPUT=A%, WLG=2.0, OUTPUT=C%)"
SCAN_LOOP_7010, END_7010, SUMMER_7010, LAG_7010, REMARK_7010 = 80.00, 13.82, 11.28, 26.52, 9.88
ASSIGN, IF, FOR, NEXT, GOTO, GOSUB, RETURN, ON = (
    ESTIMATES_US[name] for name in ("Assignment", "If", "For", "Next", "Goto", "Gosub", "Return", "OnJump")
)


def bounds(*statements: str, model: Model = Model.MODEL_7010, alone: bool = False, **options) -> tuple[float, float]:
    """Least and most time in us, without SCAN_LOOP and END of a task that latches nothing."""
    times = scan_times(program_of(lines(*statements, **options)), CostModel(model, alone))
    fixed = SCAN_LOOP_7010 + END_7010
    return times.least_ns / 1000 - fixed, times.most_ns / 1000 - fixed


LINE = """10 COMMON REF%, FDBK%, CUR_REF%, RUN@, FAULT@, TOTAL!
20 LOCAL ERROR%, TABLE%(9)
30 ! BEFORE SCAN_LOOP: ONCE, IT COUNTS NOTHING
40 CALL SCAN_LOOP(TICKS=4)
50 ! A REMARK
60 REM ANOTHER
70 CALL DIFFERENCE(INPUT1=REF%, INPUT2=FDBK%, OUTPUT=ERROR%)
80 CALL PROP_INT(INPUT=ERROR%, KP=1.0, WLD=2.0, LIMIT_PLUS=4095, LIMIT_MINUS=-4095, RESET=-RUN@, &
   INITIAL_VALUE=0, OUTPUT=CUR_REF%)
90 CALL AND(INPUT1=RUN@, INPUT2=-FAULT@, OUTPUT=RUN@)
100 CALL SEARCH(INPUT=REF%, COMPARE_LES=TRUE, TABLE1=TABLE%, OUTPUT=ERROR%)
110 CALL SELECT(SELECT1=RUN@, INPUT1=REF%, SELECT2=FAULT@, INPUT2=FDBK%, OUTPUT=ERROR%)
120 CALL COMPARE(INPUT1=REF%, INPUT2=FDBK%, OUTPUT_LES=FAULT@, OUTPUT_EQU=RUN@)
130 END
"""
"""Six commons are latched: three INTEGER, two BOOLEAN, one DOUBLE INTEGER."""


@pytest.mark.parametrize(
    ("model", "least", "most"),
    [
        pytest.param(
            Model.MODEL_7010,
            80.00 + 6 * 1.6 + 3 * 2.5 + 2 * 3.8 + 1 * 4.1  # SCAN_LOOP
            + 9.88  # ! remark
            + 10.80  # DIFFERENCE
            + 40.32  # PROP_INT
            + 10.80 + 2 * 1.88  # AND, 2 inputs
            + 19.80 + 1 * 0.68  # SEARCH finds the first element
            + 11.36 + 4 * 2.52  # SELECT: INPUT1, SELECT1, INPUT2, SELECT2
            + 11.24 + 2 * 1.16  # COMPARE, 2 outputs
            + 13.82 + 6 * 2.0 + 3 * 1.6 + 2 * 2.2 + 1 * 2.5,  # END
            9 * 0.68,
            id="table 4, 7010",
        ),
        pytest.param(
            Model.MODEL_6010,
            326 + 6 * 2.4 + 3 * 4.4 + 2 * 6.8 + 1 * 7.2
            + 40
            + 44
            + 193
            + 41 + 2 * 8.3
            + 74 + 1 * 3
            + 44 + 4 * 12.2
            + 45 + 2 * 5.5
            + 60 + 6 * 3.2 + 3 * 2.8 + 2 * 4.3 + 1 * 4.9,
            9 * 3,
            id="table 4, 6010",
        ),
        pytest.param(
            Model.PC3000,
            56.00 + 6 * 1.12 + 3 * 1.76 + 2 * 2.68 + 1 * 2.88
            + 6.92
            + 7.56
            + 28.24
            + 7.56 + 2 * 1.32
            + 13.88 + 1 * 0.48
            + 7.96 + 4 * 1.76
            + 7.88 + 2 * 0.80
            + 9.68 + 6 * 1.40 + 3 * 1.12 + 2 * 1.56 + 1 * 1.76,
            9 * 0.48,
            id="table 6",
        ),
    ],
)  # fmt: skip
def test_a_task_summed_by_hand(model, least, most):
    target = Platform.PC3000 if model is Model.PC3000 else Platform.AUTOMAX
    times = scan_times(program_of(LINE, target=target), CostModel(model))
    assert times.least_ns / 1000 == pytest.approx(least, abs=0.01)
    assert times.most_ns / 1000 == pytest.approx(least + most, abs=0.01)
    assert not times.estimated


UDC_TASK = """10 COMMON REF%, SPD%, RUN@, POS!
20 LOCAL OUT%, WORD%
30 CALL SCAN_LOOP(TICKS=2)
40 ! A REMARK
50 CALL PACK_BITS(INPUT0=RUN@, INPUT5=RUN@, INPUT9=RUN@, OUTPUT=WORD%)
60 CALL NOTCHN(INPUT=REF%, Q_FACTOR=1.0, WN=50.0, ORDER=4, OUTPUT=OUT%)
70 CALL MOVE(ENABLE=RUN@, INPUT1=REF%, OUTPUT1=OUT%, INPUT2=SPD%, OUTPUT2=WORD%)
80 END
"""


@pytest.mark.parametrize("alone", [False, True])
def test_a_udc_task_summed_by_hand(alone):
    """Table 5: no t; x and z where one task runs alone; the n of PACK_BITS counts inputs."""
    expected = (
        350.00 + 2 * 2.20 + 1 * 2.00 + 1 * 3.30 + (312 if alone else 0)
        + 2.37
        + 16.16 + 3 * 1.25
        + 64.25 + 4 * 20.00
        + 10.40 + 2 * 1.80
        + 130.00 + 2 * 2.40 + 1 * 2.50 + 1 * 3.30 + (100 if alone else 0)
    )  # fmt: skip
    times = scan_times(program_of(UDC_TASK, target=Platform.UDC), CostModel(Model.UDC, alone=alone))
    assert times.least_ns == times.most_ns
    assert times.least_ns / 1000 == pytest.approx(expected, abs=0.01)


def test_each_element_searched_takes_its_time():
    """Table 4: 19.80 + m(0.68) where a scan searches m elements."""
    text = """10 COMMON KA%
20 LOCAL OUT%, TABLE%(9), I%
30 TABLE%(4) = 7
40 CALL SCAN_LOOP(TICKS=4)
50 CALL SEARCH(INPUT=KA%, COMPARE_EQU=TRUE, TABLE1=TABLE%, OUTPUT=OUT%)
60 END
"""
    fixed = 80.00 + 1.6 + 2.5 + 13.82 + 2.0 + 1.6

    def searched(value: int) -> float:
        task, _ = task_of(text, cost_model=CostModel(Model.MODEL_7010), **{"KA%": value})
        task.run()
        return sum(scan_in_steps(task, 0)) / 1000 - fixed

    assert searched(0) == pytest.approx(19.80 + 1 * 0.68, abs=0.01)
    assert searched(7) == pytest.approx(19.80 + 5 * 0.68, abs=0.01)
    assert searched(99) == pytest.approx(19.80 + 10 * 0.68, abs=0.01)


@pytest.mark.parametrize(
    ("statements", "least", "most"),
    [
        (["A% = 1"], ASSIGN, ASSIGN),
        (["IF X@ THEN", SUMMER, "END_IF"], IF, IF + SUMMER_7010),
        (["IF X@ THEN", SUMMER, "ELSE", LAG, "END_IF"], IF + SUMMER_7010, IF + LAG_7010),
        (["IF X@ THEN 200", SUMMER, LAG, "200 REM"], IF, IF + SUMMER_7010 + LAG_7010),
        (["IF X@ THEN 200", SUMMER, "GOTO 300", "200 REM", LAG, "300 REM"], IF + SUMMER_7010 + GOTO, IF + LAG_7010),
        (["FOR A% = 1 TO 10 STEP 4", SUMMER, "NEXT A%"], *(2 * (FOR + 3 * (SUMMER_7010 + NEXT),))),
        (["FOR A% = 10 TO 1 STEP -4", SUMMER, "NEXT A%"], *(2 * (FOR + 3 * (SUMMER_7010 + NEXT),))),
        (["FOR A% = 3 TO 1", SUMMER, "NEXT A%"], FOR, FOR),
        (["FOR A% = 32766 TO 32767", LAG, "NEXT A%"], *(2 * (FOR + 2 * (LAG_7010 + NEXT),))),
        (["FOR A% = 1 TO B%", LAG, "NEXT A%"], FOR, FOR + LAG_7010 + NEXT),
        (["FOR R = 1.0 TO 3.0", LAG, "NEXT R"], FOR, FOR + LAG_7010 + NEXT),
        (["FOR A% = 1 TO 3", "A% = A% + 1", "NEXT A%"], FOR, FOR + ASSIGN + NEXT),
        (
            ["FOR A% = 1 TO 3", "IF X@ THEN 200", SUMMER, "NEXT A%", "200 REM"],
            FOR + IF,  # leaves in the first turn
            FOR + 3 * (IF + SUMMER_7010 + NEXT),
        ),
        (["30 ! TURN", "IF X@ THEN 30"], REMARK_7010 + IF, REMARK_7010 + IF),
        (["GOSUB 200", "GOSUB 200", "GOTO 300", "200 REM", LAG, "RETURN", "300 REM"],)
        + (2 * (GOSUB + LAG_7010 + RETURN) + GOTO,) * 2,
        (["ON A% GOTO 200, 300", SUMMER, "200 REM", SUMMER, "300 REM"], ON, ON + 2 * SUMMER_7010),
        (["RETURN", SUMMER], RETURN + SUMMER_7010, RETURN + SUMMER_7010),
        (["IF X@ THEN", "STOP", "END_IF", SUMMER], IF + SUMMER_7010, IF + SUMMER_7010),
        (["GOTO 100", "50 REM", SUMMER, "GOTO 200", "100 REM", LAG, "GOTO 50", "200 REM"],)
        + (3 * GOTO + SUMMER_7010 + LAG_7010,) * 2,
    ],
)  # fmt: skip
def test_least_and_most_over_all_ways(statements, least, most):
    assert bounds(*statements) == (pytest.approx(least, abs=0.01), pytest.approx(most, abs=0.01))


def test_a_subroutine_that_calls_itself_nests_sixteen_deep():
    """The seventeenth GOSUB is skipped, then every call returns."""
    statements = ["GOSUB 200", "GOTO 300", "200 REM", "IF X@ THEN", "GOSUB 200", "END_IF", "RETURN", "300 REM"]
    least, most = bounds(*statements)
    assert least == pytest.approx(GOSUB + IF + RETURN + GOTO, abs=0.01)
    assert most == pytest.approx(16 * (GOSUB + IF + RETURN) + GOSUB + GOTO, abs=0.01)


def test_times_are_estimates_where_a_basic_statement_is_in_the_sum():
    model = CostModel(Model.MODEL_7010)
    assert not scan_times(program_of(lines(SUMMER, "! REMARK", "REM")), model).estimated
    assert scan_times(program_of(lines(SUMMER, "IF X@ THEN", LAG, "END_IF")), model).estimated
    assert scan_times(program_of(lines("FOR A% = 1 TO 2", "B% = 1", "NEXT A%")), model).estimated


def test_a_statement_that_is_jumped_to_takes_its_time_once():
    text = lines("IF X@ THEN 200", "200 A% = 1", "210 ! REMARK")
    task, _ = task_of(text, cost_model=CostModel(Model.MODEL_7010))
    task.run()
    expected = SCAN_LOOP_7010 + IF + ASSIGN + REMARK_7010 + END_7010
    assert sum(scan_in_steps(task, 0)) / 1000 == pytest.approx(expected, abs=0.01)


CONDITIONS = st.sampled_from(["KX@", "KA% > 3", "T%(2) = KA%", "X@ OR KX@", "B% < A%"])
SIMPLE = st.sampled_from(
    ["A% = A% + 1", "B% = KA%", "KB% = A%", "X@ = NOT X@", SUMMER, LAG, "! REMARK", "REM", 'PRINT "X"', "GOSUB 9000",
     "CALL SEARCH(INPUT=A%, COMPARE_EQU=TRUE, TABLE1=T%, OUTPUT=C%)"]
)  # fmt: skip


@st.composite
def suites(draw, depth: int, loop: int = 0) -> list[str]:
    """Statements whose loops count whole literals with variables of their own."""
    found: list[str] = []
    for _ in range(draw(st.integers(1, 4))):
        kind = draw(st.integers(0, 5)) if depth else 0
        if kind == 3:
            inner, other = draw(suites(depth - 1, loop)), draw(suites(depth - 1, loop))
            found += [f"IF {draw(CONDITIONS)} THEN", *inner, "ELSE", *other, "END_IF"]
        elif kind == 4 and loop < 3:
            first, last, step = draw(st.integers(-2, 3)), draw(st.integers(-2, 5)), draw(st.sampled_from([-2, 1, 2]))
            inner = [item for item in draw(suites(depth - 1, loop + 1)) if "GOSUB" not in item]
            found += [f"FOR F{loop}% = {first} TO {last} STEP {step}", *inner, f"NEXT F{loop}%"]
        elif kind == 5 and not loop and depth == 3:
            found += [f"IF {draw(CONDITIONS)} THEN TARGET", *draw(suites(depth - 1)), "TARGET"]
        else:
            found.append(draw(SIMPLE))
    return found


def numbered(statements: list[str]) -> str:
    """The task's text: each place called TARGET is the line of the next one."""
    text = ["10 COMMON KA%, KB%, KX@", "12 LOCAL A%, B%, C%, X@, T%(4), F0%, F1%, F2%", "20 CALL SCAN_LOOP(TICKS=4)"]
    places = dict(enumerate(statements, 30))
    for number, item in places.items():
        if item.endswith("THEN TARGET"):
            opened = [other for other, text_ in places.items() if other > number and text_ == "TARGET"]
            text.append(f"{number} {item.replace('TARGET', str(opened[0]))}")
        else:
            text.append(f"{number} {'REM' if item == 'TARGET' else item}")
    return "\n".join([*text, "8000 GOTO 9900", "9000 C% = C% + 1", "9010 RETURN", "9900 END", ""])


@given(suites(3), st.lists(st.tuples(st.integers(0, 6), st.booleans()), min_size=4, max_size=4))
@repeatable(60)
def test_scans_of_random_tasks_stay_between_least_and_most(statements, history):
    text = numbered(statements)
    model = CostModel(Model.MODEL_7010)
    times = scan_times(program_of(text), model)
    task, memory = task_of(text, cost_model=model)
    task.run()
    for now, (value, flag) in enumerate(history):
        memory.write_from_outside(memory.view("KA%"), value, 9)
        memory.write_from_outside(memory.view("KX@"), flag, 9)
        assert times.least_ns <= sum(scan_in_steps(task, now)) <= times.most_ns


BASIC = """10 COMMON KA%
20 LOCAL A%
30 OPEN CHANNEL FOR INPUT AS FILE #1, TYPE=(I), DEPTH=4
40 START EVERY 2 SECONDS
50 A% = A% + 1
60 INPUT:EMPTY=80 #1, A%
70 KA% = A%
80 PRINT A%
90 END
"""


def basic(text: str):
    result = check(SourceText("DIAG.BAS", text), name="DIAG", catalogue=CATALOGUE, tick_ns=TICK)
    assert result.program is not None, result.diagnostics
    return result.program


def test_a_basic_task_is_what_start_every_repeats():
    times = scan_times(basic(BASIC), CostModel(Model.MODEL_7010))
    least = sum(ESTIMATES_US[name] for name in ("Assignment", "InputFile", "Print"))
    assert times.least_ns / 1000 == pytest.approx(least)
    assert times.most_ns / 1000 == pytest.approx(least + ASSIGN)
    assert times.estimated
    assert period_ns(basic(BASIC)) == 2_000_000_000
    assert period_ns(basic(BASIC.replace("2 SECONDS", "3 TICKS"))) == 3 * TICK
    assert period_ns(basic(BASIC.replace("2 SECONDS", "KA% SECONDS"))) is None


def test_a_basic_task_that_never_ends_counts_one_turn():
    times = scan_times(
        basic("10 COMMON KA%\n20 KA% = 1\n30 DELAY 2 SECONDS\n40 GOTO 20\n50 END\n"), CostModel(Model.PC3000)
    )
    assert (times.least_ns, times.most_ns) == (0, round(0.7 * (ASSIGN + ESTIMATES_US["Delay"] + GOTO) * 1000))


def test_a_loop_whose_variable_a_message_sets_has_no_known_turns():
    text = "10 LOCAL I%\n20 OPEN CHANNEL FOR INPUT AS FILE #1, TYPE=(I), DEPTH=4\n30 FOR I% = 1 TO 3\n"
    text += "40 INPUT #1, I%\n50 NEXT I%\n60 END\n"
    times = scan_times(basic(text), CostModel(Model.MODEL_7010))
    least = ESTIMATES_US["OpenChannel"] + FOR
    assert times.least_ns / 1000 == pytest.approx(least)
    assert times.most_ns / 1000 == pytest.approx(least + ESTIMATES_US["InputFile"] + NEXT)
