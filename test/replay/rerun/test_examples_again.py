"""Each example rack that is recorded in simulated time runs again as it was, from the start and from a later moment."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import rack_at

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import NS_PER_S
from automax_ros.rackfile.reading.files import read_task_source
from automax_ros.recordings.read.reader import BagReader
from automax_ros.replay.engine import ReplayOptions, replay
from automax_ros.replay.rerun.rerun import Rerun, RerunOptions
from replay.rerun.runs import data_of, recorded_run, run_again

ROOT = Path(__file__).parents[3]
CONFIG = ROOT / "config"
EXAMPLES = {
    "dc_drive": ("tour.yaml", 0.3),
    "paper_line": ("shift.yaml", 0.15),
    "section_drive": (None, 1.0),
    "web_line": ("start.yaml", 0.4),
    "two_racks/line": (None, 1.0),
    "two_racks/winder": (None, 1.0),
}
"""Stimuli, and seconds that are enough for some hundred scans; the soak tests take the time in which things happen."""
LONG_S = {"dc_drive": 8.0, "paper_line": 2.0, "section_drive": 12.0, "web_line": 12.0}


def test_these_are_all_examples():
    assert set(EXAMPLES) == {str(path.parent.relative_to(CONFIG)) for path in CONFIG.rglob("rack.yaml")}


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_runs_again(tmp_path, example, execution):
    assert_again(tmp_path, example, execution, EXAMPLES[example][1])


@pytest.mark.soak
@pytest.mark.parametrize("execution", ["ideal", "modeled"])
@pytest.mark.parametrize("example", LONG_S)
def test_an_example_runs_again_for_longer(tmp_path, example, execution):
    assert_again(tmp_path, example, execution, LONG_S[example])


def assert_again(tmp_path: Path, example: str, execution: str, seconds: float) -> None:
    """Record an example; unedited, and with each task replaced by itself from a later moment, it is the same run."""
    stimuli, folder = EXAMPLES[example][0], tmp_path / "rack"
    folder.mkdir()
    for path in (CONFIG / example).iterdir():
        if path.is_file():
            text = path.read_text(encoding="utf-8")
            if path.name == "rack.yaml":
                text = "\n".join(line for line in text.splitlines() if not line.startswith("execution:"))
                text += f"\nexecution: {execution}\n"
            (folder / path.name).write_text(text, encoding="utf-8")
    rack = rack_at(folder / "rack.yaml")
    bag = recorded_run(rack, tmp_path / "bag", seconds, stimuli=None if stimuli is None else folder / stimuli)
    report = run_again(bag, tmp_path / "after")
    assert report.deviation is None, report.text()
    assert report.is_exact
    assert data_of(tmp_path / "after") == data_of(bag)

    from_s = round(seconds * 0.6, 4)
    later = run_again(bag, tmp_path / "later", from_s)
    assert later.deviation is None, later.text()
    blocks = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.BLK")}
    replaced = run_again(bag, tmp_path / "replaced", from_s, **blocks)
    assert replaced.deviation is None, replaced.text()
    assert replaced.compared > 20
    if replaced.at_ns == round(from_s * NS_PER_S):  # else a modeled scan was under way
        assert data_of(tmp_path / "replaced") == data_of(tmp_path / "later")


def test_the_golden_recording_from_its_middle(tmp_path):
    golden, source = ROOT / "bags" / "section_drive", read_task_source(CONFIG / "section_drive" / "SPEED.BLK")
    assert run_again(golden, tmp_path / "whole").deviation is None
    assert data_of(tmp_path / "whole") == data_of(golden)
    stronger = SourceText("new/SPEED.BLK", source.text.replace("CURRENT=26.7", "CURRENT=30.0"))
    report = Rerun(golden, {"SPEED": stronger}, RerunOptions(from_ns=5 * NS_PER_S)).run(tmp_path / "after")
    assert report.deviation is None
    assert "SPEED: tunable KP_SPEED starts at its new CURRENT=30.0, not at 26.7" in report.notes
    first, last = (f([item.publish_time for item in BagReader(tmp_path / "after").records()]) for f in (min, max))
    assert (first, last) == (5 * NS_PER_S, 10 * NS_PER_S)
    assert replay(tmp_path / "after", {}, ReplayOptions()).identical
