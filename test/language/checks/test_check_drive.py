"""DC_DRIVE_CML in a task: the manual's own CALL, each parameter spoiled in each way, and the rules of its task."""

import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Form, Input, Platform
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.types import DataType
from automax_ros.language.tree.tree import Reference
from language.check_support import check_text, codes, one, problems, program

BLOCK = CATALOGUE["DC_DRIVE_CML"]
INPUTS = {item.name: item for item in BLOCK.inputs}
MANUAL = """\
  IO_CNTL_SLOT = 7, DIG_IO_SLOT = 8, AC_LINE_FREQ = 60, REFERENCE = REFERENCE%, REF_RATE = REF_RATE, REF_LAG = REF_LAG,
  KP = KP, PI_W_LEAD = PI_W_LEAD, AG_FACTOR = AG_FACTOR%, CC_THRESH = CC_THRESH%, CML_RUN = CML_RUN@,
  CML_COAST_STOP = CML_COAST_STOP@, MCR_SELECT = MCR_SELECT@, MAX_M_DROPOUT = MAX_M_DROPOUT, CML_TEST = CML_TEST@,
  TEST_BRPOL = TEST_BRPOL@, TEST_ALPHA = TEST_ALPHA%, IOC_THRESH = IOC_THRESH%, LIM_BAR = LIM_BAR%,
  DIGITAL_TACH = DIGITAL_TACH@, SPEED_FDBK = SPEED_FDBK%, TACH_LOSS_STOP = TACH_LOSS_STOP@, OSV_FDBK = OSV_FDBK%,
  OSV_THRESH = OSV_THRESH%, NONSTAND_PHROT = NONSTAND_PHROT@, AUTO_PHROT = AUTO_PHROT@, FAULT_RESET = FAULT_RESET@,
  DC_CML_STATE = DC_CML_STATE@, SYNC_LOCKED = SYNC_LOCKED@, LINE_PERIOD = LINE_PERIOD%, INSWITCH_POSA = INSWITCH_POSA@,
  INSWITCH_POSB = INSWITCH_POSB@, INFALT_RESET = INFAULT_RESET@, DC_TIME = DC_TIME%, BRIDGE_POL = BRIDGE_POL@,
  REF_RATE_OUT = REF_RATE_OUT%, REF_LAG_OUT = REF_LAG_OUT%, FDBK_GAIN = FDBK_GAIN%, I_FDBK = I_FDBK%,
  INTEGRAL_GAIN = INTEGRAL_GAIN%, DELTA = DELTA%, IOC_OUT = IOC_OUT@, SYNC_LOSS_OUT = SYNC_LOSS_OUT@,
  TACH_LOSS_OUT = TACH_LOSS_OUT@, OSV_OUT = OSV_OUT@, EXT_IET_OUT = EXT_IET_OUT@, PHROT_FLT_OUT = PHROT_FIT_OUT@,
  BAD_SCR_OUT = BAD_SCR_OUT@, BAD_SCR_NUM = BAD_SCR_NUM%, DIAG_DATA = DIAG_DATA%"""
"""The CALL that section 52 prints, its slots and its frequency as the literals that they must be, FAULT_RESET as the
boolean that it is, OSV_OUT assigned once. INFALT_RESET is as printed."""
PRINTED = dict(re.findall(r"(\w+) = ([\w%@]+)", MANUAL))
GIVEN = {name.replace("INFALT", "INFAULT"): value for name, value in PRINTED.items()}
MARKS = {DataType.INTEGER: "%", DataType.BOOLEAN: "@", DataType.REAL: ""}
ADVISED = {"SPEED_FDBK": "AMX4182", "OSV_FDBK": "AMX4183", "BAD_SCR_OUT": "AMX4184"}
"""Parameters without which there is a warning: BAD_SCR_NUM is given with them."""


def drive(*more: str, declare: str = "", **changes: str | None) -> str:
    """A task with every parameter; ``changes`` give others, None leaves one out; ``more`` follows the CALL."""
    given = {name: value for name, value in {**GIVEN, **changes}.items() if value is not None}
    names = sorted(set(GIVEN.values()) - {"7", "8", "60", "DIAG_DATA%"})
    head = "".join(f"{line} COMMON {name}\n" for line, name in enumerate(names, 10))
    head += f"90 COMMON DIAG_DATA%(37,1) \\ LOCAL X@, N%, D!, R, S$, T%(9), W%(37,2), F@(3)\n{declare}"
    call = "100 CALL DC_DRIVE_CML(" + ", &\n      ".join(f"{name}={value}" for name, value in given.items()) + ")\n"
    rest = "".join(f"{line}\n" if line[0].isdigit() else f"{number} {line}\n" for number, line in enumerate(more, 110))
    return f"{head}{call}{rest}900 END\n"


# The manual's CALL


def test_the_call_of_the_manual_with_its_misprints_mended_is_a_task():
    found = program(drive(INFAULT_RESET=None, INFALT_RESET="INFAULT_RESET@"))
    assert found.cml is not None
    assert found.cml.line == 100
    assert {name: found.cml.arguments[name] for name in ("INFAULT_RESET", "DIAG_DATA")} == {
        "INFAULT_RESET": Reference("INFAULT_RESET@"),
        "DIAG_DATA": Reference("DIAG_DATA%"),
    }
    assert sorted(found.cml.arguments) == sorted(item.name for item in BLOCK.parameters)
    assert len(found.cml.arguments) == 50
    assert found.cml.defaults == {}


def test_its_scans_are_six_in_a_cycle_of_the_line():
    found = {hz: program(drive(AC_LINE_FREQ=str(hz))) for hz in (48, 50, 60, 62)}
    assert {hz: (item.line_hz, item.period_ns) for hz, item in found.items()} == {
        48: (48, 3_472_222), 50: (50, 3_333_333), 60: (60, 2_777_777), 62: (62, 2_688_172)
    }  # fmt: skip
    assert program(drive(AC_LINE_FREQ=None)).line_hz == 60
    assert found[60].ticks == 0
    assert found[60].event is None


def test_the_printed_misprint_is_told():
    found = one(drive(INFAULT_RESET=None, INFALT_RESET="INFAULT_RESET@"))
    assert found.code == "AMX4186"
    assert found.hint == "write INFAULT_RESET"


def test_both_spellings_are_one_parameter_given_twice():
    found = problems(drive(INFALT_RESET="X@"))
    assert [item.code for item in found] == ["AMX4073"]
    assert "INFAULT_RESET is given twice" in found[0].message


def test_defaults_are_those_of_table_1():
    needed = {name: value for name, value in GIVEN.items() if name in INPUTS and INPUTS[name].required}
    found = program(drive(**dict.fromkeys(set(GIVEN) - set(needed))))
    assert found.cml.defaults == {
        "AC_LINE_FREQ": 60, "REF_RATE": 0.0, "REF_LAG": 200.0, "AG_FACTOR": 1, "CC_THRESH": 0, "CML_COAST_STOP": False,
        "MCR_SELECT": False, "MAX_M_DROPOUT": 0.1, "CML_TEST": False, "TEST_BRPOL": False, "TEST_ALPHA": 180,
        "DIGITAL_TACH": True, "TACH_LOSS_STOP": True, "OSV_THRESH": 0, "NONSTAND_PHROT": False, "AUTO_PHROT": False,
    }  # fmt: skip
    assert set(needed) == {
        "IO_CNTL_SLOT", "DIG_IO_SLOT", "REFERENCE", "KP", "PI_W_LEAD", "CML_RUN", "IOC_THRESH", "LIM_BAR", "FAULT_RESET"
    }  # fmt: skip


# Each parameter spoiled in each way: one clear finding


@pytest.mark.parametrize("name", GIVEN)
def test_a_missing_parameter(name):
    found = [(item.code, item.message) for item in problems(drive(**{name: None}))]
    if name in INPUTS and INPUTS[name].required:
        assert found == [("AMX4074", f"DC_DRIVE_CML needs {name}")]
    else:
        assert [code for code, _ in found] == ([ADVISED[name]] if name in ADVISED else [])


@pytest.mark.parametrize("name", GIVEN)
def test_a_variable_of_another_type(name):
    wrong = {"%": "R", "@": "N%", "": "N%"}[MARKS[BLOCK.parameter(name).type]]
    found = one(drive(**{name: wrong}))
    literal_only = getattr(BLOCK.parameter(name), "form", None) is Form.LITERAL
    assert found.code == ("AMX4076" if literal_only else "AMX2015")
    assert name in found.message
    declared = {DataType.INTEGER: "NOWHERE%", DataType.BOOLEAN: "NOWHERE@", DataType.REAL: "NOWHERE"}
    assert one(drive(**{name: declared[BLOCK.parameter(name).type]})).code == ("AMX4076" if literal_only else "AMX4001")


@pytest.mark.parametrize("name", GIVEN)
def test_a_constant_where_none_may_stand(name):
    item = BLOCK.parameter(name)
    literal = {DataType.INTEGER: "100", DataType.BOOLEAN: "TRUE", DataType.REAL: "0.5"}[item.type]
    found = codes(drive(**{name: literal}))
    if not isinstance(item, Input):
        assert found == ["AMX4075" if item.dimensions else "AMX4078"]
    elif name in VARIABLES:
        assert found == ["AMX4075"]
    else:
        assert set(found) <= {"AMX4080"}


VARIABLES = {"REFERENCE", "CML_RUN", "CML_COAST_STOP", "SPEED_FDBK", "OSV_FDBK", "FAULT_RESET"}
"""Inputs that take symbols only, by the text of 52.1 (table 1 allows a literal for OSV_FDBK)."""
LITERALS = {"IO_CNTL_SLOT", "DIG_IO_SLOT", "AC_LINE_FREQ"}


def test_forms_are_those_of_the_manual():
    assert {name for name, item in INPUTS.items() if item.form is Form.VARIABLE} == VARIABLES
    assert {name for name, item in INPUTS.items() if item.form is Form.LITERAL} == LITERALS


@pytest.mark.parametrize("name", sorted(LITERALS))
def test_a_variable_where_a_literal_must_stand(name):
    assert one(drive(**{name: "N%"})).code == "AMX4076"


@pytest.mark.parametrize("name", GIVEN)
def test_an_expression(name):
    assert one(drive(**{name: "N% + 1"})).code == "AMX4077"


@pytest.mark.parametrize("name", [name for name in GIVEN if BLOCK.parameter(name).type is DataType.BOOLEAN])
def test_an_inverted_boolean(name):
    assert codes(drive(**{name: "-X@"})) == ([] if name in INPUTS else ["AMX4079"])


@pytest.mark.parametrize("name", GIVEN)
def test_a_parameter_given_twice(name):
    text = drive().replace(f"{name}={GIVEN[name]}", f"{name}={GIVEN[name]}, {name}={GIVEN[name]}", 1)
    assert one(text).code == "AMX4073"


@pytest.mark.parametrize("name", GIVEN)
def test_a_misspelt_parameter(name):
    found = one(drive(**{name: None, f"{name}X": GIVEN[name]}))
    assert (found.code, found.hint) == ("AMX4072", f"did you mean {name}?")


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("IO_CNTL_SLOT", ("0", "15"), ("-1", "16")),
        ("DIG_IO_SLOT", ("0", "15"), ("-1", "16")),
        ("AC_LINE_FREQ", ("48", "62"), ("47", "63")),
        ("REF_RATE", ("0.0", ".00035", "11.37"), (".00034", "11.38", "-1.0")),
        ("REF_LAG", ("1.0", "500.0"), ("0.9", "500.1")),
        ("KP", ("0.0", "4.0"), ("-.001", "4.001")),
        ("PI_W_LEAD", ("10.0", "500.0"), ("9.99", "500.1")),
        ("AG_FACTOR", ("1", "300"), ("0", "301")),
        ("CC_THRESH", ("0", "32767"), ("-1",)),
        ("MAX_M_DROPOUT", ("0.1", "1.0"), (".099", "1.001")),
        ("TEST_ALPHA", ("0", "180"), ("-1", "181")),
        ("IOC_THRESH", ("100", "400"), ("99", "401")),
        ("LIM_BAR", ("100", "400"), ("99", "401")),
        ("OSV_THRESH", ("0", "32767"), ("-1",)),
    ],
)
def test_literals_have_the_ranges_of_table_1(name, good, bad):
    for literal in good:
        assert codes(drive(**{name: literal})) == [], literal
    for literal in bad:
        found = one(drive(**{name: literal}))
        assert found.code == "AMX4080"
        assert f"{name} = {float(literal):g} is out of range" in found.message


@pytest.mark.parametrize(
    ("hz", "name", "good", "bad", "words"),
    [
        (50, "REF_RATE", (".00042", "13.65"), (".00041", "13.66"), "0 or 0.00042 to 13.65 at 50 Hz"),
        (60, "REF_RATE", (".00035", "11.37"), (".00034", "11.38"), "0 or 0.00035 to 11.37 at 60 Hz"),
        (50, "REF_LAG", ("1.0", "400.0"), ("400.5",), "1 to 400 at 50 Hz"),
        (54, "REF_LAG", ("400.0",), ("400.5",), "1 to 400 at 54 Hz"),
        (55, "REF_LAG", ("500.0",), ("500.5",), "1 to 500 at 55 Hz"),
        (60, "REF_LAG", ("500.0",), ("500.5",), "1 to 500 at 60 Hz"),
    ],
)
def test_limits_that_follow_the_line(hz, name, good, bad, words):
    for literal in good:
        assert codes(drive(**{"AC_LINE_FREQ": str(hz), name: literal})) == []
    for literal in bad:
        assert words in one(drive(**{"AC_LINE_FREQ": str(hz), name: literal})).message


def test_a_bad_frequency_alone_is_told():
    assert codes(drive(AC_LINE_FREQ="70", REF_LAG="450.0", REF_RATE="12.0")) == ["AMX4080"]


@pytest.mark.parametrize(
    ("ioc", "bar", "good"),
    [
        (179, 100, True),
        (180, 100, False),
        (181, 101, True),
        (182, 101, False),
        (269, 150, True),
        (270, 150, False),
        (400, 223, True),
        (400, 222, False),
    ],
)
def test_the_overcurrent_level_is_less_than_1_8_times_the_largest_current(ioc, bar, good):
    assert codes(drive(IOC_THRESH=str(ioc), LIM_BAR=str(bar))) == ([] if good else ["AMX4185"])
    assert codes(drive(IOC_THRESH=str(ioc))) == codes(drive(LIM_BAR=str(bar))) == []


def test_a_real_literal_without_its_point():
    for name in (name for name, item in INPUTS.items() if item.type is DataType.REAL):
        assert one(drive(**{name: "1"})).code == "AMX2016"


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ("DIAG_DATA%(0,0)", "AMX4092"),
        ("T%", "AMX4092"),
        ("W%", "AMX4092"),
        ("N%", "AMX4092"),
        ("-DIAG_DATA%", "AMX4077"),
        ("F@", "AMX2015"),
        ("NOWHERE%", "AMX4001"),
    ],
)
def test_diagnostic_data_is_a_whole_array_of_38_by_2(given, code):
    assert one(drive(DIAG_DATA=given)).code == code


def test_diagnostic_data_may_be_local():
    assert codes(drive(DIAG_DATA="L%", declare="95 LOCAL L%(37,1)\n")) == []
    found = one(drive(DIAG_DATA="T%"))
    assert found.hint == "declare it as LOCAL T%(37,1)"


def test_elements_may_be_inputs_and_outputs():
    assert codes(drive(REFERENCE="T%(3)", I_FDBK="T%(4)", IOC_OUT="F@(1)")) == []


# The task


def test_it_takes_the_place_of_scan_loop():
    found = one(drive("CALL SCAN_LOOP(TICKS=4)"))
    assert (found.code, found.message) == ("AMX4180", "a task with DC_DRIVE_CML has no SCAN_LOOP")
    assert one(drive(declare="95 CALL SCAN_LOOP(TICKS=4)\n")).message == "a task with SCAN_LOOP has no DC_DRIVE_CML"


def test_it_is_called_once():
    call = drive().partition("100 ")[2].partition("\n900")[0]
    assert one(drive(call)).code == "AMX4041"


def test_it_is_the_first_block():
    found = one(drive(declare="95 CALL TRANSITION(INPUT=X@, OUTPUT=X@)\n"))
    assert found.code == "AMX4042"
    assert "called before DC_DRIVE_CML" in found.message


def test_it_stands_at_the_top():
    text = drive("END_IF", declare="99 IF X@ THEN\n")
    assert one(text).message == "DC_DRIVE_CML stands inside an IF or FOR block"


@pytest.mark.parametrize(
    ("more", "declare", "code"),
    [
        (("110 LOCAL Z%",), "", "AMX4003"),
        (("110 EVENT NAME=GO",), "", "AMX4064"),
        ((), "95 IF X@ THEN END\n", "AMX4046"),
        (("110 IF X@ THEN 100",), "", "AMX4048"),
        (("110 IF X@ THEN 95",), "95 N% = 1\n", "AMX4048"),
        (("110 N% = 2",), "95 IF X@ THEN 110\n", "AMX4049"),
    ],
)
def test_the_order_of_the_task_is_that_around_scan_loop(more, declare, code):
    found = one(drive(*more, declare=declare))
    assert found.code == code
    assert "SCAN_LOOP" not in f"{found.message} {found.hint}"
    assert "DC_DRIVE_CML" in f"{found.message} {found.hint}" or code == "AMX4046"


def test_jumps_and_subroutines_in_its_scan():
    text = drive("110 IF X@ THEN 130", "120 GOSUB 200", "130 N% = 1", "140 GOTO 900", "200 N% = 2", "210 RETURN")
    assert codes(text) == []


DYNAMIC = [name for name, block in CATALOGUE.items() if block.coefficients and Platform.AUTOMAX in block.runs_on]


@pytest.mark.parametrize("name", DYNAMIC)
def test_no_dynamic_block_stands_with_it(name):
    found = [item for item in problems(drive(f"CALL {name}(INPUT=N%, OUTPUT=N%)")) if item.code == "AMX4187"]
    assert [item.message for item in found] == [f"a task with DC_DRIVE_CML has no {name}"]


def test_blocks_that_are_not_dynamic_may_follow_it():
    more = ("CALL DIFFERENCE(INPUT1=N%, INPUT2=5, OUTPUT=N%)", "CALL RAMP(INPUT=N%, ACCEL_RATE=9, OUTPUT=N%)")
    assert [code for code in codes(drive(*more)) if not code.startswith("AMX407")] == []
    assert codes(drive(more[0], "CALL LATCH(SET=X@, RESET=X@, OUTPUT=X@)")) == []


@pytest.mark.parametrize("target", [Platform.PC3000, Platform.UDC])
def test_it_runs_on_an_automax_processor_alone(target):
    udc = target is Platform.UDC
    found = codes(drive(), target=target, tick_ns=500_000 if udc else 5_500_000)
    assert sorted(found) == (["AMX4071", "AMX4097"] if udc else ["AMX4071"])


@pytest.mark.parametrize("tick_ns", [500_000, 5_000_000, 6_000_000, 10_000_000])
def test_its_processor_has_the_default_tick(tick_ns):
    found = one(drive(), tick_ns=tick_ns)
    assert found.code == "AMX4181"
    assert found.message == "DC_DRIVE_CML needs a Processor with the tick of 5.5 ms"


def test_no_basic_task_calls_it():
    assert "AMX4111" in {item.code for item in _basic(drive())}


def _basic(text: str):
    from automax_ros.core.diagnostics import SourceText
    from automax_ros.language.checks.checker import check

    return check(SourceText("task.bas", text), name="TASK", catalogue=CATALOGUE).diagnostics


# Whatever is written

VALUES = [
    *("7", "8", "60", "-1", "40000", "1.5", "-0.5", "1E30", "TRUE", "'A'", "N%", "-N%", "X@", "-X@", "R", "D!", "S$"),
    *(
        "T%",
        "T%(2)",
        "T%(99)",
        "W%",
        "DIAG_DATA%",
        "DIAG_DATA%(1,1)",
        "F@(2)",
        "N% + 1",
        "X@ AND X@",
        "NOWHERE%",
        "ABS(N%)",
    ),
]


@settings(max_examples=150, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
@given(
    st.dictionaries(st.sampled_from([*GIVEN, "INFALT_RESET"]), st.sampled_from(VALUES) | st.none(), max_size=12),
    st.sampled_from([*Platform]),
    st.lists(
        st.sampled_from(["CALL SCAN_LOOP(TICKS=4)", "GOTO 100", "IF X@ THEN END", "CALL LAG(INPUT=N%)"]), max_size=2
    ),
)
def test_whatever_is_given_there_is_a_program_or_a_reason(changes, target, more):
    result = check_text(drive(*more, **changes), target=target)
    errors = [item for item in result.diagnostics if PROBLEMS[item.code].severity.value == "error"]
    assert (result.program is None) == bool(errors)
    if result.program is not None:
        assert result.program.cml is not None
        assert result.program.cml.arguments.keys() <= {item.name for item in BLOCK.parameters}
