"""`automax replay`: exit codes, the report as text and JSON, the picture, what it refuses."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from recordings.write.test_bag_split import recorded as recorded_files
from replay.replays import SPEED, WORK, edited, recorded

from automax_ros.core.ticks import NS_PER_S
from automax_ros.recordings.write.recorder import RecordingOptions

STRONGER = edited(SPEED, ("INPUT2=100", "INPUT2=104"))


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Path:
    return recorded(tmp_path_factory.mktemp("small"), seconds=2.0)


@pytest.fixture
def bag(source, automax) -> str:
    """The recording under a short name in the folder of the test."""
    (automax.folder / "out").symlink_to(source)
    return "out"


def test_identical_is_0(automax, bag):
    result = automax("replay", bag)
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[0].startswith("out: rack LINE1, 0 to 1.")
    assert lines[1].startswith("Open loop: each task scans on the recorded inputs.")
    assert lines[-1] == "548 scans executed again, no difference."
    assert ["SPEED", "as", "recorded", "365", "identical,", "and", "3", "states"] in [line.split() for line in lines]


def test_difference_is_1_and_tells_scan_time_values_and_line(automax, bag):
    result = automax("replay", bag, "--task", f"SPEED={automax.write('SPEED.BLK', STRONGER)}")
    assert (result.code, result.err) == (1, "")
    lines = result.out.splitlines()
    assert "First difference: task SPEED, scan 38 at 0.2035 s" in lines
    assert "  OUT%: recorded 26, replayed 27  (line 130)" in lines
    assert any(line.startswith("  it latched: REF%=74, OUT%=24, RUN@=TRUE") for line in lines)
    header, row = lines[-2], lines[-1]
    assert header.split()[:3] == ["task", "differs", "line"]
    assert row.split()[:9] == ["SPEED", "OUT%", "(counts)", "130", "38", "0.2035", "26", "27", "+18"]


def test_a_cluster_that_is_not_used_is_told(automax, bag):
    result, alone = automax("replay", bag, "--scheduler", "tcp://127.0.0.1:1"), automax("replay", bag)
    assert (result.code, result.out) == (0, alone.out)
    assert result.err == (
        "automax replay: the recording is replayed here: a cluster is handed parts of at least 16 MB, "
        "each of one file or more, and this recording makes only one such part\n"
    )


def test_json(automax, bag):
    result = automax("replay", bag, "--task", f"SPEED={automax.write('SPEED.BLK', STRONGER)}", "--json")
    data = json.loads(result.out)
    assert (result.code, result.err, data["identical"]) == (1, "", False)
    assert data["bag"] == "out"
    assert data["first"]["differences"][0]["first"] == {
        "scan": 38,
        "time_s": 0.2035,
        "recorded": 26,
        "replayed": 27,
    }
    assert [task["name"] for task in data["tasks"]] == ["SPEED", "WORK"]


def test_options_reach_the_replay(automax, bag):
    task = f"speed={automax.write('SPEED.BLK', STRONGER)}"
    options = ("--only", "speed", "--from", "1", "--to", "1.5", "--tolerance", "1", "--max-differences", "3", "--json")
    data = json.loads(automax("replay", bag, "--task", task, *options).out)
    assert [item["name"] for item in data["tasks"]] == ["SPEED"]
    assert (data["from_s"], data["tolerance"]) == (1.0, 1.0)
    assert 1.0 <= data["first"]["time_s"] < data["to_s"] <= 1.5
    assert data["tasks"][0]["scans"] == 91


def test_tolerance_that_is_wide_enough_makes_it_0(automax, bag):
    task = f"SPEED={automax.write('SPEED.BLK', STRONGER)}"
    assert automax("replay", bag, "--task", task, "--tolerance", "18").code == 0
    assert automax("replay", bag, "--task", task, "--tolerance", "17").code == 1


def test_picture(automax, bag):
    pytest.importorskip("matplotlib")
    result = automax("replay", bag, "--task", f"SPEED={automax.write('SPEED.BLK', STRONGER)}", "--plot", "first.png")
    assert (result.code, result.err) == (1, "")
    assert (automax.folder / "first.png").read_bytes().startswith(b"\x89PNG")


def test_picture_of_several_lanes_shows_what_was_compared(source, tmp_path):
    """Both traces, the boolean among them, around the first difference."""
    from automax_ros.cli.output.difference_figure import draw, traces
    from automax_ros.core.diagnostics import SourceText
    from automax_ros.replay.engine import Replay, ReplayOptions

    pytest.importorskip("matplotlib")
    changed = edited(WORK, ("TOTAL > 2.0", "TOTAL > 1.0"), ("COUNT! + 1", "COUNT! + 2"), ("LEFT$(NOTE$, 4)", "NOTE$"))
    replay = Replay(source, {"WORK": SourceText("WORK.BLK", changed)}, ReplayOptions())
    report = replay.run()
    found = traces(replay, report)
    assert [trace.difference.name for trace in found] == ["COUNT!", "FLAG@"], "strings are not drawn"
    count, flag = found
    assert count.recorded[:3] == [5, 6, 7], "scan 0, 1, 2"
    assert count.replayed[:3] == [5, 7, 9]
    assert count.time_s[:3] == [0.0, 0.0, 0.011]
    assert set(flag.recorded) == {False, True}
    assert count.time_s[-1] == pytest.approx(1.5, abs=0.02)
    draw(found, report, tmp_path / "lanes.svg")
    text = (tmp_path / "lanes.svg").read_text()
    assert text.count("<svg") == 1


def test_picture_without_a_difference_is_not_drawn(automax, bag):
    result = automax("replay", bag, "--plot", "first.png")
    assert result.code == 0
    assert "nothing to draw" in result.err
    assert not (automax.folder / "first.png").exists()


def test_picture_that_cannot_be_drawn(automax, bag, monkeypatch):
    task = f"SPEED={automax.write('SPEED.BLK', STRONGER)}"
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = automax("replay", bag, "--task", task, "--plot", "first.png")
    assert (result.code, "pip install matplotlib" in result.err) == (2, True)


def test_picture_of_a_folder_with_an_odd_name(source, automax, recwarn):
    """It is not taken for a formula, and nobody hears what the font of matplotlib lacks."""
    pytest.importorskip("matplotlib")
    (automax.folder / r"$\frac$ 軋機").symlink_to(source)
    task = f"SPEED={automax.write('SPEED.BLK', STRONGER)}"
    result = automax("replay", r"$\frac$ 軋機", "--task", task, "--plot", "first.png")
    assert (result.code, result.err, recwarn.list) == (1, "", [])
    assert (automax.folder / "first.png").read_bytes().startswith(b"\x89PNG")


def test_picture_that_breaks_off_leaves_nothing(automax, bag, monkeypatch):
    figure = pytest.importorskip("matplotlib.figure")

    def broken(self, place, **_):
        Path(place).write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure.Figure, "savefig", broken)
    task = f"SPEED={automax.write('SPEED.BLK', STRONGER)}"
    before = set(automax.folder.iterdir())
    result = automax("replay", bag, "--task", task, "--plot", "first.png")
    assert result.code == 2
    assert "first.png: error[AMX6834]: cannot be written: No space left on device" in result.err
    assert set(automax.folder.iterdir()) == before


def test_range_outside_of_one_file_of_a_recording(automax):
    folder = automax.folder / "small"
    folder.mkdir()
    recorded_files(folder, RecordingOptions(split_ns=2 * NS_PER_S), seconds=5.0)
    result = automax("replay", "small/bag/scans_1.mcap", "--to", "1")
    assert (result.code, result.out) == (2, "")
    assert "error[AMX6825]" in result.err
    assert "it lasts from 2 to 4 s of the run" in result.err
    assert "version unknown" not in automax("replay", "small/bag/scans_1.mcap").out


def test_without_a_picture_matplotlib_is_not_imported(automax, bag, monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    assert automax("replay", bag, "--task", f"SPEED={automax.write('SPEED.BLK', STRONGER)}").code == 1
    assert "matplotlib" not in sys.modules


def test_source_with_errors_is_2_and_shows_them_as_check_does(automax, bag):
    name = automax.write("WORK.BLK", edited(WORK, ("10 COMMON GAIN", "10 COMMON SLIP%, GAIN")))
    result = automax("replay", bag, "--task", f"WORK={name}")
    assert (result.code, result.out) == (2, "")
    assert "WORK.BLK:1:11: error[AMX4010]" in result.err
    assert result.err.endswith("automax replay: errors in WORK.BLK; nothing is replayed\n")


def test_warnings_of_a_new_source_are_counted(automax, bag):
    """`automax check` shows them: a replay is repeated often."""
    text = edited(SPEED, ("140 END", "135 OUT% = OUT%\n140 END"))
    result = automax("replay", bag, "--task", f"SPEED={automax.write('SPEED.BLK', text)}")
    assert result.err.startswith("1 warning of SPEED.BLK: automax check SPEED.BLK shows it\n")
    assert "warning[" in automax("check", "SPEED.BLK").out


def test_truncated_recording_points_to_the_repair(automax, source):
    data = (source / "scans_0.mcap").read_bytes()
    automax.write("cut.mcap", data[: len(data) // 2])
    result = automax("replay", "cut.mcap")
    assert (result.code, result.out) == (2, "")
    assert "error[AMX6812]" in result.err
    assert "`automax bag repair cut.mcap`" in result.err


def test_unfinished_recording_points_to_the_repair(automax, source):
    (automax.folder / "dead").mkdir()
    (automax.folder / "dead" / "scans_0.mcap").write_bytes((source / "scans_0.mcap").read_bytes()[:5000])
    result = automax("replay", "dead")
    assert result.code == 2
    assert "`automax bag repair dead`" in result.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none"], "error[AMX6810]"),
        (["out", "--task", "SPEED"], "is not NAME=FILE"),
        (["out", "--task", "=X.BLK"], "is not NAME=FILE"),
        (["out", "--task", "SPEED=none.BLK"], "none.BLK cannot be read"),
        (["out", "--task", "SPEED=."], "is a folder, not a file"),
        (["out", "--task", "SPED=A.BLK"], "did you mean SPEED?"),
        (["out", "--task", "SPEED=A.BLK", "--task", "SPEED=A.BLK"], "is given twice"),
        (["out", "--task", "SPEED=A.BLK", "--only", "WORK"], "--only leaves this task out"),
        (["out", "--only", ","], "--only names no task"),
        (["out", "--only", "SPED"], "did you mean SPEED?"),
        (["out", "--tolerance", "-1"], "--tolerance: -1 is not a number from 0"),
        (["out", "--tolerance", "nan"], "--tolerance: 'nan' is not a number"),
        (["out", "--tolerance", "few"], "--tolerance: 'few' is not a number"),
        (["out", "--from", "-1"], "--from: -1 s is negative"),
        (["out", "--to", "x"], "--to: "),
        (["out", "--from", "2", "--to", "1"], "--to lies before --from"),
        (["out", "--from", "1e9"], "it lasts from 0 to 2 s of the run"),
        (["out", "--from", "1.0001", "--to", "1.0002"], "error[AMX6825]: holds no scan of SPEED, WORK in the range"),
        (["out", "--from", "1.0001", "--to", "1.0002", "--only", "SPEED"], "error[AMX6825]: holds no scan of SPEED in"),
        (["out", "--plot", "first.jpg"], "first.jpg names no format of pictures"),
        (["out", "--plot", "first"], "end it with .png, .svg, .pdf"),
        (["out", "--plot", "none/first.png"], "there is no folder none"),
        (["out", "--max-differences", "0"], "at least 1"),
        (["out", "--task", "SPEED=A.BLK", "--plot", "A.BLK"], "are the same file"),
    ],
)
def test_wrong_usage_is_2_with_one_message(automax, bag, arguments, words):
    automax.write("A.BLK", STRONGER)
    result = automax("replay", *arguments)
    assert (result.code, result.out) == (2, "")
    assert words in result.err
    assert "Traceback" not in result.err


def test_progress_is_shown_where_it_lasts(automax, bag, monkeypatch):
    """With no patience left the bar is fed from 0 to nearly all."""
    shown: list[int] = []
    monkeypatch.setattr("automax_ros.cli.output.screen.ProgressBar.show", lambda _, done: shown.append(done))
    assert automax("replay", bag).code == 0
    assert shown == sorted(shown)
    assert shown
    assert 0 <= shown[0] <= shown[-1] <= 1000


def test_every_option_stands_in_the_documentation(automax):
    page = (Path(__file__).parents[3] / "docs" / "replay.md").read_text(encoding="utf-8")
    options = [word for word in automax("replay", "--help").out.split() if word.startswith("--")]
    assert len(options) > 8
    assert [option for option in options if f"`{option.strip('[]')}" not in page and option not in ("--help",)] == []
