"""What the parser says about wrong texts, frozen as golden files, and that it says it once and at the right place."""

from pathlib import Path

import pytest
from golden_text import GOLDEN, check_golden

from automax_ros.core.diagnostics import Diagnostic, SourceText, render_all
from automax_ros.core.problems import PROBLEMS
from automax_ros.language.parse.parser import SOURCE_LIMIT, parse
from automax_ros.language.text.reporter import DIAGNOSTIC_LIMIT

TEXTS = sorted((GOLDEN / "diagnostics").glob("syntax_*.BLK"))
LARGE = {"AMX0001", "AMX0002", "AMX0005", "AMX0006"}
"""Codes of texts too large for a golden file, or not text; tested here."""


def problems(text: str) -> list[Diagnostic]:
    return parse(SourceText("TASK.BLK", text))[1]


def codes(text: str) -> list[str]:
    return [item.code for item in problems(text)]


def source_of(path: Path) -> SourceText:
    return SourceText(path.name, path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.stem)
def test_rendered_diagnostics_are_the_golden_ones(path: Path) -> None:
    source = source_of(path)
    check_golden(path.with_suffix(".expected.txt"), render_all(parse(source)[1], source))


def test_golden_files_show_every_syntax_code() -> None:
    shown = {item.code for path in TEXTS for item in parse(source_of(path))[1]}
    assert shown | LARGE == {code for code in PROBLEMS if code[3] == "0"}


def test_update_switch_is_refused_in_continuous_integration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AUTOMAX_UPDATE_GOLDEN", "1")
    monkeypatch.setenv("CI", "true")
    with pytest.raises(RuntimeError, match="continuous integration"):
        check_golden(tmp_path / "new.txt", "text")
    assert not (tmp_path / "new.txt").exists()


def test_text_above_the_limit_is_refused_unread() -> None:
    module, found = parse(SourceText("TASK.BLK", "10 END".ljust(SOURCE_LIMIT + 1)))
    assert [item.code for item in found] == ["AMX0001"]
    assert module.statements == ()
    assert codes("10 END".ljust(SOURCE_LIMIT)) == []


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_a_utf_16_source_gives_one_error(encoding: str) -> None:
    text = "10 LOCAL A%\n20 CALL SCAN_LOOP(TICKS=4)\n30 A% = A% + 1\n40 END\n"
    module, found = parse(SourceText("TASK.BLK", text.encode(encoding).decode("latin-1")))
    assert [item.code for item in found] == ["AMX0006"]
    assert "UTF-8" in (found[0].hint or "")
    assert module.statements == ()


def test_a_zero_byte_in_a_plain_text_is_a_character_without_meaning() -> None:
    assert codes("10 LOCAL A%\n20 A% = 1 \0\n30 END\n") == ["AMX0004"]


@pytest.mark.parametrize("rest", ["", "\n", "garbage ,,,\n", "\0" * 100, "50 A% =\n60 END\n", "\x1a\x1a"])
def test_text_after_ctrl_z_is_ignored_as_dos_does(rest: str) -> None:
    text = "10 LOCAL A%\r\n20 A% = 1\r\n30 END\r\n"
    module, found = parse(SourceText("TASK.BLK", f"{text}\x1a{rest}"))
    assert found == []
    assert module == parse(SourceText("TASK.BLK", text))[0]


def test_problems_end_at_the_limit_with_one_that_says_so() -> None:
    few = "\n".join(f"{number} A% = " for number in range(1, DIAGNOSTIC_LIMIT + 1))
    assert codes(few) == ["AMX0040"] * DIAGNOSTIC_LIMIT
    many = few + f"\n{DIAGNOSTIC_LIMIT + 1} A% = \n{DIAGNOSTIC_LIMIT + 2} A% = "
    assert codes(many) == ["AMX0040"] * DIAGNOSTIC_LIMIT + ["AMX0002"]


@pytest.mark.parametrize(("length", "expected"), [(8192, []), (8193, ["AMX0005"])])
def test_statement_has_at_most_8192_characters(length: int, expected: list[str]) -> None:
    statement = "A% = 1".ljust(length - len("+ 1")) + "+ 1"
    assert codes(f"10 B% = 2 \\ {statement}\n20 END") == expected


def test_continuation_lines_count_in_the_length_of_a_statement() -> None:
    assert codes("10 PRINT " + "A%, &\n" * 1600 + "B%\n20 END") == ["AMX0005"]


def test_lower_case_gives_one_warning_at_its_first_place() -> None:
    found = problems('10 ! remark\n20 PRINT "text"\n30 A% = b%\n40 c% = a%\n50 end')
    assert [(item.code, item.span.line, item.span.column) for item in found] == [("AMX0003", 3, 9)]


def test_statement_is_the_line_number_in_force() -> None:
    found = problems("10 A% = \n20 CALL X(A = B%, &\n   C = )\n30 D% = 1 \\ E% =\n40 FOR I% = 1 TO 3\n50 END")
    assert [(item.code, item.statement, item.span.line) for item in found] == [
        ("AMX0040", 10, 1),
        ("AMX0040", 20, 3),
        ("AMX0040", 30, 4),
        ("AMX0055", 40, 5),
    ]


@pytest.mark.parametrize("word", ["WAIT ON X", "DELAY 3 TICKS", "START EVERY 3 TICKS", "INPUT A%", "GET A%", "PUT A%"])
def test_statements_that_suspend_a_task_have_their_own_answer(word: str) -> None:
    found = problems(f"10 {word}\n20 END")
    assert [item.code for item in found] == ["AMX0031"]
    assert "suspended" in found[0].message


def test_words_of_basic_tasks_can_be_variables() -> None:
    assert codes("10 DELAY = 3.0\n20 INPUT = DELAY\n30 SET@ = TRUE\n40 STOP@ = SET@\n50 STEP% = 3") == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("10 IF A% = = 3 THEN\n20 B% = 1\n30 ELSE\n40 B% = 2\n50 END_IF", ["AMX0041"]),
        ("10 IF A% 3\n20 B% = 1\n30 END_IF", ["AMX0050"]),
        ("10 FOR I% 1 TO 3\n20 B% = 1\n30 NEXT I%", ["AMX0035"]),
        ("10 IF A@ THEN\n20 B% = 1\n30 EDN_IF\n40 B% = 2", ["AMX0030"]),
        ("10 FOR I% = 1 TO 3\n20 NXET I%", ["AMX0030"]),
        ("10 IF A@ THEN\n20 IF B@ THN\n30 END_IF\n40 END_IF", ["AMX0050"]),
        ("10 FOR I% = 1 TO 3\n20 NEXT", ["AMX0057"]),
        ("10 FOR I% = 1 TO 3\n20 NEXT J%\n30 A% = 1", ["AMX0057"]),
        ("10 FOR I% = 1 TO 3\n20 FOR J% = 1 TO 3\n30 NEXT I%\n40 NEXT J%", ["AMX0055"]),
        ("10 IF A@ THEN\n20 FOR I% = 1 TO 3\n30 END_IF\n40 NEXT I%", ["AMX0055"]),
        ("10 IF A@ THEN B% = 1\n20 ELSE\n30 B% = 2\n40 END_IF", ["AMX0051"]),
        ("10 IF A@ B% = 1\n20 C% = 1", ["AMX0050"]),
        ("10 CALL X(A = B%\n  C = D%)\n20 END", ["AMX0016"]),
        ("10 PRINT \"A &\n B\n20 END", ["AMX0020"]),
        ("10 IF A@ THEN B% = \\ C% = 1 ELSE D% = 1", ["AMX0040"]),
    ],
)  # fmt: skip
def test_one_mistake_gives_one_error(text: str, expected: list[str]) -> None:
    assert codes(text) == expected


def test_good_statements_around_bad_ones_are_kept() -> None:
    module, found = parse(SourceText("T", "10 LOCAL A%\n20 CALL X(A = , B = C%) \\ A% = 1\n30 A% = (2\n40 END"))
    assert [item.code for item in found] == ["AMX0040", "AMX0042"]
    kinds = [(type(item).__name__, item.number) for item in module.statements]
    assert kinds == [("Declaration", 10), ("Assignment", 20), ("Label", 30), ("End", 40)]
