"""Any scan of a recording executed again, line by line: exactly what was recorded, wherever one jumps."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rack.helpers import config_at

from automax_ros.core.types import Value
from automax_ros.messages.types.messages import CommonWrite, Scan, TaskState
from automax_ros.rack.rack import Rack
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.replay.recorded.lines import kept_of
from automax_ros.replay.recorded.task import RecordedTask, ScanRefused, run_edited
from replay.recorded.runs import Messages, assert_same, edited_replay, left, own_in, run_of, task_of
from replay.replays import SPEED, WORK, edited, record, recorded, rewritten
from replay.test_operated_rack import make, operate

ROOT = Path(__file__).parents[3]
SEED_RUNS = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
REUSED = edited(
    WORK,
    ("LOCAL I%, J%, NIL%", "LOCAL I%, J%, NIL%, SPARE%, HELD%(2)"),
    ("110 TOTAL", "102 SPARE% = 7\n104 HELD%(1) = SPARE% + 1\n106 SPARE% = HELD%(1) * 2\n108 SPARE% = 0\n110 TOTAL"),
)


def simulated(folder: Path, config: str, seconds: float, options: RecordingOptions | None = None) -> Path:
    rack = Rack(config_at(ROOT / "config" / config / "rack.yaml"))
    return record(rack, folder / "bag", None, slices=1, seconds=seconds, options=options)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two and a half keyframes of a small rack, of which every value changes."""
    return recorded(tmp_path_factory.mktemp("small"), seconds=25.0)


@pytest.fixture(scope="module")
def drawn(bag: Path) -> tuple[Messages, dict[str, RecordedTask]]:
    run = run_of(bag)
    return Messages(bag), {name: task_of(run, name) for name in run.tasks}


def assert_exact(messages: Messages, task: RecordedTask, place: int) -> None:
    scan, where = messages.scans[task.name][place], (task.name, place)
    lines = task.lines(place)
    assert_same(lines.before, messages.latched(scan), where)
    assert_same(left(lines), messages.written(scan), where)


@pytest.mark.parametrize("config", ["section_drive", "dc_drive", "web_line"])
def test_scans_of_the_example_racks_leave_what_was_recorded(config: str, tmp_path: Path) -> None:
    """Of all their tasks: blocks, a current minor loop, modeled scans, UDCs; jumps forwards and backwards."""
    found = ROOT / "bags/section_drive" if config == "section_drive" else simulated(tmp_path, config, 3.0)
    messages, run = Messages(found), run_of(found)
    executed = 0
    for name in run.tasks:
        task, scans = task_of(run, name), messages.scans.get(name, [])
        for place in sorted(range(0, len(scans), max(1, len(scans) // 12)), key=lambda place: place * 7919 % 104_729):
            if scans[place].scan and not task.is_basic:
                assert_exact(messages, task, place)
                executed += 1
    assert executed > 30


@SEED_RUNS
@given(data=st.data())
def test_jumps_in_any_order_leave_what_was_recorded(drawn: tuple[Messages, dict[str, RecordedTask]], data) -> None:
    messages, tasks = drawn
    for _ in range(4):
        name = data.draw(st.sampled_from(sorted(tasks)))
        place = data.draw(st.integers(1, len(messages.scans[name]) - 1))
        assert_exact(messages, tasks[name], place)


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_own_variables_are_those_of_the_recorded_states(execution: str, tmp_path: Path) -> None:
    """A rack that is operated: reloads, forces, power, errors, BASIC tasks; a state is recorded after every scan."""
    rack = make(tmp_path / "rack", execution)
    bag = record(rack, tmp_path / "bag", operate, slices=40, options=RecordingOptions(every_state=True))
    messages, run = Messages(bag), run_of(bag)
    compared = 0
    for name in run.tasks:
        task, first = task_of(run, name), {}
        for after, state in messages.states[name]:
            first.setdefault(after, state)
        for place, scan in enumerate(messages.scans[name]):
            state = first.get(place)
            if state is not None and state.scan == scan.scan:
                assert_same(task.scan(place).own, own_in(messages, state), (name, place))
                compared += 1
    assert compared > 800


def test_each_writer_of_a_reused_local_has_its_own_value(tmp_path: Path) -> None:
    bag = recorded(tmp_path, WORK=REUSED)
    run = run_of(bag)
    lines = task_of(run, "WORK").lines(7)
    assert [lines.after[line] for line in (102, 104, 106, 108)] == [
        {"SPARE%": 7},
        {"HELD%(1)": 8} if lines.before["HELD%(1)"] != 8 else {},
        {"SPARE%": 16},
        {"SPARE%": 0},
    ]
    assert lines.before["SPARE%"] == 0
    assert task_of(run, "WORK").scan(7).own["SPARE%"] == 0


def test_lines_that_run_several_times_have_their_last_values(bag: Path) -> None:
    messages, run = Messages(bag), run_of(bag)
    place = 100
    reads = {name: value for name, value in task_of(run, "WORK").lines(place).before.items() if "TABLE%(0" in name}
    after = task_of(run, "WORK").lines(place).after
    assert after[140] == {"J%": reads["TABLE%(0,2)"] + 2}
    assert after[150] == {f"TABLE%(1,{index})": reads[f"TABLE%(0,{index})"] + index for index in range(3)}
    assert messages.written(messages.scans["WORK"][place])["TABLE%(1,2)"] == after[140]["J%"]


def test_a_line_that_is_jumped_over_has_no_values(tmp_path: Path) -> None:
    source = edited(WORK, ("120 COPY$", "115 IF FLAG@ THEN GOTO 130\n120 COPY$"))
    bag = recorded(tmp_path, WORK=source)
    task = task_of(run_of(bag), "WORK")
    for place in range(20, 40):
        lines = task.lines(place)
        assert (120 in lines.after) != lines.before["FLAG@"]


def test_a_forced_common_keeps_its_value_whatever_writes_it(tmp_path: Path) -> None:
    def steps(rack: Rack, number: int) -> None:
        if number == 4:
            rack.adjust.force("OUT%", 77)
            rack.adjust.force("FLAG@", True)

    bag = recorded(tmp_path, steps)
    run = run_of(bag)
    assert task_of(run, "SPEED").lines(300).before["OUT%"] == 77
    assert task_of(run, "WORK").lines(120).after[180] == {"FLAG@": True}


def test_files_of_a_split_recording_are_read_as_one(tmp_path: Path) -> None:
    bag = recorded(tmp_path, seconds=7.0, options=RecordingOptions(split_ns=2_000_000_000))
    assert len([*bag.glob("*.mcap")]) > 2
    messages, run = Messages(bag), run_of(bag)
    for place in (1200, 30, 700, 1271, 400):
        assert_exact(messages, task_of(run, "SPEED"), place)


def test_one_steps_on_and_back_without_reading_again(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_of(bag)
    task = task_of(run, "SPEED")
    task.scan(3000)
    monkeypatch.setattr(run, "messages", lambda chunk: pytest.fail(f"reads again from chunk {chunk}"))
    for place in (3001, 3002, 3001, 3000, 2999, 2995, 3010):
        task.scan(place)


def test_a_jump_executes_the_scans_since_the_last_recorded_state(bag: Path) -> None:
    run = run_of(bag)
    start = run.start_of("SPEED", 4400)
    assert 3600 <= start.scan <= 3640, "the states at 20 s are those of scan 3,636"
    assert run.start_of("SPEED", 100).scan == 0


EDIT = edited(SPEED, ("WLG=10.0", "WLG=2.0"))


@SEED_RUNS
@given(places=st.lists(st.integers(1, 4500), min_size=1, max_size=4))
def test_an_edited_task_has_what_it_had_in_the_whole_replay(edits: tuple, places: list[int]) -> None:
    run, replay, kept, whole = edits
    task = RecordedTask(run, "SPEED", replay, kept)
    for place in places:
        assert dict(task.scan(place).own) == whole[place]


@pytest.fixture(scope="module")
def edits(bag: Path) -> tuple:
    """A replay of the edited task, what it keeps, and its own variables after each scan of one pass."""
    run, replay = run_of(bag), edited_replay(bag, SPEED=EDIT)
    first, kept = run_edited(run, replay)
    assert first is not None
    assert len(kept["SPEED"]) >= 3
    whole: dict[int, dict[str, Value]] = {}
    names = ("TRIM%", "SUM%", "FILTERED%")
    replay.run(watcher=lambda task, scan: whole.setdefault(scan.scan, {name: task.task.value(name) for name in names}))
    return run, replay, kept["SPEED"], whole


def test_the_first_difference_is_that_of_a_replay(bag: Path) -> None:
    report = edited_replay(bag, SPEED=EDIT).run()
    found, _ = run_edited(run_of(bag), edited_replay(bag, SPEED=EDIT))
    assert report.first is not None
    assert found is not None
    assert (found.task, found.scan, found.time_ns / 1e9) == ("SPEED", report.first.scan, report.first.time_s)
    item = report.first.differences[0]
    assert found.text.startswith(f"{item.name}: recorded {item.first.recorded}, replayed {item.first.replayed} (line ")


def test_what_is_kept_is_what_the_task_has(bag: Path) -> None:
    seen = []
    edited_replay(bag, SPEED=EDIT).run(watcher=lambda task, scan: seen.append((scan.scan, kept_of(task))), to_ns=10**9)
    assert [number for number, kept in seen if kept.scan != number] == []


def test_scans_after_a_gap_are_refused_until_a_state_follows(bag: Path, tmp_path: Path) -> None:
    def change(message):
        lost = isinstance(message, Scan) and message.task == "SPEED" and 1000 <= message.scan < 1010
        return None if lost else message

    holed = rewritten(bag, tmp_path / "bag", change)
    task = task_of(run_of(holed), "SPEED")
    task.scan(990)
    with pytest.raises(ScanRefused, match=r"scan 1500 .* scans 1000 to 1009 are missing"):
        task.scan(1490)
    task.scan(2000)


def test_scans_without_any_state_before_them_are_refused(bag: Path, tmp_path: Path) -> None:
    late = rewritten(bag, tmp_path / "bag", lambda it: None if _is_early(it) else it)
    task = task_of(run_of(late), "SPEED")
    with pytest.raises(ScanRefused, match="the state before it is not recorded"):
        task.scan(3)
    task.scan(2000)


def _is_early(message: object) -> bool:
    return isinstance(message, (Scan, TaskState)) and message.stamp < 7_000_000_000


def test_scans_that_come_out_otherwise_than_recorded_are_refused(bag: Path, tmp_path: Path) -> None:
    def change(message):
        if isinstance(message, Scan) and message.task == "SPEED" and message.committed.value:
            values = message.committed._replace(value=[value + 1 for value in message.committed.value])
            return message._replace(committed=values)
        return message

    scans = Messages(bag).scans["SPEED"]
    place = next(place for place in range(500, len(scans)) if scans[place].committed.value)
    task = task_of(run_of(rewritten(bag, tmp_path / "bag", change)), "SPEED")
    with pytest.raises(ScanRefused, match="comes out otherwise now"):
        task.scan(place)


def test_basic_tasks_and_start_up_parts_are_not_shown_line_by_line(tmp_path: Path) -> None:
    bag = record(make(tmp_path / "rack", "ideal"), tmp_path / "bag", operate, slices=9, seconds=0.5)
    run = run_of(bag)
    with pytest.raises(ScanRefused, match="scan 0 of task SPEED is not shown line by line: it is what stands before"):
        task_of(run, "SPEED").lines(0)
    teller = task_of(run, "TELLER")
    assert "K%" in teller.scan(3).own
    with pytest.raises(ScanRefused, match="it is of a BASIC task"):
        teller.lines(3)


def test_a_recording_that_has_been_cut_since_is_refused(tmp_path: Path) -> None:
    bag = recorded(tmp_path, seconds=25.0)
    run = run_of(bag)
    (file,) = bag.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:20_000])
    with pytest.raises(ScanRefused):
        task_of(run, "SPEED").scan(4000)


def test_writes_that_are_missing_are_no_obstacle_to_what_a_scan_has_seen(bag: Path, tmp_path: Path) -> None:
    lost = rewritten(bag, tmp_path / "bag", lambda it: None if _is_lost(it) else it)
    messages, run = Messages(lost), run_of(lost)
    assert_exact(messages, task_of(run, "SPEED"), 4000)


def _is_lost(message: object) -> bool:
    return isinstance(message, CommonWrite) and 12_000_000_000 < message.stamp < 13_000_000_000


def test_a_rack_that_ended_by_a_stop_statement(tmp_path: Path) -> None:
    source = edited(WORK, ("190 IF", "185 IF COUNT! > 30 THEN STOP\n190 IF"))
    bag = recorded(tmp_path, WORK=source)
    run, messages = run_of(bag), Messages(bag)
    task, last = task_of(run, "WORK"), len(messages.scans["WORK"]) - 1
    assert task.lines(last).after[170] == {"COUNT!": 31}
    assert 190 not in task.lines(last).after
