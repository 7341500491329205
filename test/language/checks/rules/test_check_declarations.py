"""LOCAL, COMMON, tunables and EVENT: names, sizes, limits, agreement with the rack (2.4)."""

import pytest

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Span
from automax_ros.core.numbers import INT16_MAX, INT16_MIN, REAL_MAX, stored_real
from automax_ros.core.types import DataType
from automax_ros.language.program import CommonSpec, TuningLimits
from automax_ros.language.tree.tree import Scope
from language.check_support import codes, one, problems, program, task


def declared(text: str) -> str:
    return task("A% = 1", declare=f"LOCAL A% \\ {text}")


def test_symbols_of_a_program() -> None:
    symbols = program(declared("COMMON T!(3,4) \\ LOCAL S$:20(5), RUN@, RUN \\ GLOBAL RUN%")).symbols
    assert list(symbols) == ["A%", "T!", "S$", "RUN@", "RUN", "RUN%"]
    assert symbols["T!"].dimensions == (4, 5)
    assert symbols["T!"].elements == 20
    assert symbols["T!"].scope is Scope.COMMON
    assert not symbols["T!"].latched
    assert (symbols["S$"].dimensions, symbols["S$"].length) == ((6,), 20)
    assert symbols["RUN%"].scope is Scope.COMMON
    assert symbols["RUN%"].latched
    assert symbols["RUN"].type is DataType.REAL


def test_default_length_is_31() -> None:
    assert program(declared("LOCAL S$")).symbols["S$"].length == 31


@pytest.mark.parametrize(
    "text",
    ["LOCAL A!, A@, A, A$", "LOCAL T%(65534)", "LOCAL T%(999,999)", "LOCAL T%(1,1,1,1)", "LOCAL S$:255(10)"],
)
def test_names_that_differ_in_type_and_the_largest_sizes(text: str) -> None:
    assert codes(declared(text)) == []


@pytest.mark.parametrize("second", ["LOCAL A%", "COMMON A%", "LOCAL A%(3)"])
def test_second_declaration_shows_both_places(second: str) -> None:
    found = one(declared(second))
    assert found.code == "AMX4002"
    scope, name = second.split()
    assert found.span == Span(1, 16 + len(scope), 16 + len(scope) + len(name))
    assert found.notes[0].span == Span(1, 10, 12)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("LOCAL T%(65535)", "AMX4007"),
        ("LOCAL T%(1000,1000)", "AMX4007"),
        ("LOCAL T%(1,1,1,1,1)", "AMX4006"),
        ("LOCAL S$:0", "AMX4008"),
        ("LOCAL S$:256", "AMX4008"),
        ("LOCAL G@ [CURRENT=TRUE]", "AMX4012"),
        ("COMMON G [CURRENT=1.0]", "AMX4012"),
        ("LOCAL G [LOW=1.0]", "AMX4013"),
        ("LOCAL G [CURRENT=1.0, LOW=2.0]", "AMX4014"),
        ("LOCAL G [CURRENT=1.0, HIGH=0.5]", "AMX4014"),
        ("LOCAL G% [CURRENT=1, STEP=0]", "AMX4015"),
        ("LOCAL G% [CURRENT=1, STEP=-1]", "AMX4015"),
        ("LOCAL G% [CURRENT=1.0]", "AMX2018"),
        ("LOCAL G [CURRENT='A']", "AMX2018"),
        ("LOCAL G% [CURRENT=1, HIGH=32768]", "AMX2007"),
    ],
)
def test_each_is_one_error(text: str, code: str) -> None:
    assert codes(declared(text)) == [code]


def test_data_of_a_task_is_bounded() -> None:
    four = "LOCAL B(999,999), C(999,999), D(999,999), E(999,998)"
    assert codes(declared(four)) == []
    assert codes(declared(f"{four}, F(999)")) == ["AMX4009"]


def test_tuning_limits_in_their_own_type() -> None:
    symbols = program(
        declared("LOCAL G [LOW=0, CURRENT=1.1, STEP=0.1, HIGH=10.0], N% [CURRENT=-5], P! [CURRENT=0AH]")
    ).symbols
    assert symbols["G"].tuning == TuningLimits(stored_real(1.1)[0], 0.0, 10.0, stored_real(0.1)[0])
    assert symbols["N%"].tuning == TuningLimits(-5, INT16_MIN, INT16_MAX, 1)
    assert symbols["P!"].tuning == TuningLimits(10, -(2**31), 2**31 - 1, 1)


def test_limits_of_a_real_default_to_the_type() -> None:
    tuning = program(declared("LOCAL G [CURRENT=1]")).symbols["G"].tuning
    assert tuning is not None
    assert (tuning.low, tuning.high) == (-REAL_MAX, REAL_MAX)
    widest = program(declared("LOCAL G [CURRENT=1, LOW=-9.2233717E18, HIGH=9.2233717E18]")).symbols["G"].tuning
    assert widest is not None
    assert (widest.low, widest.high) == (-REAL_MAX, REAL_MAX)
    assert isinstance(tuning.current, float)
    assert isinstance(tuning.step, float)
    assert tuning.step > 0


@pytest.mark.parametrize(
    "statement",
    [
        "G% = 1",
        "READ G%",
        "FOR G% = 1 TO 2 \\ NEXT G%",
        "CALL DIFFERENCE(INPUT1=A%, INPUT2=A%, OUTPUT=G%)",
    ],
)
def test_nothing_in_a_task_writes_a_tunable(statement: str) -> None:
    found = one(task(statement, "DATA 1", declare="LOCAL A%, G% [CURRENT=1]"))
    assert found.code == "AMX4016"


def test_a_tunable_may_be_read() -> None:
    text = task("CALL DIFFERENCE(INPUT1=G%, INPUT2=A%, OUTPUT=A%)", "B% = G%", declare="LOCAL A%, B%, G% [CURRENT=1]")
    assert codes(text) == []


RACK = {
    spec.name: spec
    for spec in (
        CommonSpec("REF%", DataType.INTEGER, "rack.yaml:14"),
        CommonSpec("TABLE%", DataType.INTEGER, "rack.yaml:15", (11,)),
        CommonSpec("NAME$", DataType.STRING, "rack.yaml:16", (), 20),
        CommonSpec("START@", DataType.BOOLEAN, "rack.yaml:17", is_input=True),
    )
}


def common(names: str, *statements: str) -> str:
    return task(*(statements or ("A% = 1",)), declare=f"COMMON {names} \\ LOCAL A%, X@, T%(3)")


def test_a_task_that_agrees_with_the_rack() -> None:
    assert codes(common("REF%, TABLE%(10), NAME$:20, START@"), commons=RACK) == []


@pytest.mark.parametrize(
    ("names", "code", "words"),
    [
        ("REFF%", "AMX4010", "does not define the common REFF%"),
        ("REF!", "AMX4011", "REF! is DOUBLE INTEGER here, REF% at rack.yaml:14 is INTEGER"),
        ("REF%(3)", "AMX4011", "REF% is an array (3) here, a simple variable at rack.yaml:14"),
        ("TABLE%", "AMX4011", "TABLE% is a simple variable here, an array (10) at rack.yaml:15"),
        ("TABLE%(11)", "AMX4011", "TABLE% is an array (11) here, an array (10) at rack.yaml:15"),
        ("NAME$", "AMX4011", "NAME$ has the length 31 here, 20 at rack.yaml:16"),
    ],
)
def test_disagreement_shows_both_places(names: str, code: str, words: str) -> None:
    found = one(common(names), commons=RACK)
    assert (found.code, found.span.line, found.statement) == (code, 1, 10)
    assert words in found.message
    assert codes(common(names)) == []


def test_unknown_common_suggests_a_near_one() -> None:
    hint = one(common("REFF%"), commons=RACK).hint
    assert hint == "did you mean REF%? If not, add to `common:` of the rack file:  REFF%: {}"


@pytest.mark.parametrize("declared", ["XYZ%", "XYZ!(7,2)", "XYZ$:8(3)", "XYZ$", "XYZ"])
def test_unknown_common_gives_the_line_to_paste(declared) -> None:
    assert one(common(declared), commons=RACK).hint == f"add to `common:` of the rack file:  {declared}: {{}}"


@pytest.mark.parametrize(
    "statement",
    ["START@ = TRUE", "CALL TRANSITION(INPUT=X@, OUTPUT=START@)", "READ START@"],
)
def test_an_input_point_is_not_written(statement: str) -> None:
    found = one(common("START@", statement, "DATA TRUE"), commons=RACK)
    assert found.code == "AMX4017"
    assert "rack.yaml:17" in found.message
    assert codes(common("START@", statement, "DATA TRUE")) == []


def test_a_local_of_an_input_points_name_is_free() -> None:
    assert codes(task("START@ = TRUE", declare="LOCAL START@"), commons=RACK) == []


EVENT = "EVENT NAME=GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=6"


def event_task(event: str = EVENT, declare: str = "COMMON ISCR%", argument: str = ", EVENT=GO") -> str:
    return f"10 {declare}\n20 {event}\n30 CALL SCAN_LOOP(TICKS=4{argument})\n40 END\n"


def test_event_starts_the_scan() -> None:
    found = program(event_task())
    assert found.event == "GO"
    assert [item.name for item in found.events] == ["GO"]
    assert program(event_task(argument="")).event is None


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (event_task(argument=", EVENT=G0"), "AMX4060"),
        (event_task(event="REM"), "AMX4060"),
        (event_task(event="EVENT NAME=GO"), "AMX4061"),
        (event_task(declare="LOCAL ISCR%"), "AMX4062"),
        (event_task(declare="COMMON ISCR%(2)"), "AMX4062"),
        (event_task(declare="COMMON ISCR!"), "AMX4001"),
        (event_task(event=EVENT.replace("6", "0")), "AMX4063"),
        (event_task(event=f"{EVENT} \\ {EVENT}"), "AMX4002"),
    ],
)
def test_wrong_events(text: str, code: str) -> None:
    assert codes(text) == [code]


@pytest.mark.parametrize("target", [Platform.PC3000, Platform.UDC])
def test_events_belong_to_automax_processors(target: Platform) -> None:
    found = [item for item in problems(event_task(), target=target, tick_ns=500_000) if item.code != "AMX4097"]
    assert {item.code for item in found} == {"AMX4027"}
    assert [item.span.line for item in found] == [2, 3]
    assert codes(event_task(event="EVENT NAME=GO", argument=""), target=Platform.PC3000) == []


PREDEFINED_NAMES = ["AUTORUNSTATUS@", "FORCINGSTATUS@", *(f"BATTERYSTATUS{slot}@" for slot in range(5))]


@pytest.mark.parametrize("name", PREDEFINED_NAMES)
def test_a_task_may_read_a_predefined_variable(name: str) -> None:
    assert codes(task(f"X@ = {name}", declare=f"COMMON {name} \\ LOCAL X@")) == []


@pytest.mark.parametrize("name", PREDEFINED_NAMES)
@pytest.mark.parametrize(
    "statement",
    [
        "{} = TRUE",
        "IF X@ THEN {} = TRUE",
        "READ {} \\ DATA TRUE",
        "CALL AND(INPUT1=X@, INPUT2=X@, OUTPUT={})",
        "CALL MOVE(INPUT1=X@, OUTPUT1={})",
    ],
)
def test_no_task_writes_a_predefined_variable(name: str, statement: str) -> None:
    """The rack alone keeps them true to what they show (2.4.6)."""
    found = problems(task(statement.format(name), declare=f"COMMON {name} \\ LOCAL X@"))
    assert "AMX4122" in {item.code for item in found}
    assert {item.span.line for item in found if item.code == "AMX4122"} == {3}


def test_a_local_of_such_a_name_is_the_tasks_own() -> None:
    assert codes(task("FORCINGSTATUS@ = TRUE", declare="LOCAL FORCINGSTATUS@")) == []
