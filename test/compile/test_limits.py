"""Nothing in a task can hang it or break the compiler: statements of a scan, depths, lengths, hostile names."""

from __future__ import annotations

import ast
import time

import pytest

from automax_ros.blocks.declare.declaration import HELPERS
from automax_ros.compile.compiler import compile_program
from automax_ros.compile.lowering.statements import STATEMENT_LIMIT
from automax_ros.runtime.tasks.task import Status
from compile.support import compiled_of, lines, logged, program_of, ran, run_scans, scan_in_steps, task_of, views_of

STOP_S = 3.0
"""A scan that never ends is stopped within about a second of processor time."""


def timed(work) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


ENDLESS = {
    "goto": ("A% = 5", "40 GOTO 40"),
    "goto over blocks": ("A% = 5", "CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=B%)", "GOTO 40"),
    "for": ("A% = 5", "FOR R = 0.0 TO 1.0E18", "NEXT R"),
    "for with a jump": ("A% = 5", "FOR R = 0.0 TO 1.0E18", "IF X@ THEN 60", "60 NEXT R"),
    "for that is set back": ("A% = 5", "FOR C% = 1 TO 3", "C% = 1", "NEXT C%"),
    "gosub": ("A% = 5", "40 GOSUB 60", "GOTO 40", "60 RETURN"),
    "on": ("A% = 5", "40 ON A% - 4 GOTO 40"),
}


@pytest.mark.parametrize("body", ENDLESS.values(), ids=ENDLESS)
def test_an_endless_scan_is_stopped(body):
    task, _ = task_of(lines(*body))
    assert timed(lambda: run_scans(task, 1)) < STOP_S
    assert task.status is Status.FAULTED
    (line, code) = logged(task)[0]
    assert (code, line >= 40) == (7040, True)
    assert task.value("A%") == 5, "the state is kept"
    number = task.scan_number
    task.scan(2)
    assert task.scan_number == number


def test_an_endless_scan_in_steps_is_stopped():
    task, _ = task_of(lines(*ENDLESS["goto over blocks"]))
    task.run()
    scan_in_steps(task, 1)
    assert (task.status, task.value("A%"), logged(task)[0][1]) == (Status.FAULTED, 5, 7040)


def test_an_endless_start_is_stopped():
    endless = "30 FOR N% = 1 TO 2\n31 N% = 1\n32 NEXT N%\n"
    task, _ = task_of(f"10 LOCAL A%, N%\n20 A% = 1\n{endless}40 CALL SCAN_LOOP(TICKS=4)\n50 END\n")
    task.run()
    assert (task.status, task.value("A%"), logged(task)) == (Status.FAULTED, 1, [(30, 7040)])


def test_run_starts_a_faulted_task_again():
    task, _ = task_of(lines("A% = A% + 1", "40 IF A% = 2 THEN 40"))
    run_scans(task, 2)
    assert task.status is Status.FAULTED
    run_scans(task, 3)
    assert (task.status, task.value("A%")) == (Status.RUNNING, 5)


@pytest.mark.parametrize(("turns", "status"), [(0, Status.RUNNING), (1, Status.FAULTED)])
def test_a_million_statements_are_allowed_one_more_is_not(turns, status):
    """FOR and assignment count in each turn, also where the loop is made of blocks."""
    count = (STATEMENT_LIMIT - 2) // 2 + 2 * turns
    task = ran(f"FOR D! = 1 TO {count}", "A% = 1", "NEXT D!")
    assert task.status is status


def test_a_jump_back_in_a_task_of_a_thousand_blocks_costs_few_comparisons():
    """A turn of the dispatch must not look at every block of the task."""
    labels = [f"{100 + 10 * number} IF A% = 1 THEN {110 + 10 * number}" for number in range(2000)]
    task, _ = task_of(lines(*labels, "20100 GOTO 20090"))
    assert timed(lambda: run_scans(task, 1)) < STOP_S
    assert task.status is Status.FAULTED


def long_task(kind: str, count: int) -> str:
    body = {
        "assignments": lambda number: f"T%({number % 10}) = T%({number % 7}) * 2 + A% / (B% + 1)",
        "blocks": lambda number: f"CALL PROP_INT(INPUT=A%, KP=2.0, WLD=1.0, RESET=-X@, OUTPUT=T%({number % 10}))",
        "jumps": lambda number: f"IF A% > {number} THEN {6 * number + 112 if number < count - 2 else 6 * count + 94}",
    }[kind]
    text = [f"{6 * number + 100} {body(number)}" for number in range(count)]
    return lines(*text).replace("30000 END", "32000 END")


LONG = pytest.mark.parametrize("kind", ["assignments", "blocks", "jumps"])


@LONG
def test_tasks_of_500_lines_compile_and_run(kind):
    task, _ = task_of(long_task(kind, 500))
    run_scans(task, 2)
    assert task.status is Status.RUNNING


@pytest.mark.soak
@LONG
def test_tasks_of_5000_lines_compile_and_run(kind):
    program = program_of(long_task(kind, 5000))
    assert timed(lambda: compile_program(program, {})) < 60
    task, _ = task_of(long_task(kind, 5000))
    run_scans(task, 2)
    scan_in_steps(task, 3)
    assert (task.status, task.scan_number) == (Status.RUNNING, 3)


def test_a_task_of_nested_conditions_compiles_in_both_forms():
    opened = [f"IF A% = {number} THEN" for number in range(16)]
    for inside in ("B% = 1", "IF B% = 0 THEN 29000"):
        task = ran(*opened[:15], inside, *["END_IF"] * 15, "29000 C% = 1")
        scan_in_steps(task, 2)
        assert (task.value("C%"), task.scan_number) == (1, 2)


HOSTILE = [
    "__IMPORT__", "__BUILTINS__", "__CLASS__", "_", "__", "_1", "T1", "OVER", "PC", "STEPS", "LATCH1", "STATE", "IO",
    "NONE", "DATA_POINTER", "CHANGES", "IMPORT", "LAMBDA", "EXEC", "EVAL", "B30_X", "LATCHED_A", "COST", "GLOBALS",
]  # fmt: skip
PAYLOADS = [
    "__import__('os').system('true')",
    "'); raise SystemExit #",
    "''' + x + '''",
    "\\\\n\\\\x00{}%s",
    "{0.__class__}",
    "# -*- coding",
    "éß€",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_are_variables_like_any_other(name):
    text = f"10 LOCAL {name}%, {name}!, {name}@, {name}, {name}$\n20 COMMON A{name[:14]}%\n30 CALL SCAN_LOOP(TICKS=4)\n"
    text += f"""40 {name}% = {name}% + 1
50 {name}! = {name}% * 2
60 {name}@ = {name}% > 0
70 {name} = {name}% * 2.5
80 {name}$ = STR$({name}%)
90 A{name[:14]}% = {name}%
100 CALL RAMP(INPUT={name}%, OUTPUT={name}%)
110 FOR {name}! = 1 TO {name}%
120 IF {name}@ THEN 130
130 NEXT {name}!
140 END
"""
    task, memory = task_of(text)
    run_scans(task, 2)
    assert [task.value(f"{name}{suffix}") for suffix in "%!@$"] == [2, 3, True, "2"]
    assert (task.value(name), memory.read_now(0)) == (5.0, 2)


@pytest.mark.parametrize("payload", PAYLOADS)
def test_strings_of_the_source_stay_strings(payload):
    task = ran(
        f'S$ = "{payload}"', f'PRINT "{payload}"', "READ P$", f'DATA "{payload}"', declare="LOCAL S$:132, P$:132"
    )
    assert (task.value("S$"), task.value("P$"), list(task.printed)) == (payload, payload, [payload])
    constants = {node.value for node in ast.walk(ast.parse(task.compiled.source)) if isinstance(node, ast.Constant)}
    assert payload in constants


ALLOWED_CALLS = {
    *HELPERS, "latch", "commit", "log", "read_now", "write_now", "append", "ScanTooLong", "integer_quotient", "joined",
    "b110_coefficients", "text_of",
}  # fmt: skip
FULL = """10 COMMON K%, KR, KT%(3)
20 LOCAL A%, B%, S$, X@
30 CALL SCAN_LOOP(TICKS=4)
40 A% = A% + K% / 2
50 KT%(A%) = A%
60 S$ = S$ + STR$(A%)
70 IF A% > 10 THEN GOTO 100
80 K% = MIN(A%, 3)
100 CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=K%)
110 CALL LAG(INPUT=A%, WLG=KR, OUTPUT=B%)
120 END
"""


def test_generated_code_knows_nothing_but_its_own_helpers():
    compiled = compiled_of(FULL)
    scope = compiled.scans.__globals__
    assert scope["__builtins__"] == {}
    called = set()
    for node in ast.walk(ast.parse(compiled.source)):
        assert not isinstance(node, (ast.Import, ast.ImportFrom, ast.Global, ast.Lambda))
        if isinstance(node, ast.Attribute):
            assert node.attr == "append" or node.value.id == "io"
            assert not node.attr.startswith("_")
        if isinstance(node, ast.Call):
            called.add(node.func.id if isinstance(node.func, ast.Name) else node.func.attr)
    assert called <= ALLOWED_CALLS
    assert all(
        not isinstance(value, type) or value.__name__ in ("ScanTooLong", "int", "float") for value in scope.values()
    )


def test_compiled_source_is_what_runs():
    """``automax compile`` prints the function: it parses, and both forms stand in it."""
    compiled = compiled_of(FULL)
    names = [node.name for node in ast.parse(compiled.source).body]
    assert names == ["startup", "scans", "scan_steps"]
    assert compiled.source == compiled_of(FULL).source
    assert len(views_of(compiled.program)) == 3


def test_statements_that_do_not_execute_do_not_count_towards_the_limit():
    rare = [f"{60 + number} B% = {number}" for number in range(60)]
    task = ran("40 FOR D! = 1 TO 20000", "50 IF D! = 3 THEN", *rare, "130 END_IF", "140 NEXT D!")
    assert (task.status, task.value("D!")) == (Status.RUNNING, 20001)


@pytest.mark.parametrize("jump", ["", "GOTO 500"])
def test_branches_of_an_if_inside_a_loop_count_when_they_execute(jump):
    inner = [f"{60 + number} B% = {number}" for number in range(60)]
    tail = [f"400 {jump}", "500 A% = 1"] if jump else []
    task = ran("40 FOR D! = 1 TO 20000", "50 IF D! > 0 THEN", *inner, "130 END_IF", "140 NEXT D!", *tail)
    assert task.status is Status.FAULTED
