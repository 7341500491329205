"""Recorders that are killed, and disks that are full: what is on the disk is whole, and at most a second is lost."""

from __future__ import annotations

import os
import random
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from soaking import in_soak

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.recordings.live.recording import LiveRecording
from automax_ros.recordings.live.topics import LiveTopics
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.repair.repairing import RepairReport, repair
from automax_ros.recordings.write.data_file import StorageOptions
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from recordings.live_racks import build
from recordings.others import assert_mcap_reads, rosbags_messages
from recordings.repair.test_bag_repair import whole_scans

ROOT = Path(__file__).parents[3]
RACK = ROOT / "config" / "section_drive" / "rack.yaml"
PERIOD_NS = 11 * NS_PER_MS
"""Of the rack's fastest task: between two of its scans nothing can be lost."""
QUICK, ALL = 3, 50
OPTIONS = (
    ["--record-compression", "zstd"],
    ["--record-compression", "lz4", "--record-split-mb", "0.1"],
    ["--record-compression", "none", "--record-split-s", "2", "--record-locals"],
)


def started(folder: Path, *arguments: str, limit: int = 0) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, str(Path(__file__).with_name("crash_driver.py")), str(folder / "time"), str(limit)]
    return subprocess.Popen(
        [*command, "run", str(RACK), "--record", str(folder / "bag"), *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_rack(process: subprocess.Popen[str], folder: Path) -> None:
    """Wait until the rack scans."""
    for _ in range(3000):
        if (folder / "time").exists() and rack_time(folder):
            return
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    pytest.fail("the rack does not start")


def rack_time(folder: Path) -> int:
    """Rack time of the latest scan in ns."""
    (value,) = struct.unpack("<q", (folder / "time").read_bytes()[:8].ljust(8, b"\0"))
    return int(value)


def killed_after(folder: Path, seconds: float, *arguments: str) -> int:
    """Kill a recording run some time after its rack has begun; return the rack time it had come to."""
    process = started(folder, *arguments)
    try:
        wait_for_rack(process, folder)
        time.sleep(seconds)
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    return rack_time(folder)


def assert_little_is_lost(bag: Path, end: int) -> RepairReport | None:
    """Repair a killed run's recording: it must be sound then, end in time, and hold no scan by half."""
    assert not (bag / "metadata.yaml").exists()
    try:
        report = repair(bag)
    except BagError as error:
        assert error.code == "AMX6817"  # noqa: PT017  # killed within the first second
        assert end <= NS_PER_S + PERIOD_NS
        return None
    # The scan at ``end`` was told before it was recorded; what is lost begins one scan after the last that is kept.
    first_lost, last_lost = report.last_stamp - report.run_start + PERIOD_NS, end - PERIOD_NS
    assert last_lost - first_lost < NS_PER_S, f"{first_lost / 1e9:.3f} to {last_lost / 1e9:.3f} s lost"
    assert report.output is not None
    assert whole_scans(report.output) > 0
    return report


def moments(first: int, last: int) -> Iterator[tuple[float, list[str]]]:
    chance = random.Random(20)
    for number in range(last):
        seconds = chance.choice((0.02, 0.1, 0.4)) * chance.random()
        if number >= first:
            yield seconds, OPTIONS[number % len(OPTIONS)]


@pytest.mark.parametrize(("first", "last"), [(0, QUICK), in_soak(QUICK, ALL, timeout_s=1800)])
def test_killed_at_any_moment(tmp_path: Path, first: int, last: int) -> None:
    kept: list[RepairReport] = []
    for number, (seconds, options) in enumerate(moments(first, last)):
        here = tmp_path / f"run{number}"
        here.mkdir()
        end = killed_after(here, seconds, "--simulated", "--duration", "1000000", *options)
        report = assert_little_is_lost(here / "bag", end)
        kept += [report] if report is not None else []
    assert len(kept) >= (last - first) // 2
    smallest = min(kept, key=lambda report: report.files[0].contents.messages).output
    assert smallest is not None
    assert len(rosbags_messages(smallest)) == sum(map(assert_mcap_reads, smallest.glob("*.mcap")))


@pytest.mark.usefixtures("ros_domain_id")
def test_a_live_rack_killed(tmp_path: Path) -> None:
    pytest.importorskip("rclpy")
    end = killed_after(tmp_path, 2.7, "--state", str(tmp_path / "state"))
    assert end > 2 * NS_PER_S
    report = assert_little_is_lost(tmp_path / "bag", end)
    assert report is not None
    assert abs(report.last_stamp / 1e9 - time.time()) < 20, "the wall clock is in the stamps"


@pytest.mark.parametrize(
    ("options", "limit"), list(zip(OPTIONS, (60_000, 99_000, 900_000), strict=True)), ids=("zstd", "lz4", "none")
)
def test_full_disk(tmp_path: Path, options: list[str], limit: int) -> None:
    """A file may not grow beyond a limit: the system answers as a full disk does."""
    process = started(tmp_path, "--simulated", "--duration", "12", *options, limit=limit)
    out, err = process.communicate(timeout=240)
    assert process.returncode == 1
    assert err.count("AMX6801") == 1
    assert "File too large" in err
    assert out.count("recording ended, the rack goes on") == 1
    assert "ran 12.000 s" in out
    assert "automax bag repair" in out
    report = repair(tmp_path / "bag")
    assert report.output is not None
    assert whole_scans(report.output) == report.files[0].contents.scans > 0


def test_an_idle_rack_reaches_the_disk(tmp_path: Path) -> None:
    """On the wall clock ``flush`` ends the open chunk when its time is over, though no message comes."""
    rack = build(tmp_path)
    stream = RackStream(rack, 1)
    options = RecordingOptions(StorageOptions(chunk_ns=NS_PER_S // 2))
    recorder = Recorder(rack, stream, tmp_path / "bag", options)
    stream.begin(epoch_ns=1_700_000_000 * NS_PER_S)
    rack.start()
    rack.run(0.2)
    rack.operations.stop_tasks()
    data = tmp_path / "bag" / "scans_0.mcap"
    size = data.stat().st_size
    recorder.flush(NS_PER_S // 2 - 1)
    assert data.stat().st_size == size
    recorder.flush(NS_PER_S // 2)
    recorder.sync()
    grown = data.stat().st_size
    assert grown > size
    recorder.flush(10 * NS_PER_S)
    recorder.sync()
    assert data.stat().st_size == grown, "nothing new, nothing to write"
    report = repair(tmp_path / "bag")
    assert report.last_stamp - report.run_start == 198 * NS_PER_MS
    recorder.close()
    assert len(list(BagReader(tmp_path / "bag").messages())) == report.files[0].contents.messages


def test_a_disk_that_fails_to_sync_ends_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rack = build(tmp_path)
    stream = RackStream(rack, 1)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()

    def refuse(_: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", refuse)
    recorder.sync()
    assert recorder.failure is None
    rack.run(1.0)
    assert recorder.failure is not None
    assert "Input/output error" in str(recorder.failure)
    assert rack.statistics["SPEED"].scans == 91
    recorder.close()
    recorder.sync()


@pytest.mark.parametrize("refusing", ["before close", "after close"])
@pytest.mark.parametrize("live", [False, True])
def test_a_disk_that_refuses_the_last_sync_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refusing: str, live: bool
) -> None:
    """No write comes any more that would notice it; the bag is finished all the same."""
    rack = build(tmp_path)
    stream = RackStream(rack, 1)
    recorder: Recorder | LiveRecording = Recorder(rack, stream, tmp_path / "bag")
    table: list[bytes] = []
    stream.add_sink(
        lambda topic: (lambda _, payload: table.append(payload)) if topic is stream.variables_topic else None
    )
    stream.begin()
    rack.start()
    rack.run(0.5)
    stream.end()
    if live:
        recorder.close()
        topics = LiveTopics("/line1", decode("automax_msgs/msg/VariableTable", table[0]))
        recorder = LiveRecording(tmp_path / "live", topics, table[0])

    def refuse(_: int) -> None:
        raise OSError(5, "Input/output error")

    if refusing == "before close":
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", refuse)
            recorder.sync()
        recorder.close()
        assert recorder.failure is not None
    else:
        recorder.close()
        assert recorder.failure is None
        monkeypatch.setattr(os, "fsync", refuse)
    recorder.sync_at_end()
    assert recorder.failure is not None
    assert "Input/output error" in str(recorder.failure)
    assert repair(tmp_path / ("live" if live else "bag")).sound
