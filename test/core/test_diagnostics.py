"""Diagnostics as a person and a program read them."""

from automax_ros.core.diagnostics import (
    Diagnostic,
    Note,
    SourceText,
    Span,
    as_json,
    has_errors,
    in_order,
    render,
    render_all,
)
from automax_ros.core.problems import PROBLEMS, Severity
from automax_ros.core.text import printable

SOURCE = SourceText("task.blk", "10 LOCAL A%\r\n\t20 B% = 1\n30 END")
FAULT = Diagnostic(
    "AMX4001", "B% is not declared", Span(2, 5, 7), 20, "did you mean A%?", (Note("here", Span(1, 10, 12)),)
)
WARNING = Diagnostic("AMX4054", "this statement is never reached", Span(1, 1, 3), 10)


def test_rendered_with_caret_note_and_hint() -> None:
    assert render(FAULT, SOURCE) == (
        "task.blk:2:5: error[AMX4001]: B% is not declared\n"
        "  \t20 B% = 1\n"
        "  \t   ^^\n"
        "task.blk:1:10: note: here\n"
        "  10 LOCAL A%\n"
        "           ^^\n"
        "  hint: did you mean A%?"
    )


def test_rendered_in_the_order_of_the_text() -> None:
    text = render_all([FAULT, WARNING], SOURCE)
    assert text.index("warning[AMX4054]") < text.index("error[AMX4001]")
    assert text.endswith("\n")
    assert in_order([FAULT, WARNING]) == [WARNING, FAULT]


def test_a_place_outside_of_the_text_has_no_excerpt() -> None:
    assert "\n" not in render(Diagnostic("AMX4044", "no END", Span(9, 1, 2)), SOURCE)


def test_a_caret_never_leaves_its_line_by_more_than_one() -> None:
    rendered = render(Diagnostic("AMX4044", "no END", Span(3, 4, 99)), SOURCE).splitlines()
    assert rendered[-1] == "     ^^^^"


def test_of_a_long_line_only_the_part_around_the_fault_is_shown() -> None:
    source = SourceText("x", "A" * 300 + "BAD" + "C" * 1_000_000)
    place, excerpt, caret = render(Diagnostic("AMX0036", "x", Span(1, 301, 304)), source).splitlines()
    assert place == "x:1:301: error[AMX0036]: x"
    assert len(excerpt) < 300
    assert excerpt[caret.index("^") : caret.index("^") + 3] == "BAD"
    assert caret.count("^") == 3
    assert excerpt.startswith("  ...A")
    assert excerpt.endswith("C...")


def test_carets_of_a_long_fault_stay_below_the_part_that_is_shown() -> None:
    source = SourceText("x", "A" * 1000)
    for column in (1, 500, 1000):
        _, excerpt, caret = render(Diagnostic("AMX0005", "x", Span(1, column, 1001)), source).splitlines()
        assert len(caret) <= len(excerpt)
        assert excerpt[caret.index("^")] == "A"


def test_control_characters_do_not_reach_the_terminal() -> None:
    source = SourceText("x", "10 A$ = '\x1b[2J'")
    assert "\x1b" not in render(Diagnostic("AMX0004", "x", Span(1, 10, 11)), source)
    assert printable("a\tb\x07") == "a\tb\N{REPLACEMENT CHARACTER}"


def test_json_record() -> None:
    assert as_json(FAULT, SOURCE) == {
        "file": "task.blk",
        "line": 2,
        "column": 5,
        "end_column": 7,
        "statement": 20,
        "severity": "error",
        "code": "AMX4001",
        "message": "B% is not declared",
        "hint": "did you mean A%?",
    }
    assert as_json(WARNING, SOURCE)["severity"] == "warning"


def test_severity_comes_from_the_table() -> None:
    assert FAULT.severity is Severity.ERROR
    assert has_errors([WARNING, FAULT])
    assert not has_errors([WARNING])


def test_lines_end_in_any_fashion() -> None:
    assert SourceText("x", "a\r\nb\rc\nd").lines == ["a", "b", "c", "d"]


def test_span_to_another() -> None:
    assert Span(1, 3, 5).to(Span(1, 8, 9)) == Span(1, 3, 9)
    assert Span(1, 3, 5).to(Span(2, 1, 9)) == Span(1, 3, 5)
    assert Span(1, 3, 9).to(Span(1, 4, 5)) == Span(1, 3, 9)


def test_table_is_sorted_and_its_titles_are_phrases() -> None:
    assert list(PROBLEMS) == sorted(PROBLEMS)
    for code, problem in PROBLEMS.items():
        assert problem.code == code
        assert problem.number == int(code[3:])
        assert not problem.title.endswith(".")
