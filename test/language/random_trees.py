"""Random trees of whole tasks, drawn by a grammar of the nodes: everything the language can say, meaningful or not."""

import dataclasses

from hypothesis import strategies as st

from automax_ros.language.parse.expressions import LEVELS
from automax_ros.language.printer import numbered
from automax_ros.language.tree import tree
from automax_ros.language.tree.functions import FUNCTIONS

WORDS = st.sampled_from(["SPEED", "_X", "A1", "STEP_2", "GAIN", "LONGEST_NAME_OK_"])
NAMES = st.one_of(
    WORDS,
    st.tuples(st.one_of(WORDS, st.sampled_from(["STEP", "STOP", "ON", "REM"])), st.sampled_from("%!@$")).map("".join),
)
LINES = st.integers(1, 32767)
DIGITS = st.integers(0, 99_999_999)


def real(digits: int, exponent: int) -> tree.RealLiteral:
    """A REAL constant of up to 8 digits, spelled in one of two ways."""
    text = f"{digits}E{exponent}" if exponent % 2 else f"{digits / 1000:.3f}"[:9]
    return tree.RealLiteral(float(text), text if digits % 2 else "")


INTEGERS = st.one_of(
    st.builds(tree.IntegerLiteral, st.integers(0, 2**31)),
    st.builds(tree.IntegerLiteral, st.integers(-(2**31), 2**31 - 1), st.just(True)),
)
STRINGS = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=20).filter(
    lambda text: not ('"' in text and "'" in text)
)
CONSTANTS = st.one_of(
    INTEGERS,
    st.builds(real, DIGITS, st.integers(-9, 9)),
    st.builds(tree.StringLiteral, STRINGS),
    st.builds(tree.BooleanLiteral, st.booleans()),
)
SIGNED = st.one_of(
    CONSTANTS,
    st.builds(tree.Unary, st.sampled_from("+-"), st.one_of(INTEGERS, st.builds(real, DIGITS, st.integers(-9, 9)))),
)


FUNCTION_NAMES = sorted(set(FUNCTIONS) - {"TST_ERRLOG@"})


@st.composite
def expressions(draw: st.DrawFn, depth: int = 3) -> tree.Expression:
    """An expression of at most ``depth`` operations above one another."""
    kind = draw(st.integers(0, 6 if depth else 2))
    if kind == 0:
        return draw(CONSTANTS)
    if kind == 1:
        return tree.Reference(draw(NAMES))
    if kind == 2:
        return tree.FunctionCall("TST_ERRLOG@")
    if kind == 3:
        return tree.Unary(draw(st.sampled_from(["-", "+", "NOT"])), draw(expressions(depth - 1)))
    if kind == 4:
        arguments = tuple(draw(expressions(depth - 1)) for _ in range(draw(st.integers(1, 2))))
        element = draw(st.booleans())
        return (
            tree.Element(draw(NAMES), arguments)
            if element
            else tree.FunctionCall(draw(st.sampled_from(FUNCTION_NAMES)), arguments)
        )
    operator = draw(st.sampled_from(sorted(LEVELS)))
    return tree.Binary(operator, draw(expressions(depth - 1)), draw(expressions(depth - 1)))


EXPRESSIONS = expressions(1)
DEEP_EXPRESSIONS = expressions(4)
TARGETS = st.one_of(
    st.builds(tree.Reference, NAMES),
    st.builds(tree.Element, NAMES, st.lists(EXPRESSIONS, min_size=1, max_size=2).map(tuple)),
)
COUNTS = st.integers(0, 100_000)
DECLARED = st.one_of(
    st.builds(tree.Declared, NAMES, st.lists(COUNTS, max_size=5).map(tuple)),
    st.builds(
        tree.Declared,
        NAMES,
        tuning=st.builds(tree.Tuning, SIGNED, st.none() | SIGNED, st.none() | SIGNED, st.none() | SIGNED),
    ),
    st.builds(
        tree.Declared, WORDS.map(lambda word: word + "$"), st.lists(COUNTS, max_size=2).map(tuple), st.integers(0, 300)
    ),
)
BLOCKS = st.sampled_from(["SUMMER", "AND", "OR", "SCAN_LOOP", "UNKNOWN"])
KEYWORDS = st.sampled_from(["INPUT", "SET", "STEP", "INPUT1", "OUTPUT", "EVENT", "A_LONG_KEYWORD_THAT_BREAKS"])
ARGUMENTS = st.lists(st.builds(tree.Argument, KEYWORDS, EXPRESSIONS), max_size=8).map(tuple)


def _print(items: list[tuple[object, str]], last: str) -> tree.Print:
    """The last separator may be absent, the others not."""
    separators = [separator for _, separator in items]
    return tree.Print(tuple(item for item, _ in items), (*separators[:-1], last) if items else ())  # type: ignore[misc]


SIMPLE = st.one_of(
    st.builds(tree.Declaration, st.sampled_from(tree.Scope), st.lists(DECLARED, min_size=1, max_size=3).map(tuple)),
    st.builds(tree.Assignment, TARGETS, EXPRESSIONS),
    st.builds(tree.Gosub, LINES),
    st.builds(tree.Goto, LINES),
    st.builds(tree.Return),
    st.builds(tree.OnJump, EXPRESSIONS, st.lists(LINES, min_size=1, max_size=4).map(tuple), st.booleans()),
    st.builds(tree.Read, st.lists(TARGETS, min_size=1, max_size=3).map(tuple)),
    st.builds(tree.Data, st.lists(SIGNED, min_size=1, max_size=4).map(tuple)),
    st.builds(tree.Restore, st.none() | LINES),
    st.builds(
        _print, st.lists(st.tuples(EXPRESSIONS, st.sampled_from(",;")), max_size=3), st.sampled_from(["", ",", ";"])
    ),
    st.builds(tree.Stop),
    st.builds(tree.Event, WORDS, st.none() | st.builds(tree.Reference, NAMES), st.none() | COUNTS),
    st.builds(tree.Call, BLOCKS, ARGUMENTS),
    st.builds(tree.IoWrite, EXPRESSIONS, EXPRESSIONS, EXPRESSIONS),
    st.builds(tree.ClearErrorLog),
    st.builds(tree.End),
)
REMARKS = st.builds(
    tree.Remark,
    st.lists(st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=9), max_size=3)
    .map(" ".join)
    .filter(lambda text: not text.endswith("&")),
    st.booleans(),
)


def _ends_in_if(branch: tuple[tree.Statement, ...], inner: tree.If | None) -> tuple[tree.Statement, ...]:
    return branch if inner is None else (*branch, inner)


BRANCHES = st.lists(SIMPLE, min_size=1, max_size=2).map(tuple)
INNER_IF = st.builds(tree.If, EXPRESSIONS, BRANCHES, BRANCHES, st.just(True))
ONE_LINE = st.builds(
    tree.If,
    EXPRESSIONS,
    st.builds(_ends_in_if, BRANCHES, st.none() | INNER_IF),
    st.one_of(st.just(()), st.builds(_ends_in_if, BRANCHES, st.none() | INNER_IF)),
    st.just(True),
)


@st.composite
def statements(draw: st.DrawFn, depth: int = 2) -> tree.Statement:
    """A statement with at most ``depth`` blocks inside one another."""
    kind = draw(st.integers(0, 8 if depth else 6))
    if kind < 5:
        return draw(SIMPLE)
    if kind < 7:
        return draw(REMARKS if kind == 5 else ONE_LINE)
    bodies = st.lists(statements(depth - 1), max_size=3).map(tuple)
    if kind == 7:
        return tree.If(draw(EXPRESSIONS), draw(bodies), draw(bodies))
    step = draw(st.none() | EXPRESSIONS)
    return tree.For(tree.Reference(draw(NAMES)), draw(EXPRESSIONS), draw(EXPRESSIONS), step, draw(bodies))


@st.composite
def modules(draw: st.DrawFn) -> tree.Module:
    """A task: statements with numbers, some of them joined to the line before."""
    module = numbered(tree.Module(tuple(draw(st.lists(statements(), max_size=5)))))
    result: list[tree.Statement] = []
    for statement in module.statements:
        before = result[-1] if result else None
        open_line = isinstance(before, (tree.Assignment, tree.Call, tree.Print, tree.Stop, tree.Data))
        joins = open_line and not isinstance(statement, (tree.If, tree.For)) and draw(st.booleans())
        result.append(dataclasses.replace(statement, number=None) if joins else statement)
    return tree.Module(tuple(result))
