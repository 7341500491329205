"""Random trees of whole tasks, drawn by a grammar of the nodes: everything the language can say, meaningful or not."""

import dataclasses

from hypothesis import strategies as st

from automax_ros.language.parse.expressions import LEVELS
from automax_ros.language.printer import numbered
from automax_ros.language.tree.functions import FUNCTIONS
from automax_ros.language.tree.tree import (
    Argument,
    Assignment,
    Binary,
    BooleanLiteral,
    Call,
    ClearErrorLog,
    Data,
    Declaration,
    Declared,
    Element,
    End,
    Event,
    Expression,
    For,
    FunctionCall,
    Gosub,
    Goto,
    If,
    IntegerLiteral,
    IoWrite,
    Module,
    OnJump,
    Print,
    Read,
    RealLiteral,
    Reference,
    Remark,
    Restore,
    Return,
    Scope,
    Statement,
    Stop,
    StringLiteral,
    Tuning,
    Unary,
)

WORDS = st.sampled_from(["SPEED", "_X", "A1", "STEP_2", "GAIN", "LONGEST_NAME_OK_"])
NAMES = st.one_of(
    WORDS,
    st.tuples(st.one_of(WORDS, st.sampled_from(["STEP", "STOP", "ON", "REM"])), st.sampled_from("%!@$")).map("".join),
)
LINES = st.integers(1, 32767)
DIGITS = st.integers(0, 99_999_999)


def real(digits: int, exponent: int) -> RealLiteral:
    """A REAL constant of up to 8 digits, spelled in one of two ways."""
    text = f"{digits}E{exponent}" if exponent % 2 else f"{digits / 1000:.3f}"[:9]
    return RealLiteral(float(text), text if digits % 2 else "")


INTEGERS = st.one_of(
    st.builds(IntegerLiteral, st.integers(0, 2**31)),
    st.builds(IntegerLiteral, st.integers(-(2**31), 2**31 - 1), st.just(True)),
)
STRINGS = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=20).filter(
    lambda text: not ('"' in text and "'" in text)
)
CONSTANTS = st.one_of(
    INTEGERS,
    st.builds(real, DIGITS, st.integers(-9, 9)),
    st.builds(StringLiteral, STRINGS),
    st.builds(BooleanLiteral, st.booleans()),
)
SIGNED = st.one_of(
    CONSTANTS,
    st.builds(Unary, st.sampled_from("+-"), st.one_of(INTEGERS, st.builds(real, DIGITS, st.integers(-9, 9)))),
)


FUNCTION_NAMES = sorted(set(FUNCTIONS) - {"TST_ERRLOG@"})


@st.composite
def expressions(draw: st.DrawFn, depth: int = 3) -> Expression:
    """An expression of at most ``depth`` operations above one another."""
    kind = draw(st.integers(0, 6 if depth else 2))
    if kind == 0:
        return draw(CONSTANTS)
    if kind == 1:
        return Reference(draw(NAMES))
    if kind == 2:
        return FunctionCall("TST_ERRLOG@")
    if kind == 3:
        return Unary(draw(st.sampled_from(["-", "+", "NOT"])), draw(expressions(depth - 1)))
    if kind == 4:
        arguments = tuple(draw(expressions(depth - 1)) for _ in range(draw(st.integers(1, 2))))
        element = draw(st.booleans())
        return (
            Element(draw(NAMES), arguments)
            if element
            else FunctionCall(draw(st.sampled_from(FUNCTION_NAMES)), arguments)
        )
    operator = draw(st.sampled_from(sorted(LEVELS)))
    return Binary(operator, draw(expressions(depth - 1)), draw(expressions(depth - 1)))


EXPRESSIONS = expressions(1)
DEEP_EXPRESSIONS = expressions(4)
TARGETS = st.one_of(
    st.builds(Reference, NAMES), st.builds(Element, NAMES, st.lists(EXPRESSIONS, min_size=1, max_size=2).map(tuple))
)
COUNTS = st.integers(0, 100_000)
DECLARED = st.one_of(
    st.builds(Declared, NAMES, st.lists(COUNTS, max_size=5).map(tuple)),
    st.builds(
        Declared, NAMES, tuning=st.builds(Tuning, SIGNED, st.none() | SIGNED, st.none() | SIGNED, st.none() | SIGNED)
    ),
    st.builds(
        Declared, WORDS.map(lambda word: word + "$"), st.lists(COUNTS, max_size=2).map(tuple), st.integers(0, 300)
    ),
)
BLOCKS = st.sampled_from(["SUMMER", "AND", "OR", "SCAN_LOOP", "UNKNOWN"])
KEYWORDS = st.sampled_from(["INPUT", "SET", "STEP", "INPUT1", "OUTPUT", "EVENT", "A_LONG_KEYWORD_THAT_BREAKS"])
ARGUMENTS = st.lists(st.builds(Argument, KEYWORDS, EXPRESSIONS), max_size=8).map(tuple)


def _print(items: list[tuple[object, str]], last: str) -> Print:
    """The last separator may be absent, the others not."""
    separators = [separator for _, separator in items]
    return Print(tuple(item for item, _ in items), (*separators[:-1], last) if items else ())  # type: ignore[misc]


SIMPLE = st.one_of(
    st.builds(Declaration, st.sampled_from(Scope), st.lists(DECLARED, min_size=1, max_size=3).map(tuple)),
    st.builds(Assignment, TARGETS, EXPRESSIONS),
    st.builds(Gosub, LINES),
    st.builds(Goto, LINES),
    st.builds(Return),
    st.builds(OnJump, EXPRESSIONS, st.lists(LINES, min_size=1, max_size=4).map(tuple), st.booleans()),
    st.builds(Read, st.lists(TARGETS, min_size=1, max_size=3).map(tuple)),
    st.builds(Data, st.lists(SIGNED, min_size=1, max_size=4).map(tuple)),
    st.builds(Restore, st.none() | LINES),
    st.builds(
        _print, st.lists(st.tuples(EXPRESSIONS, st.sampled_from(",;")), max_size=3), st.sampled_from(["", ",", ";"])
    ),
    st.builds(Stop),
    st.builds(Event, WORDS, st.none() | st.builds(Reference, NAMES), st.none() | COUNTS),
    st.builds(Call, BLOCKS, ARGUMENTS),
    st.builds(IoWrite, EXPRESSIONS, EXPRESSIONS, EXPRESSIONS),
    st.builds(ClearErrorLog),
    st.builds(End),
)
REMARKS = st.builds(
    Remark,
    st.lists(st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=9), max_size=3)
    .map(" ".join)
    .filter(lambda text: not text.endswith("&")),
    st.booleans(),
)


def _ends_in_if(branch: tuple[Statement, ...], inner: If | None) -> tuple[Statement, ...]:
    return branch if inner is None else (*branch, inner)


BRANCHES = st.lists(SIMPLE, min_size=1, max_size=2).map(tuple)
INNER_IF = st.builds(If, EXPRESSIONS, BRANCHES, BRANCHES, st.just(True))
ONE_LINE = st.builds(
    If,
    EXPRESSIONS,
    st.builds(_ends_in_if, BRANCHES, st.none() | INNER_IF),
    st.one_of(st.just(()), st.builds(_ends_in_if, BRANCHES, st.none() | INNER_IF)),
    st.just(True),
)


@st.composite
def statements(draw: st.DrawFn, depth: int = 2) -> Statement:
    """A statement with at most ``depth`` blocks inside one another."""
    kind = draw(st.integers(0, 8 if depth else 6))
    if kind < 5:
        return draw(SIMPLE)
    if kind < 7:
        return draw(REMARKS if kind == 5 else ONE_LINE)
    bodies = st.lists(statements(depth - 1), max_size=3).map(tuple)
    if kind == 7:
        return If(draw(EXPRESSIONS), draw(bodies), draw(bodies))
    step = draw(st.none() | EXPRESSIONS)
    return For(Reference(draw(NAMES)), draw(EXPRESSIONS), draw(EXPRESSIONS), step, draw(bodies))


@st.composite
def modules(draw: st.DrawFn) -> Module:
    """A task: statements with numbers, some of them joined to the line before."""
    module = numbered(Module(tuple(draw(st.lists(statements(), max_size=5)))))
    result: list[Statement] = []
    for statement in module.statements:
        before = result[-1] if result else None
        open_line = isinstance(before, (Assignment, Call, Print, Stop, Data))
        joins = open_line and not isinstance(statement, (If, For)) and draw(st.booleans())
        result.append(dataclasses.replace(statement, number=None) if joins else statement)
    return Module(tuple(result))
