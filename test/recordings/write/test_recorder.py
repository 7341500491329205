"""Recordings of whole runs: complete, repeatable, readable by others, and enough to execute every scan again."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from rack.helpers import config_at
from replay.reexecution import Reexecution
from replay.replays import record
from rosbags.rosbag2 import Reader as RosbagsReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import automax_ros
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack
from automax_ros.recordings.mcap.errors import BagError, RecordingError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.soundness import verdict_of
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.engine import replay
from recordings.live_racks import SPEED, WORK, YAML, build

ROOT = Path(__file__).parents[3]


def play(rack: Rack, number: int) -> None:
    """Be a busy plant: every value changes, errors come and go, tunables are set."""
    rack.write("REF%", (number * 7919) % 65536 - 32768)
    rack.write("GAIN", (number - 10) * 1.1e17)
    rack.write("RUN@", number % 3 == 1)
    rack.write("NOTE$", ["", "ready", "Grüße", "12345678"][number % 4])
    table = rack.memory.view("TABLE%")
    rack.write_view(table, [(element, number * 10 + element - 90) for element in range(6)], 1)
    if number % 5 == 4:
        rack.tune(rack.task("SPEED"), "TRIM%", number % 10)


def files(bag: Path) -> dict[str, bytes]:
    return {item.name: item.read_bytes() for item in sorted(bag.iterdir())}


@pytest.fixture(scope="module")
def busy(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("busy")
    return record(build(folder), folder / "bag", play, seconds=25.0)


def test_every_scan_executes_again_to_the_same_result(busy, tmp_path):
    outcome = Reexecution(busy, tmp_path).execute()
    assert outcome.scans == {"SPEED": 2273 + 1, "WORK": 2500 + 1}
    # at the start, after the first scan of each of three periods, at the end; and after each of four tunings
    assert outcome.states == {"SPEED": 5 + 4, "WORK": 5}


def test_reexecution_notices_another_program(busy, tmp_path, monkeypatch):
    """The test above can fail: with a task that differs in one constant it does."""
    changed = SPEED.replace("LIMIT_PLUS=1000", "LIMIT_PLUS=90")
    original = BagReader.attachments

    def attachments(self: BagReader) -> Any:
        for item in original(self):
            if item.name == "SPEED.BLK":
                item.data = changed.encode()
            yield item

    monkeypatch.setattr(BagReader, "attachments", attachments)
    again = Reexecution(busy, tmp_path)
    monkeypatch.setattr(again, "_state", lambda _: None)
    with pytest.raises(AssertionError):
        again.execute()


def test_example_rack_executes_again(tmp_path):
    config = config_at(ROOT / "config" / "section_drive" / "rack.yaml")
    bag = record(Rack(config), tmp_path / "bag", seconds=12.0)
    (tmp_path / "again").mkdir()
    outcome = Reexecution(bag, tmp_path / "again").execute()
    assert set(outcome.scans) == {task.name for module in config.task_modules for task in module.tasks}
    assert min(outcome.scans.values()) > 200


def test_stop_all_is_recorded_to_the_end(tmp_path):
    rack = build(tmp_path, SPEED=SPEED.replace("LAST% = LAST% / NIL%", "140"))
    bag = record(rack, tmp_path / "bag", lambda made, number: made.write("RUN@", number == 3), seconds=1.0)
    assert rack.stop_reason is not None
    scans = [item.message for item in BagReader(bag).messages(topics={"/line1/scans"})]
    (last,) = (scan for scan in scans if scan.errors)
    assert (last.task, last.errors[0].line) == ("SPEED", 140)
    (tmp_path / "again").mkdir()
    assert Reexecution(bag, tmp_path / "again").execute().scans["SPEED"] > 1


def test_same_run_gives_the_same_bytes_in_any_folder(tmp_path):
    bags = []
    for name in ("one", "a much longer name"):
        folder = tmp_path / name
        folder.mkdir()
        bags.append(files(record(build(folder), folder / f"bag of {name}", play, seconds=2.0)))
    assert bags[0] == bags[1]
    assert set(bags[0]) == {"metadata.yaml", "scans_0.mcap"}


def test_sources_and_provenance_are_inside(busy):
    reader = BagReader(busy)
    stored = {item.name: item.data.decode() for item in reader.attachments()}
    assert stored == {"rack.yaml": YAML, "SPEED.BLK": SPEED, "WORK.BLK": WORK}
    assert set(reader.custom_data) == {"rack", "version", "fingerprint"}
    assert reader.custom_data["rack"] == "LINE1"
    assert reader.custom_data["version"] == automax_ros.__version__


def test_log_times_increase_and_stamps_are_rack_time(busy):
    with (busy / "scans_0.mcap").open("rb") as file:
        times = [(message.log_time, message.publish_time) for _, _, message in make_reader(file).iter_messages()]
    logged = [log for log, _ in times]
    assert all(after > before for before, after in pairwise(logged))
    assert max(log - sent for log, sent in times) < 1_000, "log times stay within a microsecond of the instant"


def test_rosbags_reads_every_message(busy):
    store = get_typestore(Stores.ROS2_JAZZY)
    for path in sorted((ROOT / "msg_defs" / "msg").glob("*.msg")):
        store.register(get_types_from_msg(path.read_text(), f"automax_msgs/msg/{path.stem}"))
    counts: dict[str, int] = {}
    with RosbagsReader(busy) as reader:
        for connection, _, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
        assert sum(counts.values()) == reader.message_count
        assert reader.duration < 25.000001 * 1e9
    assert message is not None
    assert counts["/line1/scans"] == 2273 + 1 + 2500 + 1
    assert counts["/line1/variables"] == 1
    assert counts["/line1/common/REF"] == 1 + 1 + 20
    mine: dict[str, int] = {}
    for item in BagReader(busy).messages():
        mine[item.topic] = mine.get(item.topic, 0) + 1
    assert mine == counts


def test_write_log_gives_the_final_memory(tmp_path):
    rack = build(tmp_path)
    bag = record(rack, tmp_path / "bag", play, seconds=11.0)
    writes = [item.message for item in BagReader(bag).messages(topics={"/line1/backplane"})]
    images = [item.message for item in BagReader(bag).messages(topics={"/line1/backplane/snapshot"})]
    assert [write.sequence for write in writes] == list(range(1, len(writes) + 1))
    final = {(view, element): value for view, element, value in rack.memory.image() if not isinstance(value, str)}
    for image in images:
        keys = zip(image.values.variable, image.values.element, strict=True)
        memory = dict(zip(keys, image.values.value, strict=True))
        for write in writes[image.sequence :]:
            keys = zip(write.values.variable, write.values.element, strict=True)
            memory.update(zip(keys, write.values.value, strict=True))
        assert {key: memory[key] for key in final} == final


def test_the_recording_of_a_rack_that_never_started_is_readable(tmp_path):
    """Ctrl-C between two lines of the start: the bag has the rack's table, memory and sources, and no scan."""
    rack = build(tmp_path)
    recorder = Recorder(rack, RackStream(rack, rack.fingerprint), tmp_path / "bag")
    recorder.close()
    assert (recorder.has_tasks, recorder.scans) == (True, 0)
    reader = BagReader(tmp_path / "bag")
    names = [type(entry.message).__name__ for entry in reader.messages()]
    assert names[:2] == ["VariableTable", "CommonImage"]
    assert "Scan" not in names
    fault = verdict_of(reader).fault
    assert fault is not None
    assert fault.code == "AMX6832"
    with pytest.raises(BagError, match="AMX6832"):
        replay(tmp_path / "bag")


def test_what_tasks_do_before_their_first_scan_counts_as_a_scan(tmp_path):
    """A chance failure: of a run that ended after it the program said that nothing can be replayed."""
    rack = build(tmp_path)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()
    stream.end()
    recorder.close()
    assert not any(item.scans for item in rack.statistics.values())
    assert recorder.scans == len(rack.tasks) == 2
    assert verdict_of(BagReader(tmp_path / "bag")).fault is None
    assert replay(tmp_path / "bag").identical


def test_existing_folder_is_refused(tmp_path):
    rack = build(tmp_path)
    with pytest.raises(RecordingError, match="AMX6800"):
        Recorder(rack, RackStream(rack, 1), tmp_path)


def test_full_disk_ends_the_recording_and_not_the_rack(tmp_path, monkeypatch):
    from automax_ros.recordings.write import writer

    rack = build(tmp_path)
    stream = RackStream(rack, 1)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()
    rack.run(2.0)

    def refuse(_: Any, __: bytes) -> int:
        raise OSError(28, "full")

    monkeypatch.setattr(writer.DataFile, "write", refuse)
    rack.run(3.0)
    assert recorder.failure is not None
    assert "full" in str(recorder.failure)
    assert rack.statistics["SPEED"].scans == 455
    stream.end()
    recorder.close()
