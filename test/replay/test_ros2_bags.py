"""Bags of `ros2 bag record`: exported, drawn and replayed as our own recordings of the same run are."""

from __future__ import annotations

from pathlib import Path

import pytest
from recordings.live_racks import build
from recordings.ros2_bags import JOINED_NS, Sent, recorded_twice, ros2_bag

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import String
from automax_ros.recordings.info.info import bag_info, task_facts
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.playback import survey
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.export import CommonTable, write_csv
from automax_ros.recordings.tables.scan_table import ScanTable
from automax_ros.recordings.tables.series import Window
from automax_ros.recordings.tables.traces import traces
from automax_ros.replay.engine import replay
from replay.replays import SPEED, WORK, YAML, busy, edited, rewritten
from replay.replays import replayed as replayed_with

SETTLED = JOINED_NS + 200 * NS_PER_MS
"""From here on the other recorder has everything."""


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("bags")
    return recorded_twice(build(folder, YAML, SPEED=SPEED, WORK=WORK), folder, busy)


def test_the_export_is_that_of_our_own_recording(bags: tuple[Path, Path], tmp_path: Path) -> None:
    for number, bag in enumerate(bags):
        write_csv(CommonTable(bag, window=Window(SETTLED)), tmp_path / f"{number}.csv")
    ours, theirs = ((tmp_path / f"{number}.csv").read_text().splitlines() for number in (0, 1))
    assert len(ours) > 100
    assert theirs == ours


def test_a_table_of_scans_is_that_of_our_own_recording(bags: tuple[Path, Path]) -> None:
    ours, theirs = ([*ScanTable(bag, "SPEED", Window(SETTLED)).rows()] for bag in bags)
    assert len(ours) > 200
    assert theirs[1:] == ours[1:]  # the first row holds all that is known by then


def test_times_begin_with_the_run(bags: tuple[Path, Path]) -> None:
    """Its files were sent 2.1 s before the run began."""
    _, bag = bags
    rows = [time for time, _ in CommonTable(bag).rows()]
    assert JOINED_NS <= rows[0] <= JOINED_NS + 100 * NS_PER_MS
    assert rows == sorted(rows)
    shown = traces(bag, ["REF%", "OUT%"])
    assert 0 <= shown.start_s < shown.end_s < 2.001
    info = bag_info(bag, check=True)
    assert info.problems == []
    assert info.table is not None
    assert info.first_stamp == info.table.stamp
    assert {name: facts.period_ns for name, facts in task_facts(bag_info(bag)).items()} == {
        "SPEED": 5_500_000,
        "WORK": 11_000_000,
    }


def test_it_is_replayed_with_the_files_that_the_rack_sent(bags: tuple[Path, Path]) -> None:
    report = replay(bags[1])
    assert report.identical
    (note,) = {note.split(" ", 1)[1] for task in report.tasks for note in task.notes}
    assert note == "scans could not be executed again: the state before them is not recorded"
    ours = {task.name: task.scans for task in replay(bags[0]).tasks}
    for task in report.tasks:
        assert ours[task.name] * 0.7 < task.scans < ours[task.name]


def test_an_edited_task_differs_in_the_same_scan(bags: tuple[Path, Path]) -> None:
    new = {"SPEED": edited(SPEED, ("WLG=10.0", "WLG=11.0"))}
    ours, theirs = (replayed_with(bag, new, from_ns=1_000 * NS_PER_MS) for bag in bags)
    assert ours.first is not None
    assert theirs.first is not None
    assert (theirs.first.scan, theirs.first.task) == (ours.first.scan, ours.first.task)
    assert [item.scans for item in theirs.differences] == [item.scans for item in ours.differences]


def test_without_the_files_the_hint_names_their_topic(bags: tuple[Path, Path], tmp_path: Path) -> None:
    bag = rewritten(bags[0], tmp_path / "bag", attachments=lambda _, __: None)
    with pytest.raises(BagError, match=r"AMX6830[\s\S]*/config"):
        replay(bag)


def test_a_recorder_that_was_there_before_the_rack(bags: tuple[Path, Path], tmp_path: Path) -> None:
    """What came before the run began is sent at its beginning, and not waited for."""
    run_start = survey(bags[1]).run_start
    assert run_start is not None
    sent = [Sent("/line1/config", "std_msgs/msg/String", run_start - 2_100 * NS_PER_MS, encode(String("{}")))]
    for record in BagReader(bags[1]).records():
        assert record.schema is not None
        if record.channel.topic != "/line1/config":
            sent.append(Sent(record.channel.topic, record.schema.name, record.publish_time, record.data))
    played = survey(ros2_bag(tmp_path / "bag", sent, run_start - 3_000 * NS_PER_MS))
    assert played.begin == played.run_start
    assert "/line1/config" in played.latched
