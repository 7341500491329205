"""Statements in all their forms; those of the manual as the manual prints them, with numbers for its placeholders."""

import pytest

from automax_ros.core.diagnostics import SourceText, Span
from automax_ros.language.parse.parser import parse
from automax_ros.language.tree import tree
from language.parser_support import codes_of, module_of, statements_of

A, B, C, FLAG = tree.Reference("A%"), tree.Reference("B%"), tree.Reference("C%"), tree.Reference("FLAG@")
ONE, TWO = tree.IntegerLiteral(1), tree.IntegerLiteral(2)
MANUAL = {
    "AND": """10 CALL AND (INPUT1=input1@,           &
          INPUT2=input2@,           &
          OUTPUT=output@)""",
    "DIFFERENCE": """10 CALL DIFFERENCE(INPUT1 = input1%,           &
                INPUT2 = input2%,         &
                OUTPUT = output%)""",
    "LATCH": """10 CALL LATCH (RESET=reset@, SET=set@,           &
            CLOCK=clock@, INPUT=input@,       &
            OUTPUT=output@)""",
    "LIMIT": """10 CALL LIMIT(INPUT = input%,                                &
           LIMIT_PLUS = limit_plus%,                      &
           LIMIT_MINUS = limit_minus%,                    &
           SATURATED_PLUS = saturated_plus@,              &
           SATURATED_MINUS = saturated_minus@,            &
           OUTPUT = output%)""",
    "OR": """10 CALL OR (INPUT1=input1@,           &
        INPUT2=input2@,           &
        OUTPUT=output@)""",
    "PULSE_MULT": """10 CALL PULSE_MULT(INPUT = input%, &
  RESET = reset@, &
  WORD_SIZE = 12, &
  INITIAL_VALUE = initial_value%, &
  MULTIPLIER = multiplier%, &
  OUTPUT = output%)""",
    "RAMP": """10 CALL RAMP(INPUT = input%,           &
          ABS_RAMP = TRUE,          &
          RESET = reset@,           &
          INITIAL_VALUE = initial_value%, &
          HOLD = hold@,              &
          ACCEL_RATE = accel_rate%,  &
          DECEL_RATE = decel_rate%,  &
          SCALE = 10000,             &
          OUTPUT = output%,         &
          RATE = rate%)""",
    "SCALE": """10 CALL SCALE(INPUT=input%, CLAMP=clamp@,           &
           INPUT_MAX=input_max%,                 &
           INPUT_MIN=input_min%,                 &
           OUTPUT_IMAX=output_imax%,            &
           OUTPUT_IMIN=output_imin%,            &
           OUTPUT=output%)""",
    "SUMMER": """10 CALL SUMMER(INPUT1 = input1%,                               &
             INPUT2 = input2%,                               &
             OUTPUT = output%)""",
    "SWITCH": """10 CALL SWITCH(INPUT1 = input1%,           &
            INPUT2 = input2%,           &
            SELECT = select@,           &
            OUTPUT=output%)""",
    "TRANSITION": "10 CALL TRANSITION(INPUT = input@, OUTPUT = output@)",
    "INTEGRATE": """10 CALL INTEGRATE(INPUT = input%,           &
               KI = ki,                   &
               WM = 100.0,                 &
               INITIAL_VALUE = initial_value%, &
               LIMIT_PLUS = limit_plus%,   &
               LIMIT_MINUS = limit_minus%,  &
               RESET = reset@,             &
               HOLD_PLUS = hold_plus@,     &
               HOLD_MINUS = hold_minus@,   &
               SATURATED_PLUS = saturated_plus@, &
               SATURATED_MINUS = saturated_minus@, &
               OUTPUT = output%)""",
    "LAG": """10 CALL LAG(INPUT = input%,           &
         WLG = wlg,                 &
         WM = 100.0,                &
         INITIAL_VALUE = initial_value%, &
         RESET = reset@,            &
         OUTPUT = output%)""",
    "PROP_INT": """10 CALL PROP_INT(INPUT = input%,           &
              KP = Kp,                   &
              WLD = wld,                  &
              WM = 100.0,                 &
              INITIAL_VALUE = initial_value%, &
              LIMIT_PLUS = limit_plus%,   &
              LIMIT_MINUS = limit_minus%, &
              RESET = reset@,             &
              HOLD_PLUS = hold_plus@,     &
              HOLD_MINUS = hold_minus@,   &
              SATURATED_PLUS = saturated_plus@, &
              SATURATED_MINUS = saturated_minus@, &
              OUTPUT = output%)""",
}  # fmt: skip


@pytest.mark.parametrize("block", MANUAL)
def test_statement_forms_of_the_manual(block: str) -> None:
    """Every keyword on a line of the manual comes out once, in its order; lower case is its only problem."""
    text = MANUAL[block]
    module, problems = parse(SourceText("TASK.BLK", text))
    assert [item.code for item in problems] == ["AMX0003"]
    (call,) = module.statements
    assert isinstance(call, tree.Call)
    assert call.block == block
    keywords = [part.split()[-1] for part in text.replace("(", " ").split("=")[:-1]]
    assert [argument.keyword for argument in call.arguments] == keywords


def test_scan_loop_on_an_event_of_section_4() -> None:
    text = """100 COMMON ISCR%
500 EVENT NAME=START_TASK, &
    INTERRUPT_STATUS=ISCR%, TIMEOUT=6
1000 CALL SCAN_LOOP(TICKS=4, EVENT=START_TASK)
"""
    assert statements_of(text) == (
        tree.Declaration(tree.Scope.COMMON, (tree.Declared("ISCR%"),), number=100),
        tree.Event("START_TASK", tree.Reference("ISCR%"), 6, number=500),
        tree.Call(
            "SCAN_LOOP",
            (tree.Argument("TICKS", tree.IntegerLiteral(4)), tree.Argument("EVENT", tree.Reference("START_TASK"))),
            number=1000,
        ),
    )


def test_block_equations_of_section_35_1() -> None:
    text = """10 IF XXX_OVERSPD@ = TRUE OR &
  XXX_TACH_LOSS@ = TRUE OR &
  XXX_AVFB_LOSS@ = TRUE THEN
20 XXX_SPD_ESTOP@ = TRUE
30 ELSE
40 XXX_SPD_ESTOP@ = FALSE
50 END_IF
"""

    def lost(name: str) -> tree.Binary:
        return tree.Binary("=", tree.Reference(name), tree.BooleanLiteral(True))

    assert statements_of(text) == (
        tree.If(
            tree.Binary("OR", tree.Binary("OR", lost("XXX_OVERSPD@"), lost("XXX_TACH_LOSS@")), lost("XXX_AVFB_LOSS@")),
            (
                tree.Assignment(tree.Reference("XXX_SPD_ESTOP@"), tree.BooleanLiteral(True), number=20),
                tree.Label(number=30),
            ),
            (tree.Assignment(tree.Reference("XXX_SPD_ESTOP@"), tree.BooleanLiteral(False), number=40),),
            number=10,
        ),
        tree.Label(number=50),
    )


DECLARED = {
    "LOCAL A%, B%": (tree.Scope.LOCAL, (tree.Declared("A%"), tree.Declared("B%"))),
    "COMMON ARRAY1@(10)": (tree.Scope.COMMON, (tree.Declared("ARRAY1@", (10,)),)),
    "GLOBAL B%(6, 3)": (tree.Scope.COMMON, (tree.Declared("B%", (6, 3)),)),
    "LOCAL T(1,2,3,4)": (tree.Scope.LOCAL, (tree.Declared("T", (1, 2, 3, 4)),)),
    "LOCAL A%[3]": (tree.Scope.LOCAL, (tree.Declared("A%", (3,)),)),
    "LOCAL A$:50, A$:10(20)": (tree.Scope.LOCAL, (tree.Declared("A$", (), 50), tree.Declared("A$", (20,), 10))),
    "LOCAL GAIN [CURRENT=1.5, HIGH=10.0, LOW=-1.0, STEP=0.1]": (
        tree.Scope.LOCAL,
        (
            tree.Declared(
                "GAIN",
                tuning=tree.Tuning(
                    tree.RealLiteral(1.5),
                    tree.RealLiteral(10.0),
                    tree.Unary("-", tree.RealLiteral(1.0)),
                    tree.RealLiteral(0.1),
                ),
            ),
        ),
    ),
    "LOCAL N% [STEP=1, CURRENT=5], B%": (
        tree.Scope.LOCAL,
        (tree.Declared("N%", tuning=tree.Tuning(tree.IntegerLiteral(5), step=ONE)), tree.Declared("B%")),
    ),
}


@pytest.mark.parametrize("text", DECLARED)
def test_declarations(text: str) -> None:
    scope, variables = DECLARED[text]
    assert statements_of(f"10 {text}") == (tree.Declaration(scope, variables, number=10),)


SIMPLE = {
    "A% = 1": tree.Assignment(A, ONE),
    "LET A% = 1": tree.Assignment(A, ONE),
    "LET ARRAY1@(0) = TRUE": tree.Assignment(
        tree.Element("ARRAY1@", (tree.IntegerLiteral(0),)), tree.BooleanLiteral(True)
    ),
    "A%[B%, 2] = 1": tree.Assignment(tree.Element("A%", (B, TWO)), ONE),
    "SPEED = 1": tree.Assignment(tree.Reference("SPEED"), ONE),
    "SPEED(1) = 1": tree.Assignment(tree.Element("SPEED", (ONE,)), ONE),
    "SPEED(A = 1) = 1": tree.Assignment(tree.Element("SPEED", (tree.Binary("=", tree.Reference("A"), ONE),)), ONE),
    "X! = 1": tree.Assignment(tree.Reference("X!"), ONE),
    "GOTO 200": tree.Goto(200),
    "GOSUB 200": tree.Gosub(200),
    "RETURN": tree.Return(),
    "ON A% + 1 GOTO 100, 200": tree.OnJump(tree.Binary("+", A, ONE), (100, 200)),
    "ON A% GOSUB 100": tree.OnJump(A, (100,), True),
    "A@ = ON": tree.Assignment(tree.Reference("A@"), tree.BooleanLiteral(True)),
    "A@ = OFF": tree.Assignment(tree.Reference("A@"), tree.BooleanLiteral(False)),
    "READ A%, T%(1)": tree.Read((A, tree.Element("T%", (ONE,)))),
    'DATA 1, -2, "X", ON, 0FFH': tree.Data(
        (ONE, tree.Unary("-", TWO), tree.StringLiteral("X"), tree.BooleanLiteral(True), tree.IntegerLiteral(255, True))
    ),
    "RESTORE": tree.Restore(),
    "RESTORE 300": tree.Restore(300),
    "PRINT": tree.Print(),
    'PRINT "A"; A%, B%': tree.Print((tree.StringLiteral("A"), A, B), (";", ",", "")),
    "PRINT A%;": tree.Print((A,), (";",)),
    "STOP": tree.Stop(),
    "END": tree.End(),
    "CLR_ERRLOG": tree.ClearErrorLog(),
    "IOWRITE 3, 1, A%": tree.IoWrite(tree.IntegerLiteral(3), ONE, A),
    "EVENT NAME = START": tree.Event("START"),
    "EVENT NAME = START, TIMEOUT = 6": tree.Event("START", None, 6),
    "CALL SUMMER()": tree.Call("SUMMER"),
    "CALL AND(INPUT1 = -FLAG@)": tree.Call("AND", (tree.Argument("INPUT1", tree.Unary("-", FLAG)),)),
    "CALL LIMIT(INPUT = T%(2))": tree.Call("LIMIT", (tree.Argument("INPUT", tree.Element("T%", (TWO,))),)),
    "A@ = TST_ERRLOG@": tree.Assignment(tree.Reference("A@"), tree.FunctionCall("TST_ERRLOG@")),
    "REM a remark \\ with & signs": tree.Remark("a remark \\ with & signs", False),
    "! a remark": tree.Remark("a remark", True),
    "!": tree.Remark("", True),
}


@pytest.mark.parametrize("text", SIMPLE)
def test_simple_statements(text: str) -> None:
    (statement,) = statements_of(f"10 {text}")
    assert statement.number == 10
    (unnumbered,) = statements_of(f"10 {text}")
    assert unnumbered == type(statement)(**{**vars(SIMPLE[text]), "number": 10})


def test_if_on_one_line() -> None:
    text = """10 IF FLAG@ THEN 200
20 IF FLAG@ THEN GOTO 200
30 IF FLAG@ THEN A% = 1 ELSE 200
40 IF FLAG@ THEN A% = 1 \\ B% = 2 ELSE B% = 1 \\ A% = 2
50 IF FLAG@ THEN IF A@ THEN A% = 1 ELSE A% = 2 ELSE B% = 1
"""
    one, two = tree.Assignment(A, ONE), tree.Assignment(A, TWO)
    assert statements_of(text) == (
        tree.If(FLAG, (tree.Goto(200),), one_line=True, number=10),
        tree.If(FLAG, (tree.Goto(200),), one_line=True, number=20),
        tree.If(FLAG, (one,), (tree.Goto(200),), one_line=True, number=30),
        tree.If(FLAG, (one, tree.Assignment(B, TWO)), (tree.Assignment(B, ONE), two), one_line=True, number=40),
        tree.If(
            FLAG,
            (tree.If(tree.Reference("A@"), (one,), (two,), one_line=True),),
            (tree.Assignment(B, ONE),),
            one_line=True,
            number=50,
        ),
    )


def test_remark_behind_an_if_on_one_line_is_a_statement_of_its_own() -> None:
    expected = (tree.If(FLAG, (tree.Goto(200),), one_line=True, number=10), tree.Remark("stop", True))
    assert statements_of("10 IF FLAG@ THEN 200 ! stop") == expected
    assert statements_of("10 IF FLAG@ THEN 200 \\ ! stop") == expected


def test_if_in_block_form_nests() -> None:
    text = """10 IF FLAG@ THEN ! outer
20   IF A@ THEN
30     A% = 1
40   END_IF
50 ELSE
60   A% = 2
70 END_IF
80 END
"""
    inner = tree.If(tree.Reference("A@"), (tree.Assignment(A, ONE, number=30),), number=20)
    assert statements_of(text) == (
        tree.If(
            FLAG,
            (tree.Remark("outer", True), inner, tree.Label(number=40), tree.Label(number=50)),
            (tree.Assignment(A, TWO, number=60),),
            number=10,
        ),
        tree.Label(number=70),
        tree.End(number=80),
    )


def test_for_with_step_and_labels_on_the_lines_of_next() -> None:
    text = "10 FOR A% = 1 TO B% STEP -2\n20 C% = A%\n30 NEXT A%\n40 FOR A% = 1 TO 2 \\ C% = A% \\ NEXT A%\n"
    body = tree.Assignment(C, A)
    assert statements_of(text) == (
        tree.For(A, ONE, B, tree.Unary("-", TWO), (tree.Assignment(C, A, number=20), tree.Label(number=30)), number=10),
        tree.For(A, ONE, TWO, None, (body,), number=40),
    )


def test_several_statements_on_a_line_have_the_number_once() -> None:
    assert statements_of("10 A% = 1 \\ B% = 2 \\! both") == (
        tree.Assignment(A, ONE, number=10),
        tree.Assignment(B, TWO),
        tree.Remark("both", True),
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("10 A% = X!", tree.Assignment(A, tree.Reference("X!"), number=10)),
        ("10 A% = X !", tree.Assignment(A, tree.Reference("X"), number=10)),
        ("10 A% = X!! text", tree.Assignment(A, tree.Reference("X!"), number=10)),
        ("10 A% = 1! text", tree.Assignment(A, ONE, number=10)),
        ("10 A% = T%(1)! text", tree.Assignment(A, tree.Element("T%", (ONE,)), number=10)),
        ("10 X! = 1 !======", tree.Assignment(tree.Reference("X!"), ONE, number=10)),
    ],
)
def test_exclamation_mark_is_a_type_character_only_behind_a_name(text: str, expected: tree.Assignment) -> None:
    assert statements_of(text)[0] == expected


def test_continuation_joins_lines_and_skips_blank_ones() -> None:
    text = "10 A% = 1 &\n\n  \t \n  + &\n 20\n30 ! a remark &\n   that goes on & \n 3 lines\n40 END\n"
    assert statements_of(text) == (
        tree.Assignment(A, tree.Binary("+", ONE, tree.IntegerLiteral(20)), number=10),
        tree.Remark("a remark\nthat goes on\n3 lines", True, number=30),
        tree.End(number=40),
    )


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_and_end_of_file(end: str) -> None:
    text = end.join(["10 A% = 1 &", " + 2", "", "20 END", "\x1a"])
    expected = (tree.Assignment(A, tree.Binary("+", ONE, TWO), number=10), tree.End(number=20))
    assert statements_of(text) == expected
    assert statements_of("\N{ZERO WIDTH NO-BREAK SPACE}" + text) == expected


def test_line_number_alone_is_a_label_with_a_warning() -> None:
    module, problems = parse(SourceText("TASK.BLK", "10\n20 END"))
    assert module.statements == (tree.Label(number=10), tree.End(number=20))
    assert [(item.code, item.statement) for item in problems] == [("AMX0014", 10)]


def test_spans_are_the_places_in_the_text() -> None:
    text = "10 A% = 1 \\ B%(2) = A% + 3\n20 CALL X(IN = A%, &\n     OUT = B%)"
    first, second, call = module_of(text).statements
    assert (first.span, second.span, call.span) == (Span(1, 4, 10), Span(1, 13, 27), Span(2, 4, 19))
    assert isinstance(second, tree.Assignment)
    assert second.value.span == Span(1, 21, 27)
    assert isinstance(call, tree.Call)
    assert [item.span for item in call.arguments] == [Span(2, 11, 18), Span(3, 6, 14)]


def test_nesting_of_if_and_for_ends_at_16() -> None:
    def nested(depth: int) -> str:
        heads = [
            f"{10 + level} " + ("IF A@ THEN" if level % 2 else f"FOR I{level}% = 1 TO 2") for level in range(depth)
        ]
        tails = [f"{100 - level} " + ("END_IF" if level % 2 else f"NEXT I{level}%") for level in range(depth)]
        return "\n".join([*heads, *reversed(tails)])

    assert codes_of(nested(16)) == []
    assert codes_of(nested(17)) == ["AMX0058"]
    assert codes_of("10 " + "IF A@ THEN " * 16 + "B% = 1") == []
    assert codes_of("10 " + "IF A@ THEN " * 17 + "B% = 1") == ["AMX0058"]
