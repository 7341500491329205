"""An edit from a moment on: what of the task's state goes on, and what the rest of the rack does about it."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from rack.helpers import rack_from

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.user_error import UserError
from automax_ros.messages.types.messages import CommonWrite, Scan, TaskState
from automax_ros.rack.tasks.installation import RackError
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.replay.engine import ReplayOptions, replay
from automax_ros.replay.rerun.rerun import Rerun, RerunOptions
from automax_ros.replay.scans.stored_rack import SourceRefused
from replay.replays import busy, edited, recorded, rewritten
from replay.rerun.runs import data_of, messages_of, recorded_run, run_again

YAML = """\
rack: LOOP1
execution: {execution}
slots:
  0: {{module: 57C413}}
  1:
    module: 57C435
    tick_ms: 1.0
    tasks: {{REG: {{priority: 4}}, PLANT: {{priority: 8}}, TELL: {{priority: 10, file: TELL.BAS}}}}
common:
  REF%: {{preset: 1000}}
  OUT%: {{}}
  POS!: {{}}
  TOLD%: {{}}
"""
REG = """\
10 COMMON REF%, OUT%, POS!
20 LOCAL GAIN% [CURRENT=4, HIGH=100, LOW=1], N!, E!
100 CALL SCAN_LOOP(TICKS=2)
110 N! = N! + 1
120 E! = REF% - POS!
130 OUT% = E! / GAIN%
140 END
"""
PLANT = "10 COMMON OUT%, POS!\n20 CALL SCAN_LOOP(TICKS=2)\n30 POS! = POS! + OUT%\n40 END\n"
TELL = "10 COMMON TOLD%\n20 LOCAL K%\n30 START EVERY 10 TICKS\n40 K% = K% + 1\n50 TOLD% = K%\n60 END\n"


def closed_loop(position: int, gains: list[int]) -> list[int]:
    """The loop by hand: the regulator scans before the plant, and takes the truncated share of the error."""
    found = []
    for gain in gains:
        position += int((1000 - position) / gain)
        found.append(position)
    return found


@pytest.fixture(scope="module", params=["ideal", "modeled"])
def bag(tmp_path_factory, request) -> Path:
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "TELL.BAS").write_text(TELL)
    rack = rack_from(folder, YAML.format(execution=request.param), REG=REG, PLANT=PLANT)
    return recorded_run(rack, folder / "bag", 0.06)


def positions(bag: Path) -> list[float]:
    """The positions that the plant's scans have written."""
    view = 2
    return [
        value
        for scan in messages_of(bag, Scan)
        if scan.task == "PLANT"
        for variable, value in zip(scan.written.variable, scan.written.value, strict=True)
        if variable == view
    ]


def state_of(bag: Path, task: str) -> dict[str, float]:
    """The last state of a task."""
    state = [item for item in messages_of(bag, TaskState) if item.task == task][-1]
    names = [name for name, size in zip(state.field, state.size, strict=True) for _ in range(size)]
    return dict(zip(names, state.value, strict=True))


def test_a_gain_from_the_middle_in_closed_loop(bag, tmp_path):
    """The plant moves otherwise, and the regulator answers to that: the numbers are those of the equation."""
    before = positions(bag)
    assert before == closed_loop(0, [4] * 30)
    stronger = edited(REG, ("CURRENT=4", "CURRENT=2"))
    report = run_again(bag, tmp_path / "after", 0.02, REG=stronger)
    assert report.deviation is None
    assert "REG: tunable GAIN% starts at its new CURRENT=2, not at 4" in report.notes
    assert positions(tmp_path / "after") == closed_loop(0, [4] * 10 + [2] * 20)[10:]
    assert state_of(tmp_path / "after", "REG")["N!"] == state_of(bag, "REG")["N!"] == 30
    assert replay(tmp_path / "after", {}, ReplayOptions()).identical


def test_the_same_by_a_tunable_and_from_the_start(bag, tmp_path):
    report = run_again(bag, tmp_path / "after", 0.02, "REG.GAIN=2")
    assert report.deviation is None
    assert positions(tmp_path / "after") == closed_loop(0, [4] * 10 + [2] * 20)[10:]
    run_again(bag, tmp_path / "start", 0.0, "REG.GAIN%=2")
    assert positions(tmp_path / "start") == closed_loop(0, [2] * 30)


def test_new_locals_begin_anew_and_kept_ones_go_on(bag, tmp_path):
    more = edited(REG, ("N!, E!", "N!, E!, M!"), ("110 N! = N! + 1", "105 M! = M! + 1\n110 N! = N! + 1"))
    report = run_again(bag, tmp_path / "after", 0.04, REG=more)
    assert [note for note in report.notes if note.startswith("REG:")] == ["REG: 1 of 5 values begin as installed: M!"]
    state = state_of(tmp_path / "after", "REG")
    assert (state["N!"], state["M!"]) == (30, 10)


def test_another_period_counts_from_the_next_scan(bag, tmp_path):
    report = run_again(bag, tmp_path / "after", 0.0205, REG=edited(REG, ("TICKS=2", "TICKS=5")))
    assert report.deviation is None
    times = [scan.stamp for scan in messages_of(tmp_path / "after", Scan) if scan.task == "REG"]
    gaps = {later - earlier for earlier, later in pairwise(times)}
    assert times[0] // 1_000_000 == 22
    assert {round(gap / 1e6) for gap in gaps} == {5}


def test_a_basic_task_is_put_into_run_again_with_its_variables(bag, tmp_path):
    source = SourceText("new/TELL.BAS", TELL.replace("TOLD% = K%", "TOLD% = K% * 100"))
    report = Rerun(bag, {"TELL": source}, RerunOptions(from_ns=35_000_000)).run(tmp_path / "after")
    assert report.deviation is None
    assert "TELL: a BASIC task, put into RUN again with 1 of its variables" in report.notes
    assert state_of(bag, "TELL")["K%"] == 6
    values = [item.value[0] for scan in messages_of(tmp_path / "after", Scan) if (item := scan.written).variable]
    told = [value for value in values if value >= 100 and value % 100 == 0 and value < 1000]
    assert told[:1] == [500.0]


def test_a_reload_in_the_recording_loads_the_edit(tmp_path):
    (tmp_path / "TELL.BAS").write_text(TELL)
    rack = rack_from(tmp_path, YAML.format(execution="ideal"), REG=REG, PLANT=PLANT)
    slower = SourceText("REG.BLK", edited(REG, ("CURRENT=4", "CURRENT=50")))
    acts = {0.0301: lambda: rack.operations.reload("REG", slower, keep_state=True)}
    bag = recorded_run(rack, tmp_path / "bag", 0.06, acts)
    stronger = edited(REG, ("E! / GAIN%", "E! / 2"))
    run_again(bag, tmp_path / "after", 0.02, REG=stronger)
    assert positions(tmp_path / "after") == closed_loop(0, [4] * 10 + [2] * 20)[10:]
    assert run_again(bag, tmp_path / "same").deviation is None
    assert data_of(tmp_path / "same") == data_of(bag)


def test_a_local_that_is_forced_stays_so_while_the_task_has_it(tmp_path):
    (tmp_path / "TELL.BAS").write_text(TELL)
    rack = rack_from(tmp_path, YAML.format(execution="ideal"), REG=REG, PLANT=PLANT)
    bag = recorded_run(rack, tmp_path / "bag", 0.06, {0.0101: lambda: rack.adjust.force("REG.N!", 7)})
    run_again(bag, tmp_path / "after", 0.02, REG=edited(REG, ("CURRENT=4", "CURRENT=2")))
    assert state_of(tmp_path / "after", "REG")["N!"] == 7
    gone = REG.replace("N!, E!", "E!").replace("110 N! = N! + 1\n", "")
    report = run_again(bag, tmp_path / "gone", 0.02, REG=gone)
    assert report.deviation is None
    assert positions(tmp_path / "gone")[-1] == positions(bag)[-1]


def test_what_an_operator_tuned_later_is_tuned_again_and_what_is_refused_is_told(tmp_path):
    (tmp_path / "TELL.BAS").write_text(TELL)
    rack = rack_from(tmp_path, YAML.format(execution="ideal"), REG=REG, PLANT=PLANT)
    bag = recorded_run(rack, tmp_path / "bag", 0.06, {0.0401: lambda: rack.adjust.tune("REG.GAIN%", 10)})
    run_again(bag, tmp_path / "after", 0.02, "REG.GAIN=2")
    assert positions(tmp_path / "after") == closed_loop(0, [4] * 10 + [2] * 10 + [10] * 10)[10:]
    fixed = edited(REG, (" [CURRENT=4, HIGH=100, LOW=1]", ""), ("110 N!", "105 GAIN% = 2\n110 N!"))
    report = run_again(bag, tmp_path / "fixed", 0.02, REG=fixed)
    assert report.refused == 1
    assert any(note.startswith("tune REG at 0.0401 s is refused here: ") for note in report.notes)


def test_errors_of_an_edit_are_told_before_anything_runs(bag, tmp_path):
    with pytest.raises(SourceRefused):
        run_again(bag, tmp_path / "after", REG="10 COMMON NOWHERE%\n20 CALL SCAN_LOOP(TICKS=1)\n30 END\n")
    with pytest.raises((RackError, SourceRefused)):
        run_again(bag, tmp_path / "after", 0.02, TELL=REG)
    for wrong in ("REG.GAIN=0", "REG.GAIN=x", "REG.NONE=1", "REG.N=1", "NOBODY.GAIN=1", "REG", ""):
        with pytest.raises(UserError):
            run_again(bag, tmp_path / "after", 0.0, wrong)
    assert not (tmp_path / "after").exists()


def test_a_recording_without_its_start_is_refused(tmp_path):
    options = RecordingOptions(split_ns=500_000_000)
    files = recorded(tmp_path, busy, seconds=1.2, options=options)
    with pytest.raises(BagError) as refused:
        run_again(files / "scans_1.mcap", tmp_path / "after")
    assert refused.value.code == "AMX6835"
    assert "begins 0.5 s after the start of its run" in refused.value.message
    assert run_again(files, tmp_path / "whole").deviation is None
    with pytest.raises(BagError) as beyond:
        run_again(files, tmp_path / "after", 2.0)
    assert beyond.value.code == "AMX6825"


def test_a_recording_that_is_not_of_this_emulator_deviates(tmp_path):
    """One write of a task has another value: that is found, and when."""
    bag = recorded(tmp_path, busy, seconds=0.5)
    writers = {"changed": 0}

    def change(message):
        if (
            isinstance(message, CommonWrite)
            and message.kind == 2
            and message.stamp > 200_000_000
            and message.writer > 2
        ):
            writers["changed"] += 1
            if writers["changed"] == 1:
                return message._replace(values=message.values._replace(value=[v + 1 for v in message.values.value]))
        return message

    other = rewritten(bag, tmp_path / "other", change)
    report = run_again(other, tmp_path / "after", 0.4)
    assert report.deviation is not None
    assert 200_000_000 < report.deviation.time_ns < 220_000_000
    assert "and then not" in report.text()


def test_from_to_and_without_a_recording(bag, tmp_path):
    options = RerunOptions(from_ns=20_000_000, to_ns=40_000_000)
    report = Rerun(bag, {}, options).run(tmp_path / "part")
    assert report.deviation is None
    assert positions(tmp_path / "part") == positions(bag)[10:20]
    alone = Rerun(bag, {}, RerunOptions()).run(None)
    assert (alone.scans, alone.deviation) == (0, None)
    assert ", in simulated time, 0.04 s\n" in report.text()


def test_an_edit_that_the_recording_itself_tunes_is_told_once(tmp_path):
    (tmp_path / "TELL.BAS").write_text(TELL)
    rack = rack_from(tmp_path, YAML.format(execution="ideal"), REG=REG, PLANT=PLANT)
    acts = {at_s: lambda value=value: rack.adjust.tune("REG.GAIN%", value) for at_s, value in ((0.02, 10), (0.04, 5))}
    bag = recorded_run(rack, tmp_path / "bag", 0.06, acts)
    told = "REG.GAIN% becomes 10 at 0.02 s, as in the recording: that ends its edit"
    assert [note for note in run_again(bag, None, 0.02, "REG.GAIN=2").notes if "ends its edit" in note] == [told]
    assert told in run_again(bag, None, 0.0, "REG.GAIN=2").notes
    assert not [note for note in run_again(bag, None, 0.05, "REG.GAIN=2").notes if "ends its edit" in note]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ((" [CURRENT=4, HIGH=100, LOW=1]", ""), "it has no tunable GAIN%"),
        (("HIGH=100, LOW=1", "HIGH=4, LOW=3"), "GAIN% = 2 lies outside 3 to 4"),
    ],
)
def test_what_a_recorded_reload_has_taken_away_cannot_be_tuned(tmp_path, change, why):
    (tmp_path / "TELL.BAS").write_text(TELL)
    rack = rack_from(tmp_path, YAML.format(execution="ideal"), REG=REG, PLANT=PLANT)
    source = SourceText("REG.BLK", edited(REG, change, ("N!, E!", "N!, E!, M%"), ("110 N!", "105 M% = 4\n110 N!")))
    bag = recorded_run(rack, tmp_path / "bag", 0.06, {0.0301: lambda: rack.operations.reload("REG", source)})
    assert run_again(bag, tmp_path / "before", 0.03, "REG.GAIN=2").deviation is None
    with pytest.raises(UserError) as refused:
        run_again(bag, tmp_path / "after", 0.04, "REG.GAIN=2")
    assert refused.value.message == f"task REG at 0.04 s: {why}"
    assert refused.value.hint == "the recording has reloaded REG by then: begin before that with --from"
    assert not (tmp_path / "after").exists()


@pytest.mark.parametrize("number", [float("nan"), float("inf"), 2.5])
def test_a_tunable_with_a_number_that_it_cannot_have_is_refused(bag, tmp_path, number):
    def change(message):
        if not isinstance(message, TaskState) or message.task != "REG":
            return message
        place = sum(message.size[: list(message.field).index("GAIN%")])
        return message._replace(value=[*message.value[:place], number, *message.value[place + 1 :]])

    with pytest.raises(BagError, match=r"wrong state of task REG at .* s: tunable GAIN% cannot be") as refused:
        run_again(rewritten(bag, tmp_path / "other", change), None)
    assert refused.value.code == "AMX6813"


def test_a_tunable_without_its_task_or_value(bag):
    def hint(text: str) -> str | None:
        with pytest.raises(UserError) as error:
            Rerun(bag, {}, RerunOptions()).tune([text])
        return error.value.hint

    assert hint("GAIN=10") == "write REG.GAIN=10"
    assert hint("gain%") == "write REG.GAIN%=VALUE"
    assert hint("NONE=1") == "it has REG.GAIN"
    assert hint("REG.GAIN") == hint("REG.GAIN=x") == "it takes 1 to 100"
