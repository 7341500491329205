"""One word of soundness: what `bag info --check`, `bag repair` and `replay` say of a recording is the same."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from recordings.live_racks import build
from recordings.mutations import CHANGES, mutants

from automax_ros.cli.recordings.bag_info import as_data, lines_of
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.rack_files import files_of
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.repair.repairing import RepairReport, repair
from automax_ros.recordings.write.data_file import StorageOptions
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from automax_ros.recordings.write.writer import BagWriter
from automax_ros.replay.engine import replay
from automax_ros.replay.scans.stored_rack import SourceRefused
from replay.replays import recorded

WRITES = "automax_msgs/msg/CommonWrite"
EMPTY_RACK = (
    "rack: LINE1\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435, tick_ms: 5.5}\ncommon:\n  REF%: {ros: in}\n"
)


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    options = RecordingOptions(StorageOptions(chunk_ns=50 * NS_PER_MS))
    return recorded(tmp_path_factory.mktemp("small"), seconds=0.5, options=options)


def reordered(bag: Path, folder: Path, order: Any) -> Path:
    """The one file of a recording with its messages as ``order`` returns them: (topic, log time, bytes, stamp)."""
    folder.mkdir()
    shutil.copyfile(bag / "metadata.yaml", folder / "metadata.yaml")
    with (bag / "scans_0.mcap").open("rb") as source, (folder / "scans_0.mcap").open("wb") as stream:
        reader, writer = make_reader(source), McapWriter(stream)
        writer.start(profile="ros2")
        schemas: dict[int, int] = {}
        channels: dict[str, int] = {}
        found = []
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.topic not in channels:
                number = schemas[schema.id]
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", number, dict(channel.metadata))
            found.append((channel.topic, message.log_time, message.data, message.publish_time))
        for record in reader.iter_attachments():
            writer.add_attachment(0, 0, record.name, record.media_type, record.data)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for topic, log_time, data, stamp in order(found):
            writer.add_message(channels[topic], log_time, data, stamp)
        writer.finish()
    return folder


def checked(bag: Path) -> str:
    """What `bag info --check` says: the code of the first problem, empty where it is sound."""
    return next((problem.code for problem in bag_info(bag, check=True).problems), "")


def replayed(bag: Path) -> str:
    """What `replay` says: the code with which it refuses the recording, empty where it does not."""
    try:
        replay(bag)
    except BagError as error:
        return error.code
    return ""


def left(report: RepairReport) -> str:
    return "" if report.left is None else report.left.code


def swapped_times(found: list[Any]) -> list[Any]:
    one, two = found[100], found[101]
    return [*found[:100], (one[0], two[1], *one[2:]), (two[0], one[1], *two[2:]), *found[102:]]


def equal_times(found: list[Any]) -> list[Any]:
    return [*found[:101], (found[101][0], found[100][1], *found[101][2:]), *found[102:]]


def write_twice(found: list[Any]) -> list[Any]:
    places = [number for number, item in enumerate(found) if number > 100 and item[0].endswith("/backplane")]
    place = next(number for number in places if found[number + 1][1] > found[number][1] + 1)
    again = (found[place][0], found[place][1] + 1, *found[place][2:])
    assert found[place + 1][1] > again[1]
    return [*found[: place + 1], again, *found[place + 1 :]]


def shared_order(found: list[Any]) -> list[Any]:
    """A part of the recording stands a second time."""
    return [*found[:200], *found[150:]]


@pytest.mark.parametrize("order", [swapped_times, equal_times, write_twice, shared_order])
def test_what_stands_out_of_order_is_no_sound_recording_until_it_is_repaired(bag, tmp_path, order):
    odd = reordered(bag, tmp_path / "odd", order)
    assert checked(odd) == replayed(odd) == "AMX6813"
    (problem,) = bag_info(odd, check=True).problems
    assert "bag repair" in problem.hint
    report = repair(odd, tmp_path / "new")
    assert not report.sound
    assert "do not follow" in report.files[0].damage[0]
    assert left(report) == checked(tmp_path / "new")
    assert checked(tmp_path / "new") in {"", "AMX6823"}, "a write that was out of order is missing now"
    assert replayed(tmp_path / "new") == ""
    assert repair(tmp_path / "new").sound


def test_equal_log_times_are_told_as_that(bag, tmp_path):
    (problem,) = bag_info(reordered(bag, tmp_path / "odd", equal_times), check=True).problems
    assert problem.message.startswith("two messages have the log time")


def test_a_sound_recording_is_sound_for_all(bag):
    assert checked(bag) == replayed(bag) == left(repair(bag)) == ""
    assert repair(bag).sound


def empty_recording(folder: Path, of: str) -> Path:
    """A recording of a rack without tasks, of one that was never activated, or one without a message."""
    rack = build(folder) if of == "never activated" else build(folder, EMPTY_RACK)
    if of == "nothing":
        facts = {"rack": rack.config.name, "version": "0.1.0", "fingerprint": f"{rack.fingerprint:016x}"}
        writer = BagWriter(folder / "bag", custom_data=facts)
        for file in files_of(rack):
            writer.attach(file.name, file.media_type, file.data)
        writer.close()
        return folder / "bag"
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, folder / "bag")
    if of == "no tasks":
        stream.begin()
        rack.start()
        rack.run(0.1)
        stream.end()
    recorder.close()
    return folder / "bag"


@pytest.mark.parametrize(
    ("of", "code"), [("no tasks", "AMX6832"), ("never activated", "AMX6832"), ("nothing", "AMX6820")]
)
def test_what_replay_refuses_is_not_called_sound(tmp_path, of, code):
    bag = empty_recording(tmp_path, of)
    assert checked(bag) == replayed(bag) == code
    report = repair(bag, tmp_path / "new")
    assert left(report) == checked(tmp_path / "new") == code


def test_gaps_are_told_with_the_verdict(bag, tmp_path):
    """An image makes up for writes that did not come: sound, but not without a gap."""
    sound = lines_of(as_data(bag_info(bag, check=True), {}, checked=True))
    assert sound[-1] == "sound: every message decoded, no gap in the write log"
    info = bag_info(bag, check=True)
    info.custom_data = {**info.custom_data, "gaps": "1: 0.010000 s: 345 writes of common memory"}
    for is_checked in (True, False):
        text = "\n".join(lines_of(as_data(info, {}, checked=is_checked)))
        assert "no gap" not in text
        assert "sound, with gaps" in text
        assert "345 writes" in text.rpartition("sound, with gaps")[2]


def test_a_gap_before_an_image_is_found(bag, tmp_path):
    def without_some(found: list[Any]) -> list[Any]:
        images = [number for number, item in enumerate(found) if item[0].endswith("/snapshot")]
        writes = [n for n, item in enumerate(found) if item[0].endswith("/backplane") and images[0] < n < images[-1]]
        return [item for number, item in enumerate(found) if number not in writes[-3:]]

    image = recorded(tmp_path / "long", seconds=11.0)
    gappy = reordered(image, tmp_path / "gappy", without_some)
    info = bag_info(gappy, check=True)
    assert info.problems == []
    assert len(info.gaps) == 1
    assert "missing before" in info.gaps[0]


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("seed", "rounds"), [(1, 3), *(pytest.param(seed, 6, marks=pytest.mark.soak) for seed in (2, 3))]
)
def test_whatever_repair_writes_check_and_replay_agree_with_it(bag, tmp_path, seed, rounds):
    agreed = {"": 0}
    for number, (what, data, text) in enumerate(mutants(bag, rounds * len(CHANGES), seed)):
        if "bomb" in what:
            continue
        folder, new = tmp_path / f"mutant_{number}", tmp_path / f"repaired_{number}"
        folder.mkdir()
        (folder / "scans_0.mcap").write_bytes(data)
        (folder / "metadata.yaml").write_bytes(text)
        try:
            report = repair(folder, new)
        except BagError:
            continue  # nothing of it can be used
        verdict = checked(new)
        assert verdict == left(report), what
        assert repair(new).sound, what
        if report.sound:
            assert checked(folder) == verdict, what
        try:
            said = replayed(new)
        except SourceRefused:  # a source stored inside was changed
            continue
        assert verdict or said in {"", "AMX6830", "AMX6831", "AMX6833"}, f"{what}: sound, and replay says {said}"
        agreed[verdict] = agreed.get(verdict, 0) + 1
        shutil.rmtree(folder)
        shutil.rmtree(new)
    assert agreed[""] > 20, agreed
