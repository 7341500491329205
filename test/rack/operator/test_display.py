"""What the displays of Processors show after what stops a rack or a drive, and when nothing does."""

from __future__ import annotations

import pytest
from recordings.live_racks import build

from automax_ros.core.problems import PROBLEMS
from automax_ros.rack.operator.faults import MEANINGS, Display, displays_of
from automax_ros.rack.rack import Rack
from automax_ros.runtime.scan.error_log import LogEntry
from automax_ros.scenario.report import report_of

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {SPEED: {priority: 4}}}
  2: {module: 57C435, tick_ms: 5.5, tasks: {WORK: {priority: 4}}}
common:
  GO@: {}
"""
SPEED = "10 COMMON GO@\n20 CALL SCAN_LOOP(TICKS=1)\n40 END\n"
BUS = "10 COMMON GO@\n20 CALL SCAN_LOOP(TICKS=1)\n30 IF GO@ THEN IOWRITE 9, 0, 1\n40 END\n"
WORK = "20 CALL SCAN_LOOP(TICKS=1)\n40 END\n"
QUIET = "no fault"


def made(folder, speed: str = SPEED) -> Rack:
    rack = build(folder, YAML, SPEED=speed, WORK=WORK)
    rack.start()
    rack.run(0.02)
    return rack


def shown(rack: Rack) -> dict[str, str]:
    return {item.module: item.code for item in displays_of(rack)}


def test_every_code_of_the_hardware_has_a_meaning():
    assert {problem.hardware for problem in PROBLEMS.values() if problem.hardware} <= MEANINGS.keys()


def test_a_rack_without_a_fault_shows_nothing(tmp_path):
    rack = made(tmp_path)
    assert displays_of(rack) == [Display("processor_1", "", QUIET), Display("processor_2", "", QUIET)]
    assert report_of(rack)["displays"]["processor_1"] == {"code": None, "meaning": QUIET}
    rack.operations.stop_all("STOP ALL by the operator")
    assert set(shown(rack).values()) == {""}, "a command has no code"


def test_an_overlap_is_shown_where_it_was_until_the_log_is_cleared(tmp_path):
    rack = made(tmp_path)
    rack.task("SPEED").errors.add(LogEntry(30, 7070, 5))
    rack.operations.stop_all("task SPEED: overlap", "14", "SPEED")
    assert shown(rack) == {"processor_1": "14", "processor_2": ""}
    rack.operations.run("WORK")
    assert shown(rack)["processor_1"] == "14", "its log still holds it"
    rack.operations.clear_errors("SPEED")
    assert shown(rack)["processor_1"] == ""


def test_an_endless_scan_is_an_overlap_of_its_processor_alone(tmp_path):
    speed = (
        "10 COMMON GO@\n15 LOCAL I%\n20 CALL SCAN_LOOP(TICKS=1)\n30 FOR I% = 0 TO 1 STEP 1\n"
        "40 IF GO@ THEN I% = 0\n50 NEXT I%\n60 END\n"
    )
    rack = made(tmp_path, speed)
    rack.write("GO@", True)
    rack.run(0.02)
    assert displays_of(rack)[0] == Display("processor_1", "14", MEANINGS["14"])
    assert report_of(rack)["displays"]["processor_1"] == {"code": "14", "meaning": MEANINGS["14"]}
    assert shown(rack)["processor_2"] == ""
    other = build(tmp_path, YAML, SPEED=speed, WORK=WORK)
    other.load(rack.state())
    assert displays_of(other) == displays_of(rack), "it is a part of the rack's state"


@pytest.mark.parametrize("code", ["31", "38"])
def test_what_no_task_of_a_processor_has_caused_all_show(tmp_path, code):
    rack = made(tmp_path)
    rack.operations.stop_all("a module was lost", code)
    assert shown(rack) == {"processor_1": code, "processor_2": code}


def test_a_bus_error_is_shown(tmp_path):
    rack = made(tmp_path, BUS)
    rack.write("GO@", True)
    rack.run(0.02)
    assert shown(rack) == {"processor_1": "31", "processor_2": ""}


def test_a_shorted_scr_stops_nothing_and_is_shown(tmp_path):
    rack = made(tmp_path)
    rack.task("SPEED").errors.add(LogEntry(30, 7116, 5))
    rack.task("SPEED").errors.add(LogEntry(30, 7112, 6))
    assert displays_of(rack)[0] == Display("processor_1", "87", "shorted SCR")


def test_without_power_nothing_is_shown(tmp_path):
    rack = made(tmp_path)
    rack.operations.stop_all("lost", "31")
    rack.operations.power_off()
    assert displays_of(rack)[0] == Display("processor_1", "", "the power is off")
