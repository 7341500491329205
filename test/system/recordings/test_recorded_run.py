"""`automax run --record` as a user calls it: the same bytes from any process, readable, and replayable in principle."""

import os
from pathlib import Path

import pytest
from golden_text import check_golden
from replay.reexecution import Reexecution

from automax_ros.core.values import real_text
from automax_ros.recordings.read.reader import BagReader
from system.support import ROOT, TYPES, automax

GOLDEN = Path(__file__).parent / "golden" / "types_run.txt"
SECTION_DRIVE = ROOT / "config" / "section_drive" / "rack.yaml"


def simulated(config: Path, bag: Path, seed: str, seconds: str, *options: str) -> dict[str, bytes]:
    environment = {**os.environ, "PYTHONHASHSEED": seed}
    command = ("run", config, "--simulated", "--duration", seconds, "--record", bag, *options)
    ended = automax(*command, environment=environment)
    assert (ended.code, ended.err) == (0, "")
    assert f"recorded {bag}" in ended.out
    return {item.name: item.read_bytes() for item in sorted(bag.iterdir())}


@pytest.mark.parametrize("config", [TYPES, SECTION_DRIVE], ids=["types", "section_drive"])
def test_runs_of_two_processes_are_equal_byte_for_byte(tmp_path, config):
    one = simulated(config, tmp_path / "one", "1", "12.5")
    two = simulated(config, tmp_path / "another folder", "4242", "12.5")
    assert one == two
    (tmp_path / "again").mkdir()
    outcome = Reexecution(tmp_path / "one", tmp_path / "again").execute()
    assert min(outcome.scans.values()) > 200


@pytest.mark.soak
def test_long_runs_are_equal_byte_for_byte(tmp_path):
    one = simulated(SECTION_DRIVE, tmp_path / "one", "1", "600")
    assert one == simulated(SECTION_DRIVE, tmp_path / "two", "2", "600")


def test_summary_of_a_recorded_run_is_as_ever(tmp_path):
    """Counts and last values: small enough to read, and different after any change of behaviour."""
    bag = tmp_path / "bag"
    simulated(TYPES, bag, "0", "3", "--set", "REF%=-123", "--set", "RUN@=off")
    counts: dict[str, int] = {}
    last: dict[str, object] = {}
    for item in BagReader(bag).messages():
        counts[item.topic] = counts.get(item.topic, 0) + 1
        if hasattr(item.message, "data"):
            last[item.topic] = item.message.data
    lines = [f"{topic}: {count}" for topic, count in sorted(counts.items())]
    lines += [f"{topic} = {shown(value)}" for topic, value in sorted(last.items())]
    check_golden(GOLDEN, "\n".join(lines) + "\n")


def shown(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(shown, value))
    return real_text(value) if isinstance(value, float) else str(value)


def test_live_recording_executes_again(ros_domain_id, tmp_path):
    """Wall clock, skipped deadlines and execution times change nothing in what a scan saw and did."""
    bag = tmp_path / "bag"
    ended = automax("run", TYPES, "--duration", "1", "--record", bag)
    assert (ended.code, ended.err) == (0, "")
    (tmp_path / "again").mkdir()
    outcome = Reexecution(bag, tmp_path / "again").execute()
    assert set(outcome.scans) == {"FAST", "SLOW", "COPY"}
    scans = [item.message for item in BagReader(bag).messages(topics={"/types/scans"})]
    assert max(scan.duration_ns for scan in scans) > 0


def test_foreign_program_reads_the_recording(tmp_path):
    """The converter of rosbags goes through every message of a bag that it does not know."""
    from rosbags.rosbag2 import Reader

    bag = tmp_path / "bag"
    simulated(TYPES, bag, "0", "2")
    with Reader(bag) as reader:
        assert {connection.msgtype for connection in reader.connections} >= {
            "automax_msgs/msg/Scan",
            "automax_msgs/msg/CommonWrite",
            "std_msgs/msg/Int16MultiArray",
        }
        assert sum(1 for _ in reader.messages()) == reader.message_count
