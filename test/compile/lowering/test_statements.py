"""BASIC statements: IF, GOTO, GOSUB, ON, READ, PRINT, STOP and END inside blocks (semantics, BASIC)."""

from __future__ import annotations

import dataclasses

import pytest

from automax_ros.compile.compiler import compile_program
from automax_ros.runtime.tasks.task import Status, Task
from compile.support import OTHER, lines, logged, program_of, ran, run_scans, scan_in_steps, task_of


@pytest.fixture(params=["at once", "in steps"])
def scan(request):
    """Both forms of a scan."""
    return Task.scan if request.param == "at once" else scan_in_steps


@pytest.mark.parametrize(("value", "expected"), [(5, 1), (15, 2), (25, 3)])
def test_if_in_both_forms_nests(value, expected):
    task = ran(
        f"A% = {value}",
        "IF A% < 10 THEN",
        "B% = 1",
        "ELSE",
        "IF A% < 20 THEN B% = 2 ELSE B% = 3",
        "END_IF",
        "IF B% = 1 THEN C% = 1 \\ D! = 1",
    )
    assert task.value("B%") == expected
    assert (task.value("C%"), task.value("D!")) == ((1, 1) if expected == 1 else (0, 0))


def test_a_condition_logs_its_overflow_whatever_it_decides():
    task = ran("A% = 30000", "IF A% * A% * A% > 0 THEN B% = 1")
    assert (task.value("B%"), logged(task)) == (1, [(40, 7023)])


def test_goto_forward_and_back():
    task = ran("A% = A% + 1", "IF A% < 5 THEN 30", "GOTO 70", "60 B% = 1", "70 C% = A%", "IF X@ THEN 60")
    assert (task.value("A%"), task.value("B%"), task.value("C%")) == (5, 0, 5)


def test_then_with_goto_and_else():
    body = ("IF A% = 0 THEN GOTO 60 ELSE B% = 7", "C% = 1", "GOTO 70", "60 C% = 2", "70 A% = 1")
    task = ran(*body)
    assert (task.value("B%"), task.value("C%")) == (0, 2)
    task = ran(*body, scans=2)
    assert (task.value("B%"), task.value("C%")) == (7, 1)


def test_goto_leaves_nested_blocks():
    task = ran(
        "FOR A% = 1 TO 5",
        "FOR B% = 1 TO 5",
        "IF B% = 3 THEN",
        "IF A% = 2 THEN 100",
        "END_IF",
        "NEXT B%",
        "NEXT A%",
        "100 C% = A% * 10 + B%",
    )
    assert task.value("C%") == 23


def test_goto_the_line_of_else_end_if_and_next():
    task = ran(
        "FOR A% = 1 TO 4",
        "IF A% > 2 THEN",
        "IF A% = 3 THEN 80",
        "B% = B% + 1",
        "ELSE",
        "80 END_IF",
        "IF A% = 4 THEN 110",
        "C% = C% + 1",
        "110 NEXT A%",
    )
    assert (task.value("A%"), task.value("B%"), task.value("C%")) == (5, 1, 3)


SUBROUTINES = ("GOSUB 100", "B% = B% + 1", "GOTO 900", "100 A% = A% + 1", "IF A% < {depth} THEN GOSUB 100", "RETURN")


def test_gosub_nests_16_deep():
    text = lines(*(statement.format(depth=16) for statement in SUBROUTINES), "900 C% = 1")
    task, _ = task_of(text)
    run_scans(task, 1)
    assert (task.value("A%"), task.value("B%"), logged(task)) == (16, 1, [])


def test_the_17th_gosub_is_logged_and_skipped(scan):
    text = lines(*(statement.format(depth=30) for statement in SUBROUTINES), "900 C% = 1")
    task, _ = task_of(text)
    task.run()
    scan(task, 1)
    assert (task.value("A%"), task.value("B%"), task.value("C%")) == (16, 1, 1)
    assert logged(task) == [(110, 7028)]


def test_return_without_gosub_is_logged_and_skipped(scan):
    task, _ = task_of(lines("IF X@ THEN GOSUB 50", "RETURN", "50 A% = A% + 1", "RETURN", "B% = 1"))
    task.run()
    scan(task, 1)
    assert (task.value("A%"), task.value("B%"), logged(task)) == (1, 1, [(40, 7029), (60, 7029)])


def test_a_scan_begins_without_subroutines_in_progress():
    """A subroutine that leaves by END takes nothing of the 16 levels from the next scan."""
    text = lines("GOSUB 100", "GOTO 900", "100 A% = A% + 1", "IF A% > 0 THEN END", "RETURN", "900 B% = 1")
    task, _ = task_of(text)
    run_scans(task, 40)
    assert (task.value("A%"), logged(task)) == (40, [])


def test_gosub_inside_a_loop_comes_back_into_it():
    task = ran("FOR A% = 1 TO 4", "GOSUB 100", "NEXT A%", "GOTO 900", "100 B% = B% + A%", "RETURN", "900 C% = A%")
    assert (task.value("B%"), task.value("C%")) == (10, 5)


@pytest.mark.parametrize(("selector", "expected"), [(0, 9), (1, 1), (2, 2), (3, 1), (4, 9), (-1, 9), (32767, 9)])
def test_on_counts_from_1_and_goes_on_out_of_range(selector, expected):
    jumps = ("ON A% GOTO 100,200,100", "B% = 9", "GOTO 300", "100 B% = 1", "GOTO 300", "200 B% = 2", "300 C% = 1")
    task = ran(f"A% = {selector}", *jumps)
    assert (task.value("B%"), task.value("C%"), logged(task)) == (expected, 1, [])


@pytest.mark.parametrize(("selector", "expected"), [(0, 0), (1, 10), (2, 1), (3, 0)])
def test_on_gosub_comes_back_behind_it(selector, expected):
    task = ran(
        f"A% = {selector}",
        "ON A% GOSUB 100, 200",
        "C% = 1",
        "GOTO 900",
        "100 B% = B% + 10",
        "RETURN",
        "200 B% = B% + 1",
        "RETURN",
        "900 D! = 1",
    )
    assert (task.value("B%"), task.value("C%"), task.value("D!")) == (expected, 1, 1)


def test_an_on_with_a_thousand_lines_compiles():
    targets = ", ".join(["50"] * 1000)
    task = ran("A% = 777", f"ON A% GOTO {targets}", "50 B% = 5")
    assert task.value("B%") == 5


DATA = ("READ A%, R, S$, X@", "READ B%", "DATA 1, 2.5", 'DATA "TEXT", TRUE', "DATA 70000, -3")


def test_read_takes_values_in_order_across_data_lines_and_scans():
    task = ran(*DATA)
    assert [task.value(name) for name in ("A%", "R", "S$", "X@")] == [1, 2.5, "TEXT", True]
    assert (task.value("B%"), logged(task)) == (32767, [(40, 7020)])
    task.scan(2)
    assert task.value("A%") == -3
    assert [code for _, code in logged(task)] == [7020, 7030, 7030]


def test_read_past_the_end_leaves_the_variable():
    task = ran("A% = 7", "READ B%, A%", "DATA 5")
    assert (task.value("B%"), task.value("A%"), logged(task)) == (5, 7, [(40, 7030)])


def test_read_of_another_kind_gives_zero():
    task = ran("READ A%, S$, X@, B%", 'DATA "TEXT", 5, 1, FALSE, 7, "A", TRUE')
    assert [task.value(name) for name in ("A%", "S$", "X@", "B%")] == [0, "", False, 0]
    assert task.errors.count == 4
    assert {code for _, code in logged(task)} == {7032}


def test_one_read_logs_one_overflow():
    task = ran("READ A%, B%, D!", "DATA 40000, -40000, 1.0E10")
    assert ([task.value(name) for name in ("A%", "B%", "D!")], logged(task)) == (
        [32767, -32768, 2**31 - 1],
        [(30, 7020)],
    )


def test_restore_goes_back_to_the_start_or_to_a_line():
    task = ran("READ A%, A%, A%", "RESTORE", "READ B%", "RESTORE 80", "READ C%", "80 DATA 3, 4", "DATA 5", scans=1)
    assert (task.value("A%"), task.value("B%"), task.value("C%")) == (5, 3, 3)
    task = ran("RESTORE 70", "READ A%", "GOTO 80", "60 DATA 1", "70 DATA 2", "80 B% = 1")
    assert task.value("A%") == 2


def test_run_begins_with_the_first_data_again():
    task = ran("READ A%", "DATA 1, 2, 3", scans=2)
    assert task.value("A%") == 2
    run_scans(task, 1)
    assert task.value("A%") == 1


def test_print_zones_and_kinds():
    task = ran('PRINT "A"; 1, 2.5; TRUE, "B"', "PRINT", "PRINT 0.1 * 3; -0.0 * 1; 1.0E10", "PRINT 1;")
    assert list(task.printed) == ["A1" + " " * 12 + "2.5TRUE       B", "", "0.301E+10", "1"]


def test_end_inside_an_if_ends_the_scan_with_write_back(scan):
    text = """10 COMMON OUT%, LATE%
20 CALL SCAN_LOOP(TICKS=4)
30 CALL SUMMER(INPUT1=OUT%, INPUT2=1, OUTPUT=OUT%)
40 IF OUT% = 0 THEN END
50 LATE% = LATE% + 1
60 END
"""
    task, memory = task_of(text)
    task.run()
    scan(task, 1)
    assert (memory.read_now(0), memory.read_now(1), task.status) == (1, 0, Status.RUNNING)
    scan(task, 2)
    assert (memory.read_now(0), memory.read_now(1)) == (2, 1)


def test_stop_ends_the_task_and_commits_nothing(scan):
    text = """10 COMMON OUT%, NOW%
20 LOCAL A%
30 CALL SCAN_LOOP(TICKS=4)
40 CALL SUMMER(INPUT1=OUT%, INPUT2=1, OUTPUT=OUT%)
50 NOW% = NOW% + 1
60 A% = A% + 1
70 IF A% = 2 THEN STOP
80 A% = A% + 10
90 IF A% > 100 THEN A% = 1
100 END
"""
    task, memory = task_of(text)
    task.run()
    scan(task, 1)
    assert (memory.read_now(0), memory.read_now(1), task.value("A%")) == (1, 1, 11)
    task.state[task.compiled.layout.index("A%")] = 1
    scan(task, 2)
    assert (memory.read_now(0), memory.read_now(1), task.value("A%")) == (1, 2, 2)
    assert task.status is Status.ENDED
    scan(task, 3)
    assert (memory.read_now(1), task.scan_number) == (2, 2)


def test_stop_before_scan_loop_ends_the_task():
    task, _ = task_of("10 LOCAL A%\n20 A% = 1\n30 IF A% = 1 THEN STOP\n40 CALL SCAN_LOOP(TICKS=4)\n50 A% = 2\n60 END\n")
    task.run()
    task.scan(1)
    assert (task.status, task.value("A%")) == (Status.ENDED, 1)


def test_remarks_behind_end_do_not_make_a_task_jump():
    task, _ = task_of(lines("A% = A% + 1") + "31000 REM THE END\n31010 ! OF ALL\n")
    assert "pc = " not in task.compiled.source
    assert "pc = " in task_of(lines("A% = A% + 1", "GOTO 30000"))[0].compiled.source
    run_scans(task, 2)
    assert task.value("A%") == 2


def test_a_jump_behind_end_ends_the_scan():
    task, memory = task_of(
        "10 COMMON K%\n20 LOCAL A%\n30 CALL SCAN_LOOP(TICKS=4)\n40 CALL SUMMER(INPUT1=K%, INPUT2=1, OUTPUT=K%)\n"
        "50 IF K% = 0 THEN 80\n60 A% = A% + 1\n70 END\n80 REM OUT\n"
    )
    run_scans(task, 3)
    assert (memory.read_now(0), task.value("A%")) == (3, 2)


def test_statements_of_one_line_log_that_line():
    task = ran("A% = 1 \\ A% = 40000 * A% \\ FOR B% = 1 TO 1 \\ A% = 1 / C% \\ NEXT B% \\ C% = T%(11 * A%)")
    assert {line for line, _ in logged(task)} == {30}


def test_a_statement_on_the_line_of_scan_loop_logs_that_line():
    task, _ = task_of("10 LOCAL A!, B%\n20 CALL SCAN_LOOP(TICKS=4) \\ A! = 1 / B%\n30 END\n")
    run_scans(task, 1)
    assert logged(task) == [(20, 7024)]


def test_the_error_log_is_tested_and_cleared_by_the_task():
    task = ran("X@ = TST_ERRLOG@", "A% = 1 / B%", "Y@ = TST_ERRLOG@", "IF A% = 0 THEN CLR_ERRLOG", "CLR_ERRLOG")
    assert (task.value("X@"), task.value("Y@"), logged(task)) == (False, True, [])


def test_io_without_a_module_is_a_bus_error():
    task = ran("A% = IOREAD%(3, 0)", "IOWRITE 3, 0, A%")
    assert logged(task) == [(30, 7031), (40, 7031)]


def test_what_runs_before_scan_loop_uses_actual_memory_once():
    task, memory = task_of(
        "10 COMMON N%\n20 LOCAL A%\n30 N% = N% + 5\n40 CALL SCAN_LOOP(TICKS=4)\n50 A% = N%\n60 END\n"
    )
    memory.write_from_outside(0, 1, OTHER)
    run_scans(task, 3)
    assert (memory.read_now(0), task.value("A%")) == (6, 6)
    task.run()
    assert memory.read_now(0) == 11


def test_a_statement_without_a_lowering_is_an_error():
    unknown = dataclasses.make_dataclass("Unknown", ["number"])(100)
    program = dataclasses.replace(program_of(lines("A% = 1")), scan=(unknown,))
    with pytest.raises(TypeError, match="no lowering of Unknown"):
        compile_program(program, {})
