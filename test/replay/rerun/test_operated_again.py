"""A rack with all that a rack has runs again, operated, forced, reloaded, without power for a while: the same bytes."""

from __future__ import annotations

from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.types.messages import Operation
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import RecordingOptions
from replay.replays import SPEED, WORK, YAML, busy, record, recorded
from replay.rerun.runs import data_of, run_again
from replay.test_operated_rack import SOURCES, make, operate, overlapped


@pytest.fixture(scope="module", params=["ideal", "modeled"])
def bag(tmp_path_factory, request) -> Path:
    folder = tmp_path_factory.mktemp(request.param)
    return record(make(folder / "rack", request.param), folder / "bag", operate, slices=40)


def test_unedited_it_gives_the_recorded_bytes(bag, tmp_path):
    report = run_again(bag, tmp_path / "after")
    assert report.deviation is None, report.text()
    assert report.is_exact
    assert (report.refused, report.notes) == (0, ())
    assert data_of(tmp_path / "after") == data_of(bag)
    operations = [item.message for item in BagReader(bag).messages() if isinstance(item.message, Operation)]
    assert report.outside.counts()["operations"] == len(operations) == 17


@pytest.mark.parametrize("from_s", [0.21, 0.611, 0.92, 1.155, 1.33, 1.58])
def test_each_task_replaced_by_itself_goes_on_as_it_was(bag, tmp_path, from_s):
    """At any moment: while a local is forced, a task stopped, the power off. WORK has been reloaded meanwhile."""
    own = {name: text for name, text in SOURCES.items() if name != "WORK"}
    assert run_again(bag, tmp_path / "as_it_was", from_s).deviation is None
    report = run_again(bag, tmp_path / "replaced", from_s, **own)
    assert report.deviation is None, report.text()
    assert report.compared > 100
    if report.at_ns == round(from_s * 1e9):  # else a modeled scan was under way
        assert data_of(tmp_path / "replaced") == data_of(tmp_path / "as_it_was")
    assert [note for note in report.notes if "begin as installed" in note] == []


def test_from_the_beginning_of_a_file_it_gives_the_messages_of_that_file(tmp_path):
    rack = make(tmp_path / "rack", "modeled")
    options = RecordingOptions(split_ns=170 * NS_PER_MS)
    files = record(rack, tmp_path / "bag", operate, slices=16, seconds=0.8, options=options)
    report = run_again(files, tmp_path / "after", 0.51)
    assert report.deviation is None, report.text()

    def messages(bag: Path) -> list[tuple[str, int, bytes]]:
        return [(item.channel.topic, item.publish_time, item.data) for item in BagReader(bag).records()]

    third = messages(files / "scans_3.mcap")
    assert len(third) > 200
    assert messages(tmp_path / "after")[: len(third)] == third


def test_an_overlap_and_what_followed(tmp_path):
    bag = overlapped(tmp_path)
    report = run_again(bag, tmp_path / "after")
    assert report.deviation is None, report.text()
    assert data_of(tmp_path / "after") == data_of(bag)


@pytest.mark.parametrize("options", [RecordingOptions(every_state=True), RecordingOptions(tasks=frozenset({"SPEED"}))])
def test_what_is_recorded_is_what_was(tmp_path, options):
    bag = recorded(tmp_path, busy, options=options)
    assert run_again(bag, tmp_path / "after").deviation is None
    assert data_of(tmp_path / "after") == data_of(bag)


def test_a_state_kept_from_an_earlier_run(tmp_path):
    """Tasks, forces and tunables that were not as installed at the start."""
    rack = build(tmp_path, YAML, SPEED=SPEED, WORK=WORK)
    rack.tune(rack.task("SPEED"), "TRIM%", 4)
    rack.force("OUT%", 5)
    rack.force("WORK.J%", 2)
    bag = record(rack, tmp_path / "bag", busy)
    report = run_again(bag, tmp_path / "after")
    assert report.deviation is None, report.text()
    assert data_of(tmp_path / "after") == data_of(bag)
