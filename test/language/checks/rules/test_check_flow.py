"""The order of a task: SCAN_LOOP, END, jumps, what is reached (sections 3 and 4)."""

import pytest

from automax_ros.core.diagnostics import Span
from automax_ros.core.problems import Severity
from automax_ros.language.tree.tree import Assignment, Call, Data, Declaration, End, Remark
from language.check_support import check_text, codes, one, problems, program, task

LOOP = "CALL SCAN_LOOP(TICKS=4)"


def lines(*statements: str) -> str:
    return "".join(f"{10 * index} {statement}\n" for index, statement in enumerate(statements, 1))


def test_parts_of_a_program() -> None:
    found = program(lines("LOCAL A%", "A% = 1", "! START", LOOP, "A% = 2", "DATA 1", "END"))
    assert [type(item) for item in found.startup] == [Assignment, Remark]
    assert [type(item) for item in found.scan] == [Assignment, Data, End]
    assert found.ticks == 4
    assert found.period_ns == 22_000_000
    assert not any(isinstance(item, (Declaration, Call)) for item in (*found.startup, *found.scan))


NESTED = ("FOR A% = 1 TO 5", "IF A% = 3 THEN 70", "IF B% = 3 THEN 80", "B% = 4", "NEXT A%")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (lines("LOCAL A%", "A% = 1", "END"), ["AMX4040"]),
        ("", ["AMX4040", "AMX4044"]),
        (lines(LOOP, LOOP, "END"), ["AMX4041"]),
        (lines("LOCAL X@", "CALL TRANSITION(INPUT=X@, OUTPUT=X@)", LOOP, "END"), ["AMX4042"]),
        (lines("LOCAL X@", "IF X@ THEN", LOOP, "END_IF", "END"), ["AMX4043"]),
        (lines("LOCAL A%", "FOR A% = 1 TO 2", LOOP, "NEXT A%", "END"), ["AMX4043"]),
        (lines(LOOP), ["AMX4044"]),
        (lines("LOCAL X@", LOOP, "IF X@ THEN END"), ["AMX4044"]),
        (lines("LOCAL A%", LOOP, "END", "A% = 1"), ["AMX4045"]),
        (lines("LOCAL X@", "IF X@ THEN END", LOOP, "END"), ["AMX4046"]),
        (lines(LOOP, "LOCAL A%", "END"), ["AMX4003"]),
        (lines("LOCAL X@", "IF X@ THEN", "LOCAL A%", "END_IF", LOOP, "END"), ["AMX4004"]),
        (lines(LOOP, "EVENT NAME=GO", "END"), ["AMX4064"]),
        (lines("LOCAL X@", LOOP, "IF X@ THEN END", "X@ = TRUE", "END"), []),
        (lines(LOOP, "END", "REM LAST", "! LINE"), []),
        # Jumps over SCAN_LOOP, inside a block and out of it, from THEN into ELSE.
        (lines("LOCAL A%", "IF A% > 0 THEN 40", LOOP, "A% = 1", "END"), ["AMX4049"]),
        (lines("LOCAL A%, B%", LOOP, *NESTED, "END"), []),
        (lines("LOCAL A%", LOOP, "IF A% = 1 THEN", "GOTO 60", "ELSE", "A% = 1", "END_IF", "END"), ["AMX4050"]),
    ],
)
def test_order(text: str, expected: list[str]) -> None:
    assert codes(text) == expected


def test_second_scan_loop_shows_the_first() -> None:
    found = one(lines(LOOP, LOOP, "END"))
    assert (found.span, found.notes[0].span) == (Span(2, 4, 27), Span(1, 4, 27))


@pytest.mark.parametrize("jump", ["GOTO {}", "GOSUB {}", "IF A% > 1 THEN {}", "ON A% GOTO {}", "ON A% GOSUB {}"])
@pytest.mark.parametrize(
    ("line", "code"),
    [(25, "AMX4047"), (20, "AMX4048"), (15, "AMX4048"), (10, "AMX4051"), (50, "AMX4050"), (30, None), (60, None)],
)
def test_where_jumps_may_go(jump: str, line: int, code: str | None) -> None:
    text = (
        f"10 LOCAL A%\n15 A% = 0\n20 {LOOP}\n30 IF A% > 0 THEN {{}}\n40 IF A% = 0 THEN\n50 A% = 1\n60 END_IF\n"
        "70 A% = 2\n80 END\n"
    )
    statement = jump.format(line)
    filled = text.replace("IF A% > 0 THEN {}", statement).replace("{}", statement)
    errors = [item.code for item in problems(filled) if item.severity is Severity.ERROR]
    assert errors == ([code] if code else [])


def test_a_jump_to_scan_loop_tells_where_it_is() -> None:
    found = one(task("IF A% > 0 THEN 20"))
    assert found.code == "AMX4048"
    assert found.message == "GOTO 20 cannot be: the line is SCAN_LOOP"
    assert found.notes[0].span.line == 2


@pytest.mark.parametrize("jump", ["GOTO {}", "IF A% < 5 THEN {}", "IF A% < 5 THEN GOTO {}", "ON A% GOTO {}"])
@pytest.mark.parametrize("line", [20, 40, 50])
def test_no_jump_within_the_part_before_scan_loop(jump: str, line: int) -> None:
    """GOTO must not reference SCAN_LOOP or a line before it (4.0), from there neither; FOR may loop there."""
    start = ("LOCAL A%", "A% = A% + 1", jump.format(line), "A% = A% * 2")
    errors = [item for item in problems(lines(*start, LOOP, "END")) if item.severity is Severity.ERROR]
    assert [item.code for item in errors] == ["AMX4048"]
    assert "FOR" in (errors[0].hint or "")
    assert codes(lines("LOCAL A%, I%", "FOR I% = 1 TO 5", "A% = A% + 1", "NEXT I%", LOOP, "END")) == []


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        (("GOTO 50", "A% = 1", "B% = 1"), [40]),
        (("GOTO 50 \\ A% = 1", "B% = 1", "C% = 1"), [30]),
        (("STOP", "A% = 1"), [40]),
        (("IF A% = 1 THEN 50", "A% = 1"), []),
        (("GOTO 60", "REM A", "DATA 1", "A% = 1"), []),
        (("IF X@ THEN", "GOTO 80", "ELSE", "STOP", "END_IF", "A% = 1"), []),
        (("IF X@ THEN", "GOTO 90", "ELSE", "STOP", "END_IF", "A% = 1", "B% = 1"), [80]),
        (("IF X@ THEN", "GOTO 60", "A% = 1", "END_IF"), [50]),
        (("GOTO 30",), []),
    ],
)
def test_what_is_never_reached(statements: tuple[str, ...], expected: list[int]) -> None:
    found = problems(task(*statements))
    assert [(item.code, item.statement) for item in found] == [("AMX4054", line) for line in expected]


def test_warnings_leave_a_program() -> None:
    result = check_text(task("STOP", "A% = 1"))
    assert [item.code for item in result.diagnostics] == ["AMX4054"]
    assert result.program is not None


def test_data_pool_by_lines() -> None:
    found = program(task("DATA 1, -2, 0FFH", "READ A%, R, S$", "DATA -1.5, 'X' \\ DATA TRUE", "RESTORE 50", "READ X@"))
    assert found.data == (1, -2, 255, -1.5, "X", True)
    assert found.data_lines == ((30, 0), (50, 3))


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        (("READ A%",), ["AMX4053"]),
        (("RESTORE",), ["AMX4052"]),
        (("DATA 1", "RESTORE 40"), ["AMX4052"]),
        (("DATA 1", "RESTORE 35"), ["AMX4047"]),
        (("READ S$", "DATA 1"), ["AMX2017"]),
        (("READ X@", "DATA 1, 'A'"), ["AMX2017"]),
        (("READ A%, S$", "DATA 'A', 1"), []),
        (("RETURN",), ["AMX4055"]),
        (("FOR A% = 1 TO 5 STEP 0", "NEXT A%"), ["AMX4056"]),
        (("FOR A% = 1 TO 5 STEP 0.5", "NEXT A%"), ["AMX4056"]),
        (("FOR R = 1 TO 5 STEP 0.5", "NEXT R"), []),
        (("FOR A% = 5 TO 1 STEP -1", "NEXT A%"), []),
    ],
)
def test_data_and_loops(statements: tuple[str, ...], expected: list[str]) -> None:
    assert codes(task(*statements)) == expected
