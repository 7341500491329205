"""A drive recorded on the wall clock: its stamps are the time of day, its loop's time is the rack's."""

from pathlib import Path

from rack.drives.drive_tasks import permit, rack_of

from automax_ros.messages.stream.stream import RackStream
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.engine import replay

EPOCH = 1_795_368_125_358_325_800


def test_drive_replays_whenever_it_was_recorded(tmp_path: Path) -> None:
    rack = rack_of(tmp_path)
    stream = RackStream(rack, 4711)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin(EPOCH)
    permit(rack)
    rack.run(0.6)
    rack.write("START@", True)
    rack.run(0.4)
    assert rack.value("STATE@") is True
    stream.end()
    recorder.close()
    report = replay(tmp_path / "bag")
    assert report.identical
    assert {task.name: task.scans for task in report.tasks}["CML"] > 300
