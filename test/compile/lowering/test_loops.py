"""FOR and NEXT (semantics, BASIC): tested at the top, the variable keeps the value that failed the test."""

from __future__ import annotations

import pytest

from automax_ros.runtime.tasks.task import Task
from compile.support import OTHER, lines, logged, ran, run_scans, scan_in_steps, task_of

JUMP = "IF X@ THEN 300"
"""With a jump in the body the loop is made of basic blocks, without one it is a Python loop."""


@pytest.fixture(params=["straight", "jumping"])
def loop(request):
    """Return the task of one loop that counts its turns in C%, in both forms that the compiler makes of loops."""

    def made(head: str, variable: str, *body: str, before: tuple[str, ...] = (), scans: int = 1) -> Task:
        inside = (*body, "C% = C% + 1", *([JUMP] if request.param == "jumping" else []))
        declare = "LOCAL A%, B%, C%, D!, E!, R, Q, X@, T%(10)"
        return ran(*before, f"200 {head}", *inside, f"NEXT {variable}", "300 B% = B% + 1", scans=scans, declare=declare)

    return made


@pytest.mark.parametrize(
    ("head", "variable", "turns", "after"),
    [
        ("FOR A% = 1 TO 5", "A%", 5, 6),
        ("FOR A% = 5 TO 1", "A%", 0, 5),
        ("FOR A% = 5 TO 1 STEP -2", "A%", 3, -1),
        ("FOR A% = 1 TO 6 STEP 2", "A%", 3, 7),
        ("FOR A% = 3 TO 3", "A%", 1, 4),
        ("FOR D! = 2147483640 TO 2147483646", "D!", 7, 2147483647),
        ("FOR R = 0.0 TO 1.0 STEP 0.25", "R", 5, 1.25),
        ("FOR R = 1 TO 0 STEP -0.5", "R", 3, -0.5),
        ("FOR R = 1 TO 3", "R", 3, 4.0),
        ("FOR A% = 1 TO 4.9", "A%", 4, 5),
        ("FOR A% = 2.9 TO 4", "A%", 3, 5),
        ("FOR A% = 0 TO 4 STEP 1.9", "A%", 5, 5),
        ("FOR A% = -32768 TO -32766", "A%", 3, -32765),
    ],
)
def test_turns_and_the_value_afterwards(loop, head, variable, turns, after):
    task = loop(head, variable)
    assert (task.value("C%"), task.value(variable), task.value("B%"), logged(task)) == (turns, after, 1, [])


@pytest.mark.parametrize(
    ("head", "variable", "turns", "after", "code"),
    [
        ("FOR A% = 32766 TO 32767", "A%", 2, 32767, 7020),
        ("FOR A% = 0 TO 32767 STEP 20000", "A%", 2, 32767, 7020),
        ("FOR A% = -32767 TO -32768 STEP -1", "A%", 2, -32768, 7020),
        ("FOR D! = 2147483646 TO 2147483647", "D!", 2, 2147483647, 7021),
        ("FOR R = 9.0E18 TO 9.2E18 STEP 9.0E18", "R", 1, 9.223371487098962e18, 7022),
    ],
)
def test_an_increment_out_of_range_is_logged_and_ends_the_loop(loop, head, variable, turns, after, code):
    """Decision: it could never end else. NEXT logs it."""
    task = loop(head, variable)
    assert task.value("C%") == turns
    assert task.value(variable) == pytest.approx(after, rel=1e-6)
    assert [item for _, item in logged(task)] == [code]
    assert logged(task)[0][0] in (220, 230), "the line of NEXT"
    assert task.value("B%") == 1


def test_limits_and_step_are_evaluated_once(loop):
    task = loop("FOR A% = D! TO D! + 3 STEP D!", "A%", "D! = 100", before=("D! = 1",))
    assert (task.value("C%"), task.value("A%")) == (4, 5)


@pytest.mark.parametrize(("step", "turns"), [(1, 4), (-1, 0), (2, 2)])
def test_a_step_known_at_run_time(loop, step, turns):
    assert loop("FOR A% = 1 TO 4 STEP D!", "A%", before=(f"D! = {step}",)).value("C%") == turns


def test_a_step_of_zero_is_logged_and_the_loop_skipped(loop):
    task = loop("FOR A% = 1 TO 4 STEP D!", "A%", before=("A% = 9",))
    assert (task.value("C%"), task.value("A%"), task.value("B%"), logged(task)) == (0, 1, 1, [(200, 7027)])


def test_the_body_may_set_the_variable(loop):
    task = loop("FOR A% = 1 TO 10", "A%", "IF A% = 3 THEN A% = 9")
    assert (task.value("C%"), task.value("A%")) == (4, 11)


def test_the_body_may_set_the_variable_beyond_the_limit(loop):
    task = loop("FOR A% = 1 TO 10", "A%", "A% = 32767")
    assert (task.value("C%"), task.value("A%"), [code for _, code in logged(task)]) == (1, 32767, [7020])


def test_a_block_may_set_the_variable(loop):
    task = loop("FOR A% = 1 TO 10", "A%", "CALL SUMMER(INPUT1=A%, INPUT2=32760, OUTPUT=A%)")
    assert (task.value("C%"), task.value("A%"), [code for _, code in logged(task)]) == (1, 32762, [])


def test_a_subroutine_may_set_the_variable():
    task = ran("FOR A% = 1 TO 3", "GOSUB 200", "NEXT A%", "GOTO 300", "200 A% = 32767", "RETURN", "300 B% = 1")
    assert (task.value("A%"), logged(task), task.value("B%")) == (32767, [(50, 7020)], 1)


@pytest.mark.parametrize("scan", [Task.scan, scan_in_steps], ids=["at once", "in steps"])
def test_a_common_as_variable_is_actual_memory(scan):
    text = lines("FOR K% = 1 TO 3", "N% = N% + K%", "NEXT K%", declare="COMMON K% \\ LOCAL N%")
    task, memory = task_of(text)
    memory.keep_log()
    task.run()
    scan(task, 1)
    assert (memory.read_now(0), task.value("N%")) == (4, 6)
    assert [entry.value for entry in memory.drain()] == [1, 2, 3, 4]


def test_a_forced_common_as_variable_runs_into_the_statement_limit():
    text = "10 COMMON K%\n20 LOCAL N%\n30 CALL SCAN_LOOP(TICKS=4)\n40 FOR K% = 1 TO 3\n60 NEXT K%\n70 END\n"
    task, memory = task_of(text)
    memory.force(0, 1)
    run_scans(task, 1)
    assert logged(task) == [(40, 7040)]


def test_goto_out_of_a_loop_keeps_the_variable_and_a_new_start_begins_anew():
    task = ran("FOR A% = 1 TO 10", "IF A% = 4 THEN 60", "NEXT A%", "60 B% = B% + A%", scans=3)
    assert (task.value("A%"), task.value("B%")) == (4, 12)


def test_two_loops_of_one_line_have_limits_of_their_own():
    task = ran(
        "A% = 3",
        "B% = 5",
        "FOR C% = 1 TO A% \\ FOR D! = 1 TO B% \\ E! = E! + 1 \\ NEXT D! \\ NEXT C%",
        "FOR C% = 1 TO A% \\ NEXT C% \\ FOR D! = 1 TO B% STEP A% \\ E! = E! + 100 \\ NEXT D!",
    )
    assert (task.value("E!"), task.value("C%"), task.value("D!")) == (215, 4, 7)
    names = [field.name for field in task.compiled.layout.fields if "FOR" in field.name]
    assert len(names) == len(set(names)) == 5


def test_sixteen_loops_nest_in_both_forms():
    for jumps in (False, True):
        variables = [f"V{number}%" for number in range(16)]
        opened = [f"FOR {name} = 1 TO {2 if name == 'V0%' else 1}" for name in variables]
        closed = [f"NEXT {name}" for name in reversed(variables)]
        jump = ["IF N% > 100 THEN 29000"] if jumps else []
        text = lines(
            *opened, "N% = N% + 1", *closed, *jump, "29000 N% = N% + 10", declare=f"LOCAL N%, {', '.join(variables)}"
        )
        task, _ = task_of(text)
        run_scans(task, 1)
        scan_in_steps(task, 2)
        assert task.value("N%") == 24


def test_writes_of_others_between_scans_do_not_disturb_a_loop():
    text = lines("FOR I% = 1 TO K%", "N% = N% + 1", "NEXT I%", declare="COMMON K% \\ LOCAL N%, I%")
    task, memory = task_of(text)
    task.run()
    for limit in (3, 0, 5):
        memory.write_from_outside(0, limit, OTHER)
        task.scan(1)
    assert task.value("N%") == 8
