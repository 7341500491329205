"""Recordings of racks that were operated: RUN, STOP, STOP ALL, power, reload, errors cleared."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from automax_ros.recordings.write.recorder import RecordingOptions
from replay.replays import SPEED, WORK, busy, edited, recorded, replayed, rewritten

OTHER_SPEED = edited(SPEED, ("CURRENT=1", "CURRENT=2"))


def reload(rack: Rack, name: str, text: str) -> None:
    rack.operations.reload(name, SourceText(f"{name}.BLK", text))


OPERATED = {
    "stop and run": (lambda rack: rack.operations.stop("WORK"), lambda rack: rack.operations.run("WORK")),
    "stop all": (lambda rack: rack.operations.stop_all("test"), lambda rack: rack.operations.run_all()),
    "power": (lambda rack: rack.operations.power_off(), lambda rack: rack.operations.power_on(auto_run=True)),
    "no battery": (
        lambda rack: rack.operations.power_off(),
        lambda rack: rack.operations.power_on(battery=False, auto_run=True),
    ),
    "errors cleared": (
        lambda rack: rack.operations.clear_errors(),
        lambda rack: rack.operations.clear_errors("WORK"),
    ),
    "the same source again": (lambda rack: reload(rack, "WORK", WORK), lambda rack: reload(rack, "SPEED", SPEED)),
}


def operated(folder: Path, first, then, **options) -> Path:
    """A recording of 2 s in which a tunable is set at 0.2 s, the rack operated at 0.9 s and once more at 1.2 s."""

    def steps(rack: Rack, number: int) -> None:
        busy(rack, number)
        if number == 2:
            rack.tune(rack.task("SPEED"), "TRIM%", 5)
        if number in (9, 12):
            (first if number == 9 else then)(rack)

    return recorded(folder / "rack", steps, **options)


@pytest.mark.parametrize("name", OPERATED)
def test_a_rack_that_was_operated_replays_bit_for_bit(tmp_path, name):
    bag = operated(tmp_path, *OPERATED[name])
    for from_ms in (0, 850, 1000, 1250):
        report = replayed(bag, from_ns=from_ms * 10**6)
        assert report.identical, (from_ms, report.differences)
        assert report.scans > 100
        assert not any("missing" in note or "could not" in note for task in report.tasks for note in task.notes)


def test_an_edited_task_is_installed_again_where_the_recorded_one_was(tmp_path):
    bag = operated(tmp_path, *OPERATED["no battery"])
    speed = replayed(bag, {"SPEED": OTHER_SPEED}, only=("SPEED",)).tasks[0]
    assert "installed again at 1.2 s" in speed.notes
    assert speed.different


def test_each_scan_is_executed_with_the_source_that_ran_also_after_a_reload(tmp_path):
    bag = operated(tmp_path, lambda rack: reload(rack, "SPEED", OTHER_SPEED), lambda rack: reload(rack, "SPEED", SPEED))
    report = replayed(bag)
    speed, work = report.tasks
    assert report.identical
    assert speed.notes[:2] == ("tunable TRIM% set to 5 at 0.2 s", "reloaded at 0.9 s")
    assert "reloaded at 1.2 s" in speed.notes
    plain = replayed(recorded(tmp_path / "plain"))
    assert (speed.scans, work.scans) == (plain.tasks[0].scans + 2, plain.tasks[1].scans), "and two start-up parts"
    for from_ms in (1000, 1300):
        later = replayed(bag, from_ns=from_ms * 10**6)
        assert later.identical
        assert later.tasks[0].scans == sum(1 for number in range(364) if number * 5.5 >= from_ms) + (from_ms < 1200)


def test_scans_under_a_source_that_is_not_stored_are_left_out(tmp_path):
    bag = operated(tmp_path, lambda rack: reload(rack, "SPEED", OTHER_SPEED), lambda rack: reload(rack, "SPEED", SPEED))
    stored = iter(range(9))
    lacking = rewritten(
        bag,
        tmp_path / "lacking",
        attachments=lambda name, data: None if name == "SPEED.BLK" and next(stored) else data,
    )
    report = replayed(lacking)
    speed = report.tasks[0]
    assert report.identical
    assert "reloaded at 0.9 s with a source that is not stored inside" in speed.notes
    assert 300 < speed.scans < 320, "all but those from 0.9 to 1.2 s"


def test_an_edited_source_runs_in_place_of_each_that_ran(tmp_path):
    doubled = edited(SPEED, ("INPUT2=100,", "INPUT2=200,"))
    bag = operated(tmp_path, lambda rack: reload(rack, "SPEED", doubled), lambda rack: rack.operations.run_all())
    report = replayed(bag, {"SPEED": doubled})
    speed = report.tasks[0]
    assert speed.different
    times = {difference.first.time_s for difference in report.differences}
    assert max(times) < 0.9, "from the reload on both are the same program"
    last = max(item.settled.time_s for item in report.differences if item.settled)
    assert last == pytest.approx(0.9, abs=0.02)


def test_a_source_that_is_given_runs_in_place_of_later_ones_too_where_it_is_the_first_that_ran(tmp_path):
    doubled = edited(SPEED, ("INPUT2=100,", "INPUT2=200,"))
    bag = operated(tmp_path, lambda rack: reload(rack, "SPEED", doubled), lambda rack: rack.operations.run_all())
    report = replayed(bag, {"SPEED": SPEED})
    assert not report.identical
    assert report.tasks[0].edited
    first = min(difference.first.time_s for difference in report.differences)
    assert 0.9 <= first < 1.1, "nothing differs before the reload"
    remarked = replayed(bag, {"SPEED": edited(SPEED, ("100 CALL", "99 REM as it was\n100 CALL"))}, only=("SPEED",))
    alone = replayed(bag, {"SPEED": SPEED}, only=("SPEED",))
    assert alone.tasks[0].different == remarked.tasks[0].different > 0


def test_each_file_of_a_recording_has_the_source_that_ran_when_it_began(tmp_path):
    options = RecordingOptions(split_ns=500 * 10**6)
    first, then = (lambda rack: reload(rack, "SPEED", OTHER_SPEED)), (lambda rack: rack.operations.stop("WORK"))
    bag = operated(tmp_path, first, then, options=options)
    reports = [replayed(file) for file in sorted(bag.glob("*.mcap"))]
    assert len(reports) == 4
    assert all(report.identical for report in reports)
    assert [any("reloaded" in note for note in report.tasks[0].notes) for report in reports] == [
        False,
        True,
        False,
        False,
    ]
    assert all(report.tasks[0].scans > 70 for report in reports)
