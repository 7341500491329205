"""Recording a rack from outside: late joining, lost messages, restarts, all without ROS.

What a recorder must get right is checked by a model of its own: memory built from the bag's images and writes is at
each scan what that scan latched.
"""

from __future__ import annotations

import struct
import time
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from replay.reexecution import Reexecution

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.cdr import decode, encode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.rack_files import RackFile, files_of
from automax_ros.rack.rack import Rack
from automax_ros.recordings.live.recording import MAX_PENDING, LiveRecording
from automax_ros.recordings.live.topics import LiveTopics
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.soundness import verdict_of
from automax_ros.recordings.write.data_file import StorageOptions
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.engine import replay
from recordings.live_racks import YAML, build

RUN = 4711
EPOCH = 1_700_000_000_000_000_000
SENT = 50_000
"""Time between two messages as they are sent, ns; the rack's own times do not matter."""


class Sent(NamedTuple):
    topic: str
    payload: bytes


class Wire:
    """A rack whose messages are noted as they are sent; ``join`` is what the nodes do for a late joiner."""

    def __init__(
        self, folder: Path, run_id: int = RUN, epoch: int = EPOCH, *, own: Path | None = None, yaml: str = YAML
    ) -> None:
        folder.mkdir(exist_ok=True)
        self.rack: Rack = build(folder, yaml)
        self.stream = RackStream(self.rack, run_id)
        self.recorder = Recorder(self.rack, self.stream, own) if own else None
        self.sent: list[Sent] = []
        self.stream.add_sink(lambda topic: lambda _, payload: self.sent.append(Sent(topic.name, payload)))
        self.stream.begin(epoch)
        self.rack.start()

    def run(self, seconds: float) -> None:
        """Let time pass, with something from outside in it."""
        self.rack.run(seconds / 2)
        self.rack.write("REF%", int(self.rack.now_ns // 1_000_000) % 500, 1)
        self.rack.run(seconds / 2)

    def join(self) -> int:
        """Send the image and the states again; return where they begin among the messages."""
        start = len(self.sent)
        self.stream.send_image()
        for processor in self.rack.task_modules:
            self.stream.send_states(processor.config.slot)
        return start

    def end(self) -> list[Sent]:
        self.stream.end()
        if self.recorder:
            self.recorder.close()
        return self.sent

    @property
    def table(self) -> bytes:
        return next(item.payload for item in self.sent if item.topic == "/line1/variables")


def recording_of(wire: Wire, folder: Path, files: list[RackFile] | None = None, **options: Any) -> LiveRecording:
    table: Any = decode("automax_msgs/msg/VariableTable", wire.table)
    topics = LiveTopics("/line1", table)
    return LiveRecording(folder, topics, wire.table, files_of(wire.rack) if files is None else files, **options)


def feed(recording: LiveRecording, messages: list[Sent], first: int = 0) -> None:
    for number, (topic, payload) in enumerate(messages, first):
        recording.take(topic, number * SENT + 1, payload)


def decoded(bag: Path, *topics: str) -> list[Any]:
    return [item.message for item in BagReader(bag).messages(topics=set(topics) or None)]


def check_scans_saw_memory(bag: Path) -> int:
    """Rebuild memory from the bag and compare it with what each scan latched; return the number of values compared."""
    memory: dict[tuple[int, int], float] = {}
    latched: dict[str, dict[int, float]] = {}
    compared = 0
    for item in BagReader(bag).messages():
        message: Any = item.message
        if item.topic.endswith(("/snapshot", "/backplane")):
            memory.update(entries(message.values))
        elif item.topic.endswith("/scans"):
            seen = latched.setdefault(message.task, {})
            if message.full:
                seen.clear()
            seen.update({view: value for (view, _), value in entries(message.latched).items()})
            for view, value in seen.items():
                assert bits(memory[view, 0]) == bits(value), (message.task, message.scan, view)
                compared += 1
    return compared


def entries(values: Any) -> dict[tuple[int, int], float]:
    """The entries of a Values message; strings hold 0 in it and are left out of the comparison by being equal."""
    return dict(zip(zip(values.variable, values.element, strict=True), values.value, strict=True))


def is_scan(item: Sent) -> bool:
    return item.topic == "/line1/scans"


def wrote(item: Sent) -> bool:
    """Whether a message is a scan that wrote common memory."""
    if item.topic != "/line1/scans":
        return False
    scan: Any = decode("automax_msgs/msg/Scan", item.payload)
    return bool(scan.committed.variable or scan.written.variable)


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


@pytest.fixture
def wire(tmp_path: Path) -> Wire:
    return Wire(tmp_path / "rack", own=tmp_path / "own")


def test_recording_from_the_start_is_the_racks_own(wire, tmp_path):
    wire.run(12.0)
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, wire.end())
    recording.close()
    assert (recording.ended, recording.failure, recording.gaps, recording.lacks) == (None, None, [], [])
    topics = {"/line1/variables", "/line1/backplane/snapshot", "/line1/backplane", "/line1/scans", "/line1/states"}
    started = list(BagReader(tmp_path / "own").messages(topics=topics))
    found = list(BagReader(tmp_path / "bag").messages(topics=topics))
    assert [item.message for item in found] == [item.message for item in started]
    assert [item.stamp for item in found] == [item.stamp for item in started]
    values = [(item.topic, item.message) for item in BagReader(tmp_path / "own").messages(types={"std_msgs/msg/Int16"})]
    assert [
        (item.topic, item.message) for item in BagReader(tmp_path / "bag").messages(types={"std_msgs/msg/Int16"})
    ] == values
    own, bag = BagReader(tmp_path / "own"), BagReader(tmp_path / "bag")
    assert {item.name: item.data for item in bag.attachments()} == {item.name: item.data for item in own.attachments()}
    assert bag.custom_data["fingerprint"] == own.custom_data["fingerprint"]


def test_late_recording_begins_with_the_image_and_executes_again(wire, tmp_path):
    wire.run(3.0)
    start = wire.join()
    joined_at = wire.rack.now_ns
    wire.run(3.0)
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, wire.end()[start - 40 :], start - 40)
    recording.close()
    assert (recording.gaps, recording.lacks) == ([], [])
    assert recording.first_stamp == EPOCH + joined_at
    assert recording.replayable_from is not None
    assert recording.seconds(recording.replayable_from) < 3.02
    messages = decoded(tmp_path / "bag")
    assert [type(item).__name__ for item in messages[:2]] == ["VariableTable", "CommonImage"]
    assert messages[0].stamp == EPOCH
    first = next(item for item in BagReader(tmp_path / "bag").messages())
    assert first.log_time == EPOCH + joined_at
    assert check_scans_saw_memory(tmp_path / "bag") > 500
    (tmp_path / "again").mkdir()
    outcome = Reexecution(tmp_path / "bag", tmp_path / "again").execute()
    assert min(outcome.scans.values()) > 250


def test_each_file_of_a_split_recording_replays_alone(wire, tmp_path):
    for _ in range(4):
        wire.run(1.3)
        wire.join()
    recording = recording_of(wire, tmp_path / "bag", split_ns=1_000_000_000)
    waited = 0
    for number, (topic, payload) in enumerate(wire.end()):
        recording.take(topic, number * SENT + 1, payload)
        waited += recording.wants_image and recording.first_stamp is not None
    recording.close()
    assert waited > 100, "the rack is asked for an image when a file is due"
    assert (recording.gaps, recording.lacks) == ([], [])
    files = sorted((tmp_path / "bag").glob("*.mcap"))
    assert len(files) == recording.files_begun == 5
    whole = replay(tmp_path / "bag")
    assert whole.identical
    alone = [replay(file) for file in files[:-1]]
    assert all(report.identical for report in alone)
    assert sum(report.scans for report in alone) == whole.scans


def test_files_end_by_size(wire, tmp_path):
    for _ in range(8):
        wire.run(1.0)
        wire.join()
    storage = StorageOptions("none", split_bytes=1 << 16)
    recording = recording_of(wire, tmp_path / "bag", storage=storage)
    feed(recording, wire.end())
    recording.close()
    sizes = [file.stat().st_size for file in sorted((tmp_path / "bag").glob("*.mcap"))]
    assert len(sizes) > 2
    assert min(sizes[:-1]) >= 1 << 16
    assert replay(tmp_path / "bag").identical


def test_image_older_than_the_first_write_is_waited_over(wire, tmp_path):
    """A latched image may be as old as the run: writes between it and the first one that came are unknown."""
    wire.run(2.0)
    old_image = next(item for item in wire.sent if item.topic == "/line1/backplane/snapshot")
    before = len(wire.sent)
    wire.run(1.0)
    start = wire.join()
    wire.run(1.0)
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, [old_image, *wire.end()[before:]])
    recording.close()
    assert recording.first_stamp == EPOCH + 3_000_000_000
    assert start > before
    assert recording.gaps == []
    assert check_scans_saw_memory(tmp_path / "bag") > 100


def test_idle_rack_is_recorded_from_its_image_alone(wire, tmp_path):
    """Where no write comes, nothing proves the image; after a while it is taken for the present memory."""
    wire.run(1.0)
    start = wire.join()
    wire.run(1.0)
    quiet = [item for item in wire.end()[start:] if item.topic != "/line1/backplane" and not wrote(item)]
    recording = recording_of(wire, tmp_path / "bag")
    for number, (topic, payload) in enumerate(quiet):
        recording.take(topic, 1 + number * 20_000_000, payload)
        if number * 20_000_000 < 900_000_000:
            assert recording.first_stamp is None
    assert recording.first_stamp is not None
    assert len(quiet) < MAX_PENDING
    recording.close()
    assert recording.scans == sum(item.topic == "/line1/scans" for item in quiet)


def test_image_alone_is_kept_at_the_end(wire, tmp_path):
    start = wire.join()
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, wire.sent[start : start + 1])
    recording.close()
    assert [type(item).__name__ for item in decoded(tmp_path / "bag")] == ["VariableTable", "CommonImage"]


# Gaps


def test_gap_in_the_write_log_is_told_and_rests_until_the_next_image(wire, tmp_path):
    wire.run(2.0)
    lost_from = len(wire.sent)
    wire.run(0.5)
    lost_to = len(wire.sent)
    wire.run(0.5)
    again = wire.join()
    wire.run(1.0)
    sent = wire.end()
    missing = sum(item.topic == "/line1/backplane" for item in sent[lost_from:lost_to])
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, sent[:lost_from])
    feed(recording, sent[lost_to:again], lost_to)
    assert recording.wants_image
    assert [(gap.what, gap.missing) for gap in recording.gaps] == [("writes of common memory", missing)]
    (note,) = recording.notes
    assert f"{missing} writes of common memory did not come" in note
    feed(recording, sent[again:], again)
    assert not recording.wants_image
    assert not recording.wants_states
    recording.close()
    assert "gap" not in "".join(recording.notes[1:])
    bag = tmp_path / "bag"
    writes = [item.sequence for item in decoded(bag, "/line1/backplane")]
    jumps = [(one, two) for one, two in pairwise(writes) if two != one + 1]
    assert len(jumps) == 1
    images = [item.sequence for item in decoded(bag, "/line1/backplane/snapshot")]
    assert jumps[0][1] == images[-1] + 1
    assert recording.gaps[0].missing == jumps[0][1] - jumps[0][0] - 1 > missing
    assert BagReader(bag).custom_data["gaps"].startswith("1: 2.5")
    assert check_scans_saw_memory(bag) > 500
    (tmp_path / "again").mkdir()
    assert min(Reexecution(bag, tmp_path / "again").execute().scans.values()) > 200


def test_an_image_from_before_a_loss_does_not_begin_the_recording_again(wire, tmp_path):
    """A recorder that stood still gets the image of a late joiner after a write that shows the loss."""
    wire.run(2.0)
    older = len(wire.sent)
    wire.stream.send_image()
    wire.run(1.5)
    after = len(wire.sent)
    wire.run(0.5)
    newer = wire.join()
    wire.run(1.0)
    sent = wire.end()
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, sent[:older])
    first_write = next(number for number in range(after, newer) if sent[number].topic == "/line1/backplane")
    feed(recording, sent[first_write : first_write + 1], after)
    feed(recording, sent[older : older + 1], after)
    later = 2 * NS_PER_S // SENT  # long enough without a write for what waits to be recorded
    feed(recording, sent[first_write + 1 : newer], after + later)
    feed(recording, sent[newer:], newer + later)
    recording.close()
    assert [gap.what for gap in recording.gaps] == ["writes of common memory"]
    writes = [item.sequence for item in decoded(tmp_path / "bag", "/line1/backplane")]
    ((before, following),) = [(one, two) for one, two in pairwise(writes) if two != one + 1]
    assert recording.gaps[0].missing == following - before - 1
    assert verdict_of(BagReader(tmp_path / "bag")).fault is None
    assert check_scans_saw_memory(tmp_path / "bag") > 500


def test_missing_scan_rests_its_task_alone(wire, tmp_path):
    wire.run(1.0)
    sent = list(wire.sent)
    number = next(
        index
        for index, item in enumerate(sent)
        if item.topic == "/line1/scans" and b"WORK" in item.payload and index > len(sent) // 2
    )
    wire.join()
    wire.run(0.5)
    rest = wire.end()[len(sent) :]
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, sent[:number] + sent[number + 1 :])
    assert [(gap.what, gap.missing) for gap in recording.gaps] == [("scans of task WORK", 1)]
    assert recording.wants_states
    feed(recording, rest, len(sent))
    assert not recording.wants_states
    recording.close()
    scans = decoded(tmp_path / "bag", "/line1/scans")
    speed = [item.scan for item in scans if item.task == "SPEED"]
    work = [item for item in scans if item.task == "WORK"]
    assert speed == list(range(len(speed)))
    after = next(two for one, two in pairwise(work) if two.scan != one.scan + 1)
    assert after.full
    assert check_scans_saw_memory(tmp_path / "bag") > 300


@settings(max_examples=25, deadline=None, derandomize=True)
@given(data=st.data())
def test_whatever_is_lost_the_bag_tells_no_lies(tmp_path_factory, data):
    """Stretches of messages are lost, the rack answers the recorder's knocks: each scan in the bag saw its memory."""
    folder = tmp_path_factory.mktemp("lossy")
    wire = Wire(folder / "rack")
    recording = recording_of(wire, folder / "bag")
    position = 0
    for _ in range(data.draw(st.integers(1, 6))):
        wire.run(data.draw(st.sampled_from([0.05, 0.3, 1.1])))
        if data.draw(st.booleans()):
            wire.join()
        keep = data.draw(st.integers(0, 10)) > 2
        topic = data.draw(st.sampled_from(["", "/line1/backplane", "/line1/scans", "/line1/states"]))
        fresh = wire.sent[position:]
        feed(recording, [item for item in fresh if keep or topic not in {"", item.topic}], position)
        position = len(wire.sent)
    feed(recording, wire.end()[position:], position)
    recording.close()
    assert recording.failure is None
    assert recording.ended is None
    if recording.first_stamp is not None:
        fault = verdict_of(BagReader(folder / "bag")).fault
        assert (fault is None) == (recording.executable > 0), fault
        check_scans_saw_memory(folder / "bag")
        numbers: dict[str, int] = {}
        for scan in decoded(folder / "bag", "/line1/scans"):
            assert scan.full or numbers[scan.task] == scan.scan - 1
            numbers[scan.task] = scan.scan
        if recording.scans:
            (folder / "again").mkdir()
            Tolerant(folder / "bag", folder / "again").execute()


class Tolerant(Reexecution):
    """Leaves out scans before a state: a bag may hold a full scan whose state was lost."""

    def _scan(self, message: Any) -> None:
        if self._known.get(message.task) == message.scan - 1:
            super()._scan(message)
        elif message.full:
            self._memories[message.task].latched.clear()
            self._memories[message.task].latched.update(
                {view: value for view, _, value in self._typed(message.latched)}
            )


# The end


def test_a_rack_that_rested_and_runs_again_is_still_the_same(tmp_path):
    """After STOP ALL nothing is sent for 5 s; RUN begins with a part that writes nothing: it is the same run."""
    wire = Wire(tmp_path / "rack")
    wire.run(0.5)
    recording = recording_of(wire, tmp_path / "live")
    wire.rack.operations.stop_all("test")
    before = len(wire.sent)
    wire.rack.run(5.0)
    assert len(wire.sent) == before
    wire.rack.operations.run_all()
    resumed = len(wire.sent)
    wire.run(0.5)
    messages = wire.end()
    feed(recording, messages[:before])
    pause = 5_000_000_000 // SENT
    quiet = [item for item in messages[before:resumed] if item.topic != "/line1/backplane"]
    feed(recording, quiet, before + pause)
    assert recording.ended is None
    feed(recording, [item for item in messages[before:] if item not in quiet], before + pause + len(quiet))
    recording.close()
    assert recording.ended is None
    report = replay(tmp_path / "live")
    assert report.identical
    assert all(any("went into RUN again" in note for note in task.notes) for task in report.tasks)


@pytest.mark.parametrize("messages", ["all", "scans", "writes", "images"])
def test_restarted_rack_ends_the_recording(wire, tmp_path, messages):
    """Whatever comes first of the new run: nothing of it enters the bag."""
    wire.run(1.0)
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, wire.end())
    second = Wire(tmp_path / "second", RUN + 1, EPOCH + 60_000_000_000)
    second.run(0.2)
    wanted = {"scans": "/line1/scans", "writes": "/line1/backplane", "images": "/line1/backplane/snapshot"}.get(
        messages
    )
    scans, writes = recording.scans, recording.writes
    feed(recording, [item for item in second.end() if wanted in {None, item.topic}], 100_000)
    assert (recording.scans, recording.writes) == (scans, writes)
    recording.close()
    assert recording.ended == "the rack was started again"
    assert (recording.scans, recording.writes) == (scans, writes)
    assert {item.run_id for item in decoded(tmp_path / "bag", "/line1/backplane")} == {RUN}
    assert max(item.stamp for item in BagReader(tmp_path / "bag").messages()) < EPOCH + 2_000_000_000
    assert BagReader(tmp_path / "bag").custom_data["ended"] == recording.ended


def test_task_put_into_run_again_does_not_end_the_recording(wire, tmp_path):
    """Scans of this run stand before a write of this run: they count from 0 again since the task alone began again."""
    wire.run(0.5)
    wire.rack.operations.stop("WORK")
    wire.run(0.2)
    wire.rack.operations.run("WORK")
    wire.run(0.2)
    wire.rack.operations.stop_all("test")
    wire.rack.operations.run_all()
    wire.run(0.1)
    wire.rack.operations.reload("WORK", wire.rack.sources["WORK"])
    wire.run(0.3)
    recording = recording_of(wire, tmp_path / "bag")
    sent = wire.end()
    feed(recording, sent)
    recording.close()
    assert (recording.ended, recording.gaps) == (None, [])
    assert recording.scans == sum(item.topic == "/line1/scans" for item in sent)
    assert replay(tmp_path / "bag").identical


@pytest.mark.parametrize("lost", [False, True])
def test_a_state_that_comes_before_its_scans_is_recorded_after_them(wire, tmp_path, lost):
    """DDS keeps the order of a topic only: what a full socket drops of one comes again after the others."""
    for _ in range(4):
        wire.run(0.02)
    middle = len(wire.sent)
    wire.run(0.05)
    sent = wire.end()
    states = [item for item in sent[middle:] if item.topic == "/line1/states"]
    late = [item for item in sent[middle:] if item.topic != "/line1/states" and not (lost and is_scan(item))]
    bag = tmp_path / "bag"
    recording = recording_of(wire, bag)
    feed(recording, [*sent[:middle], *states, *late])
    recording.close()
    notes = [note for task in replay(bag).tasks for note in task.notes]
    assert any("are missing before" in note for note in notes) == lost, notes
    assert lost or replay(bag).identical


def test_a_recording_of_one_scan_says_that_nothing_of_it_can_be_replayed(wire, tmp_path):
    """It ends before a scan that follows a state: the recorder knows it as the check of the bag does."""
    wire.run(0.5)
    first = wire.join()
    wire.run(0.011)
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, [item for item in wire.sent[first:] if item.topic != "/line1/states"], first)
    recording.close()
    assert recording.scans > 0
    assert recording.executable == 0
    fault = verdict_of(BagReader(tmp_path / "bag")).fault
    assert fault is not None
    assert fault.code == "AMX6832"


def test_repeated_messages_are_dropped(wire, tmp_path):
    wire.run(0.5)
    recording = recording_of(wire, tmp_path / "bag")
    sent = wire.end()
    twice = [
        item for message in sent for item in ([message, message] if message.topic != "/line1/states" else [message])
    ]
    feed(recording, [item for item in twice if not item.topic.startswith("/line1/common")])
    recording.close()
    assert recording.ended is None
    assert recording.gaps == []
    assert recording.writes == sum(item.topic == "/line1/backplane" for item in sent)


FORGED = {"/line1/scans": "Scan", "/line1/backplane": "CommonWrite", "/line1/states": "TaskState"}


@pytest.mark.parametrize("stamp", [-1, -(1 << 31) * 1_000_000_000, (1 << 31) * 1_000_000_000 - 1])
def test_a_message_of_an_impossible_time_is_left_out_and_ends_no_recording(wire, tmp_path, stamp):
    wire.run(0.3)
    recording = recording_of(wire, tmp_path / "bag")
    sent = wire.end()
    forged = []
    for topic, kind in FORGED.items():
        payload = next(item.payload for item in sent if item.topic == topic)
        message: Any = decode(f"automax_msgs/msg/{kind}", payload)
        forged.append(Sent(topic, encode(message._replace(stamp=stamp))))
    feed(recording, sent[:50] + forged + sent[50:])
    recording.close()
    assert (recording.failure, recording.ended, recording.gaps) == (None, None, [])
    assert recording.malformed == len(forged)
    assert check_scans_saw_memory(tmp_path / "bag") > 50


def test_a_value_sent_at_the_end_of_time_ends_no_recording(wire, tmp_path):
    wire.run(0.3)
    recording = recording_of(wire, tmp_path / "bag")
    sent = wire.end()
    for number, (topic, payload) in enumerate(sent):
        is_value = topic == "/line1/common/REF"
        recording.take(topic, (1 << 63) - 1 if is_value else number * SENT + 1, payload)
    recording.close()
    assert recording.failure is None


def test_malformed_messages_are_left_out_and_told(wire, tmp_path):
    wire.run(0.3)
    recording = recording_of(wire, tmp_path / "bag")
    sent = wire.end()
    bad = [Sent(topic, payload[:9]) for topic, payload in sent if topic in {"/line1/scans", "/line1/backplane"}][:5]
    bad.append(Sent("/line1/states", b"\x00\x00\x00\x00" + sent[0].payload[4:]))
    feed(recording, sent[:50] + bad + sent[50:])
    recording.close()
    assert recording.malformed == len(bad)
    assert len([note for note in recording.notes if "malformed" in note]) == 3
    assert recording.gaps == []
    assert check_scans_saw_memory(tmp_path / "bag") > 50


def test_bag_tells_what_it_lacks(wire, tmp_path):
    wire.run(0.3)
    files = [item for item in files_of(wire.rack) if item.name != "SPEED.BLK"]
    files[-1] = RackFile(files[-1].name, files[-1].text + "\n")
    recording = recording_of(wire, tmp_path / "bag", files)
    feed(recording, wire.end())
    recording.close()
    assert recording.lacks == ["the file SPEED.BLK", "the source that task WORK runs (another one is stored)"]
    assert any("WORK.BLK is not the source" in note for note in recording.notes)
    custom = BagReader(tmp_path / "bag").custom_data
    assert custom["lacks"] == "; ".join(recording.lacks)
    assert "fingerprint" not in custom


def test_chosen_tasks_only(wire, tmp_path):
    wire.run(0.5)
    recording = recording_of(wire, tmp_path / "bag", tasks={"WORK"})
    feed(recording, wire.end())
    recording.close()
    assert {item.task for item in decoded(tmp_path / "bag", "/line1/scans", "/line1/states")} == {"WORK"}
    assert {item.writer for item in decoded(tmp_path / "bag", "/line1/backplane")} > {1}
    assert recording.lacks == []


def test_full_disk_ends_the_recording(wire, tmp_path, monkeypatch):
    from automax_ros.recordings.write import writer

    wire.run(0.5)
    recording = recording_of(wire, tmp_path / "bag")
    feed(recording, wire.sent[:200])

    def refuse(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writer.DataFile, "write", refuse)
    end = time.monotonic() + 240
    while recording.failure is None and time.monotonic() < end:
        recording.flush(10_000_000_000)  # as a recorder does every now and then
        time.sleep(0.001)
    assert recording.failure is not None
    assert "No space left" in str(recording.failure)
    feed(recording, wire.sent[200:])
    recording.close()


def test_operations_of_the_span_are_recorded_and_those_before_are_not(tmp_path):
    """The rack's last operations wait for late joiners; a reloaded source is stored, and the bag replays with both."""
    wire = Wire(tmp_path / "rack")
    wire.run(0.2)
    wire.rack.operations.stop("WORK")
    old = [item for item in wire.sent if item.topic == "/line1/operations"]
    wire.rack.operations.run("WORK")
    wire.run(0.2)
    joined = wire.join()
    recording = recording_of(wire, tmp_path / "live")
    wire.run(0.2)
    text = wire.rack.sources["SPEED"].text.replace("LIMIT_PLUS=1000", "LIMIT_PLUS=20")
    wire.rack.operations.reload("SPEED", SourceText("SPEED.BLK", text))
    recording.store(files_of(wire.rack))
    wire.run(0.2)
    wire.rack.operations.stop_all("test")
    wire.rack.operations.run_all()
    wire.run(0.2)
    messages = wire.end()[joined:]
    image = next(number for number, item in enumerate(messages) if item.topic == "/line1/backplane") + 1
    feed(recording, [*messages[:image], *old, *messages[image:]])
    recording.close()
    assert len(old) == 1
    told = decoded(tmp_path / "live", "/line1/operations")
    assert [(item.what, item.task) for item in told] == [("reload", "SPEED"), ("stop_all", ""), ("run_all", "")]
    assert recording.lacks == []
    report = replay(tmp_path / "live")
    assert report.identical
    speed = next(task for task in report.tasks if task.name == "SPEED")
    assert any(note.startswith("reloaded at") for note in speed.notes)
    assert speed.scans > 40


def test_a_rack_whose_scans_take_time_is_recorded_without_a_gap(tmp_path):
    """Scans of two Processors run at the same time: what one writes comes in the middle of the other's."""
    wire = Wire(tmp_path / "rack", yaml=f"execution: modeled\n{YAML}")
    wire.run(0.1)
    joined = wire.join()
    recording = recording_of(wire, tmp_path / "live")
    wire.run(2.0)
    feed(recording, wire.end()[joined:])
    recording.close()
    assert (recording.gaps, recording.lacks) == ([], [])
    report = replay(tmp_path / "live")
    assert report.identical
    assert all(task.scans > 150 for task in report.tasks)
    ends = [scan.stamp + scan.duration_ns for scan in decoded(tmp_path / "live", "/line1/scans")]
    assert ends == sorted(ends)
    assert len(set(ends)) > 300
