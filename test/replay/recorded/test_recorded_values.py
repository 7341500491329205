"""The values of a recording by time: those of its write log and of `automax export`, None where nothing is known."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from recordings.live_racks import build
from recordings.ros2_bags import JOINED_NS, recorded_twice

from automax_ros.core.names import element
from automax_ros.core.types import DataType, same_bits
from automax_ros.messages.types.messages import CommonImage, CommonWrite, PlantState
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import CommonLog
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.export import CommonTable
from automax_ros.replay.recorded import run as recorded_run
from automax_ros.replay.recorded.run import RecordedRun
from automax_ros.replay.recorded.values import ValueLog
from replay.recorded.runs import run_of
from replay.replays import SPEED, WORK, YAML, busy, recorded, rewritten
from replay.scans.test_replay_drive import recording as drive_recording

S = 1_000_000_000


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=12.0)


@pytest.fixture(scope="module")
def run(bag: Path) -> RecordedRun:
    return run_of(bag)


def named(run: RecordedRun, name: str):
    return element(name, run.replay.rack.config.by_name, "no")


def test_values_are_those_of_an_export(bag: Path, run: RecordedRun) -> None:
    names = ["REF%", "OUT%", "COUNT!", "GAIN", "RUN@", "COPY$", "TABLE%(1,2)"]
    table, held = CommonTable(bag, names), dict[int, object]()
    rows = 0
    for time_ns, changed in table.rows():
        held.update(changed)
        for index, name in enumerate(names):
            assert run.value(named(run, name), time_ns) == held.get(index), (name, time_ns)
        rows += 1
    assert rows > 1000


def test_the_course_of_a_value_is_the_write_log(bag: Path, run: RecordedRun) -> None:
    """Image for image and write for write, also those that change nothing; each value to the last bit."""
    log, expected = CommonLog(bag, run.replay.facts), list[tuple[int, object]]()
    total, image = named(run, "TOTAL"), True
    for entry in BagReader(bag).messages():
        message = entry.message
        if isinstance(message, (CommonImage, CommonWrite)):
            for view, _, value in log.take(message) or ():
                if view == run.views["TOTAL"] and (image or isinstance(message, CommonWrite)):
                    expected.append((message.stamp, value))
                    image = False
    times, values = run.commons.course((run.views["TOTAL"], 0))
    assert list(zip(times.tolist(), values.tolist(), strict=True)) == expected
    assert len(expected) > 1000
    assert run.value(total, times[-1]) == values[-1]


def test_nothing_is_known_before_the_first_value_and_after_missing_writes(bag: Path, tmp_path: Path) -> None:
    def change(message):
        if isinstance(message, CommonImage):
            return None if message.stamp < 9 * S else message
        return None if isinstance(message, CommonWrite) and 4 * S < message.stamp < 5 * S else message

    holed = run_of(rewritten(bag, tmp_path / "bag", change))
    gain = named(holed, "GAIN")
    known = [holed.value(gain, at_ns) is not None for at_ns in (3 * S, 4_500_000_000, 4_990_000_000, 6 * S, 11 * S)]
    assert known == [True, False, False, True, True]
    notes = [entry for entry in holed.log.after(0) if entry["kind"] == "note"]
    assert [entry["text"] for entry in notes] == ["writes are missing before this"]
    never = named(holed, "SPARE%")
    assert holed.value(never, 2 * S) is None
    assert holed.value(never, 11 * S) == 0
    assert run_of(bag).value(named(holed, "GAIN"), 4_500_000_000) is not None


def test_a_log_keeps_zeros_signs_infinities_and_texts() -> None:
    log = ValueLog([CommonVariable("X", DataType.REAL), CommonVariable("T$", DataType.STRING, length=8)])
    for time, value in enumerate((0.0, -0.0, math.inf, math.nan)):
        log.take(time, [(0, 0, value)], image=True)
    log.take(1, [(1, 0, "<b>"), (1, 0, "")], image=False)
    log.finish()
    found = [log.at((0, 0), time) for time in (-1, 0, 1, 2, 3)]
    assert found[0] is None
    assert all(same_bits(one, two) for one, two in zip(found[1:], (0.0, -0.0, math.inf, math.nan), strict=True))
    assert [log.at((1, 0), time) for time in (0, 1)] == [None, ""]


def test_forces_are_known_by_time(tmp_path: Path) -> None:
    def steps(rack: Rack, number: int) -> None:
        busy(rack, number)
        if number == 5:
            rack.adjust.force("OUT%", 9)
        if number == 12:
            rack.adjust.unforce(["OUT%"])

    run = run_of(recorded(tmp_path, steps))
    out = (run.views["OUT%"], 0)
    assert [(round(time_ns / 1e6), out in keys) for time_ns, keys in run.forced] == [(500, True), (1200, False)]
    assert [run.commons.at(out, at_ns) for at_ns in (600_000_000, 1_100_000_000)] == [9, 9]


def test_signals_of_plants_are_their_messages(tmp_path: Path) -> None:
    bag = drive_recording(tmp_path)
    run = run_of(bag)
    states = [item.message for item in BagReader(bag).messages() if isinstance(item.message, PlantState)]
    (plant,) = run.drives.plants.values()
    assert plant.at(states[0].stamp - 1) is None
    for state in states[::17]:
        found = plant.at(state.stamp)
        assert (found.speed_rpm, found.bridge, found.contactor) == (state.speed_rpm, state.bridge, state.contactor)
        assert type(found.contactor) is bool
    times, values = plant.course("current_a")
    assert list(zip(times.tolist(), values.tolist(), strict=True)) == [(it.stamp, it.current_a) for it in states]


def test_recordings_of_other_programs_are_read_too(tmp_path: Path) -> None:
    ours, theirs = recorded_twice(build(tmp_path, YAML, SPEED=SPEED, WORK=WORK), tmp_path, busy)
    one, two = run_of(ours), run_of(theirs)
    for at_ns in range(JOINED_NS + S // 4, 2 * S, S // 7):
        assert [one.value(named(one, name), at_ns) for name in ("REF%", "OUT%", "NOTE$")] == [
            two.value(named(two, name), at_ns) for name in ("REF%", "OUT%", "NOTE$")
        ]
    assert list(one.tasks["SPEED"].numbers)[-50:] == list(two.tasks["SPEED"].numbers)[-50:]


def test_a_recording_of_too_many_values_is_refused(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorded_run, "MOST_VALUES", 1000)
    with pytest.raises(BagError, match="holds more than 1000 values"):
        run_of(bag)


def test_all_of_a_recording_is_read_with_its_progress(bag: Path) -> None:
    told: list[float] = []
    replay = run_of(bag).replay
    run = RecordedRun(replay, told.append)
    assert told == sorted(told)
    assert 0.8 < told[-1] <= 1
    assert (run.from_ns, run.to_ns) == (0, 12 * S)
