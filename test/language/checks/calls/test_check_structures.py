"""Data structures: made once by a SHIFT block, used as what they are (sections 23, 24, 30, 31, 39 and 40)."""

from __future__ import annotations

import pytest

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Diagnostic, Severity
from language.check_support import codes, one, problems, program, task

DECLARE = "LOCAL A%, B%, C%, D%, E%, F%, G%, H%, V@, W@, X@, Y@, D!, R, T%(10)"
INTEGERS, BOOLEANS = "ABCDEFGH", "VWXYVWXY"
WORDS = "CALL SHIFT_WORDS(STRUCTURE_NAME=QUEUE%, MAX_COLUMNS=4, SHIFT=X@, INPUT1=A%, OUTPUT1=B%, INPUT2=C%, OUTPUT2=D%)"
BITS = "CALL SHIFT_BITS(STRUCTURE_NAME=FLAGS@, MAX_COLUMNS=4, SHIFT=X@, INPUT1=V@, OUTPUT1=W@)"
READ_WORDS = "CALL READ_WORDS(STRUCTURE_NAME=QUEUE%, COLUMN=E%, ENABLE=X@, OUTPUT1=F%)"
READ_BITS = "CALL READ_BITS(STRUCTURE_NAME=FLAGS@, COLUMN=E%, ENABLE=X@, OUTPUT1=Y@)"
WRITE_WORDS = "CALL WRITE_WORDS(STRUCTURE_NAME=QUEUE%, COLUMN=E%, ENABLE=X@, INPUT1=F%)"
WRITE_BITS = "CALL WRITE_BITS(STRUCTURE_NAME=FLAGS@, COLUMN=E%, ENABLE=X@, INPUT1=Y@)"
ALL = (WORDS, BITS, READ_WORDS, READ_BITS, WRITE_WORDS, WRITE_BITS)


def shift(kind: str, columns: str, channels: int, name: str = "Q") -> str:
    """A SHIFT block of some channels."""
    mark, names = ("%", INTEGERS) if kind == "WORDS" else ("@", BOOLEANS)
    pairs = "".join(f", INPUT{n}={names[n - 1]}{mark}, OUTPUT{n}={names[n - 1]}{mark}" for n in range(1, channels + 1))
    return f"CALL SHIFT_{kind}(STRUCTURE_NAME={name}{mark}, MAX_COLUMNS={columns}, SHIFT=X@{pairs})"


def text_at(text: str, found: Diagnostic) -> str:
    """What the diagnostic points at."""
    return text.splitlines()[found.span.line - 1][found.span.column - 1 : found.span.end_column - 1]


def only(*lines: str, declare: str = DECLARE) -> tuple[str, int, str]:
    """Code, BASIC line and marked text of the one problem that a task has."""
    text = task(*lines, declare=declare)
    found = one(text)
    assert found.statement is not None
    return found.code, found.statement, text_at(text, found)


@pytest.mark.parametrize(
    ("statements", "declare"),
    [
        pytest.param(ALL, DECLARE, id="all blocks"),
        pytest.param(ALL[::-1], DECLARE, id="used before they are made"),
        pytest.param((WORDS, BITS.replace("FLAGS@", "QUEUE@"), READ_WORDS), DECLARE, id="two types of one name"),
        pytest.param(ALL, f"{DECLARE}, QUEUE%", id="one declared LOCAL"),
        pytest.param(ALL, f"{DECLARE}, QUEUE%, FLAGS@", id="both declared LOCAL"),
    ],
)
def test_right_structures(statements: tuple[str, ...], declare: str) -> None:
    assert codes(task(*statements, declare=declare)) == []


@pytest.mark.parametrize("block", [READ_WORDS, READ_BITS, WRITE_WORDS, WRITE_BITS])
def test_a_structure_that_no_block_makes(block: str) -> None:
    name = "QUEUE%" if "QUEUE%" in block else "FLAGS@"
    assert only(block) == ("AMX4088", 30, name)
    other = BITS if name == "QUEUE%" else WORDS
    assert only(other, block) == ("AMX4088", 40, name)


def test_a_misspelt_structure_is_suggested() -> None:
    found = one(task(WORDS, READ_WORDS.replace("QUEUE%", "QEUE%"), declare=DECLARE))
    assert found.code == "AMX4088"
    assert "QUEUE%" in (found.hint or "")


def test_a_structure_of_a_comment_or_a_local_is_not_made() -> None:
    assert only(READ_WORDS, declare=f"{DECLARE}, QUEUE%") == ("AMX4088", 30, "QUEUE%")
    assert only(f"REM {WORDS}", READ_WORDS) == ("AMX4088", 40, "QUEUE%")


@pytest.mark.parametrize("block", [WORDS, BITS])
def test_a_structure_made_twice(block: str) -> None:
    name = "QUEUE%" if block is WORDS else "FLAGS@"
    assert only(block, READ_WORDS if block is WORDS else READ_BITS, block) == ("AMX4089", 50, name)
    assert codes(task(block, block, block, declare=DECLARE)) == ["AMX4089"] * 2


@pytest.mark.parametrize(
    "given", ["QUEUE@", "QUEUE!", "QUEUE", "QUEUE$", "5", "TRUE", "'QUEUE'", "QUEUE%(1)", "-A%", "A% + 1"]
)
def test_what_is_not_the_name_of_an_integer_structure(given: str) -> None:
    for block in (WORDS, READ_WORDS, WRITE_WORDS):
        wrong = block.replace("=QUEUE%", f"={given}")
        assert only(*([wrong] if block is WORDS else [WORDS, wrong])) == (
            "AMX4087",
            30 if block is WORDS else 40,
            given,
        )


@pytest.mark.parametrize(
    "given", ["FLAGS%", "FLAGS!", "FLAGS", "FLAGS$", "5", "TRUE", "FLAGS@(1)", "-FLAGS@", "NOT X@"]
)
def test_what_is_not_the_name_of_a_boolean_structure(given: str) -> None:
    for block in (BITS, READ_BITS, WRITE_BITS):
        wrong = block.replace("=FLAGS@", f"={given}")
        assert only(*([wrong] if block is BITS else [BITS, wrong])) == ("AMX4087", 30 if block is BITS else 40, given)


@pytest.mark.parametrize(
    ("block", "name", "extra"),
    [
        (READ_WORDS, "QUEUE%", "OUTPUT3=G%"),
        (READ_WORDS, "QUEUE%", "OUTPUT8=G%"),
        (WRITE_WORDS, "QUEUE%", "INPUT3=G%"),
        (READ_BITS, "FLAGS@", "OUTPUT2=V@"),
        (WRITE_BITS, "FLAGS@", "INPUT2=V@"),
        (WRITE_BITS, "FLAGS@", "INPUT8=TRUE"),
    ],
)
def test_a_channel_that_the_structure_does_not_have(block: str, name: str, extra: str) -> None:
    code, line, marked = only(*(block.replace(")", f", {extra})"), BITS, WORDS))
    assert (code, line) == ("AMX4090", 30)
    assert marked in (extra, extra.partition("=")[0])


def test_channels_that_the_structure_has() -> None:
    for kind, read, write in (("WORDS", READ_WORDS, WRITE_WORDS), ("BITS", READ_BITS, WRITE_BITS)):
        mark = "%" if kind == "WORDS" else "@"
        made = shift(kind, "3", 8, "QUEUE" if kind == "WORDS" else "FLAGS")
        names = INTEGERS if kind == "WORDS" else BOOLEANS
        more = read.replace(")", "".join(f", OUTPUT{n}={names[n - 1]}{mark}" for n in range(2, 9)) + ")")
        lone = write.replace("INPUT1", "INPUT8")
        assert codes(task(made, more, lone, declare=DECLARE)) == []


@pytest.mark.parametrize(("channels", "most"), [(1, 16383), (2, 8191), (3, 5461), (8, 2047)])
def test_words_take_two_bytes_a_channel_and_column(channels: int, most: int) -> None:
    assert codes(task(shift("WORDS", str(most), channels), declare=DECLARE)) == []
    assert only(shift("WORDS", str(most + 1), channels))[:2] == ("AMX4091", 30)
    assert only(shift("WORDS", "32767", channels))[2] in ("32767", "MAX_COLUMNS", "MAX_COLUMNS=32767")


def test_bits_take_a_byte_a_column() -> None:
    assert codes(task(shift("BITS", "32767", 8), declare=DECLARE)) == []
    assert codes(task(shift("BITS", "1", 1), declare=DECLARE)) == []


@pytest.mark.parametrize("kind", ["BITS", "WORDS"])
@pytest.mark.parametrize(
    ("columns", "code"), [("0", "AMX4080"), ("-1", "AMX4080"), ("32768", "AMX2007"), ("A%", "AMX4076")]
)
def test_max_columns_is_a_constant_from_1_to_32767(kind: str, columns: str, code: str) -> None:
    assert only(shift(kind, columns, 1)) == (code, 30, columns)
    read = READ_WORDS.replace("QUEUE", "Q") if kind == "WORDS" else READ_BITS.replace("FLAGS", "Q")
    assert only(shift(kind, columns, 1), read) == (code, 30, columns)


def test_structures_count_as_local_data_of_the_task() -> None:
    """Notes 3 of 30 and 31: their size is limited by what the task can hold of local data."""
    many = [shift("BITS", "32767", 1, f"Q{number}") for number in range(130)]
    assert codes(task(*many, declare=DECLARE)) == ["AMX4009"]


@pytest.mark.parametrize(
    ("statement", "marked"),
    [
        ("A% = QUEUE%", "QUEUE%"),
        ("QUEUE% = 3", "QUEUE%"),
        ("A% = B% + QUEUE%", "QUEUE%"),
        ("A% = QUEUE%(1)", "QUEUE%(1)"),
        ("CALL INVERTER(INPUT=QUEUE%, OUTPUT=A%)", "QUEUE%"),
        ("CALL INVERTER(INPUT=A%, OUTPUT=QUEUE%)", "QUEUE%"),
        ("PRINT QUEUE%", "QUEUE%"),
        ("FOR QUEUE% = 1 TO 3", "QUEUE%"),
    ],
)
@pytest.mark.parametrize("declared", [True, False])
@pytest.mark.parametrize("made_first", [True, False])
def test_a_structure_is_no_variable(statement: str, marked: str, declared: bool, made_first: bool) -> None:
    declare = f"{DECLARE}, QUEUE%" if declared else DECLARE
    lines = [WORDS, statement] if made_first else [statement, WORDS]
    if statement.startswith("FOR"):
        lines.insert(lines.index(statement) + 1, "NEXT QUEUE%")
    assert only(*lines, declare=declare) == ("AMX4093", 30 + 10 * lines.index(statement), marked)


@pytest.mark.parametrize("declaration", ["11 COMMON QUEUE%", "11 LOCAL QUEUE% [CURRENT=1]"])
def test_a_structure_is_local_and_no_tunable(declaration: str) -> None:
    assert only(WORDS, declare=f"{DECLARE}\n{declaration}") == ("AMX4093", 30, "QUEUE%")


LONGEST = "ABCDEFGHIJKLMNOP"


def test_sixteen_characters_give_a_warning_seventeen_an_error() -> None:
    """The sections say 15 and 16."""
    made = WORDS.replace("QUEUE", LONGEST)
    assert only(made) == ("AMX4095", 30, f"{LONGEST}%")
    assert one(task(made, declare=DECLARE)).severity is Severity.WARNING
    assert program(task(made, declare=DECLARE)).calls
    assert codes(task(WORDS.replace("QUEUE", LONGEST[:15]), declare=DECLARE)) == []
    longer = one(task(WORDS.replace("QUEUE", f"{LONGEST}Q"), declare=DECLARE))
    assert (longer.severity, longer.statement) == (Severity.ERROR, 30)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (WORDS.replace(", OUTPUT2=D%", ""), "AMX4081"),
        (WORDS.replace(", INPUT2=C%", ""), "AMX4081"),
        (WORDS.replace("PUT2=", "PUT3="), "AMX4081"),
        (WORDS.replace("PUT2=", "PUT9="), None),
        (BITS.replace("INPUT1=V@, ", ""), "AMX4074"),
        (BITS.replace(", OUTPUT1=W@", ""), "AMX4074"),
        (BITS.replace("STRUCTURE_NAME=FLAGS@, ", ""), "AMX4074"),
        (BITS.replace("MAX_COLUMNS=4, ", ""), "AMX4074"),
        (BITS.replace("SHIFT=X@, ", ""), "AMX4074"),
        (BITS.replace("OUTPUT1=W@", "OUTPUT1=TRUE"), "AMX4078"),
        (BITS.replace("OUTPUT1=W@", "OUTPUT1=-W@"), "AMX4079"),
        (WORDS.replace("INPUT1=A%", "INPUT1=X@"), "AMX2015"),
        (READ_WORDS.replace(", OUTPUT1=F%", ""), "AMX4082"),
        (READ_BITS.replace(", OUTPUT1=Y@", ""), "AMX4082"),
        (WRITE_WORDS.replace(", INPUT1=F%", ""), "AMX4082"),
        (WRITE_BITS.replace(", INPUT1=Y@", ""), "AMX4082"),
        (READ_WORDS.replace("COLUMN=E%, ", ""), "AMX4074"),
        (READ_WORDS.replace("ENABLE=X@, ", ""), "AMX4074"),
        (WRITE_BITS.replace("ENABLE=X@, ", ""), "AMX4074"),
        (READ_BITS.replace("STRUCTURE_NAME=FLAGS@, ", ""), "AMX4074"),
        (READ_BITS.replace("OUTPUT1=Y@", "OUTPUT1=A%"), "AMX2015"),
        (READ_WORDS.replace("COLUMN=E%", "COLUMN=X@"), "AMX2015"),
        (READ_WORDS.replace("COLUMN=E%", "COLUMN=E% + 1"), "AMX4077"),
        (READ_WORDS.replace("ENABLE=X@", "ENABLE=1"), "AMX2015"),
        (READ_WORDS.replace("OUTPUT1=F%", "OUTPUT1=5"), "AMX4078"),
    ],
)
def test_each_fault_of_a_call_is_one_error(text: str, code: str | None) -> None:
    """With the blocks that it goes with, which stay without fault."""
    others = [block for block in (WORDS, BITS) if text.partition("(")[0] != block.partition("(")[0]]
    found = problems(task(text, *others, declare=DECLARE))
    assert {item.code for item in found} == {code or "AMX4072"}
    assert len(found) == (2 if code is None else 1)
    assert {item.statement for item in found} == {30}


@pytest.mark.parametrize(
    "text",
    [
        READ_WORDS.replace("=E%", "=3"),
        READ_WORDS.replace("=E%", "=T%(A%)"),
        WRITE_BITS.replace("Y@", "-Y@"),
        BITS.replace("SHIFT=X@", "SHIFT=TRUE, RESET=-Y@, ENABLE=OFF"),
    ],
)
def test_right_calls(text: str) -> None:
    others = [block for block in (WORDS, BITS) if text.partition("(")[0] != block.partition("(")[0]]
    assert codes(task(text, *others, declare=DECLARE)) == []


@pytest.mark.parametrize("text", ALL)
def test_none_of_these_blocks_runs_on_a_udc(text: str) -> None:
    protection = "CALL THERMAL_OVERLOAD(I_FDBK=PMI_FB%, OVERLOAD=OVRLOAD@)"
    made = {READ_WORDS: [WORDS], WRITE_WORDS: [WORDS], READ_BITS: [BITS], WRITE_BITS: [BITS]}.get(text, [])
    written = task(protection, text, *made, declare=f"{DECLARE}\n11 COMMON PMI_FB%, OVRLOAD@")
    found = problems(written, target=Platform.UDC, tick_ns=500_000)
    name = text.removeprefix("CALL ").partition("(")[0]
    assert [item.code for item in found] == ["AMX4071"] * (1 + len(made))
    assert (found[0].statement, text_at(written, found[0])) == (40, name)


@pytest.mark.parametrize("text", ALL)
def test_they_run_on_automax_and_pc3000(text: str) -> None:
    for target in (Platform.AUTOMAX, Platform.PC3000):
        assert codes(task(*ALL, declare=DECLARE), target=target) == []
