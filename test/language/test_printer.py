"""The printer: its canonical form, and that every tree parses back to itself."""

import dataclasses

import pytest
from hypothesis import HealthCheck, given, settings

from automax_ros.core.diagnostics import SourceText
from automax_ros.language.parse.parser import parse
from automax_ros.language.printer import LINE_WIDTH, numbered, print_expression, print_module
from automax_ros.language.tree import tree
from language.parser_support import expression_of, module_of
from language.random_trees import DEEP_EXPRESSIONS, modules

SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
FLAG, ASSIGN = tree.Reference("FLAG@"), tree.Assignment(tree.Reference("A%"), tree.IntegerLiteral(1))
CANONICAL = """10 LOCAL A%, T%(3, 4), S$:50(2), GAIN [CURRENT=1.5, HIGH=2.0, LOW=-2.0, STEP=0.1]
20 COMMON SPEED%, RUN@ \\ ! the line's own
30 EVENT NAME = START, INTERRUPT_STATUS = SPEED%, TIMEOUT = 6
40 IF RUN@ THEN
50   A% = -(A% + 1) ** 2 * 3
60   FOR I% = 1 TO 10 STEP -1
70     T%(I%, 2) = 0F371H \\ PRINT "A", A%; 'a "b"'
80   NEXT I%
90 ELSE
100   IF A% <> 3 AND NOT RUN@ THEN 70 ELSE A% = 1 \\ GOSUB 200
110 END_IF
120 CALL SUMMER(INPUT1 = A%, INPUT2 = SPEED%, OUTPUT = A%)
130 CALL PROP_INT(INPUT = A%, &
                  KP = 1.5, &
                  WLD = 10.0, &
                  INITIAL_VALUE = A%, &
                  LIMIT_PLUS = 32767, &
                  LIMIT_MINUS = -32767, &
                  OUTPUT = A%)
140 ON A% GOTO 10, 20
150 ! a remark that &
goes on
160 END
"""


def test_canonical_text_prints_as_itself() -> None:
    assert print_module(module_of(CANONICAL)) == CANONICAL


def parsed_back(module: tree.Module) -> tree.Module:
    text = print_module(module)
    back, problems = parse(SourceText("TASK.BLK", text))
    assert [item for item in problems if item.code != "AMX0014"] == []
    return back


@settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=SLOW)
@given(modules())
def test_printed_task_parses_back_to_an_equal_tree(module: tree.Module) -> None:
    back = parsed_back(module)
    assert back == module
    assert print_module(back) == print_module(module)


@settings(max_examples=300, deadline=None, derandomize=True, suppress_health_check=SLOW)
@given(DEEP_EXPRESSIONS)
def test_printed_expression_parses_back_to_an_equal_tree(expression: tree.Expression) -> None:
    assert expression_of(print_expression(expression)) == expression


@pytest.mark.soak
@settings(max_examples=3000, deadline=None, suppress_health_check=SLOW)
@given(modules())
def test_many_printed_tasks_parse_back(module: tree.Module) -> None:
    assert parsed_back(module) == module


PARENTHESES = ["A% - (B% - C%)", "(A% + B%) * C%", "-(A% ** 2)", "-A% ** 2", "A% ** (B% ** C%)", "NOT (A@ AND B@)",
               "(NOT A@) = B@", "NOT A@ = B@", "A@ OR (B@ OR C@)", "A% * -B%", "-(-A%)", "A% - -(B% + 1)"]  # fmt: skip


@pytest.mark.parametrize("text", PARENTHESES)
def test_only_parentheses_that_are_needed(text: str) -> None:
    assert print_expression(expression_of(text)) == text
    assert print_expression(expression_of(f"(({text}))")) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.5, "1.5"),
        (5.0, "5.0"),
        (1e10, "1E+10"),
        (0.1, "0.1"),
        (1.0000001, "1.0000001"),
        (0.0, "0.0"),
        (1e7, "10000000."),
    ],
)
def test_real_constants_without_a_spelling(value: float, text: str) -> None:
    assert print_expression(tree.RealLiteral(value)) == text
    assert expression_of(text) == tree.RealLiteral(value)


def test_trees_made_by_hand_get_numbers() -> None:
    made = tree.Module(
        (
            tree.Declaration(tree.Scope.LOCAL, (tree.Declared("A%"),)),
            tree.If(FLAG, (ASSIGN,), (tree.Goto(10),)),
            tree.End(),
        )
    )
    text = "10 LOCAL A%\n20 IF FLAG@ THEN\n30   A% = 1\n40 ELSE\n50   GOTO 10\n60 END_IF\n70 END\n"
    assert print_module(made) == text
    assert module_of(text) == numbered(made)


def test_long_tasks_are_numbered_more_closely() -> None:
    made = numbered(tree.Module((ASSIGN,) * 10_000))
    numbers = [statement.number for statement in made.statements]
    assert numbers == list(range(3, 30_001, 3))
    with pytest.raises(ValueError, match="more than there are line numbers"):
        numbered(tree.Module((ASSIGN,) * 32_768))


def test_only_calls_that_are_too_long_are_broken() -> None:
    lines = print_module(module_of(CANONICAL)).splitlines()
    assert max(len(line) for line in lines) <= LINE_WIDTH + len("32767 ")
    assert sum(line.endswith("&") for line in lines) == 7


@pytest.mark.parametrize(
    "module",
    [
        tree.Module((ASSIGN, dataclasses.replace(ASSIGN, number=10))),
        tree.Module((tree.Remark("text", True, number=10), ASSIGN)),
        tree.Module((tree.Label(number=10), ASSIGN)),
        tree.Module((tree.If(FLAG, (ASSIGN,), one_line=True, number=10), ASSIGN)),
        tree.Module((tree.If(FLAG, (), one_line=True),)),
        tree.Module((tree.If(FLAG, (tree.If(FLAG, (ASSIGN,), one_line=True),), (ASSIGN,), one_line=True),)),
        tree.Module((tree.If(FLAG, (tree.If(FLAG, (ASSIGN,), one_line=True), ASSIGN), one_line=True),)),
        tree.Module(
            (
                tree.If(
                    FLAG,
                    (tree.For(tree.Reference("I%"), tree.IntegerLiteral(1), tree.IntegerLiteral(2), None, ()),),
                    one_line=True,
                ),
            )
        ),
        tree.Module((tree.Remark("ends with &", True),)),
        tree.Module((tree.Assignment(tree.Reference("A$"), tree.StringLiteral("both \" and '")),)),
    ],
)
def test_trees_that_no_text_gives_are_refused(module: tree.Module) -> None:
    with pytest.raises(ValueError, match=r"."):
        print_module(module)
