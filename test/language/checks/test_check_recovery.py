"""One pass reports everything, and a line that cannot be read causes no errors elsewhere."""

import time

import pytest

from automax_ros.core.diagnostics import in_order
from automax_ros.language.text.reporter import DIAGNOSTIC_LIMIT
from language.check_support import check_text, codes, one, problems, program, task

LOOP = "CALL SCAN_LOOP(TICKS=4)"


def test_syntax_and_meaning_in_one_pass() -> None:
    found = problems(task("A% = ", "B% = SPEED%", "IF A% THEN 700", "CALL LAGG(INPUT=A%)", "X@ = -Y@"))
    assert [item.code for item in found] == ["AMX0040", "AMX4001", "AMX2005", "AMX4047", "AMX4070", "AMX2004"]
    assert [item.statement for item in found] == [30, 40, 50, 50, 60, 70]
    assert found == in_order(found)


@pytest.mark.parametrize(
    ("broken", "use"),
    [
        ("LOCAL A%, SPEED%,, B%", "SPEED% = A% + B%"),
        ("LOCAL A% B%, SPEED%", "SPEED% = A% + B%"),
        ("COMMON A%, B%(, SPEED%", "SPEED% = A% + B%"),
        ("LOCAL GAIN [CURRENT=], SPEED%", "SPEED% = GAIN"),
    ],
)
def test_names_of_a_broken_declaration_are_not_missed(broken: str, use: str) -> None:
    found = problems(f"10 {broken}\n20 {LOOP}\n30 {use}\n40 OTHER% = 1\n50 END\n")
    assert found[0].code.startswith("AMX0")
    assert [item.code for item in found if item.code.startswith("AMX4")] == ["AMX4001"]
    assert "OTHER%" in found[-1].message


def test_names_on_the_continuation_of_a_broken_declaration() -> None:
    text = f"10 LOCAL A%,, &\n  SPEED%\n20 {LOOP}\n30 SPEED% = A%\n40 END\n"
    assert all(code.startswith("AMX0") for code in codes(text))


@pytest.mark.parametrize(
    "broken",
    [
        "10 CALL SCAN_LOOP(TICKS=4\n20 END\n",
        f"10 {LOOP}\n20 END END\n",
        f"10 {LOOP}\n20 GOTO 30\n30 % = 5\n40 END\n",
        f"10 LOCAL A%\n20 {LOOP}\n30 READ A%\n40 DATA 1 2\n50 END\n",
        f"10 {LOOP}\n20 RETURN\n30 GOSUB\n40 END\n",
        f"10 LOCAL X@\n20 {LOOP}\n30 IF X@ THEN\n40 END\n",
        f"10 LOCAL X@\n20 IF X@ THEN\n30 {LOOP}\n40 END\n",
        "10 EVENT NAME GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=6\n20 CALL SCAN_LOOP(TICKS=4, EVENT=GO)\n30 END\n",
    ],
)
def test_a_broken_line_has_no_consequences(broken: str) -> None:
    found = codes(broken)
    assert found
    assert all(code.startswith("AMX0") for code in found)


def test_a_twin_of_another_type_is_one_error() -> None:
    found = one(task("S$ = A$"))
    assert (found.code, found.hint) == ("AMX4001", "did you mean A%?")


@pytest.mark.parametrize(
    ("statement", "hint"),
    [
        ("A% = SPED%", "did you mean SPEED%?"),
        ("A% = SPEED", "did you mean SPEED%?"),
        ("A% = LENS%('A')", "did you mean LEN%?"),
        ("A% = Q7%", "declare it with LOCAL or COMMON"),
    ],
)
def test_did_you_mean(statement: str, hint: str) -> None:
    assert one(task(statement, declare="LOCAL A%, SPEED%")).hint == hint


def test_line_numbers_that_do_not_exist_get_the_next_one() -> None:
    assert one(task("IF A% = 1 THEN 35", "A% = 1")).hint == "the next line is 40"


def test_problems_are_bounded() -> None:
    found = problems(task(*["UNKNOWN% = 1"] * 1000))
    assert len(found) == DIAGNOSTIC_LIMIT + 1
    assert "AMX0002" in {item.code for item in found}


def test_unconfirmed_forms_are_listed() -> None:
    result = check_text(task("A% = BIT_SET%(G%, 1)", "IOWRITE 1, 2, A%", declare="LOCAL A%, G% [CURRENT=1]"))
    assert [span.line for span, _ in result.unconfirmed] == [1, 3, 4]
    assert result.program is not None
    assert check_text(task("A% = ABS(B%)")).unconfirmed == []


def test_a_call_without_a_line_number_is_unconfirmed() -> None:
    """3.1 wants one; what stands in an IF of several lines has its own."""
    latch = "CALL LATCH(SET=X@, RESET=Y@, OUTPUT=X@)"
    text = task(
        f"A% = 1 \\ {latch}",
        f"IF X@ THEN {latch} ELSE {latch}",
        "IF X@ THEN",
        latch,
        "END_IF",
        declare="LOCAL A%, X@, Y@",
    )
    result = check_text(text)
    assert result.program is not None
    assert [span.line for span, _ in result.unconfirmed] == [3, 4, 4]
    assert all("line number" in what for _, what in result.unconfirmed)


def test_program_knows_its_source() -> None:
    text = task("A% = 1")
    assert program(text).source_hash == program(text).source_hash
    assert program(text).source_hash != program(task("A% = 2")).source_hash
    assert program(text).name == "TASK"
    assert program(text).target == "automax"


def test_hostile_texts_are_checked_quickly() -> None:
    start = time.process_time()
    names = ", ".join(f"V{number}%" for number in range(300))
    declarations = [f"{10 + index} LOCAL {names.replace('V', f'V{index}X')}" for index in range(60)]
    jumps = ",".join(str(20000 + number) for number in range(1000))
    body = [f"{1000 + index} ON V0X0% GOTO {jumps}" for index in range(20)]
    uses = [f"{2000 + index} V99X{index}% = V98X{index}%" for index in range(500)]
    check_text("\n".join([*declarations, f"900 {LOOP}", *body, *uses, "30000 END"]))
    nested = "(" * 60 + "A%" + ")" * 60
    check_text(task(f"A% = {nested}", f"A% = {'T%(' * 60}1{')' * 60}", f"A% = {'1/(' * 60}1{')' * 60}"))
    assert time.process_time() - start < 5.0
