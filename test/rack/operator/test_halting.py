"""A live rack is halted, stepped and resumed: exact instants and scans, and the same as in simulated time."""

from __future__ import annotations

import pytest
from recordings.live_racks import build
from runtime.time.walls import Wall

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.halting import DONE, STOPPED, TIME_OVER, Halting, Stepped
from automax_ros.rack.rack import Rack
from automax_ros.runtime.time.pacer import Pacer
from rack.helpers import Told

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.0, tasks: {FAST: {priority: 4}, EVENTS: {priority: 6}}}
  2: {module: 57C435, tick_ms: 2.0, tasks: {OTHER: {priority: 4}}}
common:
  COUNT!: {}
  SEEN!: {}
  STUCK@: {}
"""
TASKS = {
    "FAST": "10 COMMON COUNT!\n100 CALL SCAN_LOOP(TICKS=1)\n110 COUNT! = COUNT! + 1\n120 END\n",
    "EVENTS": "10 COMMON SEEN!\n100 CALL SCAN_LOOP(TICKS=300)\n110 SEEN! = SEEN! + 1\n120 END\n",
    "OTHER": "10 COMMON COUNT!, STUCK@\n20 LOCAL HERE!\n100 CALL SCAN_LOOP(TICKS=3)\n"
    "110 HERE! = COUNT!\n120 IF STUCK@ THEN GOTO 120\n130 END\n",
}


@pytest.fixture
def config(tmp_path):
    return build(tmp_path, YAML, **TASKS).config


@pytest.fixture
def wall():
    return Wall()


@pytest.fixture
def rack(config):
    return Rack(config)


@pytest.fixture
def told(rack):
    noted = Told()
    rack.observe(noted)
    return noted


@pytest.fixture
def pacer(rack, wall):
    made = Pacer(rack.scheduler, clock=wall, wait=wall.wait)
    made.begin()
    rack.start()
    return made


@pytest.fixture
def halting(rack, pacer):
    return Halting(rack, pacer)


def test_a_rack_is_halted_goes_on_by_steps_and_resumes(rack, pacer, halting, wall, told) -> None:
    pacer.run(11 * NS_PER_MS)
    halting.halt()
    assert halting.halted
    wall.now_ns += 3 * NS_PER_S
    pacer.step()
    assert (rack.now_ns, rack.value("COUNT!")) == (11 * NS_PER_MS, 3)
    assert halting.step("scan") == Stepped(DONE, 12 * NS_PER_MS, 1)
    assert halting.step("scan", "FAST", 2) == Stepped(DONE, 20 * NS_PER_MS, 3), "OTHER at 18 ms is among them"
    assert rack.value("COUNT!") == 5
    assert halting.step("tick", "OTHER", 3) == Stepped(DONE, 26 * NS_PER_MS, 2)
    assert halting.step("tick") == Stepped(DONE, 31 * NS_PER_MS, 2)
    assert halting.step("until", until_ns=40 * NS_PER_MS) == Stepped(DONE, 40 * NS_PER_MS, 2)
    assert rack.value("COUNT!") == 8, "nothing of the instant itself has happened"
    halting.resume()
    assert not halting.halted
    pacer.run(51 * NS_PER_MS)
    assert rack.value("COUNT!") == 11
    assert [item.skipped for item in rack.statistics.values()] == [0, 0, 0]
    assert [(item.what, item.at_ns, item.detail, item.ok) for item in told.operations] == [
        ("pause", 11 * NS_PER_MS, "", True),
        ("step", 11 * NS_PER_MS, "1 scan", True),
        ("step", 12 * NS_PER_MS, "2 scan FAST", True),
        ("step", 20 * NS_PER_MS, "3 tick OTHER", True),
        ("step", 26 * NS_PER_MS, "1 tick", True),
        ("step", 31 * NS_PER_MS, "until 0.04 s", True),
        ("resume", 40 * NS_PER_MS, "", True),
    ]


def test_a_halted_and_stepped_rack_is_where_a_simulated_one_is(config, rack, pacer, halting, wall) -> None:
    for number in range(1, 30):
        pacer.run(rack.now_ns + number * NS_PER_MS)
        halting.halt()
        wall.now_ns += number * 77_000_001
        halting.step("scan", count=number % 4 + 1)
        halting.step("tick", count=number % 3 + 1)
        halting.resume()
    pacer.run(3 * NS_PER_S)
    simulated = Rack(config)
    simulated.start()
    simulated.scheduler.run_until(3 * NS_PER_S)
    assert rack.state() == simulated.state()
    assert rack.value("SEEN!") == 2


def test_a_step_lasts_a_second_of_rack_time_at_most(rack, pacer, halting) -> None:
    pacer.run(NS_PER_MS)
    halting.halt()
    assert halting.step("scan", "EVENTS") == Stepped(TIME_OVER, NS_PER_S + NS_PER_MS, 200 + 166)
    assert halting.step("scan", "EVENTS").why == DONE
    assert rack.now_ns == 1_500 * NS_PER_MS
    assert halting.step("scan", count=10**9) == Stepped(TIME_OVER, 2_500 * NS_PER_MS, 199 + 166)


def test_a_step_ends_where_the_rack_is_stopped(rack, pacer, halting) -> None:
    pacer.run(NS_PER_MS)
    halting.halt()
    rack.adjust.set("STUCK@", value=True)
    assert halting.step("tick", count=100) == Stepped(STOPPED, 6 * NS_PER_MS, 2)
    assert rack.operations.stopped.task == "OTHER"
    assert halting.step("until", until_ns=8 * NS_PER_MS).why == DONE, "it was stopped before"


@pytest.mark.parametrize(
    ("halted", "call", "reason"),
    [
        (False, lambda halting: halting.resume(), "the rack is not halted"),
        (False, lambda halting: halting.step("scan"), "the rack is not halted: pause it first"),
        (True, lambda halting: halting.halt(), "the rack is halted already"),
        (True, lambda halting: halting.step("line"), "'line' is not a step: it has scan, tick, until"),
        (True, lambda halting: halting.step("scan", "FLAT"), "the rack has no task 'FLAT': did you mean FAST?"),
        (True, lambda halting: halting.step("tick", "NIL"), "the rack has no task 'NIL'"),
        (True, lambda halting: halting.step("tick", count=0), "0 steps cannot be made"),
        (True, lambda halting: halting.step("tick", count=201), "201 ticks are 1.005 s: a step lasts at most 1 s"),
        (True, lambda halting: halting.step("until", until_ns=0), "0 s is not within 1 s after 0 s, which it is now"),
        (True, lambda halting: halting.step("until", until_ns=NS_PER_S + 1), "1 s is not within 1 s after 0 s"),
    ],
)
def test_what_cannot_be_done_is_refused_and_told(rack, halting, told, halted, call, reason) -> None:
    if halted:
        halting.halt()
    before = rack.state()
    with pytest.raises(OperationRefused) as refused:
        call(halting)
    assert reason.replace("'", '"') in str(refused.value).replace("'", '"')
    assert (told.operations[-1].ok, told.operations[-1].reason) == (False, str(refused.value))
    assert halting.halted == halted
    assert rack.state() == before


def test_a_stopped_task_gives_no_scan(rack, halting) -> None:
    halting.halt()
    rack.operations.stop("FAST")
    with pytest.raises(OperationRefused, match="task FAST does not run: put it into RUN first"):
        halting.step("scan", "FAST")
    rack.operations.stop_all("test")
    with pytest.raises(OperationRefused, match="no task runs: put it into RUN first"):
        halting.step("scan")


def test_a_rack_on_anothers_clock_is_not_halted(rack) -> None:
    halting = Halting(rack, object())
    assert not halting.halted
    with pytest.raises(OperationRefused, match="follows another's clock"):
        halting.halt()


def test_operations_on_time_leave_every_task_as_it_was() -> None:
    assert not Operation(0, "pause").concerns("FAST")
    assert not Operation(0, "step", detail="1 scan").concerns("FAST")
    assert Operation(0, "run_all").concerns("FAST")
