"""Expressions: constants, precedence, what binds to what."""

import pytest

from automax_ros.core.types import DataType
from automax_ros.language.checks.rules.unconfirmed import UNCONFIRMED_FUNCTIONS, UNCONFIRMED_STATEMENTS
from automax_ros.language.tree.functions import FUNCTIONS, Result
from automax_ros.language.tree.tree import (
    Binary,
    BooleanLiteral,
    Element,
    Expression,
    FunctionCall,
    IntegerLiteral,
    RealLiteral,
    Reference,
    StringLiteral,
    Unary,
)
from language.parser_support import codes_of, expression_of

A, B, C = Reference("A%"), Reference("B%"), Reference("C%")

CONSTANTS: dict[str, Expression] = {
    "32767": IntegerLiteral(32767),
    "2147483647": IntegerLiteral(2147483647),
    "-2147483648": Unary("-", IntegerLiteral(2147483648)),
    "0F371H": IntegerLiteral(0xF371, True),
    "000000000F371H": IntegerLiteral(0xF371, True),
    "7FFFFFFFH": IntegerLiteral(2147483647, True),
    "80000000H": IntegerLiteral(-2147483648, True),
    "0FFFFFFFFH": IntegerLiteral(-1, True),
    "1E5H": IntegerLiteral(0x1E5, True),
    "120.": RealLiteral(120.0),
    "+.120E+03": Unary("+", RealLiteral(120.0)),
    "120E3": RealLiteral(120000.0),
    "1200000E-4": RealLiteral(120.0),
    "0000.00012345678": RealLiteral(0.00012345678),
    "-1234.5678E+11": Unary("-", RealLiteral(1234.5678e11)),
    "9.2233717E18": RealLiteral(9.2233717e18),
    "5.4210107E-20": RealLiteral(5.4210107e-20),
    "-2.7105054E-20": Unary("-", RealLiteral(2.7105054e-20)),
    "0.0": RealLiteral(0.0),
    '"it\'s"': StringLiteral("it's"),
    "'say \"so\"'": StringLiteral('say "so"'),
    '"  \t & \\ ! REM "': StringLiteral("  \t & \\ ! REM "),
    '""': StringLiteral(""),
    "TRUE": BooleanLiteral(True),
    "FALSE": BooleanLiteral(False),
}


@pytest.mark.parametrize("text", CONSTANTS)
def test_constants(text: str) -> None:
    assert expression_of(text) == CONSTANTS[text]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("3FFFFE342H", "AMX0024"),
        ("0123456789H", "AMX0024"),
        ("2147483649", "AMX0027"),
        ("1" * 5000, "AMX0027"),
        ("123456789.0", "AMX0025"),
        ("1.00000000", "AMX0025"),
        ("9.2233718E18", "AMX0026"),
        ("1E999999", "AMX0026"),
        ("5.4210106E-20", "AMX0026"),
        ("-2.7105053E-20", "AMX0026"),
        ('"' + "x" * 133 + '"', "AMX0021"),
        ('"\0"', "AMX0004"),
        ("1E", "AMX0023"),
        ("E+13 1", "AMX0036"),
    ],
)
def test_constants_outside_their_limits(text: str, code: str) -> None:
    assert codes_of(f"10 RESULT = {text}") == [code]


def test_strings_reach_132_characters() -> None:
    assert expression_of('"' + "x" * 132 + '"') == StringLiteral("x" * 132)


TREES: dict[str, Expression] = {
    "A% + B% * C%": Binary("+", A, Binary("*", B, C)),
    "(A% + B%) * C%": Binary("*", Binary("+", A, B), C),
    "A% - B% - C%": Binary("-", Binary("-", A, B), C),
    "A% - (B% - C%)": Binary("-", A, Binary("-", B, C)),
    "A% ** B% ** C%": Binary("**", Binary("**", A, B), C),
    "-A% ** 2": Binary("**", Unary("-", A), IntegerLiteral(2)),
    "-(A% ** 2)": Unary("-", Binary("**", A, IntegerLiteral(2))),
    "A% * -B%": Binary("*", A, Unary("-", B)),
    "A% ** -B%": Binary("**", A, Unary("-", B)),
    "A% - -B%": Binary("-", A, Unary("-", B)),
    "A% / B% * C%": Binary("*", Binary("/", A, B), C),
    "A% + 1 > B% * 2": Binary(">", Binary("+", A, IntegerLiteral(1)), Binary("*", B, IntegerLiteral(2))),
    "NOT A% = B%": Unary("NOT", Binary("=", A, B)),
    "NOT A% AND B%": Binary("AND", Unary("NOT", A), B),
    "A% AND NOT B%": Binary("AND", A, Unary("NOT", B)),
    "A% OR B% AND C%": Binary("OR", A, Binary("AND", B, C)),
    "A% OR B% XOR C%": Binary("XOR", Binary("OR", A, B), C),
    "A% XOR B% OR C%": Binary("OR", Binary("XOR", A, B), C),
    "A% > B% AND C% < 1": Binary("AND", Binary(">", A, B), Binary("<", C, IntegerLiteral(1))),
    "A% = B% = C%": Binary("=", Binary("=", A, B), C),
    "NOT -A%": Unary("NOT", Unary("-", A)),
    "A% >< B%": Binary("<>", A, B),
    "A% < > B%": Binary("<>", A, B),
    "A% <  = B%": Binary("<=", A, B),
    "A% > = B%": Binary(">=", A, B),
    "A%>-1": Binary(">", A, Unary("-", IntegerLiteral(1))),
    "T%[A%]": Element("T%", (A,)),
    "T%(A% + 1, B%(2))": Element("T%", (Binary("+", A, IntegerLiteral(1)), Element("B%", (IntegerLiteral(2),)))),
    "ABS(A%)": FunctionCall("ABS", (A,)),
    "BIT_TST@(A%, 3)": FunctionCall("BIT_TST@", (A, IntegerLiteral(3))),
    "MAX(A%, B%, C%)": FunctionCall("MAX", (A, B, C)),
    "MAX%(1)": Element("MAX%", (IntegerLiteral(1),)),
    "TST_ERRLOG@": FunctionCall("TST_ERRLOG@"),
    "TST_ERRLOG@()": FunctionCall("TST_ERRLOG@"),
    "FFH": Reference("FFH"),
}


@pytest.mark.parametrize("text", TREES)
def test_precedence(text: str) -> None:
    assert expression_of(text) == TREES[text]


@pytest.mark.parametrize("depth", [64, 65])
@pytest.mark.parametrize(
    "form",
    [
        lambda depth: " + ".join(["A%"] * depth),
        lambda depth: "A%(" * (depth - 1) + "1" + ")" * (depth - 1),
        lambda depth: "ABS(" * (depth - 1) + "1" + ")" * (depth - 1),
    ],
    ids=["chain", "subscripts", "functions"],
)
def test_expressions_are_at_most_64_deep(form: object, depth: int) -> None:
    assert callable(form)
    assert codes_of(f"10 RESULT = {form(depth)}") == ([] if depth == 64 else ["AMX0045"])


def test_functions_that_are_left_out_tell_why() -> None:
    assert codes_of("10 A% = RND(1)\n20 A! = VARPTR!(A%)\n30 A@ = GATEWAY_CMD_OK@(A%)") == ["AMX0047"] * 3


def test_a_name_of_16_characters_is_allowed_and_a_longer_one_reported_once() -> None:
    name = "A" * 16
    assert codes_of(f"10 {name}% = {name}@ + {name}(1)") == []
    assert codes_of(f"10 {name}B% = {name}B%\n20 {name}B% = 1\n30 {name}B@ = TRUE") == ["AMX0028"] * 2


def test_the_name_of_a_function_shows_the_type_of_its_result() -> None:
    """A name with a type character gives that type; one without gives a number (J-3675: VARPTR!, TST_ERRLOG@)."""
    by_name = {"%": Result.INTEGER, "@": Result.BOOLEAN, "$": Result.STRING}
    for name, function in FUNCTIONS.items():
        if name[-1] in by_name:
            assert function.result is by_name[name[-1]]
        else:
            assert function.result.of((DataType.REAL,)).is_numeric
    assert Result.SAME.of((DataType.INTEGER, DataType.REAL)) is DataType.REAL
    assert Result.SAME.of((DataType.INTEGER, DataType.DOUBLE)) is DataType.DOUBLE


def test_unconfirmed_forms_stand_in_one_table() -> None:
    functions = {name for name, function in FUNCTIONS.items() if function.unconfirmed}
    assert functions == {"BIT_SET%", "BIT_CLR%", "BIT_TST@", "SHIFTL%", "SHIFTR%", "ROTATEL%", "ROTATER%", "IOREAD%"}
    assert set(UNCONFIRMED_FUNCTIONS) == functions
    assert set(UNCONFIRMED_STATEMENTS) == {"TUNABLE", "IOWRITE", "CALL", "EMPTY", "GET", "SET"}
