"""What the recorder of a live rack is made of: heads of messages, their order, the rack's files."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.kinds import Direction
from automax_ros.core.types import DataType
from automax_ros.messages.cdr.cdr import CdrError, encode
from automax_ros.messages.cdr.message_headers import image_head, scan_head, write_head
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import CommonImage, CommonWrite, Scan, Variable
from automax_ros.messages.types.rack_files import (
    MAX_TEXT,
    RackFilesError,
    files_from_text,
    files_of,
    files_text,
    fingerprint,
)
from automax_ros.messages.types.topics import LATCHED
from automax_ros.recordings.live.topics import MAX_VALUE_TOPICS, LiveTopics
from automax_ros.recordings.live.tracks import SendOrder
from automax_ros.recordings.mcap.channels import MAX_DEPTH, MAX_QOS_BYTES, STREAM, recorded_qos
from recordings.live_racks import build
from recordings.recordings import TABLE, messages

SETTINGS = settings(max_examples=150, deadline=None, derandomize=True)
TASK_NAMES = st.text("ABCDEFGHIJ_0123456789", min_size=1, max_size=40)


# Heads


@SETTINGS
@given(messages("automax_msgs/msg/CommonWrite"))
def test_head_of_a_write(message: CommonWrite) -> None:
    assert write_head(encode(message)) == (message.stamp, message.run_id, message.sequence)


@SETTINGS
@given(messages("automax_msgs/msg/CommonImage"))
def test_head_of_an_image(message: CommonImage) -> None:
    assert image_head(encode(message)) == (message.stamp, message.run_id, message.sequence)


@SETTINGS
@given(messages("automax_msgs/msg/Scan"), TASK_NAMES)
def test_head_of_a_scan(message: Scan, task: str) -> None:
    message = message._replace(task=task)
    assert scan_head(encode(message)) == (message.stamp, task, message.scan, message.full)


@pytest.mark.parametrize("head", [write_head, image_head, scan_head])
@SETTINGS
@given(data=st.binary(max_size=60))
def test_head_of_anything_else_is_refused_or_read(head, data: bytes) -> None:
    for payload in (data, b"\x00\x01\x00\x00" + data):
        with contextlib.suppress(CdrError):
            assert head(payload)


def test_scan_of_a_nameless_or_endless_task_is_refused() -> None:
    with pytest.raises(CdrError, match="65 bytes"):
        scan_head(encode(Scan(0, 1, "A" * 64, 1)))
    payload = encode(Scan(0, 1, "A", 1))
    with pytest.raises(CdrError, match="0 bytes"):
        scan_head(payload[:16] + bytes(4) + payload[20:])


# Order


@SETTINGS
@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 90)), min_size=1, max_size=80), st.integers(0, 10**12))
def test_messages_that_come_within_the_hold_are_put_in_order(delays: list[tuple[int, int]], offset: int) -> None:
    """Messages 10 ns apart, each up to 90 ns on its way, seen by looks every 25 ns; the clocks differ by ``offset``."""
    coming = [(number * 10 + delay, number) for number, (_, delay) in enumerate(delays)]
    order: SendOrder[int] = SendOrder(hold_ns=100)
    found: list[int] = []
    waiting = sorted(coming)
    for look in range(0, coming[-1][1] * 10 + 500, 25):
        while waiting and waiting[0][0] <= look:
            _, number = waiting.pop(0)
            order.add(offset + number * 10, number)
        found += [number for _, number in order.due(look)]
    assert found == list(range(len(delays)))
    assert len(order) == 0
    assert order.rest() == []


def test_nothing_is_due_before_the_hold_and_the_rest_is_in_order() -> None:
    order: SendOrder[str] = SendOrder(hold_ns=100)
    order.add(7, "b")
    order.add(5, "a")
    assert order.due(1000) == []
    assert order.due(1099) == []
    assert len(order) == 2
    assert order.rest() == [(5, "a"), (7, "b")]


# The rack's files


def test_files_of_a_rack_come_back_with_its_fingerprint(tmp_path: Path) -> None:
    rack = build(tmp_path)
    files = files_of(rack)
    assert [item.name for item in files] == ["rack.yaml", "SPEED.BLK", "WORK.BLK"]
    text = files_text(rack.config.name, files)
    assert text.isascii()
    assert files_from_text(text) == files
    assert fingerprint(files) == rack.fingerprint
    hashes = {task.name: task.compiled.program.source_hash for task in rack.tasks}
    assert {item.name.removesuffix(".BLK"): item.sha256 for item in files[1:]} == hashes


def changed(**entry: object) -> str:
    good = {"name": "A.BLK", "sha256": "", "text": ""}
    return json.dumps({"files": [{**good, **entry}]})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("[]", "no list of files"),
        ('{"files": {}}', "no list of files"),
        (json.dumps({"files": [{}] * 201}), "no list of files"),
        ('{"files": [3]}', "without name"),
        (changed(text=3), "without name"),
        (changed(name="../A.BLK"), "named '../A.BLK'"),
        (changed(name="rack.yml"), "named"),
        (changed(text="10 END"), "hash"),
        ("x" * (MAX_TEXT + 1), "at most"),
    ],
)
def test_text_that_no_rack_sends_is_refused(text: str, words: str) -> None:
    with pytest.raises(RackFilesError, match=words):
        files_from_text(text)


def test_two_files_of_one_name_are_refused(tmp_path: Path) -> None:
    (file, *_) = files_of(build(tmp_path))
    with pytest.raises(RackFilesError, match="one name"):
        files_from_text(files_text("LINE1", [file, file]))


# Topics


def test_topics_of_the_table_are_those_of_the_rack(tmp_path: Path) -> None:
    rack = build(tmp_path)
    stream = RackStream(rack, 1)
    table = stream._messages.table()
    found = LiveTopics("/line1", table).all
    assert {name: (kind.type_name, kind.qos) for name, kind in found.items()} == {
        topic.name: (topic.type_name, topic.qos) for topic in stream.topics
    }


def test_topics_outside_of_the_rack_are_left_alone() -> None:
    """A table comes from the network: it cannot make the recorder listen elsewhere, or to what is not a type."""
    variables = [
        Variable(0, "A%", DataType.INTEGER.number, direction=Direction.OUT, topic="/cmd_vel"),
        Variable(1, "B%", DataType.INTEGER.number, direction=Direction.OUT, topic="/line1/common/B"),
        Variable(2, "C%", 99, direction=Direction.OUT, topic="/line1/common/C"),
        Variable(3, "D%", DataType.INTEGER.number, direction=Direction.CLOSED, topic="/line1/common/D"),
    ]
    assert list(LiveTopics("/line1", TABLE._replace(variables=variables)).values) == ["/line1/common/B"]


def test_a_variable_with_a_scale_has_the_type_that_ros_offers() -> None:
    """The table does not say which variables have a scale; only a simple one can, and only a Float32 comes of it."""
    variables = [
        Variable(
            n, f"{name}%", DataType.INTEGER.number, dimensions, direction=Direction.OUT, topic=f"/line1/common/{name}"
        )
        for n, (name, dimensions) in enumerate((("A", ()), ("B", ()), ("C", (3,)), ("D", ())))
    ]
    scaled, hostile = ["std_msgs/msg/Float32"], ["geometry_msgs/msg/Twist"]
    offered = {f"/line1/common/{name}": types for name, types in (("A", scaled), ("C", scaled), ("D", hostile))}
    found = LiveTopics("/line1", TABLE._replace(variables=variables), offered).values
    assert [kind.type_name.removeprefix("std_msgs/msg/") for kind in found.values()] == [
        "Float32",
        "Int16",
        "Int16MultiArray",
        "Int16",
    ]


def test_number_of_topics_is_bounded_and_told() -> None:
    variables = [
        Variable(n, f"V{n}%", DataType.INTEGER.number, direction=Direction.OUT, topic=f"/line1/common/V{n}")
        for n in range(MAX_VALUE_TOPICS + 3)
    ]
    topics = LiveTopics("/line1", TABLE._replace(variables=variables))
    assert (len(topics.values), topics.left_out) == (MAX_VALUE_TOPICS, 3)


# Quality of service


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("- {reliability: reliable, durability: transient_local, history: keep_last, depth: 1}", LATCHED),
        ("- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n", LATCHED),
        ("- {}", STREAM),
        ("", STREAM),
        ("[]", STREAM),
        ("3", STREAM),
        ("{", STREAM),
        ("- [[[[[[[[1]]]]]]]]", STREAM),
        ("[" * 60_000, STREAM),
        ("- &a {depth: 3}\n- *a", STREAM),
        ("x" * (MAX_QOS_BYTES + 1), STREAM),
        ("- {reliability: unknown, depth: -4}", STREAM),
    ],
)
def test_recorded_quality_of_service(text: str, expected: object) -> None:
    assert recorded_qos(text) == expected


def test_history_is_bounded() -> None:
    assert recorded_qos("- {depth: 4000000000}").depth == MAX_DEPTH
    assert recorded_qos("- {history: keep_all, depth: 0}").depth == STREAM.depth
    assert recorded_qos("- {reliability: best_effort, durability: volatile, depth: 5}").depth == 5
    assert recorded_qos("- {reliability: 2}").reliability == "best_effort"
