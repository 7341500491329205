"""Drives of recordings by others, and of split ones: they are what our own whole recording tells of the same run."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli.drive_racks import loop_task, rack_file
from rack.helpers import written_in
from recordings.live_racks import build
from recordings.ros2_bags import recorded_twice

from automax_ros.cli.main import main
from automax_ros.rack.rack import Rack
from automax_ros.recordings.tables.series import Window
from automax_ros.replay.drive_report.drive_report import drive_report
from automax_ros.replay.drive_report.drive_run import DriveRun

MORE = "  PERM@: {slot: 8, register: 0, bit: 0, ros: in}\n"
STIMULI = """\
- {at: 0.1, set: {PERM@: true, REF%: 1500}}
- {at: 0.8, set: {RUN@: true}}
- {at: 2.2, plant: {UNWIND: {lose_phase: 1}}}
- {at: 2.6, set: {RUN@: false, RESET@: true}}
"""


def steps(rack: Rack, number: int) -> None:
    for name, value in {1: [("PERM@", True), ("REF%", 1500)], 8: [("RUN@", True)], 22: [("RUN@", False)]}.get(
        number, ()
    ):
        rack.adjust.set(name, value)


def run_of(bag: Path, window: Window) -> DriveRun:
    ((run, _),) = drive_report(bag, window=window).drives
    return run


def test_a_bag_of_ros2_bag_record_tells_the_same_drive(tmp_path: Path) -> None:
    rack = build(tmp_path, rack_file(more=MORE), LOOP=loop_task(OSV_FDBK=None, OSV_THRESH=None, SPEED_FDBK=None))
    ours, theirs = (
        run_of(bag, Window(600_000_000, 2_400_000_000)) for bag in recorded_twice(rack, tmp_path, steps, 25, 2.5)
    )
    assert ours.starts == 1
    assert [event for event in theirs.happened.events if event.kind == "state"] == [
        event for event in ours.happened.events if event.kind == "state"
    ]
    assert ours.counts.greatest > 40
    for name in ("time_s", "run_s", "greatest", "rms", "heat_j"):
        assert getattr(theirs.counts, name) == pytest.approx(getattr(ours.counts, name), rel=1e-6), name
    assert ours.plant.messages == theirs.plant.messages > 100
    assert theirs.plant.rms_a == pytest.approx(ours.plant.rms_a, rel=1e-6)
    assert theirs.plant.energy_j("line_j") == pytest.approx(ours.plant.energy_j("line_j"), rel=1e-6)


def test_files_of_a_split_recording_add_up_to_the_whole(tmp_path: Path) -> None:
    written_in(tmp_path, rack_file(more=MORE), LOOP=loop_task(OSV_FDBK=None, OSV_THRESH=None, SPEED_FDBK=None))
    (tmp_path / "s.yaml").write_text(STIMULI)
    run = ["run", str(tmp_path), "--simulated", "--duration", "3", "--stimuli", str(tmp_path / "s.yaml")]
    assert main([*run, "--record", str(tmp_path / "whole")]) == 0
    assert main([*run, "--record", str(tmp_path / "split"), "--record-split-s", "1"]) == 0
    whole, split = (run_of(tmp_path / name, Window()) for name in ("whole", "split"))
    assert split.happened.events == whole.happened.events
    assert any("lose_phase" in event.text for event in whole.happened.events)
    assert split.counts == whole.counts
    assert split.plant == whole.plant
    files = sorted((tmp_path / "split").glob("*.mcap"))
    assert len(files) == 3
    parts = [run_of(file, Window()) for file in files]
    assert [part.starts for part in parts] == [1, 0, 0]
    assert sum(len(part.happened.events) for part in parts) == len(whole.happened.events)
    assert sum(part.counts.heat_j for part in parts) == pytest.approx(whole.counts.heat_j, rel=0.01)
