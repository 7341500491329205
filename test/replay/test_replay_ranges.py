"""Where a replay begins and ends: --from, --to, states on the way, tunables, holes in the recording."""

from __future__ import annotations

from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import CommonImage, CommonWrite, Scan, TaskState
from automax_ros.rack.rack import Rack
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from replay.replays import SPEED, WORK, YAML, busy, edited, recorded, replayed, rewritten

DOUBLED = edited(WORK, ("COUNT! + 1", "COUNT! + 2"))
LATER = edited(SPEED, ("110 CALL", "105 CALL"), ("120 CALL", "115 CALL"))
"""The same meaning, with blocks on other lines: their recorded states do not fit by name."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=25.0)


def tune(rack: Rack, number: int) -> None:
    busy(rack, number)
    if number % 4 == 3:
        rack.tune(rack.task("SPEED"), "TRIM%", number % 10)


@pytest.fixture(scope="module")
def tuned(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("tuned"), tune, seconds=25.0)


def test_range_counts_scans_from_first_to_last(bag):
    report = replayed(bag, from_ns=11 * NS_PER_S, to_ns=22 * NS_PER_S)
    assert report.identical
    assert {task.name: task.scans for task in report.tasks} == {"SPEED": 2001, "WORK": 1001}
    assert (report.from_s, report.to_s) == (11.0, 22.0)


@pytest.mark.parametrize("from_s", [0.001, 5, 9.999, 10, 10.0000001, 13, 20.5, 24.9])
def test_replay_can_begin_anywhere(bag, from_s):
    report = replayed(bag, from_ns=round(from_s * NS_PER_S))
    assert report.identical
    assert report.scans > 20
    assert not any(task.notes for task in report.tasks)


def test_edited_task_starts_from_the_last_state_before(bag):
    """COUNT! + 2 since the state at 20 s: at 22 s it has counted 181 scans more, not 2000."""
    report = replayed(bag, {"WORK": DOUBLED}, from_ns=22 * NS_PER_S)
    found = report.differences[0]
    state = max(stamp for stamp in states_of(bag, "WORK") if stamp <= 22 * NS_PER_S)
    scans = sum(state < scan.stamp <= found.first.time_s * NS_PER_S + 1 for scan in scans_of(bag, "WORK"))
    assert (found.first.time_s, found.name) == (22.0, "COUNT!")
    assert found.first.replayed - found.first.recorded == scans == 181


def states_of(bag: Path, task: str) -> list[int]:
    messages = (item.message for item in BagReader(bag).messages(types={"automax_msgs/msg/TaskState"}))
    return [message.stamp for message in messages if isinstance(message, TaskState) and message.task == task]


def scans_of(bag: Path, task: str) -> list[Scan]:
    messages = (item.message for item in BagReader(bag).messages(types={"automax_msgs/msg/Scan"}))
    return [message for message in messages if isinstance(message, Scan) and message.task == task]


def test_state_that_does_not_fit_by_name_is_told(bag):
    report = replayed(bag, {"SPEED": LATER}, from_ns=12 * NS_PER_S, only=("SPEED",))
    (task,) = report.tasks
    assert any(note.startswith("at 10.0") and "115 LAG.y1" in note for note in task.notes)
    assert replayed(bag, {"SPEED": LATER}, only=("SPEED",)).identical, "from the start of the run nothing is taken over"


def test_locals_of_another_type_start_at_their_initial_value(bag):
    changed = edited(WORK, ("I%, J%, NIL%", "I%, J%, NIL%, MORE%")).replace("J%", "J!")
    (task,) = replayed(bag, {"WORK": changed}, from_ns=12 * NS_PER_S, only=("WORK",)).tasks
    assert any(note.endswith("start at their initial values: J!, MORE%") for note in task.notes)


def test_tunables_set_on_the_way_are_set_again(tuned):
    report = replayed(tuned)
    assert report.identical
    notes = report.tasks[0].notes
    assert notes[0] == "tunable TRIM% set to 3 at 3.75 s"
    assert len(notes) == 5


def test_tunables_set_on_the_way_reach_an_edited_task(tuned):
    changed = edited(SPEED, ("140 END", "135 SUM% = SUM%\n140 END"))
    report = replayed(tuned, {"SPEED": changed})
    assert report.identical
    assert replayed(tuned, {"SPEED": changed}, from_ns=12 * NS_PER_S).identical


def test_a_changed_current_counts_until_the_operator_sets_the_tunable(tuned):
    """TRIM% 4 instead of 1 up to 3.75 s, where it was set to 3; SUM% shows it one to one, OUT% after the LAG."""
    changed = edited(SPEED, ("CURRENT=1", "CURRENT=4"))
    report = replayed(tuned, {"SPEED": changed}, only=("SPEED",))
    (found,) = report.differences
    assert found.settled is not None
    assert (found.settled.low, found.settled.high) == (0, 0)
    assert 3.75 <= found.settled.time_s < 5.0
    assert "tunable TRIM% starts at its new CURRENT=4, not at 1" in report.tasks[0].notes


def test_a_changed_current_does_not_count_where_the_operator_has_set_the_tunable_before(tuned):
    """From 12 s on just as in the replay from the start: what was set at 8.75 s holds."""
    report = replayed(tuned, {"SPEED": edited(SPEED, ("CURRENT=1", "CURRENT=4"))}, from_ns=12 * NS_PER_S)
    assert report.identical
    assert "tunable TRIM% had been set to 7 before 10.0045 s: that counts" in report.tasks[0].notes


def test_a_tunable_that_the_edit_has_dropped_or_limited_is_told(tuned):
    dropped = edited(SPEED, ("TRIM% [CURRENT=1, HIGH=10, LOW=0]", "TRIM%"))
    notes = replayed(tuned, {"SPEED": dropped}).tasks[0].notes
    assert "tunable TRIM% set to 3 at 3.75 s: the new source has no such tunable" in notes
    limited = edited(SPEED, ("HIGH=10", "HIGH=5"))
    notes = replayed(tuned, {"SPEED": limited}).tasks[0].notes
    assert any(note.startswith("tunable TRIM% set to 7 at 8.75 s: not here, TRIM% = 7 lies outside") for note in notes)


def test_only_some_tasks(bag):
    report = replayed(bag, only=("WORK",))
    assert [task.name for task in report.tasks] == ["WORK"]


def test_restarted_task_starts_afresh(tmp_path):
    """STOP and RUN: scans count from 0 again, blocks start again, locals keep their values."""
    counting = edited(SPEED, ("130 CALL", "125 SCANS% = SCANS% + 1\n130 CALL"), ("SUM%, F", "SUM%, SCANS%, F"))
    rack = build(tmp_path, YAML, SPEED=counting, WORK=WORK)
    stream = RackStream(rack, 7)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()
    rack.write("RUN@", True)
    rack.run(0.5)
    task = rack.task("SPEED")
    task.stop()
    rack.run(0.2)
    record_of_start = task.run(rack.now_ns)
    assert record_of_start is not None
    stream.scanned(task, record_of_start, rack.memory.take_writes())
    rack.run(0.5)
    stream.end()
    recorder.close()
    report = replayed(tmp_path / "bag")
    assert report.identical
    assert report.tasks[0].notes == ("went into RUN again at 0.7 s",)
    assert report.tasks[0].scans == 1 + 91 + 1 + 91


def without_scans(first: int, last: int, task: str = "WORK"):
    """Leave scans and the states among them out."""

    def change(message):
        wanted = isinstance(message, (Scan, TaskState)) and message.task == task
        return None if wanted and first <= message.scan <= last else message

    return change


def test_missing_scans_are_told_and_the_next_state_goes_on(bag, tmp_path):
    """The next state stands after scan 911, the first one from 10 s on."""
    report = replayed(rewritten(bag, tmp_path / "bag", without_scans(400, 449)))
    assert report.identical
    work = report.tasks[1]
    assert work.notes == (
        "scans 400 to 449 are missing before 4.939 s; it continues from the next recorded state",
        "462 scans could not be executed again: the state before them is not recorded",
    )
    assert work.scans == 2273 + 1 - 50 - 462


def test_hole_right_before_a_state_costs_one_scan(bag, tmp_path):
    report = replayed(rewritten(bag, tmp_path / "bag", without_scans(850, 910)))
    assert report.identical
    work = report.tasks[1]
    assert work.notes[1] == "1 scan could not be executed again: the state before it is not recorded"
    assert work.scans == 2273 + 1 - 61 - 1


def test_state_behind_missing_scans_is_taken_over(bag, tmp_path):
    def change(message):
        missing = isinstance(message, Scan) and message.task == "WORK" and 850 <= message.scan <= 911
        return None if missing else message

    report = replayed(rewritten(bag, tmp_path / "bag", change))
    assert report.identical
    work = report.tasks[1]
    assert work.notes == ("scans 850 to 911 are missing before 10.01 s",)
    assert work.scans == 2273 + 1 - 62


def test_gap_in_the_write_log_is_told(bag, tmp_path):
    """What was latched is in the scans all the same; an edited task that reads more waits for the next image."""

    def change(message):
        return None if isinstance(message, CommonWrite) and 700 <= message.sequence <= 720 else message

    holed = rewritten(bag, tmp_path / "bag", change)
    assert replayed(holed).identical
    added = edited(WORK, ("10 COMMON", "5 COMMON REF%, SPARE%\n10 COMMON"), ("200 END", "195 SPARE% = REF%\n200 END"))
    report = replayed(holed, {"WORK": added})
    assert any("REF% is not known: writes are missing in the log" in note for note in report.tasks[1].notes)
    assert 1000 < report.tasks[1].scans < 2274


def test_a_value_that_no_message_tells_is_an_error(bag, tmp_path):
    def change(message):
        return None if isinstance(message, CommonImage) else message

    blind = rewritten(bag, tmp_path / "bag", change)
    assert replayed(blind).identical, "all that the recorded tasks saw is in their scans"
    added = edited(WORK, ("10 COMMON", "5 COMMON SPARE%\n10 COMMON"), ("200 END", "195 COUNT! = SPARE%\n200 END"))
    with pytest.raises(BagError) as error:
        replayed(blind, {"WORK": added})
    assert error.value.code == "AMX6833"
    assert "does not contain SPARE% before 0 s; task WORK reads it (new/WORK.BLK:1)" in str(error.value)


def test_recording_that_begins_in_the_middle(bag, tmp_path):
    """The first state is at 10 s: what comes before it cannot be executed."""

    def change(message):
        late = not isinstance(message, (Scan, TaskState)) or message.stamp >= 7 * NS_PER_S
        return message if late else None

    report = replayed(rewritten(bag, tmp_path / "bag", change))
    assert report.identical
    assert all(any("could not be executed again" in note for note in task.notes) for task in report.tasks)
    assert 2700 < report.tasks[0].scans < 2750


def test_single_file_of_a_split_recording(tmp_path):
    """Each file stands alone."""
    rack = build(tmp_path, YAML, SPEED=SPEED, WORK=WORK)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag", RecordingOptions(split_ns=2 * NS_PER_S))
    stream.begin()
    rack.start()
    for number in range(14):
        tune(rack, number)
        rack.run(0.5)
    stream.end()
    recorder.close()
    whole = replayed(tmp_path / "bag")
    assert whole.identical
    assert whole.scans == 1 + 1273 + 1 + 637
    part = replayed(tmp_path / "bag" / "scans_1.mcap")
    assert part.identical
    assert part.differences == ()
    assert 363 <= part.tasks[0].scans <= 365
    assert part.from_s == 2.0, "where the file begins"
    assert not any("could not" in note for note in part.tasks[0].notes)


def test_range_leaves_earlier_differences_out(bag):
    """Scans before --from are executed, not compared."""
    changed = edited(WORK, ("110 TOTAL", "105 IF COUNT! < 500 THEN TABLE%(0,0) = 1\n110 TOTAL"))
    assert not replayed(bag, {"WORK": changed}, to_ns=2 * NS_PER_S).identical
    assert replayed(bag, {"WORK": changed}, from_ns=12 * NS_PER_S).identical
