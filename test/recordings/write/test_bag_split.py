"""Recordings of several files, in each compression: every file stands alone, together they are the whole run."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.reader import make_reader
from replay.reexecution import Reexecution

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import Int16, String
from automax_ros.messages.types.topics import LATCHED, SCAN
from automax_ros.recordings.mcap.errors import RecordingError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.data_file import COMPRESSIONS, MIN_SPLIT_BYTES, StorageOptions
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from automax_ros.recordings.write.writer import BagWriter
from recordings.live_racks import build
from recordings.others import assert_mcap_reads, rosbags_messages

SECONDS = 7.0
TASKS = {"SPEED", "WORK"}


def recorded(folder: Path, options: RecordingOptions | None = None, seconds: float = SECONDS, epoch: int = 0) -> Path:
    """Record a run of the small rack with a busy plant."""
    rack = build(folder)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, folder / "bag", options)
    stream.begin(epoch)
    rack.start()
    for number in range(50):
        rack.write("REF%", (number * 7919) % 65536 - 32768)
        rack.write("NOTE$", ["", "ready", "Grüße", "12345678"][number % 4])
        rack.write("RUN@", number % 3 == 1)
        rack.run(seconds / 50)
    stream.end()
    recorder.close()
    assert recorder.failure is None
    return folder / "bag"


def options(split_ns: int = 0, **storage: Any) -> RecordingOptions:
    return RecordingOptions(StorageOptions(**storage), split_ns)


def files(bag: Path) -> list[Path]:
    return sorted(bag.glob("*.mcap"))


def on(bag: Path, topic: str) -> list[Any]:
    return [item.message for item in BagReader(bag).messages(topics={f"/line1/{topic}"})]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module", params=[*COMPRESSIONS, "by size"])
def split(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same run in files of two seconds in each compression, and in files of a size."""
    how = (
        options(split_bytes=MIN_SPLIT_BYTES)
        if request.param == "by size"
        else options(2 * NS_PER_S, compression=request.param)
    )
    return recorded(tmp_path_factory.mktemp("split"), how)


def test_there_are_several_files_and_metadata_lists_each(split: Path) -> None:
    information = yaml.safe_load((split / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    names = [file.name for file in files(split)]
    assert len(names) >= 3
    assert information["relative_file_paths"] == names == [f"scans_{number}.mcap" for number in range(len(names))]
    for entry, path in zip(information["files"], files(split), strict=True):
        times = [item.log_time for item in BagReader(path).messages()]
        assert entry["path"] == path.name
        assert entry["starting_time"]["nanoseconds_since_epoch"] == times[0]
        assert entry["duration"]["nanoseconds"] == times[-1] - times[0]
        assert entry["message_count"] == len(times)
    first, last = information["files"][0], information["files"][-1]
    end = last["starting_time"]["nanoseconds_since_epoch"] + last["duration"]["nanoseconds"]
    assert information["starting_time"] == first["starting_time"]
    assert information["duration"]["nanoseconds"] == end - first["starting_time"]["nanoseconds_since_epoch"]
    assert information["message_count"] == sum(entry["message_count"] for entry in information["files"])
    topics = {
        item["topic_metadata"]["name"]: item["message_count"] for item in information["topics_with_message_count"]
    }
    assert sum(topics.values()) == information["message_count"]
    assert topics["/line1/scans"] == len(on(split, "scans"))


def test_each_file_describes_itself(split: Path) -> None:
    for path in files(split):
        (record,) = BagReader(path).metadata_records()
        own = yaml.safe_load(record.metadata["serialized_metadata"])
        topics: dict[str, int] = {}
        for item in BagReader(path).messages():
            topics[item.topic] = topics.get(item.topic, 0) + 1
        told = {item["topic_metadata"]["name"]: item["message_count"] for item in own["topics_with_message_count"]}
        assert own["relative_file_paths"] == [path.name]
        assert {name: count for name, count in told.items() if count} == topics


def test_others_read_every_message(split: Path) -> None:
    counts = [assert_mcap_reads(path) for path in files(split)]
    read = rosbags_messages(split)
    mine = list(BagReader(split).messages())
    assert len(read) == sum(counts) == len(mine)
    assert [(topic, time) for topic, time, _ in read] == [(item.topic, item.log_time) for item in mine]


def test_log_times_and_sequence_numbers_go_on(split: Path) -> None:
    times: list[int] = []
    numbers: dict[str, list[int]] = {}
    for path in files(split):
        with path.open("rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages():
                times.append(message.log_time)
                numbers.setdefault(channel.topic, []).append(message.sequence)
    assert all(after > before for before, after in pairwise(times))
    assert all(counted == list(range(1, len(counted) + 1)) for counted in numbers.values())


def test_each_file_begins_with_the_facts(split: Path) -> None:
    for path in files(split):
        found = list(BagReader(path).messages())
        assert [item.topic for item in found[:2]] == ["/line1/variables", "/line1/backplane/snapshot"]
        assert found[0].message.stamp == 0, "when the run began"
        full = {}
        for item in found:
            if item.topic == "/line1/scans":
                full.setdefault(item.message.task, item.message.full)
        assert full == dict.fromkeys(TASKS, True)
        known: set[str] = set()
        for item in found:
            if item.topic == "/line1/states":
                known.add(item.message.task)
            elif item.topic == "/line1/scans":
                assert item.message.task in known or not item.message.scan
        assert known == TASKS
        assert {item.name for item in BagReader(path).attachments()} == {"rack.yaml", "SPEED.BLK", "WORK.BLK"}


def test_each_further_file_has_image_and_values_of_its_first_instant(split: Path) -> None:
    """What the write log of all files before says is what the image at the beginning of a file says."""
    memory: dict[tuple[int, int], float] = {}
    last: dict[str, Any] = {}
    for number, path in enumerate(files(split)):
        fresh = True
        for item in BagReader(path).messages():
            name = type(item.message).__name__
            if name == "CommonWrite":
                fresh = False
                values = item.message.values
                memory.update(zip(zip(values.variable, values.element, strict=True), values.value, strict=True))
            elif name == "CommonImage" and number and fresh:
                values = item.message.values
                image = dict(zip(zip(values.variable, values.element, strict=True), values.value, strict=True))
                assert {key: image[key] for key in memory} == memory
            elif "/common/" in item.topic:
                if number and fresh:
                    assert item.message == last[item.topic]
                last[item.topic] = item.message


def test_each_file_alone_executes_again(split: Path, tmp_path: Path) -> None:
    scans = dict.fromkeys(TASKS, 0)
    for path in files(split):
        folder = tmp_path / path.stem
        folder.mkdir()
        outcome = Reexecution(path, folder).execute()
        for task, count in outcome.scans.items():
            scans[task] += count
    folder = tmp_path / "all"
    folder.mkdir()
    assert Reexecution(split, folder).execute().scans == scans


def test_split_or_not_the_run_is_the_same(whole: Path, split: Path) -> None:
    assert on(split, "backplane") == on(whole, "backplane")
    plain = [scan._replace(full=False, latched=()) for scan in on(whole, "scans")]
    assert [scan._replace(full=False, latched=()) for scan in on(split, "scans")] == plain


def test_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    bags = []
    for name in ("one", "a much longer name"):
        (tmp_path / name).mkdir()
        bag = recorded(tmp_path / name, options(NS_PER_S, split_bytes=MIN_SPLIT_BYTES), 3.0)
        bags.append({path.name: path.read_bytes() for path in sorted(bag.iterdir())})
    assert bags[0] == bags[1]
    assert len(bags[0]) >= 4


def test_files_end_at_multiples_of_rack_time(tmp_path: Path) -> None:
    epoch = 1_700_000_000_123_456_789
    bag = recorded(tmp_path, options(2 * NS_PER_S), epoch=epoch)
    starts = [next(iter(BagReader(path).messages())).stamp - epoch for path in files(bag)]
    assert starts == [0, 2 * NS_PER_S, 4 * NS_PER_S, 6 * NS_PER_S]
    for path, begin in zip(files(bag), starts, strict=True):
        stamps = [item.stamp - epoch for item in BagReader(path).messages()]
        assert begin <= min(stamps)
        assert max(stamps) < begin + 2 * NS_PER_S


def test_a_file_ends_when_it_has_its_size(tmp_path: Path) -> None:
    limit = 150_000
    bag = recorded(tmp_path, options(split_bytes=limit), 20.0)
    sizes = [path.stat().st_size for path in files(bag)]
    assert len(sizes) >= 3
    assert all(limit <= size < 2 * limit for size in sizes[:-1])


def test_chosen_tasks_and_whole_memory(tmp_path: Path, whole: Path) -> None:
    bag = recorded(tmp_path, RecordingOptions(tasks=frozenset({"WORK"})))
    assert {scan.task for scan in on(bag, "scans")} == {state.task for state in on(bag, "states")} == {"WORK"}
    assert on(bag, "scans") == [scan for scan in on(whole, "scans") if scan.task == "WORK"]
    assert on(bag, "backplane") == on(whole, "backplane")


def test_locals_of_every_scan(tmp_path: Path) -> None:
    bag = recorded(tmp_path, RecordingOptions(split_ns=2 * NS_PER_S, tasks=frozenset({"SPEED"}), every_state=True), 5.0)
    after: dict[int, int] = {}
    for item in BagReader(bag).messages(topics={"/line1/scans", "/line1/states"}):
        if type(item.message).__name__ == "Scan":
            after[item.message.scan] = 0
        else:
            after[item.message.scan] += 1
    assert len(after) == 455 + 1
    assert min(after.values()) == 1
    (tmp_path / "again").mkdir()
    assert Reexecution(bag, tmp_path / "again").execute().states["SPEED"] == sum(after.values())


def test_a_writer_splits_when_told(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", options=StorageOptions(split_bytes=MIN_SPLIT_BYTES, compression="none")) as writer:
        writer.attach("note", "text/plain", b"abc")
        channel = writer.channel("/text", "std_msgs/msg/String", SCAN)
        splits = 0
        for index in range(40):
            if writer.split_due:
                writer.split()
                splits += 1
                assert not writer.split_due
            writer.write(channel, index * NS_PER_S, encode(String("x" * 10_000)))
        writer.write(writer.channel("/late", "std_msgs/msg/Int16", LATCHED), 40 * NS_PER_S, encode(Int16(1)))
    assert splits == len(files(tmp_path / "bag")) - 1 == 4
    for path in files(tmp_path / "bag"):
        assert [item.data for item in BagReader(path).attachments()] == [b"abc"]
        assert assert_mcap_reads(path)
    assert [item.stamp for item in BagReader(tmp_path / "bag").messages()] == [index * NS_PER_S for index in range(41)]
    with pytest.raises(RecordingError, match="AMX6802"):
        writer.split()


@pytest.mark.parametrize(
    "wrong", [{"compression": "zip"}, {"split_bytes": 100}, {"split_bytes": -1}, {"chunk_ns": 0}], ids=str
)
def test_storage_options_are_checked(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"compression|bytes|chunks"):
        StorageOptions(**wrong)
