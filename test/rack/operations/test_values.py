"""An operator forces, sets and tunes: what is taken, what is refused and why, and that each is told."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.requests import OperatorRequests
from rack.helpers import Told, rack_from

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {LINE: {priority: 5}, PLAIN: {priority: 6}}}
  6: {module: 57C403}
common:
  REF%: {preset: 7}
  TOTAL!:
  GAIN:
  ON@:
  TEXT$:8:
  TABLE%(3):
  LAMP@: {slot: 6, register: 0, bit: 1}
  LAMPS%: {slot: 6, register: 0}
  FORCINGSTATUS@:
  BATTERYSTATUS0@:
"""
LINE = """\
10 COMMON REF%, GAIN
20 LOCAL N%, K [CURRENT=1.5, LOW=0.0, HIGH=2.0, STEP=0.1], COUNT% [CURRENT=4, LOW=0, HIGH=10, STEP=3]
100 CALL SCAN_LOOP(TICKS=1)
110 REF% = REF% + 1
120 N% = N% + COUNT%
130 END
"""
PLAIN = "10 LOCAL N%\n20 CALL SCAN_LOOP(TICKS=1)\n30 N% = N% + 1\n40 END\n"


INPUTS = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {PLAIN: {priority: 6}}}
  5: {module: 57C419}
  6: {module: 57C403}
  10: {module: 57552}
common:
  DOOR@: {slot: 5, register: 0, bit: 3}
  FEEDBACK%: {slot: 10, register: 207}
  LAMP@: {slot: 6, register: 0, bit: 1}
  REF%:
"""


@pytest.fixture
def made(tmp_path):
    rack, told = rack_from(tmp_path, YAML, LINE=LINE, PLAIN=PLAIN), Told()
    rack.observe(told)
    rack.start()
    return rack, told.operations


def test_a_force_holds_until_it_is_released(made):
    rack, told = made
    rack.adjust.force("ref%", 100)
    rack.run(0.05)
    assert (rack.value("REF%"), rack.value("FORCINGSTATUS@")) == (100, True)
    rack.adjust.force("REF%", 200)
    assert [(item.name, item.value) for item in rack.forces()] == [("REF%", 200)]
    rack.adjust.unforce(["REF%"])
    assert (rack.value("REF%"), rack.value("FORCINGSTATUS@"), rack.forces()) == (200, False, [])
    rack.run(0.011)
    assert rack.value("REF%") == 202
    assert [(item.what, item.detail, item.ok) for item in told] == [
        ("force", "REF% = 100", True),
        ("force", "REF% = 200", True),
        ("unforce", "REF%", True),
    ]


def test_everything_is_released_at_once(made):
    rack, told = made
    for name, value in (("REF%", 1), ("ON@", True), ("TOTAL!", -70000), ("GAIN", 0.5)):
        rack.adjust.force(name, value)
    assert [item.name for item in rack.forces()] == ["REF%", "TOTAL!", "GAIN", "ON@"]
    rack.adjust.unforce()
    assert rack.forces() == []
    assert told[-1].detail == "REF% TOTAL! GAIN ON@"


def directly(rack, verb, *arguments):
    getattr(rack.adjust, verb)(*arguments)


def in_words(rack, verb, *arguments):
    getattr(OperatorRequests(rack), verb)(*map(str, arguments))


@pytest.mark.parametrize("by", [directly, in_words])
@pytest.mark.parametrize(
    ("verb", "name", "value", "why"),
    [
        ("force", "REF", 1, "did you mean REF%"),
        ("force", "TEXT$", "A", "it is a string"),
        ("force", "TABLE%(1)", 1, "TABLE%(1) cannot be forced: it is an element of an array"),
        ("force", "TABLE%", 1, "TABLE% is an array"),
        ("set", "TABLE%", 1, "TABLE%"),
        ("force", "LAMP@", True, "LAMPS% is part of the same register"),
        ("force", "LAMPS%", 1, "LAMP@ is part of the same register"),
        ("force", "BATTERYSTATUS0@", False, "the rack itself writes it"),
        ("force", "REF%", 40000, "40000 is not a value for REF%"),
        ("force", "LINE.N%", 40000, "40000 is not a value for LINE.N%"),
        ("force", "LINE.J%", 1, "task LINE has no variable of its own 'J%'"),
        ("force", "LIN.N%", 1, "the rack has no task 'LIN': it has LINE, PLAIN"),
        ("force", "line.K", 1.0, "LINE.K cannot be forced: it is a tunable"),
        ("set", "LINE.N%", 1, "'LINE.N%' is a variable of task LINE: only common variables can be set"),
        ("set", "NONE%", 1, "the rack has no common variable 'NONE%'"),
        ("set", "FORCINGSTATUS@", True, "the rack itself writes it"),
        ("set", "REF%", "x", "'x' is not a value for REF%"),
        ("set", "TABLE%(4)", 1, "the largest is 3"),
        ("tune", "K", 1.0, "'K' is not TASK.TUNABLE"),
        ("tune", "LINE.J", 1.0, "task LINE has no tunable 'J'"),
        ("tune", "PLAIN.N%", 1, "task PLAIN has no tunable 'N%': it has none"),
        ("tune", "LIN.K", 1.0, "the rack has no task 'LIN': did you mean LINE?"),
        ("tune", "LINE.K", 2.01, "K = 2.01 lies outside 0 to 2"),
        ("tune", "LINE.COUNT%", 1.5, "a whole number"),
    ],
)
def test_what_cannot_be_is_refused_and_told(made, by, verb, name, value, why):
    rack, told = made
    before = rack.state()
    with pytest.raises(OperationRefused) as refused:
        by(rack, verb, name, value)
    assert why.replace("'", "") in str(refused.value).replace("'", "")
    assert [(item.what, item.ok, item.reason) for item in told] == [(verb, False, str(refused.value))]
    assert rack.state() == before


def test_a_forced_variable_cannot_be_set(made):
    rack, _ = made
    rack.adjust.set("REF%", 50)
    assert rack.value("REF%") == 50
    rack.adjust.force("REF%", 60)
    with pytest.raises(OperationRefused, match="REF% cannot be set: it is forced at 60"):
        rack.adjust.set("REF%", 70)
    rack.adjust.set("TABLE%(2)", 9)
    assert (rack.value("REF%"), rack.value("TABLE%", 2)) == (60, 9)


def test_a_sample_is_written_like_a_set_but_nobody_is_told_of_an_operation(made):
    rack, told = made
    writes = rack.memory.sequence
    rack.adjust.write("table%(2)", 5)
    assert (rack.value("TABLE%", 2), rack.memory.sequence) == (5, writes + 1)
    rack.adjust.force("REF%", 60)
    for name, value in (("REF%", 1), ("FORCINGSTATUS@", True), ("NONE%", 1), ("TABLE%(1)", 40000)):
        with pytest.raises(OperationRefused):
            rack.adjust.write(name, value)
    assert [(item.what, item.ok) for item in told] == [("force", True)]


def test_what_is_not_forced_cannot_be_released_and_nothing_else_is(made):
    rack, _ = made
    rack.adjust.force("REF%", 60)
    with pytest.raises(OperationRefused, match="TOTAL! is not forced"):
        rack.adjust.unforce(["REF%", "TOTAL!"])
    assert [item.name for item in rack.forces()] == ["REF%"]


def test_without_power_nothing_is_adjusted(made):
    rack, _ = made
    rack.adjust.force("REF%", 60)
    rack.operations.power_off()
    for call in (
        lambda: rack.adjust.force("GAIN", 1.0),
        rack.adjust.unforce,
        lambda: rack.adjust.set("GAIN", 1.0),
        lambda: rack.adjust.tune("LINE.K", 1.0),
        lambda: rack.adjust.tune_step("LINE.K", 1),
        lambda: rack.operations.stop("LINE"),
        lambda: rack.operations.stop_all("operator"),
        rack.operations.clear_errors,
    ):
        with pytest.raises(OperationRefused, match="the power is off"):
            call()
    assert [item.name for item in rack.forces()] == ["REF%"], "a force outlives the power"


def test_the_process_moves_inputs_without_the_racks_power(tmp_path):
    rack = rack_from(tmp_path, INPUTS, PLAIN=PLAIN)
    rack.start()
    rack.operations.power_off()
    rack.adjust.set("DOOR@", True)
    rack.adjust.set("FEEDBACK%", 12)
    for name in ("LAMP@", "REF%"):
        with pytest.raises(OperationRefused, match="the power is off"):
            rack.adjust.set(name, 1)
    with pytest.raises(OperationRefused, match="the power is off"):
        rack.adjust.force("DOOR@", False)
    rack.operations.power_on()
    shown = [rack.value(name) for name in ("DOOR@", "FEEDBACK%", "LAMP@", "REF%")]
    assert shown == [True, 12, False, 0]


def test_tuning_takes_any_value_within_the_limits(made):
    rack, told = made
    rack.adjust.tune("line.k", 0.123)
    assert rack.task("LINE").value("K") == pytest.approx(0.123, rel=1e-7)
    rack.adjust.tune("LINE.COUNT%", 10)
    assert rack.task("LINE").value("COUNT%") == 10
    assert [(item.what, item.task, item.detail) for item in told] == [
        ("tune", "LINE", "LINE.K = 0.123"),
        ("tune", "LINE", "LINE.COUNT% = 10"),
    ]
    with pytest.raises(OperationRefused, match=r"COUNT% = 1\.5 is not a whole number"):
        rack.adjust.tune("LINE.COUNT%", 1.5)


def test_steps_move_by_step_and_end_at_the_limits(made):
    rack, _ = made
    task = rack.task("LINE")
    seen = []
    for steps in (1, 1, 1, -2, -9, 3):
        rack.adjust.tune_step("LINE.COUNT%", steps)
        seen.append(task.value("COUNT%"))
    assert seen == [7, 10, 10, 4, 0, 9]
    for _ in range(3):
        rack.adjust.tune_step("LINE.K", 1)
    assert task.value("K") == pytest.approx(1.8, rel=1e-7)
    rack.adjust.tune_step("LINE.K", 1000)
    assert task.value("K") == 2.0
    rack.adjust.tune_step("LINE.K", -1)
    assert f"{task.value('K'):.7g}" == "1.9"


@given(st.lists(st.integers(-30, 30), max_size=20))
@settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_steps_add_up_as_decimals(made, moves):
    rack, _ = made
    task = rack.task("LINE")
    rack.adjust.tune("LINE.K", 1.0)
    tenths = 10
    for steps in moves:
        tenths = min(max(tenths + steps, 0), 20)
        rack.adjust.tune_step("LINE.K", steps)
        assert f"{task.value('K'):.7g}" == f"{tenths / 10:g}"
