"""What an operator asks in words: carried out, or refused with a reason that observers are told too."""

from __future__ import annotations

from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.reloads import ReloadRefused
from automax_ros.rack.operator.requests import MAX_NAME, MAX_NAMES, MAX_VALUE, OperatorRequests
from automax_ros.rack.rack import Rack
from rack.helpers import Told

YAML = """\
rack: LINE1
operator: true
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {SPEED: {priority: 4}}}
common:
  REF%: {preset: 100}
  OUT%: {}
  GAIN: {preset: 0.1}
  RUN@: {}
  NOTE$:8: {}
  TABLE%(1,2): {}
"""
SPEED = """\
10 COMMON REF%, OUT%
20 LOCAL TRIM% [CURRENT=1, HIGH=10, LOW=0], KP [CURRENT=0.5, HIGH=2.0, LOW=0.0, STEP=0.1]
100 CALL SCAN_LOOP(TICKS=1)
110 CALL SUMMER(INPUT1=REF%, INPUT2=TRIM%, OUTPUT=OUT%)
120 END
"""


@pytest.fixture
def rack(tmp_path: Path) -> Rack:
    made = build(tmp_path, YAML, SPEED=SPEED)
    made.start()
    made.run(0.02)
    return made


@pytest.fixture
def told(rack: Rack) -> Told:
    observer = Told()
    rack.observe(observer)
    return observer


def test_values_are_read_from_texts_as_everywhere(rack, told):
    orders = OperatorRequests(rack)
    for name, text, value in [
        ("ref%", " 255 ", 255),
        ("GAIN", "0.1", 0.10000000149011612),
        ("RUN@", "on", True),
        ("NOTE$", " two ", " two "),
        ("TABLE%(1,2)", "-7", -7),
    ]:
        orders.set(name, text)
        held, shown = orders.get([name])[0]
        element = 5 if "(" in name else 0
        assert rack.value(name.partition("(")[0].upper(), element) == value
        assert held == name.upper()
        assert shown in {"255", "0.1", "TRUE", '" two "', "-7"}
    orders.tune("speed.trim%", "4")
    orders.tune("SPEED.KP", "1.5")
    assert orders.get(["SPEED.TRIM%", "SPEED.KP"]) == [("SPEED.TRIM%", "4"), ("SPEED.KP", "1.5")]
    orders.force("OUT%", "-5")
    assert orders.forces() == [("OUT%", "-5")]
    orders.unforce([])
    assert orders.forces() == []
    assert [(item.what, item.ok) for item in told.operations] == [
        *[("set", True)] * 5,
        ("tune", True),
        ("tune", True),
        ("force", True),
        ("unforce", True),
    ]


@pytest.mark.parametrize(
    ("what", "arguments", "reason"),
    [
        ("set", ("REF%", "70000"), "a whole number from -32768 to 32767"),
        ("set", ("REF%", ""), "is not a value for REF%"),
        ("force", ("REF%", "x" * (MAX_VALUE + 1)), "at most 1000"),
        ("force", ("R" * (MAX_NAME + 1), "1"), "at most 100"),
        ("unforce", (["REF%"],), "not forced"),
        ("unforce", (["REF%"] * (MAX_NAMES + 1),), "at most 1000"),
        ("tune", ("SPEED.TRIM%", "fast"), "is not a value"),
        ("tune", (" ", "1"), "the name is empty"),
        ("set", ("", "1"), "the name is empty"),
        ("force", ("", "1"), "the name is empty"),
        ("run", ("SPEED",), "runs already"),
        ("run", ("NIL",), "no task"),
        ("stop", ("N" * 5000,), "at most 100"),
        ("reload", ("SPEED", "!" * 1_000_001), "at most 1000000"),
    ],
)
def test_what_means_nothing_is_refused_and_told(rack, told, what, arguments, reason):
    before = rack.state().image
    with pytest.raises(OperationRefused) as refused:
        getattr(OperatorRequests(rack), what)(*arguments)
    assert reason in str(refused.value)
    assert [(item.what, item.ok, item.reason) for item in told.operations] == [(what, False, str(refused.value))]
    assert rack.state().image == before


def test_questions_are_no_operations(rack, told):
    orders = OperatorRequests(rack)
    for names in (["NONE%"], ["SPEED.NIL%"], ["NIL.X%"], ["X" * 101]):
        with pytest.raises(OperationRefused):
            orders.get(names)
    with pytest.raises(OperationRefused, match="it has SPEED"):
        orders.tasks_named("NIL")
    assert orders.tasks_named("") == orders.tasks_named("speed") == ["SPEED"]
    assert told.operations == []


def test_a_source_with_errors_is_refused_with_what_is_wrong_and_a_good_one_runs(rack, told):
    orders = OperatorRequests(rack)
    with pytest.raises(ReloadRefused) as refused:
        orders.reload("SPEED", SPEED.replace("OUTPUT=OUT%", "OUTPUT=NIL%"))
    assert any("NIL%" in item and "110" in item for item in refused.value.findings)
    assert all(item.startswith("SPEED.BLK:4:") for item in refused.value.findings)
    orders.tune("SPEED.TRIM%", "7")
    orders.reload("speed", SPEED.replace("INPUT1=REF%", "INPUT1=1000"), keep_state=True)
    rack.run(0.02)
    assert rack.value("OUT%") == 7 + 1000
    assert [(item.what, item.ok, item.detail) for item in told.operations] == [
        ("reload", False, ""),
        ("tune", True, "SPEED.TRIM% = 7"),
        ("reload", True, "keep_state"),
    ]


def test_stop_all_and_run_all(rack, told):
    orders = OperatorRequests(rack)
    orders.stop_all()
    assert rack.stop_reason == "STOP ALL by the operator"
    orders.run_all()
    assert rack.stop_reason is None
    orders.stop("speed")
    orders.clear_errors()
    orders.run("speed")
    assert [item.what for item in told.operations] == ["stop_all", "run_all", "stop", "clear_errors", "run"]


def test_a_source_that_was_prepared_before_another_reload_is_known_to_be_old(rack, told):
    orders = OperatorRequests(rack)
    named = orders.reloads.admit("SPEED", SPEED.replace("TRIM%, OUTPUT", "7, OUTPUT"))
    first = orders.reloads.prepare(*named)
    assert orders.reloads.is_current(first)
    assert (rack.run(0.02), rack.value("OUT%")) == (None, 101)
    orders.reload("SPEED", SPEED)
    assert not orders.reloads.is_current(first)
    again = orders.reloads.prepare(*named)
    assert orders.reloads.is_current(again)
    orders.reloads.install(again)
    rack.run(0.02)
    assert rack.value("OUT%") == 107
    assert [(item.what, item.ok) for item in told.operations] == [("reload", True), ("reload", True)]


def test_power_is_switched_in_words(rack, told):
    orders = OperatorRequests(rack)
    orders.power("off")
    assert not rack.operations.powered
    orders.power(" ON ", without_battery=True)
    assert (rack.operations.powered, rack.operations.battery_good) == (True, False)
    before = rack.now_ns
    orders.power("cycle", 0.25)
    rack.run(0.2)
    assert not rack.operations.powered
    rack.run(0.1)
    assert (rack.operations.powered, rack.operations.battery_good) == (True, True)
    assert [(item.what, item.at_ns - before) for item in told.operations] == [
        ("power_off", 0),
        ("power_on", 0),
        ("power_off", 0),
        ("power_on", 250_000_000),
    ]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("up",), '"up" is not off, on or cycle'),
        (("cycle", -1.0), "the power cannot be off for -1 s: it takes 0 to 86400"),
        (("cycle", float("nan")), "the power cannot be off for nan s"),
        (("cycle", float("inf")), "the power cannot be off for inf s"),
        (("on",), "the power is on"),
        (("x" * (MAX_NAME + 1),), "a text of 101 characters"),
    ],
)
def test_power_that_cannot_be_is_refused_and_told(rack, told, arguments, reason):
    with pytest.raises(OperationRefused) as refused:
        OperatorRequests(rack).power(*arguments)
    assert reason in str(refused.value).replace("'", '"')
    assert not told.operations[-1].ok
    assert rack.operations.powered


def test_a_task_is_deleted_and_comes_back_with_its_source(rack, told):
    orders = OperatorRequests(rack)
    with pytest.raises(OperationRefused, match="runs: stop it first"):
        orders.delete("speed")
    orders.stop("SPEED")
    orders.delete(" speed ")
    with pytest.raises(OperationRefused, match="was deleted: reload it first"):
        orders.run("SPEED")
    orders.reload("SPEED", SPEED)
    orders.run("SPEED")
    assert [(item.what, item.ok) for item in told.operations] == [
        ("delete", False),
        ("stop", True),
        ("delete", True),
        ("run", False),
        ("reload", True),
        ("run", True),
    ]
