"""Compile-time rules of the simple blocks: ABSOLUTE_VALUE to UNPACK_BITS (5 to 38)."""

from __future__ import annotations

import pytest

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Severity, Span
from language.check_support import codes, one, problems, task

DECLARE = (
    "LOCAL A%, B%, C%, D!, R, X@, Y@, S$, T%(16), U%(16), V%(8), W%(2,2), L!(16), M@(16), Q(16), TEN%(9), TWO%(1), "
    "ONE%(0) \\ COMMON F%(16), G%(8)"
)
UDC = {"target": Platform.UDC, "tick_ns": 500_000}


def call(statement: str) -> str:
    return task(f"CALL {statement}", declare=DECLARE)


def marked(statement: str) -> tuple[str, Span]:
    """A task of the CALL, and the place of what stands between « and »."""
    before, fault, after = statement.replace("»", "«").split("«")
    column = len("30 CALL ") + len(before) + 1
    return call(before + fault + after), Span(3, column, column + len(fault))


def check_one(statement: str, code: str, *words: str, severity: Severity = Severity.ERROR) -> None:
    """The statement has one problem, at the marked place, and its message has these words."""
    text, span = marked(statement)
    found = one(text)
    assert (found.code, found.severity) == (code, severity)
    assert (found.span, found.statement) == (span, 30)
    for word in words:
        assert word in found.message


# One parameter


COMPARISONS = ("COMPARE_GTR", "COMPARE_EQU", "COMPARE_LES")
MISTAKES = {
    ("no variable where one must stand", "AMX4075"): [
        ("ABSOLUTE_VALUE(INPUT=«5», OUTPUT=B%)", "INPUT"),
        ("ABSOLUTE_VALUE(INPUT=«-5», OUTPUT=B%)", "INPUT"),
        ("ALARM(INPUT=«5», ALARM_LOW=X@)", "INPUT"),
        ("COUNTER(PRESET=«5», OUTPUT=B%)", "PRESET"),
        ("COUNTER(RESET=X@, PRESET=«70000», OUTPUT=B%)", "PRESET"),
        ("FUNCTION(INPUT=«5», MAX_INPUT=15, TABLE1=T%, OUTPUT=B%)", "INPUT"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=«5», OUTPUT=B%)", "TABLE1"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, TABLE2=«5», SELECT=X@, OUTPUT=B%)", "TABLE2"),
        ("INVERTER(INPUT=«5», OUTPUT=B%)", "INPUT"),
        ("RUNNING_AVERAGE(REQUIRED_SAMPLES=4, INPUT=«5», OUTPUT=B%)", "INPUT"),
        ("SAMPLED_AVERAGE(REQUIRED_SAMPLES=4, INPUT=«5», OUTPUT=B%)", "INPUT"),
        ("SEARCH(COMPARE_EQU=TRUE, INPUT=«5», TABLE1=T%, OUTPUT=B%)", "INPUT"),
        ("SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=«5», OUTPUT=B%)", "TABLE1"),
        ("SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=T%, TABLE2=«5», SELECT=X@, OUTPUT=B%)", "TABLE2"),
    ],
    ("no literal where one must stand", "AMX4076"): [
        ("FUNCTION(INPUT=A%, MAX_INPUT=«C%», TABLE1=T%, OUTPUT=B%)", "MAX_INPUT"),
        ("RUNNING_AVERAGE(REQUIRED_SAMPLES=«C%», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES"),
        ("SEARCH(COMPARE_GTR=«X@», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_GTR"),
        ("SEARCH(COMPARE_EQU=«X@», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_EQU"),
        ("SEARCH(COMPARE_LES=«X@», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_LES"),
        ("SEARCH(COMPARE_EQU=TRUE, COMPARE_LES=«X@», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_LES"),
    ],
    ("an expression as the only comparison", "AMX4077"): [
        ("SEARCH(COMPARE_EQU=«NOT TRUE», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_EQU"),
        ("SEARCH(COMPARE_EQU=«-TRUE», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_EQU"),
    ],
    ("another type", "AMX2015"): [
        ("ABSOLUTE_VALUE(INPUT=«D!», OUTPUT=B%)", "INPUT is INTEGER", "DOUBLE INTEGER"),
        ("ABSOLUTE_VALUE(INPUT=A%, OUTPUT=«D!»)", "OUTPUT is INTEGER"),
        ("ALARM(INPUT=A%, HIGH_LIMIT=«X@», ALARM_LOW=Y@)", "HIGH_LIMIT"),
        ("ALARM(INPUT=A%, ALARM_LOW_LOW=«B%»)", "ALARM_LOW_LOW"),
        ("AMPLIFIER(INPUT1=A%, GAIN1=«R», OUTPUT=B%)", "GAIN1"),
        ("AMPLIFIER(INPUT1=A%, GAIN1=1, SCALE=«1.0», OUTPUT=B%)", "SCALE"),
        ("BIT_SELECT(INPUT=A%, OFFSET=«X@», OUTPUT0=Y@)", "OFFSET"),
        ("BIT_SELECT(INPUT=A%, OUTPUT12=«B%»)", "OUTPUT12"),
        ("COMPARE(INPUT1=A%, INPUT2=«D!», OUTPUT_EQU=X@)", "INPUT2"),
        ("COUNTER(PRESET=«R», OUTPUT=B%)", "PRESET", "INTEGER", "REAL"),
        ("COUNTER(PRESET=«X@», OUTPUT=B%)", "PRESET"),
        ("COUNTER(INPUT_PLUS=«D!», OUTPUT=B%)", "INPUT_PLUS"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=«15.0», TABLE1=T%, OUTPUT=B%)", "MAX_INPUT"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=«L!», OUTPUT=B%)", "TABLE1 is INTEGER", "L!"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=«M@», OUTPUT=B%)", "TABLE1 is INTEGER", "M@"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=«Q», OUTPUT=B%)", "TABLE1 is INTEGER"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=«S$», OUTPUT=B%)", "TABLE1 is INTEGER"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, TABLE2=«L!», SELECT=X@, OUTPUT=B%)", "TABLE2 is INTEGER"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, TABLE2=U%, SELECT=«A%», OUTPUT=B%)", "SELECT"),
        ("INVERTER(ENABLE=«A%», INPUT=A%, OUTPUT=B%)", "ENABLE"),
        ("MOVE(INPUT1=«D!», OUTPUT1=B%)", "INPUT1"),
        ("MULTIPLY_DIVIDE(INPUT1=A%, INPUT2=B%, INPUT3=«R», OUTPUT=C%)", "INPUT3"),
        ("PACK_BITS(INPUT3=«A%», OUTPUT=B%)", "INPUT3"),
        ("RUNNING_AVERAGE(REQUIRED_SAMPLES=«4.0», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES"),
        ("SAMPLED_AVERAGE(REQUIRED_SAMPLES=«D!», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES"),
        ("SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=«L!», OUTPUT=B%)", "TABLE1 is INTEGER"),
        ("SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=T%, FOUND=«A%», OUTPUT=B%)", "FOUND"),
        ("SEARCH(COMPARE_EQU=TRUE, COMPARE_LES=«1», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_LES"),
        ("SEARCH(COMPARE_EQU=«1», INPUT=A%, TABLE1=T%, OUTPUT=B%)", "COMPARE_EQU"),
        ("SELECT(INPUT1=A%, SELECT1=«B%», OUTPUT=C%)", "SELECT1"),
        ("UNPACK_BITS(INPUT=«D!», OUTPUT0=X@)", "INPUT"),
        ("UNPACK_BITS(INPUT=A%, OUTPUT15=«B%»)", "OUTPUT15"),
    ],
    ("a constant as an output", "AMX4078"): [
        ("ALARM(INPUT=A%, ALARM_HIGH=«TRUE»)", "ALARM_HIGH"),
        ("UNPACK_BITS(INPUT=A%, OUTPUT3=«FALSE»)", "OUTPUT3"),
        ("MOVE(INPUT1=A%, OUTPUT1=«5»)", "OUTPUT1"),
    ],
    ("an inverted output", "AMX4079"): [("COMPARE(INPUT1=A%, INPUT2=B%, OUTPUT_LES=«-X@»)", "OUTPUT_LES")],
    ("MAX_INPUT is not a power of two less one", "AMX4080"): [
        (f"FUNCTION(INPUT=A%, MAX_INPUT=«{number}», TABLE1=TWO%, OUTPUT=B%)", "MAX_INPUT")
        for number in (0, -1, 2, 4, 6, 8, 12, 14, 16, 1000, 1024, 32766, -32768, -32767)
    ],
    # 17 elements are right for MAX_INPUT = 15 and more: what the limit should have been is not known.
    ("a wrong MAX_INPUT says nothing of the table", "AMX4080"): [
        (f"FUNCTION(INPUT=A%, MAX_INPUT=«{number}», TABLE1=T%, OUTPUT=B%)", "MAX_INPUT") for number in (0, -1, 12)
    ],
    ("a MAX_INPUT that is not an INTEGER", "AMX2007"): [
        ("FUNCTION(INPUT=A%, MAX_INPUT=«32768», TABLE1=T%, OUTPUT=B%)", "MAX_INPUT")
    ],
    ("samples that are not an INTEGER", "AMX2007"): [
        ("RUNNING_AVERAGE(REQUIRED_SAMPLES=«32768», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES"),
        ("SAMPLED_AVERAGE(REQUIRED_SAMPLES=«32768», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES"),
    ],
    ("samples beyond 32767 bytes", "AMX4091"): [
        ("RUNNING_AVERAGE(«REQUIRED_SAMPLES=16384», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES", "32768", "16383"),
        ("RUNNING_AVERAGE(«REQUIRED_SAMPLES=20000», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES", "40000", "16383"),
        ("RUNNING_AVERAGE(«REQUIRED_SAMPLES=32767», INPUT=A%, OUTPUT=B%)", "REQUIRED_SAMPLES", "65534", "16383"),
    ],
    ("a constant beyond 16 bits", "AMX2007"): [
        ("ALARM(INPUT=A%, LOW_LOW_LIMIT=«-32769», ALARM_LOW_LOW=X@)", "LOW_LOW_LIMIT"),
        ("BIT_SELECT(INPUT=«32768», OUTPUT0=X@)", "INPUT"),
        ("COUNTER(INPUT_MINUS=«40000», OUTPUT=B%)", "INPUT_MINUS"),
        ("UNPACK_BITS(INPUT=«0FFFFH», OUTPUT0=X@)", "INPUT"),
    ],
    ("none of a group", "AMX4082"): [
        (
            "«ALARM»(INPUT=A%, HIGH_LIMIT=B%)",
            "at least 1",
            "ALARM_HIGH",
            "ALARM_LOW",
            "ALARM_HIGH_HIGH",
            "ALARM_LOW_LOW",
        ),
        ("«BIT_SELECT»(INPUT=A%, OFFSET=3)", "at least 1", "OUTPUT0", "OUTPUT15"),
        ("«COMPARE»(INPUT1=A%, INPUT2=B%)", "at least 1", "OUTPUT_GTR", "OUTPUT_EQU", "OUTPUT_LES"),
        ("«PACK_BITS»(OUTPUT=A%)", "at least 1", "INPUT0", "INPUT15"),
        ("«UNPACK_BITS»(INPUT=A%)", "at least 1", "OUTPUT0", "OUTPUT15"),
    ],
    ("a channel with a gap before it, or half of one", "AMX4081"): [
        # The incorrect statements of sections 7 and 32.
        (
            "AMPLIFIER(INPUT1=A%,GAIN1=A%, «INPUT3=C%»,GAIN3=C%, INPUT4=B%,GAIN4=B%, SCALE=C%,OUTPUT=B%)",
            "INPUT3",
            "INPUT2",
        ),
        ("SELECT(INPUT1=A%,SELECT1=X@, «INPUT3=C%»,SELECT3=X@, INPUT4=B%,SELECT4=Y@, OUTPUT=B%)", "INPUT3", "INPUT2"),
        ("AMPLIFIER(INPUT1=A%, GAIN1=1, «INPUT2=B%», OUTPUT=C%)", "INPUT2", "GAIN2"),
        ("AMPLIFIER(INPUT1=A%, GAIN1=1, «GAIN2=B%», OUTPUT=C%)", "GAIN2", "INPUT2"),
        ("AMPLIFIER(INPUT1=A%, GAIN1=1, «INPUT2=B%», GAIN3=5, OUTPUT=C%)", "INPUT2", "GAIN2"),
        ("AMPLIFIER(«GAIN8=1», INPUT1=A%, GAIN1=1, OUTPUT=C%)", "GAIN8", "INPUT2"),
        ("MOVE(INPUT1=A%, OUTPUT1=B%, «INPUT2=C%»)", "INPUT2", "OUTPUT2"),
        ("MOVE(INPUT1=A%, OUTPUT1=B%, «OUTPUT2=C%»)", "OUTPUT2", "INPUT2"),
        ("MOVE(INPUT1=A%, OUTPUT1=B%, «INPUT3=A%», OUTPUT3=C%)", "INPUT3", "INPUT2"),
        ("SELECT(INPUT1=A%, SELECT1=X@, «SELECT2=Y@», OUTPUT=B%)", "SELECT2", "INPUT2"),
        ("SELECT(INPUT1=A%, SELECT1=X@, «INPUT2=5», OUTPUT=B%)", "INPUT2", "SELECT2"),
    ],
    ("a table of a wrong size", "AMX4092"): [
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, «TABLE1=TEN%», OUTPUT=B%)", "TABLE1", "10", "2**m + 1"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, «TABLE1=ONE%», OUTPUT=B%)", "TABLE1", "1 ", "2**m + 1"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=7, «TABLE1=T%», OUTPUT=B%)", "TABLE1", "17", "MAX_INPUT = 7", "9"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=1, «TABLE1=V%», OUTPUT=B%)", "TABLE1", "9", "MAX_INPUT = 1", "3"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, «TABLE1=TEN%», TABLE2=TEN%, SELECT=X@, OUTPUT=B%)", "TABLE1", "10"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, «TABLE2=V%», SELECT=X@, OUTPUT=B%)", "TABLE2", "9", "17"),
        ("FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=V%, «TABLE2=F%», SELECT=X@, OUTPUT=B%)", "TABLE2", "9", "17"),
        ("SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=T%, «TABLE2=G%», SELECT=X@, OUTPUT=B%)", "TABLE2", "9", "17"),
        ("SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=ONE%, «TABLE2=TWO%», SELECT=X@, OUTPUT=B%)", "TABLE2", "2", "1"),
    ],
    ("no comparison is true", "AMX4082"): [
        ("«SEARCH»(INPUT=A%, TABLE1=T%, OUTPUT=B%)", *COMPARISONS),
        ("«SEARCH»(COMPARE_GTR=FALSE, INPUT=A%, TABLE1=T%, OUTPUT=B%)", *COMPARISONS),
        (
            "«SEARCH»(COMPARE_LES=OFF, COMPARE_EQU=FALSE, COMPARE_GTR=FALSE, INPUT=A%, TABLE1=T%, OUTPUT=B%)",
            *COMPARISONS,
        ),
    ],
    ("the third comparison is one too many", "AMX4082"): [
        ("SEARCH(COMPARE_LES=TRUE, COMPARE_GTR=ON, «COMPARE_EQU=TRUE», INPUT=A%, TABLE1=T%, OUTPUT=B%)", *COMPARISONS),
    ],
}


@pytest.mark.parametrize(
    ("code", "row"),
    [pytest.param(code, row, id=f"{what}-{row[0]}") for (what, code), rows in MISTAKES.items() for row in rows],
)
def test_a_mistake_is_one_problem_at_its_place(code: str, row: tuple[str, ...]) -> None:
    statement, *words = row
    check_one(statement, code, *words)


@pytest.mark.parametrize(
    "statement",
    [
        "FUNCTION(INPUT=A%, MAX_INPUT=«7 + 8», TABLE1=T%, OUTPUT=B%)",
        "RUNNING_AVERAGE(REQUIRED_SAMPLES=«2 * 2», INPUT=A%, OUTPUT=B%)",
        "SEARCH(COMPARE_EQU=«NOT TRUE», COMPARE_LES=TRUE, INPUT=A%, TABLE1=T%, OUTPUT=B%)",
    ],
)
def test_an_expression_for_a_literal_is_not_sent_to_a_variable(statement: str) -> None:
    """A variable in its place would be the next error."""
    check_one(statement, "AMX4077")
    found = one(marked(statement)[0])
    assert "variable" not in f"{found.message} {found.hint}"


NEEDED = {
    "ABSOLUTE_VALUE": ("INPUT=A%, OUTPUT=B%", ""),
    "ALARM": ("INPUT=A%", "ALARM_LOW=X@"),
    "AMPLIFIER": ("INPUT1=A%, GAIN1=1, OUTPUT=B%", ""),
    "BIT_SELECT": ("INPUT=A%", "OUTPUT0=X@"),
    "COMPARE": ("INPUT1=A%, INPUT2=B%", "OUTPUT_EQU=X@"),
    "COUNTER": ("OUTPUT=B%", "INPUT_PLUS=A%"),
    "FUNCTION": ("INPUT=A%, MAX_INPUT=15, TABLE1=T%, OUTPUT=B%", ""),
    "INVERTER": ("INPUT=A%, OUTPUT=B%", "ENABLE=X@"),
    "MOVE": ("INPUT1=A%, OUTPUT1=B%", ""),
    "MULTIPLY_DIVIDE": ("INPUT1=A%, INPUT2=B%, INPUT3=C%, OUTPUT=B%", ""),
    "PACK_BITS": ("OUTPUT=B%", "INPUT0=X@"),
    "RUNNING_AVERAGE": ("REQUIRED_SAMPLES=4, INPUT=A%, OUTPUT=B%", ""),
    "SAMPLED_AVERAGE": ("REQUIRED_SAMPLES=4, INPUT=A%, OUTPUT=B%", ""),
    "SEARCH": ("INPUT=A%, TABLE1=T%, OUTPUT=B%", "COMPARE_EQU=TRUE"),
    "SELECT": ("INPUT1=A%, SELECT1=X@, OUTPUT=B%", ""),
    "UNPACK_BITS": ("INPUT=A%", "OUTPUT0=X@"),
}
"""The parameters that a block needs, and one that makes a CALL of them whole."""


@pytest.mark.parametrize(
    ("block", "missing"), [(block, item) for block, (needed, _) in NEEDED.items() for item in needed.split(", ")]
)
def test_required_parameter_is_missing(block: str, missing: str) -> None:
    needed, more = NEEDED[block]
    name = missing.partition("=")[0]
    others = [item for item in (*needed.split(", "), more) if item and item != missing]
    statement = f"«{block}»({', '.join(others)})"
    check_one(statement, "AMX4074", f"needs {name}")
    assert one(marked(statement)[0]).message.split()[-1] == name


@pytest.mark.parametrize(
    ("statement", "name"),
    [
        ("AMPLIFIER(INPUT1=A%, GAIN1=1, «INPUT9»=B%, OUTPUT=C%)", "INPUT9"),
        ("BIT_SELECT(INPUT=A%, «OUTPUT16»=X@)", "OUTPUT16"),
        ("MOVE(INPUT1=A%, OUTPUT1=B%, «OUTPUT9»=C%)", "OUTPUT9"),
        ("PACK_BITS(INPUT0=X@, «INPUT16»=X@, OUTPUT=A%)", "INPUT16"),
        ("SELECT(INPUT1=A%, SELECT1=X@, «SELECT9»=X@, OUTPUT=B%)", "SELECT9"),
        ("UNPACK_BITS(INPUT=A%, OUTPUT15=X@, «OUTPUT16»=Y@)", "OUTPUT16"),
    ],
)
def test_more_channels_than_there_are(statement: str, name: str) -> None:
    text, span = marked(statement)
    found = [item for item in problems(text) if item.span == span]
    assert [item.code for item in found] == ["AMX4072"]
    assert name in found[0].message


# Ranges


@pytest.mark.parametrize("n", range(1, 16))
def test_every_power_of_two_less_one_is_right(n: int) -> None:
    assert codes(call(f"FUNCTION(INPUT=A%, MAX_INPUT={2**n - 1}, TABLE1=TWO%, OUTPUT=B%)")) == []


@pytest.mark.parametrize("block", ["RUNNING_AVERAGE", "SAMPLED_AVERAGE"])
@pytest.mark.parametrize("number", ["0", "-1", "-32768"])
def test_required_samples_are_at_least_1(block: str, number: str) -> None:
    """Section 27 forces a lower value to 1, section 25 has no such words."""
    if block == "RUNNING_AVERAGE":
        check_one(f"{block}(REQUIRED_SAMPLES=«{number}», INPUT=A%, OUTPUT=B%)", "AMX4080", "REQUIRED_SAMPLES")
    else:
        statement = f"{block}(«REQUIRED_SAMPLES={number}», INPUT=A%, OUTPUT=B%)"
        check_one(statement, "AMX4098", "REQUIRED_SAMPLES", "counts as 1", severity=Severity.WARNING)


def test_samples_count_toward_the_data_of_the_task() -> None:
    """Section 25 note 1: the storage is further limited by what the task can hold, here 4 000 000 values."""
    calls = ["CALL RUNNING_AVERAGE(REQUIRED_SAMPLES=16383, INPUT=A%, OUTPUT=B%)"] * 245
    assert codes(task(*calls[:240], declare=DECLARE)) == []
    assert codes(task(*calls, declare=DECLARE)) == ["AMX4009"]


# Sets of parameters


@pytest.mark.parametrize(
    ("statement", "names"),
    [
        ("AMPLIFIER(INPUT2=A%, GAIN2=1, OUTPUT=B%)", {"INPUT1", "GAIN1"}),
        ("SELECT(INPUT2=A%, SELECT2=X@, OUTPUT=B%)", {"INPUT1", "SELECT1"}),
        ("MOVE(INPUT2=A%, OUTPUT2=B%)", {"INPUT1", "OUTPUT1"}),
    ],
)
def test_channel_1_is_required(statement: str, names: set[str]) -> None:
    """Each missing parameter is told once, and not again as a gap."""
    found = problems(call(statement))
    assert {item.code for item in found} == {"AMX4074"}
    assert {item.message.split()[-1] for item in found} == names
    assert len(found) == len(names)


def test_a_gap_on_a_continued_line() -> None:
    """The incorrect statement of section 7 as it is printed there."""
    text = (
        f"10 {DECLARE}\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL AMPLIFIER( &\n  INPUT1 = A%,GAIN1 = A%, &\n"
        "  INPUT3 = C%,GAIN3 = C%, &\n  INPUT4 = B%,GAIN4 = B%, &\n  SCALE = C%,OUTPUT = B%)\n40 END\n"
    )
    found = one(text)
    assert (found.code, found.span, found.statement) == ("AMX4081", Span(5, 3, 14), 30)


@pytest.mark.parametrize(
    "statement",
    [
        # The correct statements of sections 7 and 32, and their order turned round.
        "AMPLIFIER(INPUT1=A%,GAIN1=A%, INPUT2=B%,GAIN2=B%, INPUT3=C%,GAIN3=C%, INPUT4=A%,GAIN4=A%, SCALE=B%,OUTPUT=C%)",
        "AMPLIFIER(INPUT2=B%,GAIN2=B%, INPUT4=A%,GAIN4=A%, INPUT3=C%,GAIN3=C%, INPUT1=A%,GAIN1=A%, SCALE=B%,OUTPUT=C%)",
        "SELECT(INPUT1=A%,SELECT1=X@, INPUT2=B%,SELECT2=Y@, INPUT3=C%,SELECT3=X@, INPUT4=A%,SELECT4=Y@, OUTPUT=B%)",
        "SELECT(INPUT2=B%,SELECT2=Y@, INPUT4=A%,SELECT4=Y@, INPUT3=C%,SELECT3=X@, INPUT1=A%,SELECT1=X@, OUTPUT=B%)",
        "MOVE(OUTPUT2=B%, ENABLE=X@, INPUT1=A%, INPUT2=5, OUTPUT1=T%(3))",
        "ABSOLUTE_VALUE(INPUT=T%(2), OUTPUT=T%(A%))",
        "ALARM(INPUT=A%, HIGH_LIMIT=5, LOW_LIMIT=B%, ALARM_LOW_LOW=M@(3))",
        "AMPLIFIER(INPUT1=5, GAIN1=-3, OUTPUT=B%)",
        "BIT_SELECT(OUTPUT7=X@, OFFSET=-3, OUTPUT0=Y@, INPUT=5)",
        "COMPARE(INPUT1=5, INPUT2=A%, OUTPUT_LES=X@)",
        "COUNTER(OUTPUT=A%)",
        "COUNTER(RESET=-X@, PRESET=D!, INPUT_PLUS=1, INPUT_MINUS=A%, OUTPUT=B%)",
        "COUNTER(PRESET=A%, OUTPUT=B%)",
        "COUNTER(PRESET=L!(3), OUTPUT=B%)",
        "COUNTER(PRESET=T%(3), OUTPUT=B%)",
        "INVERTER(ENABLE=-X@, INPUT=A%, OUTPUT=B%)",
        "MULTIPLY_DIVIDE(INPUT1=1, INPUT2=2, INPUT3=3, OUTPUT=A%)",
        "PACK_BITS(INPUT15=-X@, INPUT0=TRUE, OUTPUT=A%)",
        "RUNNING_AVERAGE(INPUT=A%, REQUIRED_SAMPLES=9, RESET=X@, DATA_VALID=Y@, MAX_VALUE=B%, MIN_VALUE=C%, OUTPUT=B%)",
        "SAMPLED_AVERAGE(INPUT=A%, REQUIRED_SAMPLES=C%, RESET=X@,DATA_VALID=Y@, MAX_VALUE=B%, MIN_VALUE=C%, OUTPUT=B%)",
        "UNPACK_BITS(INPUT=5, OUTPUT3=X@, OUTPUT0=Y@)",
        "RUNNING_AVERAGE(REQUIRED_SAMPLES=1, INPUT=A%, OUTPUT=B%)",
        "RUNNING_AVERAGE(REQUIRED_SAMPLES=16383, INPUT=A%, OUTPUT=B%)",
        "SAMPLED_AVERAGE(REQUIRED_SAMPLES=1, INPUT=A%, OUTPUT=B%)",
        "SAMPLED_AVERAGE(REQUIRED_SAMPLES=32767, INPUT=A%, OUTPUT=B%)",
        "SAMPLED_AVERAGE(REQUIRED_SAMPLES=C%, INPUT=A%, OUTPUT=B%)",
        "FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, OUTPUT=B%)",
        "FUNCTION(INPUT=A%, MAX_INPUT=7, TABLE1=V%, OUTPUT=B%)",
        "FUNCTION(INPUT=A%, MAX_INPUT=0FH, TABLE1=TWO%, OUTPUT=B%)",
        "FUNCTION(INPUT=A%, MAX_INPUT=32767, TABLE1=V%, TABLE2=G%, SELECT=X@, OUTPUT=B%)",
        "SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=TEN%, OUTPUT=B%)",
        "SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=ONE%, FOUND=X@, OUTPUT=B%)",
        "SEARCH(COMPARE_GTR=TRUE, INPUT=A%, TABLE1=T%, OUTPUT=B%)",
        "SEARCH(COMPARE_EQU=ON, INPUT=A%, TABLE1=T%, OUTPUT=B%)",
        "SEARCH(COMPARE_LES=TRUE, COMPARE_GTR=FALSE, INPUT=A%, TABLE1=T%, OUTPUT=B%)",
        "SEARCH(COMPARE_LES=TRUE, COMPARE_EQU=ON, COMPARE_GTR=OFF, INPUT=A%, TABLE1=T%, OUTPUT=B%)",
        "SEARCH(COMPARE_LES=TRUE, COMPARE_GTR=TRUE, INPUT=A%, TABLE1=T%, OUTPUT=B%)",
    ],
)
@pytest.mark.parametrize("target", [Platform.AUTOMAX, Platform.PC3000])
def test_correct_statements(statement: str, target: Platform) -> None:
    assert codes(call(statement), target=target) == []


# Tables


TABLES = pytest.mark.parametrize(
    "around",
    [
        "FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1={}, OUTPUT=B%)",
        "FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, TABLE2={}, SELECT=X@, OUTPUT=B%)",
        "SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1={}, OUTPUT=B%)",
        "SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=T%, TABLE2={}, SELECT=X@, OUTPUT=B%)",
    ],
)


def name_of(around: str) -> str:
    return around.partition("={}")[0].rpartition(" ")[2]


@TABLES
@pytest.mark.parametrize("table", ["A%", "W%", "T%(3)", "T%(A%)"])
def test_a_table_is_a_whole_array_of_one_dimension(around: str, table: str) -> None:
    """Simple variable, two dimensions, an element."""
    check_one(around.format(f"«{table}»"), "AMX4092", name_of(around))


@TABLES
def test_a_table_is_declared(around: str) -> None:
    check_one(around.format("«NONE%»"), "AMX4001", "NONE%")


@pytest.mark.parametrize("name", ["FUNCTION(MAX_INPUT=15", "SEARCH(COMPARE_EQU=TRUE"])
def test_a_table_whose_declaration_is_at_fault_has_no_size(name: str) -> None:
    statement = f"CALL {name}, INPUT=A%, TABLE1=BIG%, OUTPUT=A%)"
    assert codes(task(statement, declare="LOCAL A%, BIG%(65536)")) == ["AMX4007"]


@TABLES
def test_a_table_is_no_expression(around: str) -> None:
    check_one(around.format("«-T%»"), "AMX4077", name_of(around))


@TABLES
@pytest.mark.parametrize("table", ["T%", "U%", "F%"])
def test_right_tables(around: str, table: str) -> None:
    """LOCAL and COMMON ones, and the same one twice."""
    assert codes(call(around.format(table))) == []


def test_a_common_table_may_be_filled_by_basic_statements() -> None:
    """Arrays are not latched, so blocks and statements see the same: no warning."""
    search = "CALL SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=F%, OUTPUT=B%)"
    assert codes(task("F%(3) = A%", search, "C% = F%(2)", declare=DECLARE)) == []


@pytest.mark.parametrize("size", [2**m + 1 for m in range(16)])
def test_the_largest_table_of_each_max_input(size: int) -> None:
    """2**m with m up to the n of MAX_INPUT = 2**n - 1; twice as many segments are too many."""
    most = max(size - 2, 1)
    statement = f"CALL FUNCTION(INPUT=A%, MAX_INPUT={most}, TABLE1=BIG%, OUTPUT=A%)"
    assert codes(task(statement, declare=f"LOCAL A%, BIG%({size - 1})")) == []
    if 2 < size < 32769:
        assert codes(task(statement, declare=f"LOCAL A%, BIG%({2 * (size - 1)})")) == ["AMX4092"]


@pytest.mark.parametrize(("last", "expected"), [(32767, []), (32768, ["AMX4092"])])
def test_a_table_to_search_ends_where_the_index_does(last: int, expected: list[str]) -> None:
    """OUTPUT is an INTEGER, so 32767 is the last element that it can tell."""
    statement = "CALL SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=BIG%, OUTPUT=A%)"
    assert codes(task(statement, declare=f"LOCAL A%, BIG%({last})")) == expected


@pytest.mark.parametrize(
    ("statement", "code", "severity", "words"),
    [
        (
            "FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, «TABLE2=U%», OUTPUT=B%)",
            "AMX4094",
            Severity.WARNING,
            ("TABLE2", "SELECT"),
        ),
        (
            "FUNCTION(INPUT=A%, MAX_INPUT=15, TABLE1=T%, «SELECT=X@», OUTPUT=B%)",
            "AMX4082",
            Severity.ERROR,
            ("SELECT", "TABLE2"),
        ),
        (
            "SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=T%, «TABLE2=U%», OUTPUT=B%)",
            "AMX4082",
            Severity.ERROR,
            ("TABLE2", "SELECT"),
        ),
        (
            "SEARCH(COMPARE_EQU=TRUE, INPUT=A%, TABLE1=T%, «SELECT=FALSE», OUTPUT=B%)",
            "AMX4082",
            Severity.ERROR,
            ("SELECT", "TABLE2"),
        ),
    ],
)
def test_select_and_table_2_come_together(
    statement: str, code: str, severity: Severity, words: tuple[str, ...]
) -> None:
    check_one(statement, code, *words, severity=severity)


# Comparisons of SEARCH


# Processors


def test_bit_select_does_not_run_on_a_udc() -> None:
    text, span = marked("«BIT_SELECT»(INPUT=A%, OUTPUT0=X@)")
    (found,) = (item for item in problems(text, **UDC) if item.severity is Severity.ERROR)
    assert (found.code, found.span) == ("AMX4071", span)
    assert "BIT_SELECT" in found.message
    assert codes(text) == codes(text, target=Platform.PC3000) == []


@pytest.mark.parametrize("block", [block for block in NEEDED if block != "BIT_SELECT"])
def test_the_others_run_on_a_udc(block: str) -> None:
    """Of SEARCH its own section says so (decision); table 5 forgets it."""
    statement = call(f"{block}({', '.join(filter(None, NEEDED[block]))})")
    assert [item for item in problems(statement, **UDC) if item.severity is Severity.ERROR] == []
