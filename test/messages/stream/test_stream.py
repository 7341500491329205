"""The stream of a running rack: what is sent, in which order, at which times."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import pytest
from recordings.live_racks import SPEED, YAML, build

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.kinds import Direction, WriteKind, WriterKind
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.stream import SNAPSHOT_PERIOD_NS, RackStream
from automax_ros.messages.types.topics import LATCHED, SCAN
from automax_ros.rack.rack import Rack


class Sent(NamedTuple):
    topic: str
    stamp: int
    message: Any
    slot: int | None


class Stream:
    """A rack with its stream, and all messages so far."""

    def __init__(self, rack: Rack, epoch_ns: int = 0) -> None:
        self.rack = rack
        self.all: list[Sent] = []
        self.stream = RackStream(rack, 77)
        self.stream.add_sink(
            lambda topic: (
                lambda stamp, data: self.all.append(
                    Sent(topic.name.removeprefix("/line1/"), stamp, decode(topic.type_name, data), topic.slot)
                )
            )
        )
        self.stream.begin(epoch_ns)

    def on(self, topic: str) -> list[Sent]:
        return [item for item in self.all if item.topic == topic]

    def values(self, name: str) -> list[tuple[float, Any]]:
        """Time in ms and value of each message of a variable's topic."""
        return [(item.stamp / NS_PER_MS, item.message.data) for item in self.on(f"common/{name}")]

    def scans(self, task: str) -> list[Any]:
        return [item.message for item in self.on("scans") if item.message.task == task]


@pytest.fixture
def started(tmp_path):
    made = Stream(build(tmp_path))
    made.rack.start()
    return made


def view_of(rack: Rack, name: str) -> int:
    return rack.memory.view(name)


def entries(values: Any) -> list[tuple[int, int, float]]:
    return list(zip(values.variable, values.element, values.value, strict=True))


# The beginning


def test_facts_come_first(tmp_path):
    stream = Stream(build(tmp_path), epoch_ns=5 * NS_PER_S)
    names = [item.topic for item in stream.all]
    assert names[:2] == ["variables", "backplane/snapshot"]
    assert all(name.startswith("common/") for name in names[2:])
    assert {item.stamp for item in stream.all} == {5 * NS_PER_S}
    image = stream.all[1].message
    assert (image.run_id, image.sequence) == (77, 0)
    assert set(image.values.value) == {0.0}
    assert image.values.text == ("", "", "", "")


def test_table_is_the_configuration(started):
    table = started.on("variables")[0].message
    assert (table.rack, table.run_id) == ("LINE1", 77)
    by_name = {item.name: item for item in table.variables}
    assert [item.id for item in table.variables] == list(range(len(started.rack.config.variables)))
    assert by_name["TABLE%"].dimensions == (2, 3)
    assert (by_name["NOTE$"].type, by_name["NOTE$"].length) == (DataType.STRING.number, 8)
    assert (by_name["SHUT%"].direction, by_name["SHUT%"].topic) == (Direction.CLOSED, "")
    assert (by_name["RUN@"].direction, by_name["RUN@"].topic) == (Direction.IN, "/line1/common/RUN")
    assert [(item.name, item.kind) for item in table.writers][-2:] == [
        ("SPEED", WriterKind.TASK),
        ("WORK", WriterKind.TASK),
    ]


def test_topics_have_the_quality_and_slot_of_their_module(started):
    topics = {(topic.name.removeprefix("/line1/"), topic.slot): topic for topic in started.stream.topics}
    assert topics["variables", None].qos == topics["common/REF", None].qos == LATCHED
    assert topics["scans", 1].qos == topics["scans", 2].qos == topics["backplane", None].qos == SCAN
    assert ("common/SHUT", None) not in topics
    assert ("common/NAMES", None) not in topics, "std_msgs cannot carry arrays of strings"
    assert {topic.slot for topic in started.stream.module_topics} == {1, 2}
    assert {item.slot for item in started.on("scans")} <= {1, 2}


# Writes and values


def test_write_log_is_complete_and_gapless(started):
    started.rack.run(1.0)
    started.rack.write("REF%", 7)
    started.rack.run(0.1)
    writes = [item.message for item in started.on("backplane")]
    assert [write.sequence for write in writes] == list(range(1, len(writes) + 1))
    assert [write.stamp for write in writes] == sorted(write.stamp for write in writes)
    memory = {(view, element): 0.0 for view, element, _ in started.rack.memory.image()}
    texts: dict[tuple[int, int], str] = {}
    strings = {view for view, spec in enumerate(started.rack.memory.specs) if spec.type.value == "$"}
    for write in writes:
        text = iter(write.values.text)
        for view, element, value in entries(write.values):
            memory[view, element] = value
            if view in strings:
                texts[view, element] = next(text)
        assert next(text, None) is None
    for view, element, value in started.rack.memory.image():
        if view in strings:
            assert texts.get((view, element), "") == value
        else:
            assert memory[view, element] == value


def test_writes_of_one_writer_kind_and_instant_travel_together(started):
    work = started.rack.task("WORK").writer
    first = [item.message for item in started.on("backplane")]
    assert [(write.writer, write.kind) for write in first] == [(0, WriteKind.OUTSIDE), (3, WriteKind.BASIC)]
    started.rack.run(0.0001)
    scan = [item.message for item in started.on("backplane")][2:]
    assert [(write.writer, write.slot, write.kind) for write in scan] == [
        (3, 1, WriteKind.BASIC),
        (3, 1, WriteKind.COMMIT),
        (work, 2, WriteKind.BASIC),
    ]


def test_value_is_sent_on_change_only(started):
    started.rack.run(0.05)
    started.rack.write("REF%", 100)
    started.rack.write("REF%", 50)
    started.rack.run(0.05)
    assert started.values("REF") == [(0, 0), (0, 100), (50, 50)]
    assert started.values("SUM") == [(0, 0), (0, 5), (0, 101), (55, 51)]
    assert started.values("NOTE") == [(0, ""), (0, "Grüße")]
    assert started.values("COPY") == [(0, ""), (0, "Grüße")]


def test_array_is_sent_whole_once_a_scan(started):
    started.rack.run(0.01)
    table = view_of(started.rack, "TABLE%")
    before = len(started.on("common/TABLE"))
    started.rack.write_view(table, [(element, 10 + element) for element in range(6)], 1)
    started.rack.run(0.0005)  # WORK's scan at 10 ms writes three elements, one after the other
    sent = [item.message for item in started.on("common/TABLE")][before:]
    assert [list(message.data) for message in sent] == [
        [10, 11, 12, 13, 14, 15],
        [10, 11, 12, *(101 + value for value in (10, 11, 12))],
    ]
    assert started.rack.value("SHUT%") == 101
    layout = sent[0].layout
    assert [(item.label, item.size, item.stride) for item in layout.dim] == [("subscript1", 2, 6), ("subscript2", 3, 3)]


def test_rate_limit_spaces_messages_and_sends_the_last_value(started):
    started.rack.run(1.0)  # SLOW! counts each 10 ms; 10 messages per second are allowed
    times = [time for time, _ in started.values("SLOW")]
    assert times == [0, *range(100, 1000, 100)]
    assert started.values("SLOW")[1] == (100, 11), "the value of the scan at that very instant"
    started.stream.end()
    assert started.values("SLOW")[-1][1] == started.rack.value("SLOW!") == 100


def test_last_value_before_a_pause_is_sent(tmp_path):
    still = "10 COMMON SLOW!\n100 CALL SCAN_LOOP(TICKS=1)\n110 IF SLOW! < 3 THEN SLOW! = SLOW! + 1\n120 END\n"
    stream = Stream(build(tmp_path, WORK=still))
    stream.rack.start()
    stream.rack.run(10.0)
    assert stream.values("SLOW") == [(0, 0), (100, 3)]


@pytest.mark.parametrize("limit", [3.0, 7.5, 33.3, 2000.0])
def test_rate_limit_is_never_exceeded(tmp_path, limit):
    stream = Stream(build(tmp_path, YAML.replace("rate_limit_hz: 10", f"rate_limit_hz: {limit}")))
    stream.rack.start()
    for _ in range(50):
        stream.rack.run(0.0123)
        stream.rack.write("SLOW!", stream.rack.value("SLOW!") + 1)
    times = [item.stamp for item in stream.on("common/SLOW")]
    assert min(after - before for before, after in pairwise(times)) >= round(NS_PER_S / limit)


def test_late_joiners_get_a_fresh_image(started, tmp_path):
    started.rack.run(0.5)
    started.stream.send_image()
    image = started.on("backplane/snapshot")[-1].message
    assert image.stamp == 500 * NS_PER_MS
    assert image.sequence == started.on("backplane")[-1].message.sequence
    numbers = [value for _, _, value in started.rack.memory.image()]
    assert image.values.value == tuple(0.0 if isinstance(value, str) else value for value in numbers)
    assert image.values.text == tuple(value for value in numbers if isinstance(value, str))


def test_nothing_is_sent_before_the_beginning(tmp_path):
    stream = RackStream(build(tmp_path), 1)
    sent: list[Any] = []
    stream.add_sink(lambda _: lambda *message: sent.append(message))
    stream.send_image()
    assert sent == []


def test_sink_is_asked_once_for_each_topic_and_gets_what_it_takes(tmp_path):
    rack = build(tmp_path)
    stream = RackStream(rack, 1)
    asked: list[Any] = []
    taken: list[bytes] = []
    everything: list[str] = []

    def choose(topic):
        asked.append(topic)
        return (lambda _, data: taken.append(data)) if topic is stream.backplane_topic else None

    takes = stream.add_sink(choose)
    stream.add_sink(lambda topic: lambda *_: everything.append(topic.name))
    stream.begin()
    rack.start()
    rack.run(0.1)
    stream.end()
    assert asked == stream.topics
    assert list(takes) == [stream.backplane_topic]
    assert len(taken) == everything.count("/line1/backplane") > 0
    assert {decode("automax_msgs/msg/CommonWrite", data).run_id for data in taken} == {1}
    before = len(everything)
    stream.repeat_facts(takes)
    assert len(everything) == before


def test_facts_are_repeated_for_one_sink_alone(tmp_path):
    rack = build(tmp_path)
    stream = RackStream(rack, 1)
    one, other = ([], [])
    stream.add_sink(lambda topic: lambda *_: other.append(topic.name))
    takes = stream.add_sink(lambda topic: lambda *_: one.append(topic.name), tasks={"SPEED"})
    stream.begin()
    rack.start()
    rack.run(0.1)
    one.clear()
    before = len(other)
    stream.repeat_facts(takes)
    assert len(other) == before
    assert one[:2] == ["/line1/variables", "/line1/backplane/snapshot"]
    assert one[-1] == "/line1/states"
    assert one.count("/line1/states") == 1


# Scans and states


def test_scan_carries_what_it_saw_and_did(started):
    started.rack.run(0.011)
    started.rack.write("REF%", 30)
    started.rack.run(0.011)
    start, first, second = started.scans("SPEED")
    names = ("REF%", "SUM%", "RUN@", "TABLE%")  # RUN@ is latched for LAG and read by IF besides
    reference, total, running, table = (view_of(started.rack, name) for name in names)
    assert (start.scan, start.full, entries(start.written)) == (0, True, [(total, 0, 5)])
    assert (first.scan, first.stamp, first.full) == (1, 0, True)
    assert entries(first.latched) == [(reference, 0, 100), (total, 0, 5), (running, 0, 0)]
    assert entries(first.committed) == [(total, 0, 101)]
    assert entries(first.read) == [(table, 1, 0), (running, 0, 0)]
    assert entries(first.written) == [(table, 4, 0)]
    assert (second.scan, second.stamp, second.full) == (2, 11 * NS_PER_MS, False)
    assert entries(second.latched) == [(reference, 0, 30), (total, 0, 101)]
    assert entries(second.committed) == [(total, 0, 31)]
    assert {scan.duration_ns for scan in (start, first, second)} == {0}


def test_unchanged_latch_is_empty(started):
    started.rack.run(0.1)
    assert [entries(scan.latched) for scan in started.scans("SPEED")[3:]] == [[]] * 8
    assert [entries(scan.committed) for scan in started.scans("SPEED")[2:]] == [[]] * 9


def test_errors_of_a_scan_travel_with_it(started):
    started.rack.write("RUN@", True)
    started.rack.run(0.001)
    # an integer divided by zero is the 32-bit clamp, which 16 bits do not hold
    division, clamp = started.scans("SPEED")[-1].errors
    assert {division.line, clamp.line} == {140}
    assert [f"AMX{error.code}" for error in (division, clamp)] == ["AMX7024", "AMX7020"]


def test_skipped_deadlines_travel_with_the_next_scan(started):
    for wall_ms in (0, 12, 60):
        started.rack.scheduler.run_due(wall_ms * NS_PER_MS)
    assert [(scan.scan, scan.stamp / NS_PER_MS, scan.skipped) for scan in started.scans("SPEED")[1:]] == [
        (1, 0, 0),
        (2, 11, 0),
        (3, 55, 3),
    ]


def test_snapshots_come_with_full_scans_every_period(started):
    started.rack.run(25.0)
    full = [scan.stamp for scan in started.scans("SPEED") if scan.full and scan.scan]
    grid = [-(-number * SNAPSHOT_PERIOD_NS // (11 * NS_PER_MS)) * 11 * NS_PER_MS for number in range(3)]
    assert full == grid
    states = [item.message for item in started.on("states") if item.message.task == "SPEED"]
    assert [state.stamp for state in states] == [0, *grid]
    assert states[0].scan == 0
    images = [item.stamp for item in started.on("backplane/snapshot")]
    assert images == [0, *(min(stamp, -(-stamp // (10 * NS_PER_MS)) * 10 * NS_PER_MS) for stamp in images[1:])]
    assert [stamp // SNAPSHOT_PERIOD_NS for stamp in images] == [0, 1, 2]


def test_state_is_the_tasks_own(started):
    started.rack.run(0.05)
    task = started.rack.task("SPEED")
    started.rack.tune(task, "TRIM%", 4)
    state = started.on("states")[-1].message
    assert (state.task, state.slot, state.scan, state.stamp) == ("SPEED", 1, 5, 50 * NS_PER_MS)
    assert state.layout_hash == task.layout.hash
    assert state.source_hash == task.compiled.program.source_hash
    assert sum(state.size) == len(state.value)
    assert dict(zip(state.field, state.value, strict=False))["TRIM%"] == 4
    assert list(state.value) == [float(value) for value in task.snapshot()]


def test_task_reloaded_before_the_beginning_is_described_as_it_is(tmp_path):
    rack = build(tmp_path)
    stream = RackStream(rack, 77)
    rack.operations.reload("SPEED", SourceText("SPEED.BLK", SPEED.replace("TRIM%", "SHIM%")))
    hashes: list[str] = []
    stream.add_sink(
        lambda topic: (
            (lambda _, data: hashes.append(decode(topic.type_name, data).source_hash))
            if topic is stream.states_topics[1]
            else None
        )
    )
    stream.begin()
    rack.start()
    assert rack.task("SPEED").compiled.program.source_hash in hashes


def test_end_sends_final_states(started):
    started.rack.run(0.05)
    before = len(started.all)
    started.stream.end()
    assert [(item.topic, item.message.task) for item in started.all[before:] if item.topic == "states"] == [
        ("states", "SPEED"),
        ("states", "WORK"),
    ]


def test_stop_all_is_in_the_stream(tmp_path):
    stream = Stream(build(tmp_path, SPEED=SPEED.replace("LAST% = LAST% / NIL%", "140")))
    stream.rack.start()
    stream.rack.run(0.05)
    stream.rack.write("RUN@", True)
    before = len(stream.all)
    stream.rack.run(0.02)
    assert stream.rack.stop_reason is not None
    after = stream.all[before:]
    cleared = [item.message for item in after if item.topic == "backplane"][-1]
    assert (cleared.writer, cleared.kind) == (0, WriteKind.OUTSIDE)
    assert set(cleared.values.value) == {0.0}
    assert [item.topic for item in after][-2:] == ["states", "states"]
    assert stream.values("REF")[-1][1] == 0


def test_stamps_carry_the_epoch(tmp_path):
    epoch = 1_700_000_000 * NS_PER_S
    stream = Stream(build(tmp_path), epoch_ns=epoch)
    stream.rack.start()
    stream.rack.run(0.011)
    stamps = {item.stamp - epoch for item in stream.on("scans")}
    assert stamps == {0, 10 * NS_PER_MS}
    assert all(item.message.stamp == item.stamp for item in stream.all if hasattr(item.message, "stamp"))
