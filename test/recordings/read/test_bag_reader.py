"""Reading back, and reading what no recorder wrote."""

from __future__ import annotations

import contextlib
import os
import random
import struct
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lz4.frame
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from soaking import in_soak

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.definitions import schema_text
from automax_ros.messages.types.messages import CommonWrite, Int16, VariableTable
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.mcap import mcap_file
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.information import MAX_METADATA_BYTES
from automax_ros.recordings.read.playback import survey
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.repair.repairing import repair
from recordings.recordings import TABLE, sample_recording

INT16 = "std_msgs/msg/Int16"
MAGIC = b"\x89MCAP0\r\n"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return sample_recording(tmp_path_factory.mktemp("bags") / "sample", seconds=1.2)


def data_of(folder: Path) -> bytes:
    return (folder / "scans_0.mcap").read_bytes()


def read_all(path: Path) -> list[Any]:
    """Everything that a reader can give."""
    reader = BagReader(path)
    return [*reader.messages(), *reader.attachments(), *reader.metadata_records()]


def read_bytes(folder: Path, data: bytes) -> list[Any]:
    path = folder / "mutant.mcap"
    path.write_bytes(data)
    return read_all(path)


def refused(code: str, action: Callable[[], object]) -> BagError:
    with pytest.raises(BagError) as caught:
        action()
    assert caught.value.code == code, str(caught.value)
    assert code in PROBLEMS
    return caught.value


def test_round_trip(recording: Path) -> None:
    read = list(BagReader(recording).messages())
    assert len(read) == 2 + 3 * 218
    assert read[0] == ("/line1/variables", "automax_msgs/msg/VariableTable", 0, 0, TABLE)
    assert isinstance(read[0].message, VariableTable)
    last_write = read[-2]
    assert isinstance(last_write.message, CommonWrite)
    assert last_write.message.values.value == (217.0, 1.0)
    assert (last_write.stamp, last_write.log_time) == (218 * 5_500_000, 218 * 5_500_000 + 1)
    assert read[-1].message == Int16(217)


def test_a_single_file_reads_like_its_folder(recording: Path) -> None:
    assert list(BagReader(recording / "scans_0.mcap").messages()) == list(BagReader(recording).messages())


def test_topics_and_types_select(recording: Path) -> None:
    reader = BagReader(recording)
    assert {item.topic for item in reader.messages(topics={"/line1/scans"})} == {"/line1/scans"}
    assert {item.type_name for item in reader.messages(types={INT16})} == {INT16}
    assert list(reader.messages(topics={"/line1/scans"}, types={INT16})) == []


def test_what_stands_beside_the_messages(recording: Path) -> None:
    reader = BagReader(recording)
    assert [(item.name, item.media_type, item.data) for item in reader.attachments()] == [
        ("rack.yaml", "application/yaml", b"rack: LINE1\n")
    ]
    assert reader.custom_data == {"program_hash": "a1b2", "step": "5500000"}


def foreign(path: Path, *, profile: str = "ros2", encoding: str = "cdr", **options: Any) -> Path:
    """A recording by the mcap library, with messages on /a, three if no ``times`` are given."""
    schema_name = options.pop("schema_name", INT16)
    schema_encoding = options.pop("schema_encoding", "ros2msg")
    text = options.pop("text", schema_text(INT16))
    payload = options.pop("payload", encode(Int16(5)))
    times = options.pop("times", (3, 1, 2))
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start(profile=profile)
        schema = writer.register_schema(schema_name, schema_encoding, text.encode())
        channel = writer.register_channel("/a", encoding, schema)
        for time in times:
            writer.add_message(channel, time, payload, time)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("chunks", [True, False])
def test_recordings_of_others(tmp_path: Path, compression: CompressionType, chunks: bool) -> None:
    path = foreign(tmp_path / "a.mcap", compression=compression, use_chunking=chunks, enable_crcs=False)
    assert [(item.log_time, item.message) for item in BagReader(path).messages()] == [(t, (5,)) for t in (1, 2, 3)]


def test_a_definition_with_other_remarks_is_the_same(tmp_path: Path) -> None:
    path = foreign(tmp_path / "a.mcap", text="int16 data # anything\n")
    assert len(list(BagReader(path).messages())) == 3


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"profile": "ros1"}, "AMX6811"),
        ({"profile": ""}, "AMX6811"),
        ({"encoding": "json"}, "AMX6811"),
        ({"schema_name": "other_msgs/msg/Thing"}, "AMX6815"),
        ({"schema_name": "builtin_interfaces/msg/Time"}, "AMX6815"),
        ({"schema_name": ""}, "AMX6815"),
        ({"schema_encoding": "ros2idl"}, "AMX6815"),
        ({"text": "int32 data"}, "AMX6815"),
        ({"text": "int16 other"}, "AMX6815"),
        ({"text": ""}, "AMX6815"),
        ({"text": "!?"}, "AMX6813"),
        ({"text": "int16 data\n" + " " * (2 << 20)}, "AMX6815"),
        ({"payload": b""}, "AMX6816"),
        ({"payload": b"\0\1\0\0\5"}, "AMX6816"),
        ({"payload": b"\0\0\0\0\5\0"}, "AMX6816"),
    ],
)
def test_what_is_not_ours_is_named(tmp_path: Path, options: dict[str, Any], code: str) -> None:
    path = foreign(tmp_path / "a.mcap", **options)
    refused(code, lambda: list(BagReader(path).messages()))


def test_topics_that_are_not_wanted_may_be_strange(tmp_path: Path) -> None:
    path = foreign(tmp_path / "a.mcap", schema_name="other_msgs/msg/Thing", text="x", encoding="json")
    assert list(BagReader(path).messages(types={INT16})) == []


@pytest.mark.parametrize("data", [b"", b"\x89MCAP", b"SQLite format 3\0" * 10, b"\0" * 100, "bag".encode("utf-16")])
def test_what_is_no_mcap_file(tmp_path: Path, data: bytes) -> None:
    refused("AMX6810", lambda: read_bytes(tmp_path, data))


def test_what_is_no_recording(tmp_path: Path) -> None:
    assert "does not exist" in str(refused("AMX6810", lambda: BagReader(tmp_path / "nowhere")))
    assert "has no metadata.yaml" in str(refused("AMX6810", lambda: BagReader(tmp_path)))


METADATA = """rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  relative_file_paths: [scans_0.mcap]
"""


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "AMX6813"),
        ("[1, 2]", "AMX6813"),
        ("rosbag2_bagfile_information: 5", "AMX6813"),
        ("{{{", "AMX6813"),
        ("\0", "AMX6813"),
        ("a: !!python/object/apply:os.system [ls]", "AMX6814"),
        (METADATA.replace("mcap\n", "sqlite3\n"), "AMX6811"),
        (METADATA + "  compression_mode: FILE\n", "AMX6811"),
        (METADATA.replace("[scans_0.mcap]", "[]"), "AMX6813"),
        (METADATA.replace("[scans_0.mcap]", "scans_0.mcap"), "AMX6813"),
        (METADATA.replace("scans_0.mcap", "../scans_0.mcap"), "AMX6813"),
        (METADATA.replace("scans_0.mcap", "/etc/passwd"), "AMX6813"),
        (METADATA.replace("scans_0.mcap", "'..'"), "AMX6813"),
        (METADATA.replace("scans_0.mcap", '"a\\0b"'), "AMX6813"),
        (METADATA.replace("[scans_0.mcap]", "[{a: b}]"), "AMX6813"),
        (METADATA.replace("scans_0", "scans_1"), "AMX6810"),
        ("a: &x [1]\nb: *x\n", "AMX6814"),
        ("[" * 100_000, "AMX6814"),
        ("- " * 100_000, "AMX6814"),
        ("#" * (MAX_METADATA_BYTES + 1), "AMX6814"),
    ],
)
def test_metadata_that_cannot_be_used(tmp_path: Path, text: str, code: str) -> None:
    (tmp_path / "scans_0.mcap").write_bytes(b"")
    (tmp_path / "metadata.yaml").write_text(text)
    refused(code, lambda: BagReader(tmp_path))


def test_a_number_of_a_million_digits_costs_nothing(tmp_path: Path) -> None:
    (tmp_path / "scans_0.mcap").write_bytes(b"")
    (tmp_path / "metadata.yaml").write_text(
        METADATA + f"  message_count: {'9' * 1_000_000}\n  x: {'1:' * 1_000_000}1\n"
    )
    assert BagReader(tmp_path).files == [tmp_path / "scans_0.mcap"]


def several(folder: Path, *times: tuple[int, ...]) -> Path:
    """A recording of others with a file for each group of log times."""
    for number, group in enumerate(times):
        foreign(folder / f"part_{number}.mcap", times=group)
    names = ", ".join(f"part_{number}.mcap" for number in range(len(times)))
    (folder / "metadata.yaml").write_text(METADATA.replace("scans_0.mcap", names))
    return folder


@pytest.mark.parametrize("times", [((3, 1, 2), (5, 4)), ((1,), (), (1, 2)), ((), (0,), (), (7,), (7,))])
def test_several_files_follow_each_other(tmp_path: Path, times: tuple[tuple[int, ...], ...]) -> None:
    """Only files against each other have to be in order: others may write one file's messages in any."""
    bag = several(tmp_path, *times)
    assert [item.log_time for item in BagReader(bag).messages()] == sorted(time for group in times for time in group)
    assert survey(bag).last == max(time for group in times for time in group)


@pytest.mark.parametrize(
    ("times", "text", "hint"),
    [
        (((5, 6), (1, 2)), "is out of order: its messages begin before those of part_0.mcap", "`automax bag repair`"),
        (((5, 6), (), (1, 2)), "is out of order", "`automax bag repair`"),
        (((1,), (5, 8), (7, 9)), "overlaps part_1.mcap", "read each file by its own name"),
    ],
)
def test_files_out_of_order_are_not_one_stream(
    tmp_path: Path, times: tuple[tuple[int, ...], ...], text: str, hint: str
) -> None:
    """Times in units of 2 s: what overlaps by less than a second is put into the order of sending."""
    bag = several(tmp_path, *(tuple(time * 2 * NS_PER_S for time in group) for group in times))
    error = refused("AMX6813", lambda: list(BagReader(bag).messages()))
    assert text in error.message
    assert hint in error.hint
    refused("AMX6813", lambda: survey(bag))
    assert bag_info(bag).problems == [], "what they hold can be told all the same"


def test_repair_lists_the_files_in_the_order_of_their_times(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    bag = several(tmp_path / "bag", (5, 6), (), (1, 2))
    report = repair(bag)
    assert report.problems == ["metadata.yaml does not list the data files in the order of their times"]
    assert report.output is not None
    assert [item.log_time for item in BagReader(report.output).messages()] == [1, 2, 5, 6]
    assert repair(report.output).sound


def test_a_file_that_is_listed_twice(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    bag = several(tmp_path / "bag", (1, 2), (3, 4))
    text = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").write_text(text.replace("part_1.mcap", "part_1.mcap, part_0.mcap"))
    error = refused("AMX6813", lambda: BagReader(bag))
    assert error.message == "lists the data file 'part_0.mcap' twice"
    assert [problem.code for problem in bag_info(bag).problems] == ["AMX6813"]
    report = repair(bag)
    assert report.output is not None
    assert [item.log_time for item in BagReader(report.output).messages()] == [1, 2, 3, 4]


def test_a_single_file_tells_where_it_comes_from(tmp_path: Path, recording: Path) -> None:
    assert BagReader(recording / "scans_0.mcap").custom_data == BagReader(recording).custom_data != {}
    assert BagReader(foreign(tmp_path / "a.mcap")).custom_data == {}
    (tmp_path / "cut.mcap").write_bytes(data_of(recording)[:3000])
    assert BagReader(tmp_path / "cut.mcap").custom_data == {}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "5",
        "custom_data: 5",
        "custom_data: {a: &x 1, b: *x}",
        "custom_data: " + "[" * 100,
        "{{{",
        "custom_data: {a: b}\n#" + " " * MAX_METADATA_BYTES,
    ],
)
def test_what_a_single_file_tells_of_itself_is_not_trusted(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros2")
        writer.add_metadata("other", {"serialized_metadata": "custom_data: {version: wrong}"})
        writer.add_metadata("rosbag2", {"serialized_metadata": text})
        writer.finish()  # type: ignore[no-untyped-call]
    assert BagReader(path).custom_data == {}


def test_special_files_are_no_recordings(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("nowhere")
    for path in (Path("/dev/zero"), tmp_path / "pipe"):
        assert refused("AMX6810", lambda path=path: BagReader(path)).message == "is not a regular file"
        assert refused("AMX6810", lambda path=path: repair(path)).message == "is not a regular file"
    assert "a link that leads nowhere" in refused("AMX6810", lambda: BagReader(tmp_path / "link")).message
    assert refused("AMX6810", lambda: BagReader(tmp_path / "none")).message == "does not exist"
    (tmp_path / "metadata.yaml").write_text(METADATA.replace("scans_0.mcap", "pipe"))
    assert refused("AMX6810", lambda: BagReader(tmp_path)).message == "is not a regular file"


def test_every_message_before_the_cut_is_handed_out(tmp_path: Path) -> None:
    folder = sample_recording(tmp_path / "whole", seconds=3.5)
    data = data_of(folder)
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    cut = BagReader(tmp_path / "cut.mcap").messages()
    whole = BagReader(folder).messages()
    for _ in range(2 + 3 * 181):  # the image, and the scans of the first second
        assert next(cut) == next(whole)
    refused("AMX6812", lambda: list(cut))


@pytest.mark.parametrize("part", range(1, 20))
def test_truncated(tmp_path: Path, recording: Path, part: int) -> None:
    data = data_of(recording)
    with pytest.raises(BagError, match=r"AMX681[023]"):
        read_bytes(tmp_path, data[: len(data) * part // 20])


def test_truncated_by_one_byte_and_prolonged_by_one(tmp_path: Path, recording: Path) -> None:
    refused("AMX6813", lambda: read_bytes(tmp_path, data_of(recording)[:-1]))
    refused("AMX6813", lambda: read_bytes(tmp_path, data_of(recording) + b"\0"))


def flipped(data: bytes, position: int, bit: int) -> bytes:
    mutant = bytearray(data)
    mutant[position] ^= 1 << bit
    return bytes(mutant)


@pytest.mark.parametrize(("count", "seed"), [(60, 1), in_soak(4000, 2)])
def test_every_flipped_bit_is_noticed(tmp_path: Path, recording: Path, count: int, seed: int) -> None:
    """Any single bit that changes is noticed: everything is under a checksum."""
    data, chance = data_of(recording), random.Random(seed)
    for _ in range(count):
        position, bit = chance.randrange(len(data)), chance.randrange(8)
        mutant = flipped(data, position, bit)
        with pytest.raises(BagError):
            read_bytes(tmp_path, mutant)


@pytest.mark.parametrize(("count", "seed"), [(60, 3), in_soak(8000, 4)])
def test_garbled_files_without_checksums(tmp_path: Path, count: int, seed: int) -> None:
    """Without checksums damage may pass, but only as messages or as BagError."""
    chance = random.Random(seed)
    compressions = list(CompressionType)
    for number in range(count):
        options = {"compression": compressions[number % 3], "use_chunking": number % 5 > 0, "enable_crcs": False}
        data = bytearray(foreign(tmp_path / "a.mcap", **options).read_bytes())
        for _ in range(chance.randrange(1, 6)):
            start = chance.randrange(len(data))
            junk = chance.choice((b"\xff" * 8, b"\0" * 8, bytes([chance.randrange(256)]), struct.pack("<Q", 2**40)))
            data[start : start + len(junk)] = junk
        if chance.random() < 0.2:
            del data[chance.randrange(len(data)) :]
        with contextlib.suppress(BagError):
            read_bytes(tmp_path, bytes(data))


def record_of(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def text_of(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()


HEADER = MAGIC + record_of(Opcode.HEADER, text_of("ros2") + text_of("x"))


def chunk_of(data: bytes, size: int, compression: str, crc: int = 0) -> bytes:
    head = struct.pack("<QQQI", 0, 0, size, crc) + text_of(compression) + struct.pack("<Q", len(data))
    return record_of(Opcode.CHUNK, head + data)


BOMB = 1 << 30


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (MAGIC, "AMX6812"),
        (MAGIC + record_of(Opcode.FOOTER, bytes(20)), "AMX6813"),
        (MAGIC + record_of(Opcode.HEADER, b"\xff\xff\xff\xff"), "AMX6813"),
        (HEADER, "AMX6812"),
        (HEADER + record_of(Opcode.FOOTER, bytes(20)), "AMX6813"),
        (HEADER + struct.pack("<BQ", Opcode.CHUNK, 2**63), "AMX6814"),
        (HEADER + struct.pack("<BQ", 200, 2**40), "AMX6814"),
        (HEADER + struct.pack("<BQ", Opcode.ATTACHMENT, 50_000_000), "AMX6812"),
        (HEADER + record_of(Opcode.MESSAGE, bytes(22)), "AMX6813"),
        (HEADER + record_of(Opcode.MESSAGE, bytes(3)), "AMX6813"),
        (HEADER + record_of(Opcode.SCHEMA, struct.pack("<H", 1) + text_of("a")), "AMX6813"),
        (HEADER + record_of(Opcode.CHANNEL, struct.pack("<HH", 1, 0) + text_of("/a") + b"\xff" * 4), "AMX6813"),
        (HEADER + record_of(Opcode.METADATA, text_of("a") + b"\xff" * 4), "AMX6813"),
        (HEADER + record_of(Opcode.SCHEMA, struct.pack("<HI", 1, 2) + b"\xff\xfe"), "AMX6813"),
        (HEADER + chunk_of(b"", 2**62, "zstd"), "AMX6814"),
        (HEADER + chunk_of(b"junk", 100, "zstd"), "AMX6813"),
        (HEADER + chunk_of(b"junk", 100, "lz4"), "AMX6813"),
        (HEADER + chunk_of(b"junk", 4, ""), "AMX6813"),
        (HEADER + chunk_of(b"junk", 5, ""), "AMX6813"),
        (HEADER + chunk_of(b"", 0, "bz2"), "AMX6811"),
        (HEADER + chunk_of(record_of(Opcode.MESSAGE, bytes(22)), 31, "", crc=1), "AMX6813"),
        (HEADER + chunk_of(struct.pack("<BQ", 5, 2**40), 9, ""), "AMX6813"),
        (HEADER + chunk_of(zstandard.compress(b"abc"), 2, "zstd"), "AMX6813"),
        (HEADER + chunk_of(lz4.frame.compress(b"abc"), 2, "lz4"), "AMX6813"),
        (HEADER + chunk_of(lz4.frame.compress(b"abc")[:-6], 3, "lz4"), "AMX6813"),
    ],
)
def test_hostile_records(tmp_path: Path, content: bytes, code: str) -> None:
    refused(code, lambda: read_bytes(tmp_path, content))


def bombs() -> list[bytes]:
    """A gigabyte of zeros in a small chunk, with and without an honest size."""
    compressor = zstandard.ZstdCompressor(write_content_size=False).compressobj()
    unsized = b"".join(compressor.compress(bytes(1 << 20)) for _ in range(BOMB >> 20)) + compressor.flush()
    lz4_bomb = lz4.frame.LZ4FrameCompressor()
    parts = [lz4_bomb.begin(), *(lz4_bomb.compress(bytes(1 << 20)) for _ in range(BOMB >> 20)), lz4_bomb.flush()]
    # a frame header (single segment, 8-byte content size) that states a terabyte
    stated = b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 2**40) + b"\x01\x00\x00"
    packed = b"".join(parts)
    return [
        chunk_of(unsized, BOMB, "zstd"),
        chunk_of(unsized, 1000, "zstd"),
        chunk_of(packed, BOMB, "lz4"),
        chunk_of(packed, 1000, "lz4"),
        chunk_of(stated, 1000, "zstd"),
        chunk_of(stated, 2**40, "zstd"),
    ]


def test_bombs_do_not_take_memory(tmp_path: Path) -> None:
    for bomb in bombs():
        (tmp_path / "mutant.mcap").write_bytes(HEADER + bomb)
        tracemalloc.start()
        with pytest.raises(BagError, match=r"AMX681[34]"):
            read_all(tmp_path / "mutant.mcap")
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 3 * len(bomb) + (1 << 20)


def test_definitions_may_not_pile_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_file, "MAX_RECORD_BYTES", 10_000)
    schema = text_of("a/msg/B") + text_of("ros2msg") + text_of("x" * 5000)
    content = b"".join(record_of(Opcode.SCHEMA, struct.pack("<H", number) + schema) for number in range(1, 4))
    refused("AMX6814", lambda: read_bytes(tmp_path, HEADER + content))
    repeated = record_of(Opcode.SCHEMA, struct.pack("<H", 1) + schema) * 3
    refused("AMX6812", lambda: read_bytes(tmp_path, HEADER + repeated))


def test_our_reading_of_checksums_is_the_library_s(recording: Path) -> None:
    with (recording / "scans_0.mcap").open("rb") as file:
        kinds = {type(record).__name__ for record in StreamReader(file, validate_crcs=True).records}
    assert {"Header", "Message", "Attachment", "Metadata", "DataEnd", "Footer"} <= kinds
    data = data_of(recording)
    (crc,) = struct.unpack("<I", data[-12:-8])
    (summary_start,) = struct.unpack("<Q", data[-28:-20])
    assert zlib.crc32(data[summary_start:-12]) == crc


def test_an_error_says_where_what_and_what_to_do(tmp_path: Path) -> None:
    error = refused("AMX6810", lambda: BagReader(tmp_path / "no\nwhere\x1b[31m"))
    first, second = str(error).splitlines()
    assert first.startswith(f"{tmp_path}/no")
    assert first.endswith("error[AMX6810]: does not exist")
    assert second.startswith("  hint: ")
    assert "\x1b" not in str(error)
