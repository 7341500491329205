"""What is played of a recording: the span, the latched facts before it, the names, and what cannot be played."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.writer import Writer

from automax_ros.messages.cdr.cdr import decode, encode
from automax_ros.messages.types.messages import Int16
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.playback import NOT_CHOSEN, TABLE_TYPE, Renaming, choose, survey
from recordings.recordings import TABLE, image_of, record, sample_recording, write_of

S = 1_000_000_000
START = 50 * S


@pytest.fixture
def late(tmp_path: Path) -> Path:
    """A recording that begins 5 s after the rack's start: table and image at 55 s, a write each 0.1 s for 2 s."""
    table = TABLE._replace(stamp=START)
    messages = [("/line1/backplane/snapshot", image_of(0, START + 5 * S, {(0, 0): 0}))]
    messages += [("/line1/backplane", write_of(n, START + 5 * S + n * S // 10, {(0, 0): n})) for n in range(1, 21)]
    return record(tmp_path / "late", [*messages[:1], ("/line1/variables", table), *messages[1:]])


def test_survey_tells_topics_span_and_racks(tmp_path):
    found = survey(sample_recording(tmp_path / "bag"))
    assert found.spaces == ["/line1"]
    assert {name: topic.messages for name, topic in found.counts.topics.items()} == {
        "/line1/variables": 1,
        "/line1/backplane/snapshot": 1,
        "/line1/backplane": 454,
        "/line1/scans": 454,
        "/line1/common/REF": 454,
    }
    assert {topic.fault for topic in found.topics.values()} == {""}
    assert [name for name, topic in found.topics.items() if topic.is_latched] == [
        "/line1/variables",
        "/line1/backplane/snapshot",
        "/line1/common/REF",
    ]
    assert (found.run_start, found.begin, found.first) == (0, 0, 0)
    assert found.end == found.last == 454 * 5_500_000 + 2
    assert sum(1 for _ in found.messages()) == 454 * 3 + 2


def test_span_counts_from_the_start_of_the_run(late):
    found = survey(late, 6 * S, 6 * S + S // 2)
    times = [item.log_time - START for item in found.messages()]
    assert times == [6 * S + n * S // 10 for n in range(6)]
    assert set(found.latched) == {"/line1/variables", "/line1/backplane/snapshot"}


def test_last_value_of_a_latched_topic_before_the_span_is_kept(tmp_path):
    bag = sample_recording(tmp_path / "bag")
    found = survey(bag, S)
    latched = found.latched["/line1/common/REF"]
    assert latched.log_time < S <= next(found.messages()).log_time
    assert decode("std_msgs/msg/Int16", latched.data) == Int16(180)  # the 181st scan stands at 0.9955 s
    assert survey(bag).latched == {}


@pytest.mark.parametrize(("begin", "end"), [(8 * S, None), (0, 4 * S), (6 * S, 5 * S + S // 2)])
def test_span_without_messages_is_refused_with_the_one_there_is(late, begin, end):
    with pytest.raises(BagError, match="no message in the span") as caught:
        survey(late, begin, end)
    assert caught.value.hint == "it lasts from 5.000 to 7.000 s of the run"


def test_recording_without_a_message_is_refused(tmp_path):
    with pytest.raises(BagError, match="holds no message") as caught:
        survey(record(tmp_path / "empty", []))
    assert caught.value.code == "AMX6840"


@pytest.mark.parametrize("cut", [40, 2000, -30])
def test_damaged_recording_is_refused_before_anything_is_played(tmp_path, cut):
    path = sample_recording(tmp_path / "bag") / "scans_0.mcap"
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(BagError):
        survey(path)


def test_malformed_table_is_refused(tmp_path):
    path = tmp_path / "bag.mcap"
    foreign(path, [(TABLE_TYPE, "/x/variables", b"\x00\x01\x00\x00abc")], encode_schema=True)
    with pytest.raises(BagError, match="malformed"):
        survey(path)


def foreign(path: Path, messages: list[tuple[str, str, bytes]], *, encode_schema: bool = False) -> None:
    """An mcap file of another program: type, topic and bytes of each message."""
    from automax_ros.messages.types.definitions import schema_text

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="other")
        for number, (type_name, topic, data) in enumerate(messages):
            text = schema_text(type_name) if encode_schema else "int32 other\n"
            schema = writer.register_schema(type_name, "ros2msg", text.encode())
            channel = writer.register_channel(topic, "json" if "json" in topic else "cdr", schema)
            writer.add_message(channel, log_time=number, data=data, publish_time=number)
        writer.finish()


def test_topics_of_other_programs_are_taken_or_told(tmp_path):
    path = tmp_path / "other.mcap"
    kinds = [("std_msgs/msg/Int16", "/changed"), ("my_msgs/msg/Thing", "/thing"), ("my_msgs/msg/Thing", "/json")]
    foreign(path, [(kind, topic, encode(Int16(1))) for kind, topic in kinds])
    found = survey(path)
    assert found.topics["/changed"].fault == "std_msgs/msg/Int16 was recorded with another definition"
    assert found.topics["/thing"].fault == ""
    assert "not in CDR" in found.topics["/json"].fault
    assert [item.channel.topic for item in found.messages()] == ["/thing"]
    assert found.spaces == []


def test_topics_are_chosen_by_pattern(tmp_path):
    found = survey(sample_recording(tmp_path / "bag"))
    assert choose(found, ["/line1/common/*", "/line1/scans", "/nothing"]) == ["/nothing"]
    assert {name for name, topic in found.topics.items() if not topic.fault} == {"/line1/common/REF", "/line1/scans"}
    assert found.topics["/line1/variables"].fault == NOT_CHOSEN
    assert {item.channel.topic for item in found.messages()} == {"/line1/common/REF", "/line1/scans"}


def test_topics_move_to_another_namespace():
    assert Renaming(["/line1"], None).topic("/line1/scans") == "/line1/scans"
    moved = Renaming(["/line1"], "/test")
    assert moved.topic("/line1/common/REF") == "/test/common/REF"
    assert moved.topic("/line10/scans") == "/test/line10/scans"
    assert moved.space("/line1") == "/test"
    several = Renaming(["/line1", "/line1/sub"], "/test")
    assert several.topic("/line1/sub/scans") == "/test/line1/sub/scans"
    assert several.space("/line1") == "/test/line1"
    assert Renaming([], "/test").topic("/tf") == "/test/tf"


def test_table_tells_the_new_topics():
    moved = Renaming(["/line1"], "/test")
    table = decode(TABLE_TYPE, moved.payload(TABLE_TYPE, encode(TABLE)))
    assert table == TABLE._replace(
        variables=(TABLE.variables[0]._replace(topic="/test/common/REF"), *TABLE.variables[1:])
    )
    assert Renaming(["/line1"], None).payload(TABLE_TYPE, b"as it is") == b"as it is"
    assert moved.payload("std_msgs/msg/Int16", b"as it is") == b"as it is"
