"""The golden cycle of replay: what was recorded replays identically; a changed gain is found at its first scan."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest
from rack.helpers import rack_at

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.types.messages import Scan
from automax_ros.rack.rack import Rack
from automax_ros.recordings.read.reader import BagReader
from automax_ros.replay.scans.report import DifferenceKind
from replay.replays import SPEED, WORK, edited, record, recorded, replayed

EXAMPLE = Path(__file__).parents[3] / "config" / "section_drive"


def example_rack(folder: Path | None = None, **tasks: str) -> Rack:
    """The example rack; with a folder a copy of it, some of its sources replaced."""
    if folder is not None:
        folder.mkdir()
        for file in filter(Path.is_file, EXAMPLE.iterdir()):
            (folder / file.name).write_bytes(file.read_bytes())
        for name, text in tasks.items():
            (folder / f"{name}.BLK").write_text(text)
    return rack_at((folder or EXAMPLE) / "rack.yaml")


def drive(rack: Rack, number: int) -> None:
    """Be an operator who is never content."""
    rack.write("LINE_SPEED_SP%", 800 + number % 7 * 200)
    rack.write("START_PB@", number % 3 == 0)
    rack.write("STOP_PB@", number % 11 == 10)
    rack.write("NIP_CLOSED@", number % 4 > 1)


@pytest.fixture(scope="module")
def example(tmp_path_factory) -> Path:
    return record(example_rack(), tmp_path_factory.mktemp("example") / "bag", drive, slices=25, seconds=25.0)


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=11.0)


def test_example_rack_replays_identically(example):
    report = replayed(example)
    assert report.identical
    assert report.first is None
    assert {task.name: task.scans for task in report.tasks} == {
        "LINE": 2274,
        "SEQUENCE": 456,
        "SPEED": 2274,
        "MOTOR": 2274,
    }
    assert all(task.states >= 4 for task in report.tasks)
    assert not any(task.edited or task.different or task.notes for task in report.tasks)


@pytest.mark.soak
@pytest.mark.timeout(600)
def test_example_rack_replays_identically_over_100_000_scans(tmp_path):
    report = replayed(record(example_rack(), tmp_path / "bag", drive, slices=400, seconds=400.0))
    assert report.scans > 100_000
    assert report.identical


def test_first_scan_with_another_gain_is_the_right_one(example, tmp_path):
    """Checked by running both racks: until a first output differs both have the same inputs, open loop or not."""
    text = (EXAMPLE / "SPEED.BLK").read_text()
    changed = edited(text, ("CURRENT=26.7,", "CURRENT=27.2,"))
    other = record(example_rack(tmp_path / "other", SPEED=changed), tmp_path / "bag", drive, slices=25, seconds=25.0)
    pairs = zip(scans_of(example, "SPEED"), scans_of(other, "SPEED"), strict=True)
    expected = next(
        (one.scan, one.stamp, one.committed, two.committed) for one, two in pairs if one.committed != two.committed
    )
    report = replayed(example, {"SPEED": changed}, only=("SPEED",))
    assert report.first is not None
    assert (report.first.task, report.first.scan, report.first.time_s) == ("SPEED", expected[0], expected[1] / NS_PER_S)
    names = [variable.name for variable in example_rack().config.variables]
    before, after = (
        {names[view]: value for view, value in zip(values.variable, values.value, strict=True)}
        for values in expected[2:]
    )
    differing = {name for name in {*before, *after} if before.get(name) != after.get(name)}
    assert {item.name for item in report.first.differences} == differing
    for item in report.first.differences:
        assert (item.first.recorded, item.first.replayed) == (before[item.name], after[item.name])
    assert "tunable KP_SPEED starts at its new CURRENT=27.2, not at 26.7" in report.tasks[0].notes


def scans_of(bag: Path, task: str) -> list[Scan]:
    messages = (item.message for item in BagReader(bag).messages(types={"automax_msgs/msg/Scan"}))
    return [message for message in messages if isinstance(message, Scan) and message.task == task]


def test_small_rack_replays_identically(bag):
    report = replayed(bag)
    assert report.identical
    assert {task.name: task.scans for task in report.tasks} == {"SPEED": 2001, "WORK": 1001}


def test_each_differing_scan_is_that_of_a_rack_with_the_other_gain(bag, tmp_path):
    """SPEED reads nothing that it causes: open loop and closed loop are the same for it, scan for scan."""
    changed = edited(SPEED, ("INPUT2=100, INPUT3=100", "INPUT2=104, INPUT3=100"))
    other = recorded(tmp_path / "other", seconds=11.0, SPEED=changed)
    one, two = history(bag, "SPEED"), history(other, "SPEED")
    wrong = [number for number in one if one[number] != two[number]]
    report = replayed(bag, {"SPEED": changed})
    (found,) = report.differences
    assert (found.task, found.kind, found.name, found.lines, found.unit) == (
        "SPEED",
        DifferenceKind.VARIABLE,
        "OUT%",
        (130,),
        "counts",
    )
    assert (found.first.scan, found.first.recorded, found.first.replayed) == (wrong[0], one[wrong[0]], two[wrong[0]])
    assert found.scans == len(wrong)
    greatest = max((two[number] - one[number] for number in wrong), key=abs)
    assert found.greatest is not None
    assert found.greatest.difference == greatest
    assert found.greatest.scan == next(number for number in wrong if abs(two[number] - one[number]) == abs(greatest))
    assert {task.name: task.different for task in report.tasks} == {"SPEED": len(wrong), "WORK": 0}


def history(bag: Path, task: str) -> dict[int, int]:
    """OUT% after each scan."""
    value, values = 0, {}
    for scan in scans_of(bag, task):
        for view, number in zip(scan.committed.variable, scan.committed.value, strict=True):
            if view == 1:
                value = int(number)
        values[scan.scan] = value
    return values


def test_report_begins_with_what_the_first_differing_scan_saw(bag):
    report = replayed(bag, {"WORK": edited(WORK, ("TOTAL * 0.5 + GAIN", "TOTAL * 0.5 + GAIN * 2"))})
    first = report.first
    assert first is not None
    assert (first.task, first.scan) == ("WORK", 51), "GAIN is 0 in the first slice"
    assert [item.name for item in first.differences] == ["TOTAL"]
    assert [item.name for item in first.latched] == ["COUNT!", "FLAG@", "OUT%"]
    seen = [(item.name, item.value) for item in first.read]
    assert seen[:3] == [("TOTAL", seen[0][1]), ("GAIN", 0.125), ("NOTE$", "ready")]
    assert ("TABLE%(0,2)", 0) in seen
    text = report.text()
    assert "Open loop" in text
    assert f"First difference: task WORK, scan 51 at {first.time_s:g} s" in text
    assert "TOTAL: recorded" in text
    assert "(line 110)" in text


def test_what_a_task_wrote_itself_it_finds_again(bag):
    """COUNT! is written by WORK alone: one more a scan adds up, it is not taken back by the recorded values."""
    report = replayed(bag, {"WORK": edited(WORK, ("COUNT! = COUNT! + 1", "COUNT! = COUNT! + 2"))})
    (found,) = report.differences
    assert (found.name, found.first.scan, found.first.recorded, found.first.replayed) == ("COUNT!", 1, 6, 7)
    assert found.greatest is not None
    assert (found.greatest.difference, found.greatest.scan, found.scans) == (1000, 1000, 1000)


def test_writes_of_others_take_the_place_of_a_tasks_own(tmp_path):
    """Both tasks write SPARE%: what the replayed one wrote is gone with the other's recorded write."""
    speed = edited(SPEED, ("REF%, OUT%", "SPARE%, REF%, OUT%"), ("140 END", "135 SPARE% = REF%\n140 END"))
    work = edited(WORK, ("GAIN, TOTAL", "SPARE%, GAIN, TOTAL"), ("200 END", "195 SPARE% = -1\n200 END"))
    bag = recorded(tmp_path, SPEED=speed, WORK=work)
    report = replayed(bag, {"WORK": edited(work, ("SPARE% = -1", "SPARE% = -2"))})
    assert [(item.task, item.name, item.first.replayed) for item in report.differences] == [("WORK", "SPARE%", -2)]
    reading = edited(work, ("SPARE% = -1", "J% = SPARE% \\ SPARE% = -1 \\ COUNT! = J%"))
    report = replayed(bag, {"WORK": reading})
    last = report.differences[0].first.replayed
    assert report.differences[0].name == "COUNT!"
    assert last != -1, "it reads what SPEED has written since"


def test_settling_is_found(tmp_path):
    """A step of REF% at 1 s: with a gain of 1.1 OUT% settles 10 % apart, when the LAG has come to rest."""

    def step(rack: Rack, number: int) -> None:
        rack.write("RUN@", True)
        rack.write("REF%", 0 if number < 2 else 999)

    bag = recorded(tmp_path, step, seconds=10.0)
    report = replayed(bag, {"SPEED": edited(SPEED, ("INPUT2=100, INPUT3=100", "INPUT2=110, INPUT3=100"))})
    (found,) = report.differences
    assert found.settled is not None
    assert found.settled.high == 100
    assert found.settled.low >= 95
    assert 1.2 < found.settled.time_s < 1.6
    assert f"settles +{found.settled.low} to +100 apart from scan {found.settled.scan}" in report.text()


def test_difference_that_ends_is_told_as_ended(tmp_path):
    def pulse(rack: Rack, number: int) -> None:
        rack.write("RUN@", True)
        rack.write("REF%", 999 if number == 2 else 0)

    bag = recorded(tmp_path, pulse, seconds=10.0)
    report = replayed(bag, {"SPEED": edited(SPEED, ("INPUT2=100, INPUT3=100", "INPUT2=110, INPUT3=100"))})
    (found,) = report.differences
    assert found.settled is not None
    assert (found.settled.low, found.settled.high) == (0, 0)
    assert 1.5 < found.settled.time_s < 2.5
    assert "equal again from scan" in report.text()


def test_memory_does_not_grow_with_the_recording(tmp_path, monkeypatch):
    monkeypatch.setattr("automax_ros.recordings.mcap.chunk_table.BLOCK_BYTES", 60_000)  # several blocks each
    changed = {"SPEED": edited(SPEED, ("INPUT2=100", "INPUT2=101"))}
    peaks = []
    for seconds in (2.0, 12.0):
        bag = recorded(tmp_path / str(seconds), seconds=seconds)
        replayed(bag, changed)
        tracemalloc.start()
        replayed(bag, changed)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 1_500_000, "one block of the file is in memory at a time"


def test_same_replay_gives_the_same_report(bag):
    changed = {"WORK": edited(WORK, ("COUNT! + 1", "COUNT! + 2"))}
    assert replayed(bag, changed) == replayed(bag, changed)


def test_busy_plant_is_busy(bag):
    """The tests above would prove little on a recording in which nothing happens."""
    assert len(set(history(bag, "SPEED").values())) > 100
