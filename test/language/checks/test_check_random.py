"""Random tasks from a grammar, and random texts: check gives a program or reasons, never an exception."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Form, Input, Platform
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.types import DataType
from language.check_support import check_text

SETTINGS = settings(
    max_examples=150, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)
SOAK = settings(parent=SETTINGS, max_examples=1500)

DECLARED = {
    DataType.INTEGER: ("A%", "B%", "T%(3)", "M%(1,A%)"),
    DataType.DOUBLE: ("D!", "E!(0)"),
    DataType.REAL: ("R", "Q(2)"),
    DataType.BOOLEAN: ("X@", "Y@", "Z@(1)"),
    DataType.STRING: ("S$",),
}
HEAD = "1 LOCAL A%, T%(9), M%(3,40), D!, E!(5), R, Q(4), Y@, Z@(2), S$:20, G [CURRENT=1.5]\n2 COMMON B%, X@\n"
CONSTANTS = {
    DataType.INTEGER: ("0", "7", "-32768", "0FFH"),
    DataType.DOUBLE: ("40000", "7FFFFFFFH"),
    DataType.REAL: ("1.5", "-2.0E3"),
    DataType.BOOLEAN: ("TRUE", "OFF"),
    DataType.STRING: ("'A'", '"B C"'),
}
NUMERIC = (DataType.INTEGER, DataType.DOUBLE, DataType.REAL)


def typed(kind: DataType, depth: int) -> st.SearchStrategy[str]:
    """Expressions that have this type, or one that can stand for it."""
    leaf = st.sampled_from(DECLARED[kind] + CONSTANTS[kind])
    if depth == 0:
        return leaf
    inner = typed(kind, depth - 1)
    if kind is DataType.STRING:
        return leaf | st.tuples(inner, inner).map(" + ".join) | inner.map(lambda text: f"LEFT$({text}, 2)")
    number = typed(DataType.INTEGER, depth - 1)
    if kind is DataType.BOOLEAN:
        relation = st.tuples(number, st.sampled_from(["=", "<>", "<", ">="]), number).map(" ".join)
        joined = st.tuples(inner, st.sampled_from(["AND", "OR", "XOR"]), inner).map(" ".join)
        return leaf | relation | joined | inner.map(lambda text: f"NOT ({text})")
    operation = st.tuples(inner, st.sampled_from(["+", "-", "*", "AND" if kind.is_integer else "/"]), inner)
    return leaf | operation.map(" ".join).map(lambda text: f"({text})") | inner.map(lambda text: f"ABS({text})")


def conditions() -> st.SearchStrategy[str]:
    return typed(DataType.BOOLEAN, 2)


@st.composite
def assignments(draw: st.DrawFn) -> str:
    kind = draw(st.sampled_from(list(DataType)))
    wrong = draw(st.integers(0, 19)) == 0
    value = draw(st.sampled_from(list(DataType))) if wrong else kind
    return f"{draw(st.sampled_from(DECLARED[kind]))} = {draw(typed(value, 2))}"


@st.composite
def calls(draw: st.DrawFn) -> str:
    """A CALL of any block with mostly right arguments, some of them left out."""
    block = draw(st.sampled_from([item for item in CATALOGUE.values() if item.step is not None]))
    arguments = []
    for parameter in block.parameters:
        needed = parameter.required
        if not needed and draw(st.booleans()):
            continue
        kind = parameter.type if isinstance(parameter.type, DataType) else DataType.INTEGER
        pool = DECLARED[kind]
        if isinstance(parameter, Input):
            pool = {Form.ANY: pool + CONSTANTS[kind], Form.VARIABLE: pool, Form.LITERAL: CONSTANTS[kind]}[
                parameter.form
            ]
        arguments.append(f"{parameter.name}={draw(st.sampled_from(pool))}")
    return f"CALL {block.name}({', '.join(arguments)})"


@st.composite
def statements(draw: st.DrawFn, depth: int = 2) -> list[str]:
    kind = draw(st.sampled_from(["assign", "assign", "call", "call", "goto", "one line", "block", "loop", "other"]))
    if kind == "call":
        return [draw(calls())]
    if kind == "goto":
        return [f"{draw(st.sampled_from(['GOTO', 'GOSUB', 'RESTORE']))} {draw(st.integers(1, 40))}"]
    if kind == "one line":
        return [f"IF {draw(conditions())} THEN {draw(assignments())} ELSE {draw(st.integers(1, 30))}"]
    if kind == "block" and depth:
        inner, other = draw(bodies(depth - 1)), draw(bodies(depth - 1))
        return [f"IF {draw(conditions())} THEN", *inner, "ELSE", *other, "END_IF"]
    if kind == "loop" and depth:
        name = draw(st.sampled_from(["A%", "D!", "R"]))
        return [f"FOR {name} = 1 TO {draw(typed(DataType.INTEGER, 1))}", *draw(bodies(depth - 1)), f"NEXT {name}"]
    if kind == "other":
        return [
            draw(st.sampled_from(["READ A%", "DATA 1, -2.5, 'A'", "RETURN", "STOP", "CLR_ERRLOG", "! TEXT", "REM"]))
        ]
    return [draw(assignments())]


def bodies(depth: int) -> st.SearchStrategy[list[str]]:
    return st.lists(statements(depth), max_size=4).map(lambda lists: [line for lines in lists for line in lines])


@st.composite
def tasks(draw: st.DrawFn) -> str:
    lines = [*draw(bodies(1))] if draw(st.integers(0, 3)) == 0 else []
    lines += [f"CALL SCAN_LOOP(TICKS={draw(st.integers(1, 40))})", *draw(bodies(2)), "END"]
    return HEAD + "".join(f"{3 + index} {line}\n" for index, line in enumerate(lines))


def assert_checked(text: str) -> None:
    """A check gives a program or errors; all codes are known, all places lie in the text."""
    rows = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for target in Platform:
        result = check_text(text, target=target)
        assert (result.program is None) == has_errors(result.diagnostics)
        for item in result.diagnostics:
            assert item.code in PROBLEMS
            assert 1 <= item.span.line <= len(rows)
            assert 1 <= item.span.column < item.span.end_column
        if result.program is not None:
            assert result.program.target == target.value


@SETTINGS
@given(tasks())
def test_random_tasks(text: str) -> None:
    assert_checked(text)


@SETTINGS
@given(tasks(), st.data())
def test_random_tasks_with_a_wrong_stroke(text: str, data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(text) - 1))
    stroke = data.draw(
        st.sampled_from(["", "(", ")", "%", "@", "&", "\\", "'", "=", "-", " ", "\n", "9", "NOT ", "END\n"])
    )
    assert_checked(text[:at] + stroke + text[at + 1 :])


@SETTINGS
@given(st.text(max_size=200) | st.lists(st.text(max_size=30), max_size=8).map("\n10 ".join))
def test_random_texts(text: str) -> None:
    assert_checked(text)


@pytest.mark.soak
@SOAK
@given(tasks(), st.data())
def test_random_tasks_soak(text: str, data: st.DataObject) -> None:
    assert_checked(text)
    at = data.draw(st.integers(0, len(text) - 1))
    assert_checked(text[:at] + text[at + data.draw(st.integers(1, 20)) :])


def test_the_grammar_makes_programs_that_compile() -> None:
    """Otherwise the property would be about errors only."""
    good = 0

    @settings(SETTINGS, max_examples=100)
    @given(tasks())
    def count(text: str) -> None:
        nonlocal good
        good += check_text(text).program is not None

    count()
    assert good >= 15
