"""A recording as a source of the panel: its values, scans, courses, log and status, and another version next to it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rack.helpers import config_at
from replay.replays import SPEED, busy, edited, record, recorded, replayed, rewritten
from replay.scans.test_replay_drive import happens
from replay.scans.test_replay_drive import recording as drive_recording
from replay.test_operated_rack import make, operate

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.user_error import UsageError
from automax_ros.messages.types.messages import CommonImage, Scan, TaskState, VariableTable
from automax_ros.panel import recording
from automax_ros.panel.recording import RecordingSource
from automax_ros.panel.source import Asked, RequestRefused, Source
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables.export import CommonTable
from automax_ros.recordings.tables.scan_table import ScanTable
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.replay.scans.stored_rack import SourceRefused

ROOT = Path(__file__).parents[2]
S = 1_000_000_000
EDIT = edited(SPEED, ("WLG=10.0", "WLG=2.0"))


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=12.0)


@pytest.fixture(scope="module")
def source(bag: Path) -> Iterator[RecordingSource]:
    found = RecordingSource(bag)
    yield found
    found.close()


@pytest.fixture(scope="module")
def operated(tmp_path_factory: pytest.TempPathFactory) -> RecordingSource:
    """Two seconds of a rack that is operated before each of 40 slices of 50 ms."""
    folder = tmp_path_factory.mktemp("operated")
    return RecordingSource(record(make(folder / "rack", "ideal"), folder / "bag", operate, slices=40))


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> RecordingSource:
    def steps(rack: Rack, number: int) -> None:
        if number < 10:
            happens(rack, number)
        if number == 12:
            SwitchOperations(rack).plant("UNWIND", "lose_tach", "true")

    return RecordingSource(drive_recording(tmp_path_factory.mktemp("drive"), steps))


def value(source: Source, name: str, at_ns: int | None) -> Any:
    return source.frames([Asked((name,), at_ns)])[0].values[0]


def refusal(source: Source, what: str, **fields: object) -> str:
    with pytest.raises(RequestRefused) as refused:
        source.answer(what, fields)
    return str(refused.value)


def task_at(source: Source, name: str, ms: int) -> dict[str, Any]:
    return next(item for item in source.status(ms * 1_000_000)["tasks"] if item["name"] == name)


def test_it_says_what_it_is(source: RecordingSource, bag: Path) -> None:
    hello = source.hello()
    assert (hello["rack"], hello["kind"], hello["title"]) == ("LINE1", "recording", f"LINE1, recording {bag.name}")
    assert hello["span"] == {"from_ns": 0, "to_ns": 12 * S}
    assert hello["operate"] == {"allowed": False, "why": "a recording is only looked at"}
    assert hello["other"] is None
    assert [item["name"] for item in hello["tasks"]] == ["SPEED", "WORK"]
    assert source.is_over
    json.dumps(hello)


def test_values_of_commons_are_those_of_an_export(source: RecordingSource, bag: Path) -> None:
    names = ("REF%", "TOTAL", "NOTE$", "TABLE%(1,0)", "RUN@")
    held: dict[int, object] = {}
    for time_ns, changed in [*CommonTable(bag, names).rows()][::50]:
        held = dict(enumerate(source.frames([Asked(names, time_ns)])[0].values))
        assert {index: held[index] for index in changed} == changed
    assert len(held) == len(names)


def test_values_of_locals_are_those_of_an_export_of_scans(tmp_path: Path) -> None:
    bag = recorded(tmp_path, options=RecordingOptions(every_state=True))
    source, compared = RecordingSource(bag), 0
    table = ScanTable(bag, "SPEED")
    columns = {index: item.label for index, item in enumerate(table.columns) if item.label.startswith("local.")}
    held: dict[int, object] = {}
    for time_ns, changed in table.rows():
        held.update(changed)
        for index, label in columns.items():
            name = f"SPEED.{label.removeprefix('local.')}"
            assert value(source, name, time_ns) == held[index], (name, time_ns)
            compared += 1
    assert compared > 1000


def test_a_local_is_executed_where_no_state_follows(source: RecordingSource, bag: Path) -> None:
    """The sum is that of the reference at the latch and the tunable."""
    for at_ns in (2 * S + 1, 5 * S, 11 * S):
        place = source.answer("scan", {"task": "SPEED", "t": at_ns})
        expected = place["before"]["REF%"] + place["before"]["TRIM%"]
        assert value(source, "SPEED.SUM%", at_ns) == expected == place["after"]["110"]["SUM%"]


def test_browsers_have_their_own_times_and_none_where_nothing_is_known(source: RecordingSource) -> None:
    names = ("REF%", "NOBODY%", "SPEED.NOTHING%", "MOTOR/speed_rpm", "", "x" * 5000)
    one, two, end = source.frames([Asked(names, 3 * S), Asked(("REF%",), -1), Asked(("REF%",))])
    assert one.values[0] is not None
    assert one.values[1:] == (None,) * 5
    assert two.values == (None,)
    assert (one.time_ns, two.time_ns, end.time_ns) == (3 * S, -1, 12 * S)
    assert source.unknown(names) == [*names[1:]]


def test_a_scan_is_found_by_number_and_by_time(source: RecordingSource) -> None:
    by_number = source.answer("scan", {"task": "SPEED", "scan": 1000})
    assert (by_number["task"], by_number["scan"], by_number["other"]) == ("SPEED", 1000, None)
    assert source.answer("scan", {"task": "SPEED", "t": by_number["t"]}) == by_number
    assert source.answer("scan", {"task": "SPEED", "t": by_number["t"] + 5_000_000}) == by_number
    assert source.answer("seek", {"task": "SPEED", "scan": 1000}) == {"t": by_number["t"]}
    assert source.answer("seek", {"t": 77}) == {"t": 77}
    assert set(by_number["after"]) == {"110", "120", "130"}
    json.dumps(by_number)


def test_requests_that_cannot_be_met_say_why(source: RecordingSource) -> None:
    assert "holds no scan 999999 of task SPEED" in refusal(source, "scan", task="SPEED", scan=999_999)
    assert "there is no task" in refusal(source, "scan", task="<b>", scan=1)
    assert "has not scanned by then" in refusal(source, "scan", task="WORK", t=-5)
    assert "by its number or by a time" in refusal(source, "scan", task="WORK")
    assert "before SCAN_LOOP" in refusal(source, "scan", task="WORK", scan=0)
    assert "nothing is shown next to" in refusal(source, "diagram", task="WORK", which="other")
    assert "there is no task" in refusal(source, "diagram", task="NOBODY")
    assert "holds texts" in refusal(source, "history", names=["NOTE$"], from_ns=0, to_ns=S, points=10)
    assert "no common variable" in refusal(source, "history", names=["X"], from_ns=0, to_ns=S, points=10)
    assert "at most 32" in refusal(source, "history", names=["REF%"] * 33, from_ns=0, to_ns=S, points=10)
    assert "asked for by a time" in refusal(source, "seek")
    assert "by its number or by a time" in refusal(source, "seek", task="WORK")
    assert "code" in refusal(source, "explain", code="AMX0")
    for refused in (source.describe, source.operate):
        with pytest.raises(RequestRefused, match="only looked at"):
            refused("force", {"name": "REF%", "value": "1"})


def test_a_course_holds_each_value_until_the_next(source: RecordingSource, bag: Path) -> None:
    names = ["REF%", "RUN@", "TOTAL"]
    found = source.answer("history", {"names": names, "from_ns": 3 * S, "to_ns": 8 * S, "points": 20_000})
    for name, times, values in zip(names, found["t"], found["v"], strict=True):
        assert times[0] == 3 * S
        assert all(value(source, name, time_ns) == item for time_ns, item in zip(times, values, strict=True))
        assert {type(item) for item in values} == {type(value(source, name, 4 * S))}
    assert times[-1] <= 8 * S
    json.dumps(found)


def test_a_long_course_keeps_its_least_and_greatest_values(source: RecordingSource) -> None:
    whole = source.answer("history", {"names": ["TOTAL"], "from_ns": 0, "to_ns": 12 * S, "points": 20_000})["v"][0]
    thin = source.answer("history", {"names": ["TOTAL"], "from_ns": 0, "to_ns": 12 * S, "points": 40})
    assert len(whole) > 500
    assert len(thin["t"][0]) <= 40
    assert (min(thin["v"][0]), max(thin["v"][0])) == (min(whole), max(whole))
    assert thin["t"][0] == sorted(thin["t"][0])


def test_courses_of_locals_are_executed_or_those_of_states(
    source: RecordingSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    fields = {"names": ["SPEED.SUM%", "WORK.J%", "REF%"], "from_ns": 5 * S, "to_ns": 6 * S, "points": 2000}
    found = source.answer("history", fields)
    for name, times, values in list(zip(fields["names"], found["t"], found["v"], strict=True))[:2]:
        assert len(times) > 50
        assert all(value(source, name, time_ns) == item for time_ns, item in zip(times, values, strict=True))
    monkeypatch.setattr(recording, "MOST_EXECUTED", 10)
    fields |= {"from_ns": 0, "to_ns": 12 * S}
    assert 2 <= len(source.answer("history", fields)["t"][0]) <= 8, "states are recorded each ten seconds"


def test_each_name_of_a_drive_has_its_value(drive: RecordingSource) -> None:
    hello = drive.hello()
    (plant,) = hello["plants"]
    names = tuple(item["name"] for item in plant["signals"])
    (frame,) = drive.frames([Asked(names, S)])
    assert None not in frame.values
    course = drive.answer("history", {"names": [names[0]], "from_ns": 0, "to_ns": 2 * S, "points": 20_000})
    assert len(course["t"][0]) > 50
    (shown,) = drive.status(S // 2)["drives"]
    assert shown["plant"] == plant["name"]
    assert math.isfinite(shown["speed_rpm"])
    states = [drive.status(at_ns)["drives"][0]["state"] for at_ns in (S // 20, S)]
    assert states == ["standby", "run"]
    (lost,) = drive.status(None)["drives"]
    assert lost["broken"] == ("lose_tach",)
    assert (shown["broken"], shown["faults"]) == ((), [])
    json.dumps(drive.status(S))


def test_a_fault_of_a_drive_is_shown_with_its_code(tmp_path: Path) -> None:
    """The test of SCRs at the start finds the shorted one."""

    def steps(rack: Rack, number: int) -> None:
        if number == 0:
            SwitchOperations(rack).plant("MOTOR", "short_scr", "3")
        if number == 1:
            rack.write("START_PB@", True)

    rack = Rack(config_at(ROOT / "config/dc_drive/rack.yaml"))
    source = RecordingSource(record(rack, tmp_path / "bag", steps, slices=4))
    before, after = source.status(0), source.status(None)
    assert (before["drives"][0]["faults"], before["slots"][1]["display"]["code"]) == ([], "")
    (drive,) = after["drives"]
    assert (drive["faults"], drive["broken"], drive["state"]) == (["shorted SCR"], ("short_scr 3",), "standby")
    assert after["slots"][1]["display"] == {"code": "87", "meaning": "shorted SCR"}
    assert task_at(source, "CML", 2000)["errors"]["entries"][0]["text"] == "drive fault: shorted SCR"


def test_the_status_follows_operations(operated: RecordingSource) -> None:
    """The script of the operated rack: slice n begins at n times 50 ms."""
    assert task_at(operated, "SPEED", 440)["status"] == "running"
    assert task_at(operated, "SPEED", 480)["status"] == "stopped"
    assert task_at(operated, "SPEED", 520)["status"] == "running"
    stopped = operated.status(920_000_000)["stopped"]
    assert (stopped["t"], stopped["title"], stopped["reason"]) == (900_000_000, "STOP ALL", "the script")
    assert {item["status"] for item in operated.status(920_000_000)["tasks"]} == {"stopped"}
    assert operated.status(980_000_000)["stopped"] is None
    assert [operated.status(ms * 1_000_000)["powered"] for ms in (1080, 1120, 1180)] == [True, False, True]
    off = operated.status(1_120_000_000)
    assert not any(lamp["on"] for slot in off["slots"] for lamp in slot["lamps"])
    assert operated.status(280_000_000)["forced"] == [{"name": "OUT%", "value": "77"}]
    assert operated.status(420_000_000)["forced"] == []
    assert operated.status(None)["time_ns"] == 2 * S
    assert operated.status(None)["over"] == ""


def test_errors_are_those_of_the_task_until_they_are_cleared(source: RecordingSource, bag: Path) -> None:
    del bag
    entries = [entry for entry in source.log(0) if entry["kind"] == "error"]
    assert {entry["task"] for entry in entries} == {"WORK"}
    errors = task_at(source, "WORK", 12_000)["errors"]
    assert errors["count"] >= len(entries)
    assert [item["place"] for item in errors["entries"]] == ["first", "second", "last"]
    assert errors["entries"][0]["line"] == 190
    first_ms = entries[0]["t"] // 1_000_000
    assert task_at(source, "WORK", first_ms - 1)["errors"] == {"count": 0, "entries": []}


def test_the_log_is_one_time_line(operated: RecordingSource) -> None:
    entries = operated.log(0)
    assert [entry["n"] for entry in entries] == list(range(1, len(entries) + 1))
    assert [entry["t"] for entry in entries] == sorted(entry["t"] for entry in entries)
    assert ("force", "OUT% = 77") in [(entry["what"], entry["text"]) for entry in entries]
    assert operated.log(entries[-1]["n"]) == []
    assert operated.log(3) == entries[3:]


def test_a_diagram_is_that_of_the_stored_source(source: RecordingSource) -> None:
    facts = source.answer("diagram", {"task": "speed", "which": "own"})
    assert (facts["task"], facts["drawable"]) == ("SPEED", True)
    assert [row["text"] for row in facts["source"] if row["text"]] == SPEED.splitlines()
    assert source.answer("explain", {"code": "AMX7001"})["title"].startswith("AMX7001")


def test_an_edited_task_is_shown_next_to_the_recorded_one(bag: Path) -> None:
    source = RecordingSource(bag, tasks={"SPEED": SourceText("new/SPEED.BLK", EDIT)})
    other = source.hello()["other"]
    report = replayed(bag, {"SPEED": EDIT})
    assert report.first is not None
    assert other["label"] == "SPEED.BLK (edited)"
    assert (other["first"]["task"], other["first"]["scan"]) == ("SPEED", report.first.scan)
    item = report.first.differences[0]
    assert f"recorded {item.first.recorded}, replayed {item.first.replayed}" in other["first"]["text"]
    scan = source.answer("scan", {"task": "SPEED", "scan": other["first"]["scan"]})
    assert scan["t"] == other["first"]["t"]
    assert scan["other"]["scan"] == scan["scan"]
    assert scan["after"]["130"]["OUT%"] == item.first.recorded
    assert scan["other"]["after"]["130"]["OUT%"] == item.first.replayed
    assert source.answer("scan", {"task": "WORK", "scan": 5})["other"] is None
    shown = source.answer("diagram", {"task": "SPEED", "which": "other"})
    assert "WLG=2.0" in "\n".join(row["text"] for row in shown["source"])
    assert "there is no task" in refusal(source, "diagram", task="WORK", which="other")


def test_an_edit_without_a_difference_has_no_first(bag: Path) -> None:
    source = RecordingSource(bag, tasks={"SPEED": SourceText("SPEED.BLK", SPEED)})
    assert source.hello()["other"]["first"] is None


def test_a_second_recording_is_shown_next_to_the_first(bag: Path, tmp_path: Path) -> None:
    def steps(rack: Rack, number: int) -> None:
        busy(rack, number)
        if number == 7:
            rack.write("REF%", 333)

    told: list[float] = []
    source = RecordingSource(bag, recorded(tmp_path, steps, seconds=12.0), progress=told.append)
    assert told == sorted(told)
    other = source.hello()["other"]
    assert other["label"] == "bag"
    assert other["first"]["text"].startswith("REF%: latched 259, there 333")
    scan = source.answer("scan", {"task": "SPEED", "scan": other["first"]["scan"]})
    assert (scan["before"]["REF%"], scan["other"]["before"]["REF%"]) == (259, 333)
    assert source.answer("diagram", {"task": "WORK", "which": "other"})["task"] == "WORK"
    source.close()


def test_one_version_is_shown_next_to_it_and_not_two(bag: Path) -> None:
    with pytest.raises(UsageError):
        RecordingSource(bag, bag, {"SPEED": SourceText("SPEED.BLK", EDIT)})


def test_sources_with_errors_and_unknown_tasks_are_refused(bag: Path) -> None:
    with pytest.raises(SourceRefused):
        RecordingSource(bag, tasks={"SPEED": SourceText("SPEED.BLK", "10 NONSENSE\n")})
    with pytest.raises(BagError, match="has no task"):
        RecordingSource(bag, tasks={"NOBODY": SourceText("NOBODY.BLK", SPEED)})


def test_what_is_no_sound_recording_is_refused(bag: Path, tmp_path: Path) -> None:
    (file,) = bag.glob("*.mcap")
    cut, foreign, empty = tmp_path / "cut.mcap", tmp_path / "foreign.mcap", tmp_path / "empty.mcap"
    cut.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    foreign.write_bytes(b"not a recording")
    empty.write_bytes(b"")
    for path, code in ((cut, "AMX6812"), (foreign, "AMX6810"), (empty, "AMX6810"), (tmp_path / "none", "AMX6810")):
        with pytest.raises(BagError) as error:
            RecordingSource(path)
        assert error.value.code == code


@pytest.mark.parametrize("kind", [VariableTable, Scan, CommonImage])
def test_recordings_that_lack_something_are_refused_or_shown(bag: Path, tmp_path: Path, kind: type) -> None:
    lacking = rewritten(bag, tmp_path / "bag", lambda message: None if isinstance(message, kind) else message)
    if kind is VariableTable:
        with pytest.raises(BagError):
            RecordingSource(lacking)
        return
    source = RecordingSource(lacking)
    status = source.status(None)
    json.dumps((source.hello(), status))
    if kind is Scan:
        assert "holds no scan" in refusal(source, "scan", task="SPEED", t=5 * S)
        assert value(source, "WORK.J%", 5 * S) is not None, "it is in the recorded states"


def test_hostile_texts_stay_texts(tmp_path: Path) -> None:
    nasty = "<b>&\"'"

    def steps(rack: Rack, number: int) -> None:
        rack.write("NOTE$", nasty if number % 2 else "ok")

    bag = recorded(tmp_path, steps)
    source = RecordingSource(bag)
    assert value(source, "NOTE$", 150_000_000) == nasty
    names = ["__proto__", "constructor", "NOTE$<script>", "SPEED.__class__", "A/../../etc", "\0", "😀", "REF%(0)"]
    assert source.unknown(names) == names
    assert source.frames([Asked(tuple(names), S)])[0].values == (None,) * len(names)


def test_a_state_with_wrong_lists_is_an_error_that_says_so(bag: Path, tmp_path: Path) -> None:
    def change(message):
        return message._replace(value=list(message.value)[:3]) if isinstance(message, TaskState) else message

    with pytest.raises(BagError, match="lists of different length"):
        RecordingSource(rewritten(bag, tmp_path / "bag", change))


def test_commons_that_nobody_wrote_are_those_of_the_image(source: RecordingSource) -> None:
    assert value(source, "SPARE%", 6 * S) == 0
    assert value(source, "spare%", 6 * S) == 0
