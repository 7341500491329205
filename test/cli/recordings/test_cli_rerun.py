"""`automax rerun` and `automax export --stimuli`: exit codes, the report, what they refuse."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from replay.replays import SPEED, YAML, edited, recorded
from replay.rerun.runs import recorded_run
from scenario.stimuli.helpers import SPEED as SMALL
from scenario.stimuli.helpers import rack_in

from automax_ros.core.diagnostics import SourceText

STRONGER = edited(SPEED, ("INPUT2=100", "INPUT2=104"))


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=1.0)


@pytest.fixture
def bag(source, automax) -> str:
    (automax.folder / "out").symlink_to(source)
    return "out"


def test_unedited_it_is_the_recorded_run(automax, bag):
    result = automax("rerun", bag, "--record", "after")
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[0] == "out: rack LINE1, in simulated time, 1 s"
    assert lines[2].startswith("unedited, from the start to 1 s: ")
    assert lines[2].endswith(" messages as recorded, bit for bit")
    after, before = (automax.folder / name / "scans_0.mcap" for name in ("after", bag))
    assert after.read_bytes() == before.read_bytes()


def test_an_edit_from_the_middle(automax, bag):
    automax.write("SPEED.BLK", STRONGER)
    result = automax("rerun", bag, "--from", "0.5", "--task", "SPEED=SPEED.BLK", "--record", "after")
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[2].startswith("run up from the start to 0.5 s, for the recording does not hold where the scheduler is")
    assert lines[3] == "edited, 0.5 to 1 s: SPEED from SPEED.BLK"
    assert automax("replay", "after").code == 0
    told = json.loads(automax("rerun", bag, "--from", "0.5", "--tune", "SPEED.TRIM=3", "--record", "b", "--json").out)
    assert (told["edited"], told["at_s"], told["deviation"]) == (["SPEED.TRIM% = 3"], 0.5, None)


def test_what_is_refused(automax, bag):
    automax.write("SPEED.BLK", STRONGER)
    automax.write("WRONG.BLK", "10 NONSENSE\n")
    assert automax("rerun", bag, "--task", "SPEED=SPEED.BLK").code == 2
    assert "--record AFTER" in automax("rerun", bag, "--tune", "SPEED.TRIM=3").err
    wrong = automax("rerun", bag, "--task", "SPEED=WRONG.BLK", "--record", "after")
    assert wrong.code == 1
    assert "nothing is run" in wrong.err
    assert "SPEED has no tunable" in automax("rerun", bag, "--tune", "SPEED.NONE=3", "--record", "after").err
    assert "has no task 'NOBODY'" in automax("rerun", bag, "--tune", "NOBODY.TRIM=3", "--record", "after").err
    assert "AMX6810" in automax("rerun", "nothing").err
    assert automax("rerun", bag, "--from", "0.5", "--to", "0.4").code == 2
    assert "AMX6825" in automax("rerun", bag, "--from", "7").err
    assert not (automax.folder / "after").exists()
    (automax.folder / "there").mkdir()
    assert "AMX6800" in automax("rerun", bag, "--record", "there").err


def test_another_version_deviates(automax, tmp_path):
    """The rack file inside says another preset than the one that was recorded."""
    from replay.replays import rewritten

    bag = recorded(tmp_path / "small", seconds=0.2)
    other = YAML.replace("REF%: {preset: 100", "REF%: {preset: 101")
    rewritten(bag, tmp_path / "other", attachments=lambda name, data: other.encode() if name == "rack.yaml" else data)
    result = automax("rerun", "other", "--record", "after")
    assert result.code == 1
    assert "AMX6836" in result.err
    assert "at 0 s" in result.err


def test_stimuli_of_a_recording(automax, bag):
    result = automax("export", bag, "--stimuli", "again.yaml")
    assert (result.code, result.err) == (0, "")
    text = (automax.folder / "again.yaml").read_text()
    assert text.startswith("# What came from outside in out, rack LINE1\n")
    assert "- {at: 0.05, set: {REF%: 37}}" in text
    automax("export", bag, "--stimuli", "part.yaml", "--from", "0.05", "--to", "0.05")
    assert (automax.folder / "part.yaml").read_text().count("- {") == 5
    for options in (["-o", "x.csv"], ["--watch", "REF%"], ["--scans", "SPEED"], ["--every", "0.1"]):
        refused = automax("export", bag, "--stimuli", "other.yaml", *options)
        assert (refused.code, "is for a table" in refused.err) == (2, True)
    assert automax("export", bag, "--stimuli", "again.txt").code == 2
    assert automax("export", bag).code == 2


def test_stimuli_of_a_rerun_begin_where_it_does_and_nothing_is_written_over(automax, bag):
    assert automax("rerun", bag, "--from", "0.5", "--tune", "SPEED.TRIM=3", "--record", "after").code == 0
    assert automax("export", "after", "--stimuli", "again.yaml").code == 0
    text = (automax.folder / "again.yaml").read_text()
    assert "# The recording begins at 0.5 s of its run" in text
    assert "kept from an earlier one" not in text
    (automax.folder / "again.yaml").write_text("# mine\n")
    refused = automax("export", "after", "--stimuli", "again.yaml")
    assert refused.code == 2
    assert "--force writes over it" in refused.err
    assert (automax.folder / "again.yaml").read_text() == "# mine\n"
    assert automax("export", "after", "--stimuli", "again.yaml", "--force").code == 0
    assert (automax.folder / "again.yaml").read_text() == text
    assert automax("export", "after", "-o", "x.csv", "--force").code == 2


def test_sources_of_reloads_that_were_edited_are_not_written_over(automax):
    rack = rack_in(automax.folder)
    faster = SourceText("SPEED.BLK", edited(SMALL, ("SUM! + 1", "SUM! + 2")))
    recorded_run(rack, automax.folder / "out", 0.01, {0.002: lambda: rack.operations.reload("SPEED", faster)})
    assert automax("export", "out", "--stimuli", "again.yaml").code == 0
    source, stimuli = automax.folder / "again_sources" / "SPEED_1.BLK", automax.folder / "again.yaml"
    assert source.read_text() == faster.text
    stimuli.unlink()
    assert automax("export", "out", "--stimuli", "again.yaml").code == 0
    stimuli.unlink()
    source.write_text("mine\n")
    refused = automax("export", "out", "--stimuli", "again.yaml")
    assert (refused.code, "SPEED_1.BLK exists already, and may have been edited" in refused.err) == (2, True)
    assert (source.read_text(), stimuli.exists()) == ("mine\n", False)
    assert automax("export", "out", "--stimuli", "again.yaml", "--force").code == 0
    assert source.read_text() == faster.text
    (automax.folder / "file_sources").write_text("")
    assert "file_sources is not a folder" in automax("export", "out", "--stimuli", "file.yaml").err


def test_to_a_pipe_goes_what_needs_no_folder(automax):
    rack = rack_in(automax.folder)
    acts = {0.002: lambda: rack.write("REF%", 7), 0.004: lambda: rack.operations.reload("SPEED", rack.sources["SPEED"])}
    recorded_run(rack, automax.folder / "out", 0.01, acts)
    assert automax("export", "out", "--stimuli", "/dev/null", "--to", "0.003").code == 0
    refused = automax("export", "out", "--stimuli", "/dev/null")
    assert refused.code == 2
    assert "/dev/null: the sources of reloads need a folder next to a stimuli file" in refused.err


def test_the_recording_in_the_present_folder_has_its_name(automax, bag, monkeypatch):
    (automax.folder / "run.1").mkdir()
    for file in ("metadata.yaml", "scans_0.mcap"):
        (automax.folder / "run.1" / file).symlink_to(automax.folder / bag / file)
    monkeypatch.chdir(automax.folder / "run.1")
    for path in (".", "../run.1"):
        assert automax("export", path, "--stimuli", "../again.yaml", "--force").code == 0
        text = (automax.folder / "again.yaml").read_text()
        assert text.startswith("# What came from outside in run.1, rack LINE1\n")


def test_a_tunable_that_a_recorded_reload_took_away_is_told(automax):
    rack = rack_in(automax.folder)
    fixed = SourceText("SPEED.BLK", edited(SMALL, ("KP [CURRENT=1.0, HIGH=10.0, LOW=0.5, STEP=0.1], ", "")))
    recorded_run(rack, automax.folder / "out", 0.01, {0.002: lambda: rack.operations.reload("SPEED", fixed)})
    refused = automax("rerun", "out", "--from", "0.005", "--tune", "SPEED.KP=2", "--record", "after")
    assert (refused.code, refused.out) == (2, "")
    assert "task SPEED at 0.005 s: it has no tunable KP" in refused.err
    assert not (automax.folder / "after").exists()
