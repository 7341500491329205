"""What plants feed into commons is in recordings as the plants' writes; tasks that read it replay without a plant."""

from __future__ import annotations

import pytest

from automax_ros.core.kinds import WriterKind
from automax_ros.messages.types.messages import CommonWrite
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.read.reader import BagReader
from replay.replays import edited, recorded, replayed

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {SPEED: {priority: 4}, WORK: {priority: 8}}}
plants:
  SPEED:
    motor: dc_10hp_240v
    load: {friction_nm: 1}
    feeds:
      RPM: {signal: speed_rpm, every_ms: 0.7}
      TACH%: {signal: tach_rpm, scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}}
common:
  RPM: {}
  TACH%: {}
  SUM!: {}
  HALF: {}
"""
SPEED = """\
10 COMMON TACH%, SUM!
100 CALL SCAN_LOOP(TICKS=1)
110 SUM! = SUM! + TACH%
120 END
"""
WORK = """\
10 COMMON RPM, HALF
100 CALL SCAN_LOOP(TICKS=2)
110 HALF = RPM * 0.5
120 END
"""


def loading(rack: Rack, number: int) -> None:
    SwitchOperations(rack).plant("SPEED", "load_torque_nm", str(number * 7 % 40 - 20))
    if number == 9:
        SwitchOperations(rack).plant("SPEED", "lose_tach", "true")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("feeds") / "rack", loading, yaml=YAML, SPEED=SPEED, WORK=WORK)


@pytest.mark.parametrize(("from_ms", "more_than"), [(0, 500), (150, 0), (700, 0)])
def test_tasks_replay_without_the_plant_from_any_place(bag, from_ms, more_than):
    report = replayed(bag, from_ns=from_ms * 10**6)
    assert report.identical
    assert report.scans > more_than


def test_an_edited_task_differs_at_its_first_scan_that_moves(bag):
    report = replayed(bag, {"WORK": edited(WORK, ("RPM * 0.5", "RPM * 0.25"))})
    assert not report.identical


def test_feeds_are_the_plants_writes(bag):
    """In the table a writer of its own kind, although a task has the same name; in the log it writes what it feeds."""
    table = bag_info(bag).table
    assert table is not None
    (plant,) = [writer for writer in table.writers if writer.kind == WriterKind.PLANT]
    assert plant.name == "SPEED"
    fed = {variable.id for variable in table.variables if variable.name in ("RPM", "TACH%")}
    found = (read.message for read in BagReader(bag).messages())
    writes = [item for item in found if isinstance(item, CommonWrite) and item.writer == plant.id]
    assert {number for item in writes for number in item.values.variable} == fed
    assert len(writes) > 1000
