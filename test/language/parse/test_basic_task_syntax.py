"""Statements of BASIC tasks: printed and read again, and what the checker says of them."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import CheckResult, check
from automax_ros.language.parse.parser import parse
from automax_ros.language.printer import numbered, print_module
from automax_ros.language.program import OpenedFile
from automax_ros.language.tree import tree
from automax_ros.language.tree.task_kind import NotATask, TaskKind, kind_of_file
from language.random_trees import EXPRESSIONS, LINES, TARGETS, WORDS

FILES = st.integers(0, 300)
TYPES = st.lists(st.sampled_from([*tree.ITEM_TYPES.values()]), min_size=1, max_size=5).map(tuple)
UNITS = st.sampled_from(tree.Unit)
JUMPS = st.none() | LINES


def printed(number: int, items: list, full: int | None) -> tree.PrintFile:
    return tree.PrintFile(number, tuple(items), (*[","] * (len(items) - 1), "") if items else (), full)


WAITING = st.one_of(
    st.builds(tree.SetEvent, WORDS),
    st.builds(tree.WaitOn, WORDS),
    st.builds(tree.Delay, EXPRESSIONS, UNITS),
    st.builds(tree.StartEvery, EXPRESSIONS, UNITS),
    st.builds(tree.OpenChannel, st.just(tree.Direction.OUTPUT), FILES, TYPES),
    st.builds(tree.OpenChannel, st.just(tree.Direction.INPUT), FILES, TYPES, EXPRESSIONS),
    st.builds(tree.OpenPort, st.sampled_from(["PORTA", "PORTB", "x"]), FILES, EXPRESSIONS, st.none() | EXPRESSIONS),
    st.builds(tree.OpenPort, st.just("PORTB"), FILES, access=st.sampled_from(["EXCLUSIVE", "NON_EXCLUSIVE"])),
    st.builds(tree.Close, FILES),
    st.builds(tree.InputFile, FILES, st.lists(TARGETS, min_size=1, max_size=3).map(tuple), JUMPS),
    st.builds(printed, FILES, st.lists(EXPRESSIONS, max_size=3), JUMPS),
    st.builds(tree.Get, FILES, TARGETS, JUMPS),
    st.builds(tree.Put, FILES, EXPRESSIONS),
)


@given(st.lists(WAITING, min_size=1, max_size=4))
@settings(max_examples=150, deadline=None, derandomize=True, database=None)
def test_a_tree_of_these_statements_parses_back_to_itself(statements) -> None:
    module = numbered(tree.Module(tuple(statements)))
    text = print_module(module)
    again, found = parse(SourceText("TASK.BAS", text))
    assert [item.message for item in found if "lower case" not in item.message] == []
    assert again == module


def checked(*statements: str, name: str = "TASK.BAS", target: Platform = Platform.AUTOMAX) -> CheckResult:
    """The check of statements in lines 20, 30, ... with some declarations and END."""
    head = ["10 LOCAL A%, B!, X, F@, S$, T%(3)", "15 EVENT NAME = GO", "16 COMMON Q%"]
    lines = [f"{20 + 10 * place} {statement}" for place, statement in enumerate(statements)]
    return check(
        SourceText(name, "\n".join([*head, *lines, "9000 END"]) + "\n"),
        name="TASK", catalogue=CATALOGUE, target=target,
    )  # fmt: skip


def codes(*statements: str, **options) -> list[str]:
    return [item.code for item in checked(*statements, **options).diagnostics]


READER = "OPEN CHANNEL FOR INPUT AS FILE #1, TYPE = (I, S), DEPTH = 4"
WRITER = "OPEN CHANNEL FOR OUTPUT AS FILE #1, TYPE = (R, B)"
PORT = 'OPEN "PORTB" AS FILE #2, SETUP = 0D00H, 9600'


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        (["WAIT ON GO", "SET GO"], []),
        (["WAIT ON STOPPED"], ["AMX4060"]),
        (["SET GONE"], ["AMX4060"]),
        (["DELAY A% * 2 TICKS"], []),
        (["DELAY 1.5 SECONDS"], ["AMX2009"]),
        (["DELAY X SECONDS"], ["AMX2009"]),
        (["DELAY -1 TICKS"], ["AMX4118"]),
        (["DELAY 0 TICKS"], []),
        (["START EVERY 0 TICKS"], ["AMX4118"]),
        (["START EVERY A% HOURS"], []),
        ([READER, "INPUT #1, A%, S$"], []),
        ([READER, "INPUT #1, T%(A%), S$"], []),
        ([READER, "INPUT #1, X, S$"], []),
        ([READER, "INPUT #1, F@, S$"], ["AMX4115"]),
        ([READER, "INPUT #1, A%, A%"], ["AMX4115"]),
        ([READER, "INPUT #1, A%"], ["AMX4115"]),
        ([READER, "INPUT #3, A%, S$"], ["AMX4113"]),
        ([READER, "INPUT #1, UNKNOWN%, S$"], ["AMX4001"]),
        ([READER, "PRINT #1, 1, S$"], ["AMX4116"]),
        ([WRITER, "PRINT #1, A% / 2, A% > 1"], []),
        ([WRITER, "PRINT #1, A% / 2, A%"], ["AMX4115"]),
        ([WRITER, "INPUT #1, X, F@"], ["AMX4116"]),
        ([WRITER, "PRINT:FULL=9000 #1, 1.0, TRUE"], []),
        ([WRITER, "PRINT:FULL=55 #1, 1.0, TRUE"], ["AMX4047"]),
        ([READER, "INPUT:EMPTY=55 #1, A%, S$"], ["AMX4047"]),
        ([READER, "FOR A% = 1 TO 3", "S$ = ''", "NEXT A%", "INPUT:EMPTY=40 #1, A%, S$"], ["AMX4050"]),
        ([READER, WRITER], ["AMX4114"]),
        ([READER, READER], []),
        ([READER.replace("DEPTH = 4", "DEPTH = 1001")], ["AMX4118"]),
        ([READER.replace("DEPTH = 4", "DEPTH = A%")], []),
        ([READER.replace("#1", "#0")], ["AMX4112"]),
        ([READER, "CLOSE #1"], ["AMX4116"]),
        ([PORT, "PRINT #2, A%; S$", "PUT #2, S$ + CHR$(13)", "CLOSE #2"], []),
        ([PORT, "PUT #2, A%"], ["AMX4115"]),
        ([PORT, "GET #2, S$"], ["AMX4120"]),
        ([PORT, "INPUT #2, A%"], ["AMX4120"]),
        ([PORT, "GET:EMPTY=9000 #2, A%"], ["AMX4115"]),
        ([PORT, "GET:EMPTY=9000 #2, S$"], []),
        ([PORT, "PRINT:FULL=9000 #2, S$"], ["AMX4116"]),
        ([PORT.replace("PORTB", "portb")], []),
        ([PORT.replace("PORTB", "PORTC")], ["AMX4117"]),
        (["CALL SCAN_LOOP(TICKS=4)"], ["AMX4111"]),
        (["PRINT #A%, 1"], ["AMX4110"]),
        (["WAIT GO"], ["AMX4110"]),
        (["START A% TICKS"], ["AMX4110"]),
        (["INPUT A%"], ["AMX4110"]),
        (["OPEN CHANNEL FOR READING AS FILE #1, TYPE = (I)"], ["AMX4110"]),
        (["OPEN CHANNEL FOR INPUT AS FILE #1, TYPE = (I)"], ["AMX0071"]),
        (["OPEN CHANNEL FOR OUTPUT AS FILE #1, TYPE = (K)"], ["AMX4110"]),
    ],
)
def test_what_the_checker_says(statements: list[str], expected: list[str]) -> None:
    assert codes(*statements) == expected


def test_a_misspelt_word_gets_a_suggestion() -> None:
    (found,) = checked("DELAY 10 SECOND").diagnostics
    assert found.hint == "did you mean SECONDS?"


def test_their_words_may_name_variables() -> None:
    text = "10 LOCAL DELAY, SET, INPUT(3)\n20 DELAY = 1.0 \\ SET = DELAY\n30 INPUT(2) = SET\n40 END\n"
    assert parse(SourceText("TASK.BAS", text))[1] == []
    assert [item.span.line for item in parse(SourceText("TASK.BLK", text))[1]] == [3]


def test_the_program_knows_what_it_opens() -> None:
    program = checked(READER, PORT).program
    assert program is not None
    assert program.kind is TaskKind.BASIC
    assert [(item.number, item.words) for item in program.files] == [(1, "a channel FOR INPUT"), (2, "port PORTB")]
    assert program.files[0] == OpenedFile(1, "", tree.Direction.INPUT, (tree.ITEM_TYPES["I"], tree.ITEM_TYPES["S"]))
    assert (program.startup, program.ticks, program.event) == ((), 0, None)


@pytest.mark.parametrize("target", [Platform.PC3000, Platform.UDC])
def test_other_processors(target: Platform) -> None:
    assert codes("DELAY 1 TICKS", target=target) == ({Platform.UDC: ["AMX4119", "AMX4027"]}.get(target, []))


def test_unconfirmed_forms_are_marked() -> None:
    found = checked(
        READER, "INPUT:EMPTY=9000 #1, A%, S$", PORT, "GET:EMPTY=9000 #2, S$", "PUT #2, S$", "SET GO"
    ).unconfirmed
    assert [span.line for span, _ in found] == [5, 7, 8]
    scan = check(
        SourceText("TASK.BLK", "10 EVENT NAME = GO\n20 CALL SCAN_LOOP(TICKS=4)\n30 SET GO\n40 END\n"),
        name="TASK", catalogue=CATALOGUE,
    )  # fmt: skip
    assert scan.diagnostics == []
    assert [span.line for span, _ in scan.unconfirmed] == [3]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("SEQ.PC", "a ladder task (.PC) is not run"),
        ("RACK.CNF", "a configuration task (.CNF) is not run"),
        ("PART.INC", "an include file (.INC) is not a task"),
        ("notes.txt", "a task's source is a .BLK or .BAS file"),
        (".BAS", "a task's source is a .BLK or .BAS file"),
    ],
)
def test_a_files_name_says_what_it_is(name: str, message: str) -> None:
    assert [kind_of_file(item) for item in ("A.blk", "dir/B.BAS")] == [TaskKind.CONTROL_BLOCK, TaskKind.BASIC]
    with pytest.raises(NotATask) as found:
        kind_of_file(name)
    assert message in str(found.value)
