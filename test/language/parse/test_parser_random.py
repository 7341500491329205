"""Whatever the text: diagnostics with codes of the table and places inside the text, never an exception, never slow."""

import dataclasses
import time

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from automax_ros.core.diagnostics import SourceText, render_all
from automax_ros.core.problems import PROBLEMS
from automax_ros.language.parse.parser import SOURCE_LIMIT, parse
from automax_ros.language.printer import print_module
from automax_ros.language.text.reporter import DIAGNOSTIC_LIMIT
from automax_ros.language.text.tokens import BASIC_TASK_WORDS, RESERVED_WORDS
from automax_ros.language.tree.tree import For, If, Label, Module, Remark, Statement
from language.random_trees import modules

SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
MARKS = [*"()[],;:#\\&!%@$+-*/=<>.'\"?^|~{}_ \t\n", "\r\n", "**", "<>", " &\n", "\n10 ", "\n20 ", "\x1a", "\0", "é"]
TOKENS = [
    *sorted(RESERVED_WORDS | BASIC_TASK_WORDS.keys()),
    "A%", "B@", "C$", "D!", "GAIN", "ABS", "TST_ERRLOG@", "RND", "CURRENT", "TICKS", "SUMMER", "ENDIF", "ELSEIF", "IFF",
    "1", "32768", "99999", "1.5", "1E30", "0FFH", "12AB", '"text"', "'text'", "NAME", "THIS_IS_MUCH_TOO_LONG%",
]  # fmt: skip


def check_text(text: str) -> None:
    """Parse a text and check what every text must give."""
    source = SourceText("TASK.BLK", text)
    module, problems = parse(source)
    assert isinstance(module, Module)
    assert len(problems) <= DIAGNOSTIC_LIMIT + 1
    lines = source.lines
    for item in problems:
        assert item.code in PROBLEMS
        for span in (item.span, *(note.span for note in item.notes)):
            assert 1 <= span.line <= len(lines)
            assert 1 <= span.column <= len(lines[span.line - 1]) + 1
            assert span.column < span.end_column <= len(lines[span.line - 1]) + 2
    assert render_all(problems, source).count("\n") >= len(problems)
    assert parse(source) == (module, problems)


@settings(max_examples=400, deadline=None, derandomize=True, suppress_health_check=SLOW)
@given(st.text(max_size=200))
@example("\ud800")
@example("10 PRINT '\ud800'")
def test_any_text(text: str) -> None:
    check_text(text)


@settings(max_examples=200, deadline=None, derandomize=True, suppress_health_check=SLOW)
@given(st.binary(max_size=300))
def test_any_bytes(content: bytes) -> None:
    check_text(content.decode("latin-1"))
    check_text(content.decode("utf-8", "surrogateescape"))


@settings(max_examples=600, deadline=None, derandomize=True, suppress_health_check=SLOW)
@given(st.lists(st.sampled_from(TOKENS + MARKS), max_size=40), st.sampled_from(["", " "]))
def test_soup_of_tokens(tokens: list[str], between: str) -> None:
    check_text("10 " + between.join(tokens))


@settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=SLOW)
@given(modules(), st.data())
def test_mutations_of_good_tasks(module: Module, data: st.DataObject) -> None:
    text = print_module(module)
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        end = min(len(text), start + data.draw(st.integers(0, 6)))
        text = text[:start] + data.draw(st.sampled_from(["", *TOKENS, *MARKS])) + text[end:]
    check_text(text)


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=SLOW)
@given(modules(), st.data())
def test_a_broken_line_leaves_the_other_lines_as_they_are(module: Module, data: st.DataObject) -> None:
    """A line with a wrong statement, put in anywhere, costs one error and nothing else."""
    lines = print_module(module).splitlines()
    places = [place for place in range(len(lines) + 1) if place == 0 or not lines[place - 1].endswith("&")]
    place = data.draw(st.sampled_from(places))
    number = 1 + max([0, *(int(line.split()[0]) for line in lines[:place] if line[0].isdigit())])
    broken, problems = parse(SourceText("TASK.BLK", "\n".join([*lines[:place], f"{number} A% = (", *lines[place:]])))
    assert [(item.code, item.statement) for item in problems if item.code != "AMX0014"] == [("AMX0040", number)]
    assert without_label(broken.statements, number) == module.statements


def without_label(statements: tuple[Statement, ...], number: int) -> tuple[Statement, ...]:
    result: list[Statement] = []
    for statement in statements:
        if isinstance(statement, If):
            then, otherwise = without_label(statement.then, number), without_label(statement.otherwise, number)
            result.append(dataclasses.replace(statement, then=then, otherwise=otherwise))
        elif isinstance(statement, For):
            result.append(dataclasses.replace(statement, body=without_label(statement.body, number)))
        elif statement != Label(number=number):
            result.append(statement)
    return tuple(result)


def most(text: str) -> str:
    return "10 " + text * ((SOURCE_LIMIT - 10) // len(text))


HOSTILE = {
    "parentheses": "10 A% = " + "(" * 100_000,
    "brackets": most("B%["),
    "signs": "10 A% = " + "-" * 900_000,
    "negations": most("NOT "),
    "quotes": most('"'),
    "relations": most("<" + " " * 500),
    "digits": most("1"),
    "hexadecimal": most("1F"),
    "exponent": "10 A = 1E" + "9" * 900_000,
    "names": most("A"),
    "separators": most("\\"),
    "errors": most("\nX"),
    "empty lines": most("\n"),
    "continuations": most("1 + &\n"),
    "missing continuations": "10 A% = (" + most("\n+ 1")[3:],
    "remark continuations": "10 ! a" + most(" &\n")[3:],
    "statements": most("A%=1\\"),
    "parameters": "10 CALL X(" + most("A=1,")[3:],
    "nested IF": "\n".join(f"{number} IF A@ THEN" for number in range(1, 32_768)),
    "nested IF on a line": most("IF A@ THEN "),
    "nested FOR": "\n".join(f"{number} FOR I{number}% = 1 TO 3" for number in range(1, 32_768)),
    "wrong NEXT": "\n".join(
        [f"{number} FOR I% = 1 TO 3" for number in range(1, 16_000)]
        + [f"{number} NEXT J%" for number in range(16_000, 32_768)]
    ),
    "branches": "10 IF A@ THEN " + most("A%=1\\")[3:],
    "NUL": "\0" * SOURCE_LIMIT,
    "letters outside ASCII": "é" * SOURCE_LIMIT,
    "ampersands": "&" * SOURCE_LIMIT,
    "remarks": most("! "),
}


@pytest.mark.soak
@settings(max_examples=20_000, deadline=None, suppress_health_check=SLOW)
@given(st.lists(st.sampled_from(TOKENS + MARKS), max_size=80), st.sampled_from(["", " "]))
def test_much_soup_of_tokens(tokens: list[str], between: str) -> None:
    check_text("10 " + between.join(tokens))


@pytest.mark.timeout(600)
@pytest.mark.soak
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_texts_of_full_size_take_seconds(name: str) -> None:
    begin = time.process_time()
    parse(SourceText("TASK.BLK", HOSTILE[name][:SOURCE_LIMIT]))
    assert time.process_time() - begin < 60


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_texts(name: str) -> None:
    check_text(HOSTILE[name][: SOURCE_LIMIT // 50])


def test_remarks_keep_their_words() -> None:
    (remark,) = parse(SourceText("TASK.BLK", "10 REM ! 'quotes\" (and\0more)"))[0].statements
    assert remark == Remark("! 'quotes\" (and\0more)", False, number=10)
