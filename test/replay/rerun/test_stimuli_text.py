"""The outside of a recorded run as a stimuli file: a person reads it, and a run with it is the recorded one."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import rack_at
from scenario.stimuli.helpers import SPEED, rack_in

from automax_ros.rackfile.model.writers import ROS_WRITER
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.rerun import stimuli_text as module
from automax_ros.replay.rerun.outside import recorded_outside
from automax_ros.replay.rerun.stimuli_text import StimuliText, sources_folder, stimuli_text
from replay.replays import record
from replay.rerun.runs import data_of, recorded_run
from replay.test_operated_rack import make, operate, refused

CONFIG = Path(__file__).parents[3] / "config"
ALL = """\
- {at: 0, set: {REF%: 5}}
- {at: 0.002, set: {REF%: 7, "DIAG%(1,0)": 5, TABLE%(3): 9, NOTE$: 'a "b", c', GAIN: 0.1, START_PB@: true}}
- {at: 0.004, ramp: {REF%: {to: 20, over: 0.004}}}
- {at: 0.011, force: {SUM!: 200}}
- {at: 0.012, unforce: [SUM!]}
- {at: 0.013, force: {RUN@: false, SPEED.SEEN%: 3}}
- {at: 0.014, unforce: all}
- {at: 0.015, tune: {SPEED.KP: 1.25}}
- {at: 0.0165, stop: [DRAW]}
- {at: 0.017, run: [DRAW]}
- {at: 0.0181, reload: {SPEED: {file: other.BLK, keep_state: true}}}
- {at: 0.0191, reload: {DRAW: draw.BLK}}
- {at: 0.020, stop_all: true}
- {at: 0.021, clear_errors: [SPEED]}
- {at: 0.022, clear_errors: all}
- {at: 0.023, run_all: true}
- {at: 0.025, power: {off_for: 0.003}}
- {at: 0.030, run_all: true}
- {at: 0.032, power: {off_for: 0.002, battery: false}}
- {at: 0.036, stop: [SPEED]}
- {at: 0.037, delete: [SPEED]}
"""


def exported(bag: Path, folder: Path, **options: int | None) -> StimuliText:
    """Write the stimuli of a recording into a folder."""
    config, outside = recorded_outside(bag)
    path = folder / "again.yaml"
    made = stimuli_text(bag, config, outside, "What came from outside", folder=sources_folder(path), **options)
    path.write_text(made.text, encoding="utf-8")
    (folder / sources_folder(path)).mkdir(exist_ok=True)
    for name, text in made.sources.items():
        (folder / sources_folder(path) / name).write_text(text, encoding="utf-8")
    return made


def test_every_verb_comes_back_and_gives_the_recorded_bytes(tmp_path):
    rack = rack_in(tmp_path)
    (tmp_path / "other.BLK").write_text(SPEED.replace("SUM! + 1", "SUM! + 2"))
    (tmp_path / "draw.BLK").write_text("10 LOCAL N%\n20 CALL SCAN_LOOP(TICKS=3)\n30 N% = N% + 1\n40 END\n")
    (tmp_path / "all.yaml").write_text(ALL)
    bag = recorded_run(rack, tmp_path / "bag", 0.04, stimuli=tmp_path / "all.yaml")
    made = exported(bag, tmp_path)
    verbs = [line.split(", ")[1].partition(":")[0] for line in made.lines if line.startswith("-")]
    assert set(verbs) == {
        "set", "force", "unforce", "tune", "stop", "run", "reload", "stop_all", "clear_errors", "run_all", "power",
        "delete",
    }  # fmt: skip
    assert set(made.sources) == {"SPEED_1.BLK", "DRAW_1.BLK"}
    assert "- {at: 0.025, power: {off_for: 0.003}}" in made.lines
    assert "- {at: 0.032, power: {off_for: 0.002, battery: false}}" in made.lines
    again = recorded_run(rack_at(tmp_path / "rack.yaml"), tmp_path / "same", 0.04, stimuli=tmp_path / "again.yaml")
    assert data_of(again) == data_of(bag)
    part = exported(bag, tmp_path, from_ns=20_000_000, to_ns=23_000_000)
    assert [line.partition(",")[0] for line in part.lines[1:]] == [
        "- {at: 0.02", "- {at: 0.021", "- {at: 0.022", "- {at: 0.023",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("example", "stimuli", "seconds"), [("dc_drive", "tour.yaml", 1.5), ("web_line", "start.yaml", 2)]
)
def test_the_stimuli_of_an_example_come_back(tmp_path, example, stimuli, seconds):
    path = CONFIG / example / "rack.yaml"
    bag = recorded_run(rack_at(path), tmp_path / "bag", seconds, stimuli=CONFIG / example / stimuli)
    exported(bag, tmp_path)
    again = recorded_run(rack_at(path), tmp_path / "same", seconds, stimuli=tmp_path / "again.yaml")
    assert data_of(again) == data_of(bag)


def test_of_what_stimuli_cannot_say_they_tell_what_it_was(tmp_path):
    """A refused operation, and ROS, which they write as the operator."""
    rack = rack_in(tmp_path)
    acts = {
        0.001: lambda: rack.write_view(rack.memory.view("REF%"), [(0, 21)], ROS_WRITER),
        0.002: lambda: rack.tune(rack.task("SPEED"), "COUNT%", 5),
        0.003: lambda: refused(lambda: rack.operations.run("SPEED")),
        0.005: rack.operations.power_off,
    }
    made = exported(recorded_run(rack, tmp_path / "bag", 0.01, acts), tmp_path)
    assert made.lines[1:] == [
        "- {at: 0.001, set: {REF%: 21}} # from ROS",
        "- {at: 0.002, tune: {SPEED.COUNT%: 5}} # by ROS",
        "# at 0.003: run SPEED was refused: task SPEED runs already",
        "- {at: 0.005, power: {off_for: 1000000}}",
    ]


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_an_operated_run_by_stimuli_has_the_same_scans(tmp_path, execution):
    rack = make(tmp_path / "rack", execution)
    bag = record(rack, tmp_path / "bag", lambda rack, number: number and operate(rack, number), 17, 0.85)
    exported(bag, tmp_path)
    again = recorded_run(make(tmp_path / "rack", execution), tmp_path / "same", 0.85, stimuli=tmp_path / "again.yaml")
    assert (tmp_path / "again.yaml").read_text().count("\n") > 30
    assert data_of(again) == data_of(bag)


def test_more_than_a_stimuli_file_may_have_is_refused(tmp_path, monkeypatch):
    rack = rack_in(tmp_path)
    (tmp_path / "all.yaml").write_text(ALL.partition("- {at: 0.0181")[0])
    bag = recorded_run(rack, tmp_path / "bag", 0.02, stimuli=tmp_path / "all.yaml")
    monkeypatch.setattr(module, "MOST_ENTRIES", 5)
    with pytest.raises(BagError) as refused:
        exported(bag, tmp_path)
    assert refused.value.code == "AMX6814"


def test_nothing_from_outside_says_so(tmp_path):
    bag = recorded_run(rack_in(tmp_path), tmp_path / "bag", 0.01)
    assert exported(bag, tmp_path).lines == ["# What came from outside", "# Nothing came from outside."]
