"""Recordings of racks in which locals of tasks were forced: a replay holds them too, wherever it begins."""

from __future__ import annotations

from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from automax_ros.recordings.write.recorder import RecordingOptions
from replay.replays import SPEED, WORK, YAML, busy, edited, record, recorded, replayed
from replay.scans import test_replay_basic_tasks as basic
from replay.scans import test_replay_udc as udc

MODELED = YAML.replace("slots:", "execution: modeled\nslots:", 1)


def build_modeled(folder: Path) -> Rack:
    return build(folder, MODELED, SPEED=SPEED, WORK=WORK)


def forcing(rack: Rack, number: int) -> None:
    busy(rack, number)
    if number % 6 == 1:
        rack.force("SPEED.SUM%", number * 7)
    if number % 6 == 2:
        rack.adjust.force("WORK.J%", number)
        rack.adjust.force("SPEED.FILTERED%", 44)
    if number % 6 == 4:
        rack.adjust.force("WORK.J%", -number)
        rack.unforce("SPEED.SUM%")
    if number % 6 == 5:
        rack.adjust.unforce()


@pytest.fixture(scope="module", params=[YAML, MODELED], ids=["ideal", "modeled"])
def bag(request, tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("forces") / "rack", forcing, yaml=request.param)


def test_a_run_with_forced_locals_replays_bit_for_bit(bag):
    report = replayed(bag)
    assert report.identical
    assert report.scans > 400
    assert sum(task.states for task in report.tasks) > 20


@pytest.mark.parametrize("from_ms", [250, 450, 750, 1450])
def test_a_range_that_begins_while_a_local_is_forced_replays_too(bag, from_ms):
    assert replayed(bag, from_ns=from_ms * 10**6).identical


def test_an_edited_task_has_the_same_locals_forced(bag):
    """While FILTERED% is forced, from 0.2 to 0.5 s, what LAG writes makes no difference; later it does."""
    slow = {"SPEED": edited(SPEED, ("WLG=10.0", "WLG=1.0"))}
    assert replayed(bag, slow, from_ns=230 * 10**6, to_ns=470 * 10**6).identical
    report = replayed(bag, slow, from_ns=530 * 10**6, to_ns=700 * 10**6)
    assert "OUT%" in {item.name for item in report.differences}


def at_odd_instants(rack: Rack, number: int) -> None:
    """Force in the middle of scans: WIND_B and the tasks of the Processor are under way at some of these instants."""
    rack.write("FB%", number * 7 % 23)
    if number % 3 == 1:
        rack.adjust.force("WIND_A.N%", number)
        rack.adjust.force("SPEED.N%", number)
    if number % 9 == 4:
        rack.operations.stop_all("for the test")
    if number % 9 == 6:
        rack.operations.run_all()
    if number % 6 == 5:
        rack.adjust.unforce(["WIND_A.N%"])


@pytest.mark.parametrize("top", ["", "execution: modeled\n"], ids=["ideal", "modeled"])
def test_forced_locals_of_a_udc_replay_through_stop_all(tmp_path, top):
    yaml = udc.YAML.format(top=top)
    bag = recorded(tmp_path / "rack", at_odd_instants, seconds=1.97, yaml=yaml, **udc.SOURCES)
    for from_ms in (0, 433, 1111):
        report = replayed(bag, from_ns=from_ms * 10**6)
        assert report.identical, report.first
        assert sum(task.scans for task in report.tasks) > 200


def of_basic_tasks(rack: Rack, number: int) -> None:
    basic.steps(rack, number)
    if number % 4 == 1:
        rack.adjust.force("READER.A%", number)
        rack.adjust.force("SENDER.N%", number * 3)
    if number % 4 == 3:
        rack.unforce("SENDER.N%")
    if number in (7, 13):
        rack.force("READER.I%", 2)
    if number in (8, 15):
        rack.unforce("READER.I%")


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_forced_locals_of_basic_tasks_replay(tmp_path, execution):
    bag = record(basic.rack_of(tmp_path, execution), tmp_path / "bag", of_basic_tasks, seconds=1.983)
    for from_ms in (0, 330, 777, 1300):
        report = replayed(bag, from_ns=from_ms * 10**6)
        assert report.identical, report.differences


def test_a_scan_under_way_is_replayed_as_it_began(tmp_path):
    """Slices of 1.7 ms: many forces come while a modeled scan is under way."""
    late = []

    def often(rack: Rack, number: int) -> None:
        rack.force("SPEED.SUM%", number)
        late.append(rack.task("SPEED").held != rack.task("SPEED").forces)
        if number % 3 == 2:
            rack.unforce("SPEED.SUM%")

    rack = build_modeled(tmp_path)
    bag = record(rack, tmp_path / "bag", often, slices=300, seconds=0.51)
    assert sum(late) > 5
    assert replayed(bag).identical


@pytest.mark.parametrize("yaml", [YAML, MODELED], ids=["ideal", "modeled"])
def test_each_file_of_a_split_recording_has_the_forces_that_it_begins_with(tmp_path, yaml):
    def steps(rack: Rack, number: int) -> None:
        forcing(rack, number)
        if number % 6 == 3:
            text = SPEED.replace("INPUT3=100", f"INPUT3={number + 90}")
            rack.operations.reload("SPEED", SourceText("SPEED.BLK", text), keep_state=number > 9)

    options = RecordingOptions(split_ns=170 * 10**6, every_state=True)
    bag = recorded(tmp_path / "rack", steps, seconds=1.7, yaml=yaml, options=options)
    files = sorted(bag.glob("*.mcap"))
    assert len(files) == 10
    for file in [bag, *files]:
        report = replayed(file)
        assert report.identical, (file, report.first)
        assert sum(task.states for task in report.tasks) > 30
