"""Problems of types: what goes with what, and where the caret stands."""

import pytest

from automax_ros.core.diagnostics import Span
from language.check_support import codes, one, program, task


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("A% = B% + S$", "AMX2001"),
        ("S$ = S$ - S$", "AMX2001"),
        ("X@ = S$ = A%", "AMX2002"),
        ("X@ = S$ < S$", "AMX2002"),
        ("X@ = Y@ >= X@", "AMX2002"),
        ("X@ = Y@ = 1", "AMX2002"),
        ("A% = R AND 1", "AMX2003"),
        ("A% = NOT R", "AMX2003"),
        ("X@ = -Y@", "AMX2004"),
        ("IF A% THEN B% = 1", "AMX2005"),
        ("IF A% + 1 THEN B% = 1", "AMX2005"),
        ("A% = X@", "AMX2006"),
        ("X@ = A%", "AMX2006"),
        ("S$ = A%", "AMX2006"),
        ("A% = S$", "AMX2006"),
        ("A% = 32768", "AMX2007"),
        ("A% = -32769", "AMX2007"),
        ("A% = 1.0E5", "AMX2007"),
        ("A% = 16384 + 16384", "AMX2007"),
        ("FOR A% = 0 TO 40000 \\ NEXT A%", "AMX2007"),
        ("D! = 2147483648", "AMX2008"),
        ("T%(R) = 1", "AMX2010"),
        ("T%(X@) = 1", "AMX2010"),
        ("A% = T%(T%(1.5))", "AMX2010"),
        ("FOR A% = 0 TO S$ \\ NEXT A%", "AMX2011"),
        ("FOR X@ = 0 TO 1 \\ NEXT X@", "AMX2012"),
        ("A% = MIN(A%)", "AMX2013"),
        ("S$ = LEFT$(S$)", "AMX2013"),
        ("A% = LEN%(A%)", "AMX2014"),
        ("A% = BIT_SET%(R, 1)", "AMX2014"),
        ("A% = ABS(X@)", "AMX2014"),
        ("R = SQRT(-1.0)", "AMX2019"),
        ("R = LN(0)", "AMX2019"),
        ("S$ = CHR$(256)", "AMX2019"),
        ("A% = SHIFTL%(A%, 32)", "AMX2019"),
        ("A% = ROTATER%(A%, 16)", "AMX2019"),
        ("A% = BIT_SET%(A%, 16)", "AMX2019"),
        ("A% = -X@", "AMX2004"),
        ("IOWRITE R, 1, 2", "AMX2009"),
    ],
)
def test_each_is_one_error(statement: str, code: str) -> None:
    assert codes(task(statement)) == [code]


@pytest.mark.parametrize(
    "statement",
    [
        "A% = R",
        "A% = 32767.9",
        "A% = -32768",
        "D! = -2147483648",
        "A% = 0FFFFFFFFH",
        "R = 2147483647",
        "R = X@ * (R - 2.3376)",
        "A% = X@ + Y@",
        "A% = A% AND 0FFH",
        "A% = X@ OR B%",
        "X@ = X@ AND NOT Y@ OR A% > B% XOR S$ <> 'A'",
        "X@ = Y@ = TRUE",
        "S$ = 'A' + S$ + STR$(R)",
        "A% = INT(R) ** 2",
        "IF BIT_TST@(A%, 31) THEN B% = 1",
        "R = MAX(A%, B%, R, 1, 2.5)",
        "ON A% + 1 GOTO 30, 40",
        "T%(A% + 1) = T%(T%(0))",
        "FOR R = 0 TO 1 STEP 0.1 \\ NEXT R",
        "PRINT A%; X@, S$; T%(1)",
    ],
)
def test_well_typed(statement: str) -> None:
    assert codes(task(statement)) == []


def test_negative_hex_is_explained() -> None:
    found = one(task("A% = 0F371H"))
    assert found.code == "AMX2007"
    assert found.hint == "a hex constant is its 32-bit value and never sign-extended: write 0FFFFF371H for -3215"
    assert program(task("A% = 0FFFFF371H"))


def test_a_chain_is_blamed_where_it_goes_wrong() -> None:
    found = one(task("A% = B% + C% + S$ + D!"))
    assert found.span == Span(3, 9, 21)
    assert found.statement == 30


def test_no_second_error_about_a_value_that_is_wrong_already() -> None:
    assert codes(task("IF A% + S$ > 3 THEN T%(S$ * 2) = 1")) == ["AMX2001", "AMX2001"]


def test_a_long_chain_is_checked() -> None:
    statement = "A% = " + "+".join(["B%"] * 60)
    assert codes(task(statement)) == []
    assert codes(task(statement + "+S$")) == ["AMX2001"]
