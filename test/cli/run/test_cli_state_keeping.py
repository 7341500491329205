"""What `automax run` does about values that outlive a run: when it saves, and what it tells."""

import json
from pathlib import Path

import pytest
from rack.helpers import rack_at, written_in

from automax_ros.cli.run.saving import SAVE_PERIOD_NS, SavedState
from automax_ros.rack.rack import Rack

RACK = """\
rack: KEEP
auto_run: true
slots:
  0: {module: 57C435, tasks: {T: {priority: 5}, U: {priority: 6, file: T.BLK}}}
common:
  COUNT%: {non_volatile: true}
"""
TASK = """\
10 COMMON COUNT%
20 LOCAL K% [CURRENT=4, LOW=0, HIGH=10]
30 CALL SCAN_LOOP(TICKS=1)
40 COUNT% = COUNT% + 1
50 END
"""


@pytest.fixture
def folder(tmp_path) -> Path:
    written_in(tmp_path, RACK, T=TASK)
    return tmp_path


def made(folder: Path) -> tuple[Rack, SavedState]:
    rack = rack_at(folder / "rack.yaml")
    keeping = SavedState(rack, folder / "state")
    rack.start(keeping.settings)
    return rack, keeping


def kept(folder: Path) -> dict[str, object]:
    return json.loads((folder / "state" / "state.json").read_bytes())


def test_a_running_rack_is_saved_every_five_seconds(folder):
    rack, keeping = made(folder)
    rack.run(0.02)
    keeping.update(SAVE_PERIOD_NS - 1)
    assert not (folder / "state").exists()
    keeping.update(SAVE_PERIOD_NS)
    keeping._saving.join()
    assert kept(folder)["commons"]["COUNT%"]["values"] == [8]
    rack.run(0.02)
    keeping.update(2 * SAVE_PERIOD_NS - 1)
    assert kept(folder)["commons"]["COUNT%"]["values"] == [8]
    assert keeping.news() == []


def test_the_end_saves_what_ran_before_the_tasks_were_stopped(folder):
    rack, keeping = made(folder)
    rack.operations.stop("U")
    rack.run(0.02)
    keeping.freeze()
    rack.operations.stop_tasks()
    keeping.end()
    assert kept(folder)["status"] == {"T": "RUNNING", "U": "STOPPED"}
    again, keeping = made(folder)
    assert [task.status.name for task in again.tasks] == ["RUNNING", "STOPPED"]
    assert keeping.news() == [f"kept from the last run: 1 common, 0 tunables ({folder / 'state' / 'state.json'})"]
    assert keeping.news() == []


def test_what_came_back_is_told(folder):
    rack, keeping = made(folder)
    rack.tune(rack.task("T"), "K%", 7)
    rack.force("COUNT%", 3)
    keeping.end()
    (folder / "rack.yaml").write_text(RACK.replace(", U: {priority: 6, file: T.BLK}", ""))
    assert made(folder)[1].news() == [
        f"kept from the last run: 1 common, 1 tunable, 1 force ({folder / 'state' / 'state.json'})",
        "task U was kept and is not in the rack any more",
    ]


def test_a_folder_that_cannot_be_written_is_told_once_and_not_tried_again(folder):
    (folder / "state").write_text("a file stands there")
    rack, keeping = made(folder)
    rack.run(0.02)
    keeping.update(SAVE_PERIOD_NS)
    keeping._saving.join()
    (folder / "state").unlink()
    keeping.end()
    assert keeping.failed
    assert [text.partition(": ")[0] for text in keeping.news()] == ["values of this run will not outlive it"]
    assert keeping.news() == []
    assert not (folder / "state").exists()


def test_without_a_folder_nothing_is_kept(folder):
    keeping = SavedState(rack_at(folder / "rack.yaml"), None)
    keeping.update(SAVE_PERIOD_NS)
    keeping.freeze()
    keeping.end()
    assert (keeping.settings, keeping.news(), keeping.failed) == ((), [], False)
