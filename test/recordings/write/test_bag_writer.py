"""Recordings as others see them, and as bytes."""

from __future__ import annotations

import errno
import hashlib
import os
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.reader import make_reader
from mcap.records import ChunkIndex
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader as RosbagsReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.definitions import message_types
from automax_ros.messages.types.messages import Int16, String
from automax_ros.messages.types.topics import LATCHED, SCAN, VALUE
from automax_ros.recordings.mcap.errors import BagError, RecordingError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write import data_file
from automax_ros.recordings.write import writer as writer_module
from automax_ros.recordings.write.writer import BagWriter
from recordings.recordings import sample_recording

ROOT = Path(__file__).resolve().parents[3]
HALF = 500_000_000
INT16 = "std_msgs/msg/Int16"


def recorded_files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_a_recording_is_a_folder_with_two_files(tmp_path: Path) -> None:
    assert list(recorded_files(sample_recording(tmp_path / "a"))) == ["metadata.yaml", "scans_0.mcap"]


def test_folders_of_different_names_hold_the_same_bytes(tmp_path: Path) -> None:
    first = sample_recording(tmp_path / "first")
    second = sample_recording(tmp_path / "deep" / "down" / "another name")
    assert recorded_files(first) == recorded_files(second)


def test_hash_seed_and_time_zone_do_not_matter(tmp_path: Path) -> None:
    script = "import pathlib, sys; from recordings.recordings import sample_recording\n"
    script += "sample_recording(pathlib.Path(sys.argv[1]))"
    digests = set()
    for seed, zone in (("1", "UTC"), ("4711", "Asia/Tokyo")):
        folder = tmp_path / seed
        environment = {
            **os.environ,
            "PYTHONHASHSEED": seed,
            "TZ": zone,
            "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'test'}",
        }
        subprocess.run([sys.executable, "-c", script, str(folder)], check=True, env=environment, cwd=ROOT)
        digests.add(hashlib.sha256(repr(recorded_files(folder)).encode()).hexdigest())
    assert len(digests) == 1


def test_metadata_is_version_9(tmp_path: Path) -> None:
    folder = sample_recording(tmp_path / "a")
    information = yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    topics = information.pop("topics_with_message_count")
    span = {"starting_time": {"nanoseconds_since_epoch": 0}, "duration": {"nanoseconds": 454 * 5_500_000 + 2}}
    assert information == {
        "version": 9,
        "storage_identifier": "mcap",
        **span,
        "message_count": 2 + 3 * 454,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": ["scans_0.mcap"],
        "files": [{"path": "scans_0.mcap", **span, "message_count": 2 + 3 * 454}],
        "custom_data": {"program_hash": "a1b2", "step": "5500000"},
        "ros_distro": "jazzy",
    }
    counts = {topic["topic_metadata"]["name"]: topic["message_count"] for topic in topics}
    assert counts == {
        "/line1/variables": 1,
        "/line1/backplane/snapshot": 1,
        "/line1/backplane": 454,
        "/line1/scans": 454,
        "/line1/common/REF": 454,
    }
    scans = topics[3]["topic_metadata"]
    assert scans["type"] == "automax_msgs/msg/Scan"
    assert scans["serialization_format"] == "cdr"
    assert scans["type_description_hash"] == message_types()["automax_msgs/msg/Scan"].hash
    (qos,) = scans["offered_qos_profiles"]
    assert (qos["history"], qos["depth"], qos["reliability"], qos["durability"]) == (
        "keep_last",
        1000,
        "reliable",
        "volatile",
    )


def test_metadata_stands_in_the_mcap_file_too(tmp_path: Path) -> None:
    folder = sample_recording(tmp_path / "a")
    (record,) = BagReader(folder).metadata_records()
    assert record.name == "rosbag2"
    outside = yaml.safe_load((folder / "metadata.yaml").read_text())
    assert yaml.safe_load(record.metadata["serialized_metadata"]) == outside["rosbag2_bagfile_information"]


def test_rosbags_reads_every_message(tmp_path: Path) -> None:
    store = get_typestore(Stores.EMPTY)
    with RosbagsReader(sample_recording(tmp_path / "a")) as reader:
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            assert connection.digest == message_types()[connection.msgtype].hash
        read = [
            (connection.topic, time, store.deserialize_cdr(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]
        assert len(read) == reader.message_count == 2 + 3 * 454
        qos = {item.topic: item.ext.offered_qos_profiles[0] for item in reader.connections}
    assert qos["/line1/common/REF"].durability.name == "TRANSIENT_LOCAL"
    assert qos["/line1/scans"].depth == 1000
    topic, time, scan = read[-3]
    assert (topic, time, scan.task, scan.scan) == ("/line1/scans", 454 * 5_500_000, "SPEED", 454)
    assert list(scan.committed.value) == [453.0, 1.0]


def test_mcap_reads_it_with_checksums_summary_and_ros2_decoder(tmp_path: Path) -> None:
    folder = sample_recording(tmp_path / "a")
    with (folder / "scans_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header, summary = reader.get_header(), reader.get_summary()
        assert (header.profile, header.library.split()[0]) == ("ros2", "automax_ros")
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 2 + 3 * 454
        for channel in summary.channels.values():
            assert channel.message_encoding == "cdr"
            assert channel.metadata["topic_type_hash"].startswith("RIHS01_")
            assert yaml.safe_load(channel.metadata["offered_qos_profiles"])[0]["reliability"] == "reliable"
        assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
        (attachment,) = reader.iter_attachments()
        assert (attachment.name, attachment.data) == ("rack.yaml", b"rack: LINE1\n")
        decoded = [item.decoded_message for item in reader.iter_decoded_messages(topics=["/line1/common/REF"])]
        assert [item.data for item in decoded] == list(range(454))


def chunks_of(folder: Path) -> list[ChunkIndex]:
    with (folder / "scans_0.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return summary.chunk_indexes


def test_chunks_end_with_half_a_simulated_second(tmp_path: Path) -> None:
    chunks = chunks_of(sample_recording(tmp_path / "a", seconds=3.4))
    assert [chunk.message_start_time // HALF for chunk in chunks] == list(range(7))
    assert [chunk.message_end_time // HALF for chunk in chunks] == list(range(7))


def test_the_official_writer_would_write_the_same_bytes(tmp_path: Path) -> None:
    """Only the framing of messages is our own; here the package mcap frames the same messages."""
    ours = sample_recording(tmp_path / "a") / "scans_0.mcap"
    output = BytesIO()
    again = McapWriter(output, compression=CompressionType.ZSTD, enable_data_crcs=True)
    with ours.open("rb") as file:
        reader = make_reader(file)
        again.start(profile="ros2", library=reader.get_header().library)
        for item in reader.iter_attachments():
            again.add_attachment(item.create_time, item.log_time, item.name, item.media_type, item.data)
        summary = reader.get_summary()
        assert summary is not None
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            again.register_schema(schema.name, schema.encoding, schema.data)
            again.register_channel(channel.topic, "cdr", channel.schema_id, channel.metadata)
        half = 0
        for _, channel, message in reader.iter_messages():
            if message.log_time // HALF > half:
                again.flush()
                half = message.log_time // HALF
            again.add_message(channel.id, message.log_time, message.data, message.publish_time, message.sequence)
        again.flush()
        for record in reader.iter_metadata():
            again.add_metadata(record.name, record.metadata)
    again.finish()
    assert output.getvalue() == ours.read_bytes()


def test_an_instant_is_in_one_chunk(tmp_path: Path) -> None:
    """Whatever its size, and though its log times run over the second's end."""
    with BagWriter(tmp_path / "a") as writer:
        channel = writer.channel("/text", "std_msgs/msg/String", SCAN)
        for stamp in (0, 999_999_999, 1_000_000_005, 2_000_000_000):
            for _ in range(20):
                writer.write(channel, stamp, encode(String("x" * 100_000)))
    assert [chunk.message_start_time for chunk in chunks_of(tmp_path / "a")] == [
        0,
        999_999_999,
        1_000_000_019,
        2 * 10**9,
    ]


def test_a_huge_instant_does_not_make_a_chunk_too_long_to_read(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "a") as writer:
        channel = writer.channel("/text", "std_msgs/msg/String", SCAN)
        for _ in range(9):
            writer.write(channel, 5, encode(String("x" * (8 << 20))))
    assert (
        max(chunk.uncompressed_size for chunk in chunks_of(tmp_path / "a")) <= writer_module.LONGEST_CHUNK_BYTES + 4000
    )
    assert len(list(BagReader(tmp_path / "a").messages())) == 9


def test_sync_reaches_every_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[str] = []
    monkeypatch.setattr(os, "fsync", lambda number: synced.append(Path(f"/proc/self/fd/{number}").resolve().name))
    writer = BagWriter(tmp_path / "a")
    channel = writer.channel("/a", INT16, VALUE)
    writer.write(channel, 0, encode(Int16(1)))
    writer.sync()
    assert set(synced) == {"a", "scans_0.mcap"}
    writer.split()
    writer.write(channel, 1, encode(Int16(1)))
    synced.clear()
    writer.sync()
    assert set(synced) == {"a", "scans_0.mcap", "scans_1.mcap"}
    writer.close()
    synced.clear()
    writer.sync()
    assert set(synced) == {"a", "scans_1.mcap", "metadata.yaml"}


def test_chunks_end_by_size(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "a") as writer:
        channel = writer.channel("/text", "std_msgs/msg/String", SCAN)
        for index in range(50):
            writer.write(channel, index, encode(String("x" * 100_000)))
    sizes = [chunk.uncompressed_size for chunk in chunks_of(tmp_path / "a")]
    assert len(sizes) == 5
    assert all(size <= writer_module.CHUNK_BYTES + 110_000 for size in sizes)


def test_log_times_increase_and_stamps_are_kept(tmp_path: Path) -> None:
    stamps = [0, 0, 0, 5, 5, 6, 3, 1_000_000_000, 999_999_999, 1_000_000_002]
    with BagWriter(tmp_path / "a", custom_data={"version": "0.1.0"}) as writer:
        channel = writer.channel("/a", INT16, VALUE)
        for stamp in stamps:
            writer.write(channel, stamp, encode(Int16(1)))
    read = list(BagReader(tmp_path / "a").messages())
    assert [item.stamp for item in read] == stamps
    assert [item.log_time for item in read] == [0, 1, 2, 5, 6, 7, 8, 10**9, 10**9 + 1, 10**9 + 2]


def test_sequence_numbers_count_for_each_channel(tmp_path: Path) -> None:
    with (sample_recording(tmp_path / "a") / "scans_0.mcap").open("rb") as file:
        counts: dict[str, list[int]] = {}
        for _, channel, message in make_reader(file).iter_messages():
            counts.setdefault(channel.topic, []).append(message.sequence)
    assert counts["/line1/scans"] == counts["/line1/backplane"] == list(range(1, 455))
    assert counts["/line1/variables"] == [1]


def test_whole_chunks_are_on_disk_before_the_end(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "a")
    channel = writer.channel("/a", INT16, VALUE)
    for index in range(300):
        writer.write(channel, index * 10_000_000, encode(Int16(index)))
    writer.sync()
    assert read_until_cut(tmp_path / "a") == list(range(250))
    writer.close()
    assert len(list(BagReader(tmp_path / "a").messages())) == 300


def read_until_cut(folder: Path) -> list[int]:
    """The Int16 values that an unfinished recording holds."""
    messages = BagReader(folder / "scans_0.mcap").messages()
    read: list[int] = []
    try:
        read.extend(item.message[0] for item in messages)
    except BagError as error:
        assert error.code == "AMX6812"  # noqa: PT017  # what was read before counts too
        return read
    pytest.fail("the recording is finished")


def test_an_existing_folder_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    with pytest.raises(RecordingError, match=r"AMX6800.*exists already, not overwriting"):
        BagWriter(tmp_path / "a")
    assert list((tmp_path / "a").iterdir()) == []


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="AMX6801"):
        BagWriter(tmp_path / "file" / "a")


def test_an_exception_of_the_caller_still_finishes_the_recording(tmp_path: Path) -> None:
    def interrupted() -> None:
        with BagWriter(tmp_path / "a") as writer:
            writer.write(writer.channel("/a", INT16, VALUE), 5, encode(Int16(1)))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert [item.message for item in BagReader(tmp_path / "a").messages()] == [(1,)]


def test_a_full_disk_is_reported_and_keeps_whole_chunks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class FullDisk(data_file.FileIO):
        room = 3000

        def write(self, data: Any) -> int:
            if self.tell() + len(data) > self.room:
                if self.room == self.tell():
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                return super().write(data[: self.room - self.tell()])
            return super().write(data)

    monkeypatch.setattr(data_file, "FileIO", FullDisk)
    writer = BagWriter(tmp_path / "a")
    channel = writer.channel("/a", INT16, VALUE)

    def fill() -> None:
        for index in range(100_000):
            writer.write(channel, index * 10_000_000, encode(Int16(index % 30000)))

    with pytest.raises(RecordingError, match=r"AMX6801.*No space left on device"):
        fill()
    writer.close()
    read = read_until_cut(tmp_path / "a")
    assert read
    assert read == list(range(len(read)))
    assert len(read) % 50 == 0
    with pytest.raises(RecordingError, match="after the recording was closed"):
        writer.write(channel, 0, encode(Int16(1)))


def test_a_full_disk_at_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = BagWriter(tmp_path / "a")
    writer.write(writer.channel("/a", INT16, VALUE), 0, encode(Int16(1)))

    def refuse(*_: Any, **__: Any) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_text", refuse)
    with pytest.raises(RecordingError, match="AMX6801"):
        writer.close()
    writer.close()


@pytest.mark.parametrize("topic", ["", "a", "/", "/a/", "/a//b", "/1a", "/a b", "/ä", "/" + "x" * 250, "/a\n"])
def test_topics_are_full_ros_names(tmp_path: Path, topic: str) -> None:
    with BagWriter(tmp_path / "a") as writer, pytest.raises(RecordingError, match="AMX6802"):
        writer.channel(topic, INT16, VALUE)


def test_what_cannot_be_recorded_is_refused(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "a") as writer:
        channel = writer.channel("/a", INT16, VALUE)
        assert writer.channel("/a", INT16, VALUE) is channel
        for refused in (
            lambda: writer.channel("/a", "std_msgs/msg/Int32", VALUE),
            lambda: writer.channel("/a", INT16, SCAN),
            lambda: writer.channel("/b", "other_msgs/msg/Thing", LATCHED),
            lambda: writer.write(channel, -1, b""),
            lambda: writer.write(channel, writer_module.MAX_STAMP + 1, b""),
            lambda: writer.write(channel, 0, bytes(writer_module.MAX_PAYLOAD_BYTES + 1)),
            lambda: writer.attach("big", "text/plain", bytes(writer_module.MAX_PAYLOAD_BYTES + 1)),
        ):
            with pytest.raises(RecordingError, match="AMX6802"):
                refused()
    with pytest.raises(RecordingError, match="AMX6802"):
        writer.attach("late", "text/plain", b"")


def test_an_empty_recording_is_one(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "a"):
        pass
    assert list(BagReader(tmp_path / "a").messages()) == []
    with RosbagsReader(tmp_path / "a") as reader:
        assert reader.message_count == 0
        assert list(reader.messages()) == []
