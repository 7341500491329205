"""Repair of recordings that were cut or damaged: what was whole comes back, what was lost is told."""

from __future__ import annotations

import random
import shutil
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.data_stream import ReadDataStream
from mcap.reader import make_reader
from mcap.records import Chunk
from replay.reexecution import Reexecution

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import NAMES, CommonWrite, Int16, Scan, String, Values
from automax_ros.messages.types.topics import LATCHED, VALUE
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.mcap.errors import BagError, RecordingError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.repair.contents import SCAN, WRITE
from automax_ros.recordings.repair.repairing import repair
from automax_ros.recordings.repair.rewriting import FoundScan, kept
from automax_ros.recordings.write.data_file import COMPRESSIONS, StorageOptions
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.recordings.write.writer import BagWriter
from recordings.mutations import HEAD, chunk_record, record_places
from recordings.others import assert_mcap_reads, rosbags_messages
from recordings.recordings import TABLE, image_of, record, write_of
from recordings.write.test_bag_split import files, recorded


def messages(path: Path) -> list[Any]:
    return list(BagReader(path).messages())


def whole_scans(path: Path) -> int:
    """Return the number of scans, each of which must be followed by its writes."""
    missing, count = 0, 0
    for item in BagReader(path).messages(types={SCAN, WRITE}):
        if isinstance(item.message, Scan):
            assert missing == 0, "a scan without the writes that it made"
            missing = len(item.message.written.variable) + len(item.message.committed.variable)
            count += 1
        elif item.message.kind != 3:
            missing -= len(item.message.values.variable)
    assert missing == 0, "the last scan lacks writes"
    return count


def assert_others_read(bag: Path) -> None:
    """Let other programs read a repaired recording, and our own."""
    count = sum(assert_mcap_reads(path) for path in files(bag))
    assert len(rosbags_messages(bag)) == len(messages(bag)) == count
    assert repair(bag).sound


@pytest.fixture(scope="module", params=COMPRESSIONS)
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 7 s in each compression."""
    storage = StorageOptions(compression=request.param)
    return recorded(tmp_path_factory.mktemp("sound"), RecordingOptions(storage))


@pytest.fixture(scope="module")
def split(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("split"), RecordingOptions(split_ns=2 * NS_PER_S))


def cut(bag: Path, target: Path, size: int) -> Path:
    """A recording that broke off: no metadata.yaml, the file cut."""
    target.mkdir()
    (target / "scans_0.mcap").write_bytes((bag / "scans_0.mcap").read_bytes()[:size])
    return target


def compressed(data: bytes | bytearray) -> bool:
    return b"zstd" in data or b"lz4" in data


def chunk_places(file: Path) -> list[tuple[int, int, int]]:
    """Begin and end of each chunk, and its last log time."""
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return [
        (item.chunk_start_offset, item.chunk_start_offset + item.chunk_length, item.message_end_time)
        for item in summary.chunk_indexes
    ]


def test_a_sound_recording_is_left_alone(bag: Path, tmp_path: Path) -> None:
    copy = tmp_path / "bag"
    shutil.copytree(bag, copy)
    report = repair(copy)
    assert report.sound
    assert report.output is None
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]
    assert report.files[0].contents.messages == len(messages(bag))


def test_a_sound_recording_is_copied_if_wanted(bag: Path, tmp_path: Path) -> None:
    report = repair(bag, tmp_path / "copy")
    assert report.sound
    assert {path.name: path.read_bytes() for path in (tmp_path / "copy").iterdir()} == {
        path.name: path.read_bytes() for path in bag.iterdir()
    }


def test_wherever_it_is_cut_every_whole_chunk_comes_back(bag: Path, tmp_path: Path) -> None:
    data = (bag / "scans_0.mcap").read_bytes()
    before = messages(bag)
    places = chunk_places(bag / "scans_0.mcap")
    chance = random.Random(4711)
    sizes = [place + step for begin, end, _ in places[2:3] for place in (begin, end) for step in (-1, 0, 1, 9)]
    sizes += [chance.randrange(places[0][1], len(data)) for _ in range(4)] + [len(data) - 1]
    for size in sizes:
        broken = cut(bag, tmp_path / f"cut{size}", size)
        original = (broken / "scans_0.mcap").read_bytes()
        report = repair(broken)
        assert not report.sound
        assert (broken / "scans_0.mcap").read_bytes() == original
        assert report.output == tmp_path / f"cut{size}_repaired"
        after = messages(report.output)
        whole = max((end for _, edge, end in places if edge <= size), default=0)
        assert after == before[: len(after)]
        assert after[-1].log_time >= whole
        assert report.last_stamp == max(item.stamp for item in after)
        assert whole_scans(report.output) == report.files[0].contents.scans
    assert_others_read(report.output)


def test_what_stands_of_the_last_chunk_is_saved(tmp_path: Path) -> None:
    """Without compression all whole instants of a cut chunk come back, and nothing of the cut one."""
    bag = recorded(tmp_path, RecordingOptions(StorageOptions(compression="none", chunk_ns=NS_PER_S)), 3.0)
    begin, end, _ = chunk_places(bag / "scans_0.mcap")[2]
    broken = cut(bag, tmp_path / "broken", (begin + end) // 2)
    report = repair(broken)
    assert report.output is not None
    after = messages(report.output)
    assert 2.3 * NS_PER_S < after[-1].stamp < 2.7 * NS_PER_S
    following = messages(bag)[len(after)]
    assert following.stamp > after[-1].stamp, "an instant is kept wholly or not at all"
    assert report.files[0].dropped_messages > 0
    assert report.files[0].lost_chunks == 1


def test_the_repaired_recording_executes_again(bag: Path, tmp_path: Path) -> None:
    broken = cut(bag, tmp_path / "broken", (bag / "scans_0.mcap").stat().st_size * 2 // 3)
    repair(broken)
    (tmp_path / "again").mkdir()
    outcome = Reexecution(tmp_path / "broken_repaired", tmp_path / "again").execute()
    assert min(outcome.scans.values()) > 100


def test_provenance_is_found_again(bag: Path, tmp_path: Path) -> None:
    broken = cut(bag, tmp_path / "broken", 3 * (bag / "scans_0.mcap").stat().st_size // 4)
    repair(broken)
    told, found = BagReader(bag).custom_data, BagReader(tmp_path / "broken_repaired").custom_data
    assert found == {"rack": "LINE1", "fingerprint": told["fingerprint"], "repaired": "automax bag repair"}
    old, new = (
        yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
        for folder in (bag, tmp_path / "broken_repaired")
    )
    assert [topic["topic_metadata"] for topic in new["topics_with_message_count"]] == [
        topic["topic_metadata"] for topic in old["topics_with_message_count"]
    ]


def test_missing_metadata_is_made_anew(split: Path, tmp_path: Path) -> None:
    copy = tmp_path / "bag"
    shutil.copytree(split, copy)
    (copy / "metadata.yaml").unlink()
    report = repair(copy)
    assert report.problems == ["has no metadata.yaml"]
    old, new = (yaml.safe_load((folder / "metadata.yaml").read_text()) for folder in (split, tmp_path / "bag_repaired"))
    assert new["rosbag2_bagfile_information"]["custom_data"].pop("repaired")
    assert new == old
    for path in files(split):
        assert (tmp_path / "bag_repaired" / path.name).read_bytes() == path.read_bytes()


def test_a_missing_file_is_told_with_its_gap(split: Path, tmp_path: Path) -> None:
    for listed in (True, False):
        copy = tmp_path / f"bag{listed}"
        shutil.copytree(split, copy)
        (copy / "scans_1.mcap").unlink()
        if not listed:
            (copy / "metadata.yaml").unlink()
        report = repair(copy)
        assert "scans_1.mcap is missing" in report.problems
        assert any("s are missing between scans_0.mcap and scans_2.mcap" in text for text in report.problems)
        assert report.output is not None
        assert_others_read(report.output)


def test_a_killed_recording_of_several_files(split: Path, tmp_path: Path) -> None:
    copy = tmp_path / "bag"
    shutil.copytree(split, copy)
    (copy / "metadata.yaml").unlink()
    last = files(copy)[-1]
    last.write_bytes(last.read_bytes()[:200])
    (copy / "scans_9.mcap").write_bytes(b"")
    report = repair(copy)
    assert [file.sound for file in report.files] == [True, True, True, False, False]
    assert [file.usable for file in report.files] == [True, True, True, False, False]
    assert report.output is not None
    assert [path.name for path in files(report.output)] == ["scans_0.mcap", "scans_1.mcap", "scans_2.mcap"]
    assert_others_read(report.output)


def test_a_damaged_chunk_costs_itself_only(bag: Path, tmp_path: Path) -> None:
    places = chunk_places(bag / "scans_0.mcap")
    begin, end, _ = places[2]
    data = bytearray((bag / "scans_0.mcap").read_bytes())
    data[(begin + end) // 2] ^= 0xFF
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "scans_0.mcap").write_bytes(data)
    report = repair(tmp_path / "bag")
    lost = [item for item in messages(bag) if places[1][2] < item.log_time <= places[2][2]]
    assert report.output is not None
    after = messages(report.output)
    assert [item for item in messages(bag) if item not in lost] == after
    assert report.files[0].lost_chunks == 1
    assert_others_read(report.output)


def test_a_lying_length_costs_one_chunk(bag: Path, tmp_path: Path) -> None:
    """Records cannot be told apart after it; the next compressed chunk is found again."""
    places = chunk_places(bag / "scans_0.mcap")
    data = bytearray((bag / "scans_0.mcap").read_bytes())
    data[places[2][0] + 6] = 0x7F
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "scans_0.mcap").write_bytes(data)
    report = repair(tmp_path / "bag")
    assert report.output is not None
    after = messages(report.output)
    if compressed(data):
        assert after == messages(bag), "even the chunk itself is found to be whole"
    else:
        assert after == [item for item in messages(bag) if item.log_time <= places[2][2]]


def test_definitions_come_from_the_summary(bag: Path, tmp_path: Path) -> None:
    """The first chunk holds all definitions; without it those at the end of the file serve."""
    _, end, last = chunk_places(bag / "scans_0.mcap")[0]
    data = bytearray((bag / "scans_0.mcap").read_bytes())
    data[end - 100] ^= 0xFF
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "scans_0.mcap").write_bytes(data)
    report = repair(tmp_path / "bag")
    assert report.output is not None
    assert messages(report.output) == [item for item in messages(bag) if item.log_time > last]
    assert_others_read(report.output)


def test_a_single_file(bag: Path, tmp_path: Path) -> None:
    single = tmp_path / "scans_0.mcap"
    single.write_bytes((bag / "scans_0.mcap").read_bytes()[:-20])
    report = repair(single)
    assert report.output == tmp_path / "scans_0_repaired"
    assert messages(report.output) == messages(bag)
    assert repair(bag / "scans_0.mcap").sound


def test_the_recording_s_own_folder_is_not_written_into(split: Path, tmp_path: Path, monkeypatch: Any) -> None:
    copy = tmp_path / "bag"
    shutil.copytree(split, copy)
    for bag in (copy, copy / "scans_1.mcap"):
        for output in (copy / "new", copy / "some" / "new", tmp_path / "none" / ".." / "bag" / "new"):
            with pytest.raises(RecordingError, match=r"AMX6824[\s\S]*lies inside .* the recording itself"):
                repair(bag, output)
    before = sorted(path.name for path in copy.iterdir())
    damaged = copy / "scans_1.mcap"
    damaged.write_bytes(damaged.read_bytes()[:-20])
    assert repair(damaged).output == tmp_path / "bag_scans_1_repaired"
    shutil.rmtree(tmp_path / "bag_scans_1_repaired")
    monkeypatch.chdir(copy)
    assert repair(Path("scans_1.mcap")).output == tmp_path / "bag_scans_1_repaired"
    assert sorted(path.name for path in copy.iterdir()) == before


def test_foreign_recordings_are_repaired_too(tmp_path: Path) -> None:
    """Of others' topics every message that is whole is kept: they have no instants."""
    with BagWriter(tmp_path / "foreign", options=StorageOptions(compression="none")) as writer:
        channel = writer.channel("/chatter", "std_msgs/msg/String", VALUE)
        for index in range(100):
            writer.write(channel, 5, encode(String(f"number {index}")))
    data = (tmp_path / "foreign" / "scans_0.mcap").read_bytes()
    place = data.index(b"number 57")
    data = data.replace(b"chatter", b"gossip1")  # no matter, but not ours
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "other_0.mcap").write_bytes(data[:place])
    report = repair(broken)
    assert report.output is not None
    assert [item.message.data for item in messages(report.output)] == [f"number {index}" for index in range(57)]
    assert [path.name for path in files(report.output)] == ["other_0.mcap"]
    assert_others_read(report.output)


def test_a_private_record_inside_a_chunk_costs_nothing(tmp_path: Path) -> None:
    """Readers pass over records that they do not know, and so does the repair."""
    bag = recorded(tmp_path, RecordingOptions(StorageOptions(compression="none", chunk_ns=NS_PER_S)), 3.0)
    data = (bag / "scans_0.mcap").read_bytes()
    begin, end, _ = chunk_places(bag / "scans_0.mcap")[1]
    chunk = Chunk.read(ReadDataStream(BytesIO(data[begin + HEAD.size : end])))
    _, place, _ = record_places(chunk.data, 0)[5]
    inner = chunk.data[:place] + HEAD.pack(0x80, 3) + b"own" + chunk.data[place:]
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "scans_0.mcap").write_bytes(
        data[:begin] + chunk_record("", inner, len(inner)) + data[end:-20]
    )
    report = repair(tmp_path / "broken")
    assert report.output is not None
    assert messages(report.output) == messages(bag)


def scan(stamp: int, committed: int) -> FoundScan:
    values = Values((1,) * committed, (0,) * committed, (1.0,) * committed)
    return FoundScan(1, 1, stamp, stamp, encode(Scan(stamp, 1, "A", 1, committed=values)))


def write(stamp: int, count: int) -> FoundScan:
    values = Values((1,) * count, (0,) * count, (1.0,) * count)
    return FoundScan(2, 1, stamp, stamp, encode(CommonWrite(stamp, 1, 1, 1, 1, 1, values)))


VALUE_MESSAGE = FoundScan(3, 1, 9, 9, encode(Int16(1)))
TYPES = {1: SCAN, 2: WRITE, 3: "std_msgs/msg/Int16"}


@pytest.mark.parametrize(
    ("found", "cut_inside", "count"),
    [
        ([scan(1, 2), write(1, 2)], False, 2),
        ([scan(1, 2), write(1, 1)], False, 0),
        ([scan(1, 2)], False, 0),
        ([scan(1, 0)], False, 1),
        ([scan(1, 1), write(1, 1), scan(9, 3), write(9, 1), write(9, 1)], False, 2),
        ([scan(1, 1), write(1, 1), scan(9, 3), write(9, 3), VALUE_MESSAGE], False, 5),
        ([scan(1, 1), write(1, 1), scan(9, 3), write(9, 3), VALUE_MESSAGE], True, 2),
        ([scan(1, 1), write(1, 1), scan(9, 1), write(9, 1)], True, 2),
        ([VALUE_MESSAGE, VALUE_MESSAGE], True, 2),
        ([scan(1, 1), write(1, 1), FoundScan(1, 1, 2, 2, b"\0\1\0\0")], False, 2),
        ([], True, 0),
    ],
)
def test_only_whole_instants_are_kept(found: list[FoundScan], cut_inside: bool, count: int) -> None:
    assert kept(found, lambda channel: TYPES[channel], cut=cut_inside) == count


def test_what_cannot_be_repaired(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(BagError, match="AMX6810"):
        repair(tmp_path / "nothing")
    (tmp_path / "empty").mkdir()
    with pytest.raises(BagError, match=r"AMX6810.*no \.mcap file"):
        repair(tmp_path / "empty")
    (tmp_path / "text.mcap").write_text("this is a text")
    with pytest.raises(BagError, match="AMX6810"):
        repair(tmp_path / "text.mcap")
    with pytest.raises(BagError, match="AMX6817"):
        repair(cut(bag, tmp_path / "early", 300))
    assert not (tmp_path / "early_repaired").exists()


def test_an_existing_folder_is_not_written_into(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="AMX6800"):
        repair(bag, tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="AMX6801"):
        repair(bag, tmp_path / "file" / "new")


def test_progress_is_told(split: Path, tmp_path: Path) -> None:
    shares: list[float] = []
    repair(split, tmp_path / "copy", shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def malformed(bag: Path) -> Path:
    """A recording with right checksums in which a scan and a value are cut short."""
    table, image = ("/line1/variables", TABLE), ("/line1/backplane/snapshot", image_of(0, 0, {(0, 0): 0}))
    with BagWriter(bag) as writer:
        for topic, message in (table, image):
            writer.write(writer.channel(topic, NAMES[type(message)], LATCHED), 0, encode(message))
        scans = writer.channel("/line1/scans", NAMES[Scan], VALUE)
        value = writer.channel("/line1/common/REF", NAMES[Int16], VALUE)
        for number in range(10):
            stamp = (number + 1) * 5_500_000
            payload = encode(Scan(stamp, 1, "SPEED", number))
            writer.write(scans, stamp, payload[:-6] if number == 4 else payload)
            writer.write(value, stamp, encode(Int16(number))[: 5 if number == 7 else None])
    return bag


def test_repair_and_info_agree_on_malformed_messages(tmp_path: Path) -> None:
    bag = malformed(tmp_path / "bag")
    (problem,) = bag_info(bag, check=True).problems
    assert "bag repair" in problem.hint
    report = repair(bag)
    assert not report.sound
    assert report.files[0].damage[0].startswith("malformed messages: 2, the first on /line1/scans at 27500000 ns")
    assert (report.files[0].dropped_messages, report.files[0].dropped_scans) == (2, 1)
    repaired = tmp_path / "bag_repaired"
    assert len(messages(repaired)) == 2 + 18
    assert repair(repaired).sound
    assert bag_info(repaired, check=True).problems == []


def test_what_repair_leaves_alone_info_does_not_send_there(tmp_path: Path) -> None:
    writes = [("/line1/backplane", write_of(number, number, {(0, 0): number})) for number in (1, 2, 5)]
    bag = record(tmp_path / "bag", [("/line1/variables", TABLE), *writes])
    (problem,) = bag_info(bag, check=True).problems
    assert problem.code == "AMX6823"
    assert "repair" not in problem.hint
    assert repair(bag).sound


def test_a_repaired_bag_of_many_topics_can_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("read.information", "repair.repairing"):  # the real limit takes 20,000 topics
        monkeypatch.setattr(f"automax_ros.recordings.{module}.MAX_METADATA_BYTES", 1 << 15)
    bag = tmp_path / "bag"
    with BagWriter(bag) as writer:
        for number in range(150):
            writer.write(writer.channel(f"/line1/common/NUMBER_{number}", NAMES[Int16], VALUE), 1, encode(Int16(1)))
    (bag / "metadata.yaml").unlink()
    report = repair(bag)
    assert "of 150 topics" in report.problems[-1]
    assert bag_info(tmp_path / "bag_repaired").problems == []
    assert len(messages(tmp_path / "bag_repaired")) == 150
