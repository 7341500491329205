"""What `bag_info` counts, against the official mcap reader; damaged, foreign and lying recordings."""

from __future__ import annotations

import hashlib
import shutil
import tracemalloc
from collections import Counter
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer as McapWriter

from automax_ros.cli.recordings.bag_info import as_data, lines_of
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import Int16, Scan, ScanError
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.recordings.info.info import RecordedTask, bag_info, task_facts
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import Recorder
from recordings.independent import GOLDEN, decoded, summary
from recordings.live_racks import build
from recordings.recordings import MS, TABLE, record, sample_recording, write_of

GOLDEN_FILE = GOLDEN / "scans_0.mcap"


def test_counts_are_those_of_the_summary() -> None:
    info, expected = bag_info(GOLDEN, check=True), summary(GOLDEN_FILE)
    assert info.problems == []
    assert info.messages == expected.statistics.message_count > 10_000
    counts = {
        channel.topic: (expected.schemas[channel.schema_id].name, expected.statistics.channel_message_counts[number])
        for number, channel in expected.channels.items()
        if number in expected.statistics.channel_message_counts  # nobody operates the rack: that topic is empty
    }
    assert {name: (topic.type_name, topic.messages) for name, topic in info.topics.items()} == counts
    (file,) = info.files
    assert file.size == GOLDEN_FILE.stat().st_size == info.size
    assert file.chunks == expected.statistics.chunk_count
    assert file.stored_bytes == sum(chunk.compressed_size for chunk in expected.chunk_indexes)
    assert file.unpacked_bytes == sum(chunk.uncompressed_size for chunk in expected.chunk_indexes)
    assert info.compression == file.unpacked_bytes / file.stored_bytes
    assert [(item.name, item.size) for item in info.attachments] == [
        (item.name, item.data_size) for item in expected.attachment_indexes
    ]


def test_scans_are_those_that_another_reader_decodes() -> None:
    numbers: dict[str, list[int]] = {}
    for scan in decoded(GOLDEN_FILE, "/pm1/scans"):
        numbers.setdefault(scan.task, []).append(scan.scan)
    info = bag_info(GOLDEN)
    assert set(info.tasks) == {"LINE", "SEQUENCE", "MOTOR", "SPEED"} == set(numbers)
    for name, task in info.tasks.items():
        found = numbers[name]
        assert (task.scans, task.first, task.last) == (len(found), min(found), max(found))
        assert (task.missing, task.restarts) == (0, 0)
    assert info.scans == sum(map(len, numbers.values()))


def test_tasks_run_as_rack_file_and_sources_say() -> None:
    facts = task_facts(bag_info(GOLDEN))
    seen = {name: (item.slot, item.processor, item.target, item.ticks, item.period_ns) for name, item in facts.items()}
    assert seen == {
        "LINE": (1, "57C435", "automax", 2, 11 * MS),
        "SEQUENCE": (1, "57C435", "automax", 10, 55 * MS),
        "SPEED": (2, "57C431", "automax", 2, 11 * MS),
        "MOTOR": (2, "57C431", "automax", 2, 11 * MS),
    }


def test_what_is_stored_inside_has_the_hashes_of_the_files() -> None:
    hashes = {item.name: item.sha256 for item in bag_info(GOLDEN).attachments}
    config = GOLDEN.parents[1] / "config" / "section_drive"
    for name in ("rack.yaml", "LINE.BLK", "SPEED.BLK"):
        assert hashes[name] == hashlib.sha256((config / name).read_bytes()).hexdigest()


def test_errors_are_counted_by_line_and_code(tmp_path: Path) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=1)
    expected: Counter[tuple[int, int]] = Counter()
    for scan in decoded(bag / "scans_0.mcap", "/line1/scans"):
        expected.update((item.line, item.code) for item in scan.errors)
    assert bag_info(bag).tasks["SPEED"].errors == expected == {(1030, 7001): 26}


def test_a_rack_file_that_is_none_tells_nothing_of_the_tasks(tmp_path: Path) -> None:
    info = bag_info(sample_recording(tmp_path / "bag", seconds=0.1))
    assert info.texts == {"rack.yaml": "rack: LINE1\n"}
    assert task_facts(info) == {}


@settings(deadline=None, derandomize=True)
@given(st.sets(st.integers(0, 400), min_size=1))
def test_missing_numbers(numbers: set[int]) -> None:
    task = RecordedTask()
    for number in sorted(numbers):
        task.count(number)
    gaps = set(range(min(numbers), max(numbers) + 1)) - numbers
    assert (task.scans, task.first, task.last) == (len(numbers), min(numbers), max(numbers))
    assert (task.missing, task.restarts) == (len(gaps), 0)


def test_a_task_that_is_started_again_misses_nothing() -> None:
    task = RecordedTask()
    for number in (0, 1, 2, 3, 0, 1, 3):
        task.count(number)
    assert (task.scans, task.first, task.last, task.missing, task.restarts) == (7, 0, 3, 1, 1)


def test_files_of_a_split_recording_are_counted_together(tmp_path: Path) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=1)
    once = bag_info(bag)
    shutil.copy(bag / "scans_0.mcap", bag / "scans_1.mcap")
    metadata = yaml.safe_load((bag / "metadata.yaml").read_text())
    metadata["rosbag2_bagfile_information"]["relative_file_paths"].append("scans_1.mcap")
    (bag / "metadata.yaml").write_text(yaml.safe_dump(metadata))
    twice = bag_info(bag)
    assert twice.problems == []
    assert [file.name for file in twice.files] == ["scans_0.mcap", "scans_1.mcap"]
    assert (twice.messages, twice.scans, twice.size) == (2 * once.messages, 2 * once.scans, 2 * once.size)
    assert twice.attachments == once.attachments
    assert twice.tasks["SPEED"].restarts == 1


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8, 0.95, 0.999])
def test_a_truncated_recording_tells_what_is_readable(tmp_path: Path, share: float) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=4)
    file = bag / "scans_0.mcap"
    ends = [chunk.chunk_start_offset + chunk.chunk_length for chunk in summary(file).chunk_indexes]
    times = [chunk.message_end_time for chunk in summary(file).chunk_indexes]
    length = int(file.stat().st_size * share)
    whole = sum(end <= length for end in ends)
    expected = sum(entry.log_time <= times[whole - 1] for entry in BagReader(bag).messages()) if whole else 0
    with file.open("r+b") as stream:
        stream.truncate(length)
    info = bag_info(bag)
    assert [problem.code for problem in info.problems] == ["AMX6812"]
    assert "automax bag repair" in info.problems[0].hint
    assert (info.messages, info.files[0].chunks) == (expected, whole)


def test_a_folder_without_metadata_is_counted_and_not_sound(tmp_path: Path) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=1)
    expected = bag_info(bag).messages
    (bag / "metadata.yaml").unlink()
    info = bag_info(bag)
    assert info.messages == expected
    assert [problem.code for problem in info.problems] == ["AMX6810"]


def test_a_damaged_chunk_ends_the_count(tmp_path: Path) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=4)
    file = bag / "scans_0.mcap"
    second = summary(file).chunk_indexes[1]
    data = bytearray(file.read_bytes())
    data[second.chunk_start_offset + second.chunk_length // 2] ^= 0x40  # a bit near the end may be of no consequence
    file.write_bytes(data)
    info = bag_info(bag)
    assert [problem.code for problem in info.problems] == ["AMX6813"]
    assert info.files[0].chunks == 1


def test_a_gap_in_the_write_log_is_found_by_check(tmp_path: Path) -> None:
    log = [("/a/variables", TABLE), ("/a/backplane", write_of(1, MS, {(0, 0): 1}))]
    bag = record(tmp_path / "bag", [*log, ("/a/backplane", write_of(4, 2 * MS, {(0, 0): 1}))])
    assert bag_info(bag).problems == []
    assert [problem.code for problem in bag_info(bag, check=True).problems] == ["AMX6823"]


@pytest.mark.parametrize("sequences", [(1, 2, 1), (1, 2, 2), (3, 2)])
def test_a_write_log_that_goes_backwards_is_found_by_check(tmp_path: Path, sequences: tuple[int, ...]) -> None:
    writes = [("/a/backplane", write_of(number, i * MS, {(0, 0): 1})) for i, number in enumerate(sequences)]
    bag = record(tmp_path / "bag", [("/a/variables", TABLE), *writes])
    assert bag_info(bag).problems == []
    (problem,) = bag_info(bag, check=True).problems
    assert problem.code == "AMX6813"
    assert f"write {sequences[-1]} after write {sequences[-2]}" in problem.message


def test_the_same_file_under_two_names_is_found_by_check(tmp_path: Path) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=1)
    shutil.copy(bag / "scans_0.mcap", bag / "scans_1.mcap")
    text = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").write_text(text.replace("- scans_0.mcap\n", "- scans_0.mcap\n  - scans_1.mcap\n", 1))
    assert bag_info(bag).problems == []
    assert [problem.code for problem in bag_info(bag, check=True).problems] == ["AMX6813"]


@pytest.mark.parametrize(("version", "sound"), [("0.1.0", False), (None, True)])
def test_log_times_that_go_backwards_are_found_by_check(tmp_path: Path, version: str | None, sound: bool) -> None:
    """In recordings of ours, that is: others may store one file's messages in any order."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/Int16", "ros2msg", b"int16 data\n")
        channel = writer.register_channel("/a", "cdr", schema)
        for time in (1, 3, 2):
            writer.add_message(channel, time, encode(Int16(5)), time)
        if version:
            writer.add_metadata("rosbag2", {"serialized_metadata": f"custom_data: {{version: {version}}}"})
        writer.finish()
    assert bag_info(path).problems == []
    assert [problem.code for problem in bag_info(path, check=True).problems] == ([] if sound else ["AMX6813"])


def test_a_recording_of_something_else(tmp_path: Path) -> None:
    info = bag_info(record(tmp_path / "bag", [("/number", Int16(3)), ("/number", Int16(4))]), check=True)
    assert (info.table, info.tasks, info.scans, info.messages) == (None, {}, 0, 2)
    assert info.problems == []


def foreign(path: Path, profile: str) -> Path:
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile=profile, library="somebody")
        schema = writer.register_schema("camera_msgs/msg/Frame", "ros2msg", b"uint8[] data\n")
        channel = writer.register_channel("/camera", "cdr", schema)
        for index in range(5):
            writer.add_message(channel, index * 10**9, b"\0\1\0\0\0\0\0\0", index * 10**9)
        writer.finish()
    return path


def test_types_that_we_do_not_know_are_counted(tmp_path: Path) -> None:
    info = bag_info(foreign(tmp_path / "camera.mcap", "ros2"), check=True)
    assert info.problems == []
    assert info.topics["/camera"].type_name == "camera_msgs/msg/Frame"
    assert (info.messages, info.duration_ns) == (5, 4 * 10**9)


def test_recordings_of_another_kind_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="AMX6811"):
        bag_info(foreign(tmp_path / "ros1.mcap", "ros1"))
    (tmp_path / "text.mcap").write_text("no mcap at all")
    with pytest.raises(BagError, match="AMX6810"):
        bag_info(tmp_path / "text.mcap")
    with pytest.raises(BagError, match="AMX6810"):
        bag_info(tmp_path / "nothing")


def test_a_database_is_refused(tmp_path: Path) -> None:
    bag = sample_recording(tmp_path / "bag", seconds=0.1)
    text = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").write_text(text.replace("storage_identifier: mcap", "storage_identifier: sqlite3"))
    with pytest.raises(BagError, match="AMX6811"):
        bag_info(bag)


def test_a_scan_that_is_none_is_told(tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="ros2", library="somebody")
        schema = writer.register_schema("automax_msgs/msg/Scan", "ros2msg", b"int8 x\n")
        writer.add_message(writer.register_channel("/scans", "cdr", schema), 5, b"\0\1\0\0zzz", 5)
        writer.finish()
    assert [problem.code for problem in bag_info(path).problems] == ["AMX6816"]


def test_kinds_of_errors_are_bounded(tmp_path: Path) -> None:
    errors = [ScanError(line, 7001) for line in range(1, 1200)]
    scans = [("/a/scans", Scan(index, 1, "T", index, errors=errors)) for index in range(3)]
    (task,) = bag_info(record(tmp_path / "bag", scans)).tasks.values()
    assert len(task.errors) == 1000
    assert set(task.errors.values()) == {3}


def test_memory_does_not_grow_with_the_recording(tmp_path: Path) -> None:
    peaks = []
    for name, seconds in (("warm", 1), ("short", 4), ("long", 16)):
        bag = sample_recording(tmp_path / name, seconds=seconds)
        tracemalloc.start()
        bag_info(bag, check=True)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.2 * peaks[1]


def test_progress_goes_from_0_to_1(tmp_path: Path) -> None:
    shares: list[float] = []
    bag_info(sample_recording(tmp_path / "bag", seconds=30), check=True, progress=shares.append)
    assert shares == sorted(shares)
    assert len(shares) > 10
    assert 0 <= shares[0] < 0.1
    assert 0.9 < shares[-1] <= 1


def test_operations_are_told_with_their_time_and_what_was_refused(tmp_path):
    rack = build(tmp_path)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()
    rack.run(0.25)
    rack.adjust.force("SUM%", 7)
    with pytest.raises(OperationRefused):
        rack.operations.run("WORK")
    stream.end()
    recorder.close()
    info = bag_info(tmp_path / "bag", check=True)
    assert [(item.stamp, item.what, item.task, item.ok, item.detail) for item in info.operations] == [
        (250_000_000, "force", "", True, "SUM% = 7"),
        (250_000_000, "run", "WORK", False, ""),
    ]
    lines = lines_of(as_data(info, {}, checked=True))
    start = lines.index("operations")
    assert lines[start + 1].split() == ["0.25", "s", "force", "-", "SUM%", "=", "7"]
    assert "refused: task WORK runs already" in lines[start + 2]
