"""Recordings of racks that were operated: RUN, STOP, STOP ALL, power, reload, errors cleared."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.bags.recorder import RecordingOptions
from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack

from .replays import SPEED, WORK, busy, edited, recorded, replayed

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


def test_what_ran_after_a_reload_with_another_source_is_left_out_and_the_rest_is_compared(tmp_path):
    bag = operated(tmp_path, lambda rack: reload(rack, "SPEED", OTHER_SPEED), lambda rack: reload(rack, "SPEED", SPEED))
    report = replayed(bag)
    speed, work = report.tasks
    assert report.identical
    assert speed.notes[:2] == (
        "tunable TRIM% set to 5 at 0.2 s",
        "reloaded at 0.9 s with a source that is not stored inside",
    )
    assert work.scans == replayed(recorded(tmp_path / "plain")).tasks[1].scans
    assert 300 < speed.scans < 320, "all but those from 0.9 to 1.2 s"
    later = replayed(bag, from_ns=10**9)
    assert later.identical
    assert later.tasks[0].scans > 140, "from 1.2 s on the stored source runs again"


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
