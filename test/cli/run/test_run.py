"""`automax run` in simulated time: arguments, exit codes, summary, status lines."""

import errno
import itertools
import os
import re
import shutil
from pathlib import Path

import pytest
from rack.helpers import config_at, rack_at

from automax_ros.cli.output.screen import erasing, fitting
from automax_ros.cli.run import status as status_module
from automax_ros.cli.run.status import StatusDisplay
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.value_names import watched

RACK = """\
rack: LINE1
slots:
  0:
    module: 57C435
    tasks:
      TASK: {priority: 5}
common:
  REF%: {ros: in, preset: 5}
  RUN@:
  GAIN: {preset: 1.5}
  TOTAL!:
  NOTE$:8:
  TABLE%(2,3): {preset: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]}
"""
TASK = """\
10 COMMON REF%, RUN@, GAIN, TOTAL!, NOTE$:8, TABLE%(2,3)
20 LOCAL NIL%, X%
100 CALL SCAN_LOOP(TICKS=2)
110 TOTAL! = TOTAL! + REF%
120 IF RUN@ THEN X% = 1 / NIL%
130 END
"""


@pytest.fixture
def run(automax):
    """Call `automax run rack.yaml --simulated` with further options."""
    automax.write("rack.yaml", RACK)
    automax.write("TASK.BLK", TASK)
    return lambda *options: automax("run", "rack.yaml", "--simulated", *options)


def test_summary_of_a_run(run):
    result = run("--duration", "1.1")
    assert (result.code, result.err) == (0, "")
    first, header, task, values = result.out.splitlines()
    assert re.fullmatch(r"ran 1\.100 s in \d+\.\d\d s \(\d+ times real time\)", first)
    assert header.split() == ["task", "slot", "period", "ms", "scans", "late", "errors"]
    assert task.split() == ["TASK", "0", "11", "100", "0", "0"]
    assert values.split() == ["TOTAL!=500", "REF%=5", "RUN@=0", "GAIN=1.5"]


def test_run_time_errors_stand_in_the_summary(run):
    result = run("--duration", "0.05", "--set", "RUN@=on")
    assert result.code == 0
    errors = [line.strip() for line in result.out.splitlines() if "AMX7" in line]
    assert [line.partition(":")[0:1] for line in errors] == [("TASK",)] * 3
    assert errors[0].startswith("TASK: scan 1, line 120: AMX7")
    assert errors[-1].startswith("TASK: scan 5, line 120: AMX7")


@pytest.mark.parametrize("duration", ["0", "-1", "abc", "nan", "inf", "1e400", "", "1e-12", "0x10"])
def test_bad_duration_is_wrong_usage(run, duration):
    result = run(f"--duration={duration}")
    assert result.code == 2
    assert "--duration" in result.err
    assert result.out == ""


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("REF%=-7", "REF%=-7"),
        ("ref% = 7", "REF%=7"),
        ("RUN@=TRUE", "RUN@=1"),
        ("RUN@=off", "RUN@=0"),
        ("GAIN=0.25", "GAIN=0.25"),
        ("NOTE$=a=b", "NOTE$=a=b"),
        ("NOTE$=", "NOTE$="),
        ("TOTAL!=2147483647", "TOTAL!=2147483647"),
    ],
)
def test_set_writes_before_the_first_scan(run, text, values):
    name = values.partition("=")[0]
    result = run("--duration", "0.001", "--set", "REF%=0", "--set", text, "--watch", name)
    assert result.code == 0, result.err
    assert result.out.splitlines()[-1].strip() == values


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("REF%", "'REF%' is not NAME=VALUE"),
        ("=5", "no common variable ''"),
        ("REFF%=5", "did you mean REF%?"),
        ("REF=5", "no common variable 'REF'"),
        ("REF%=40000", "'40000' is not a value for REF%, type INTEGER"),
        ("REF%=1.5", "'1.5' is not a value for REF%"),
        ("REF%=", "'' is not a value for REF%"),
        ("RUN@=2", "'2' is not a value for RUN@, type BOOLEAN"),
        ("GAIN=nan", "'nan' is not a value for GAIN, type REAL"),
        ("GAIN=1e30", "not a value for GAIN"),
        ("NOTE$=123456789", "not a value for NOTE$, type STRING"),
        ("NOTE$=\udcff", "not a value for NOTE$"),
        ("TABLE%=1", "TABLE% is an array"),
        ("REF%=" + "9" * 10_000, "not a value for REF%"),
    ],
)
def test_bad_setting_is_wrong_usage(run, text, words):
    result = run("--duration", "1", "--set", text)
    assert result.code == 2
    assert result.err.startswith("automax run: error: --set: ")
    assert words in result.err
    assert len(result.err) < 300
    assert result.out == ""


@pytest.fixture
def tuned(automax):
    """Call `automax run` for a task with a tunable KP% from 0 to 9, which it writes to REF%."""
    automax.write("rack.yaml", RACK)
    task = TASK.replace("20 LOCAL NIL%,", "20 LOCAL KP% [CURRENT=3, LOW=0, HIGH=9], NIL%,")
    automax.write("TASK.BLK", task.replace("120 IF", "115 REF% = KP%\n120 IF"))
    return lambda *options: automax("run", "rack.yaml", "--simulated", "--duration", "1", *options)


def test_setting_of_a_tunable_says_how_to_tune(tuned):
    result = tuned("--set", "KP%=5")
    assert (result.code, result.out) == (2, "")
    assert "no common variable" in result.err
    assert "hint: KP% is a tunable of task TASK: `automax run` takes --set TASK.KP=5" in result.err
    assert result.err.endswith("ros2 param set /line1/processor_0 TASK.KP 5\n")


@pytest.mark.parametrize("name", ["TASK.KP", "task.kp%"])
def test_tunable_is_set_for_a_run(tuned, name):
    assert "REF%=3 " in tuned("--watch", "REF%,RUN@").out
    result = tuned("--set", f"{name}=5", "--watch", "REF%,RUN@")
    assert (result.code, result.err) == (0, "")
    assert "REF%=5 " in result.out


def test_tunable_of_the_command_line_counts_more_than_the_kept_one(tuned, tmp_path):
    state = tmp_path / "state"
    assert tuned("--set", "TASK.KP=5", "--state", str(state)).code == 0
    assert "REF%=5 " in tuned("--state", str(state), "--watch", "REF%,RUN@").out
    assert "REF%=7 " in tuned("--state", str(state), "--set", "TASK.KP=7", "--watch", "REF%,RUN@").out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("TASK.KP=10", "--set TASK.KP%: "),
        ("TASK.KP=1.5", "'1.5' is not a value for KP%"),
        ("TASK.KQ=1", "task TASK has no tunable"),
        ("TUSK.KP=1", "no common variable"),
    ],
)
def test_tunable_that_cannot_be_set_is_wrong_usage(tuned, text, said):
    result = tuned("--set", text)
    assert (result.code, result.out) == (2, "")
    assert said in result.err


def test_elements_of_arrays_are_set(run):
    result = run("--duration", "0.001", "--set", "TABLE%(2,1)=-7", "--watch", "TABLE%(2,1),TABLE%(2,2)")
    assert (result.code, result.err) == (0, "")
    assert result.out.splitlines()[-1].strip() == "TABLE%(2,1)=-7  TABLE%(2,2)=10"


@pytest.mark.parametrize(
    ("watch", "shown"),
    [
        ("TABLE%(2,1)", "TABLE%(2,1)=9"),
        ("table%[0,3], ref%", "TABLE%(0,3)=3  REF%=5"),
        ("NOTE$", "NOTE$="),
    ],
)
def test_watched_values_are_shown(run, watch, shown):
    assert run("--duration", "0.001", "--watch", watch).out.splitlines()[-1].strip() == shown


@pytest.mark.parametrize(
    ("watch", "words"),
    [
        ("SPEED%", "no common variable 'SPEED%'"),
        ("TABLE%", "TABLE% is an array\n  hint: name one element; the last is TABLE%(2,3)"),
        ("TABLE%(1)", "TABLE% has 2 subscripts, not 1"),
        ("TABLE%(1,4)", "the largest is 3"),
        ("REF%(0)", "REF% is not an array"),
        ("TABLE%(1,", "no common variable"),
    ],
)
def test_bad_watch_is_wrong_usage(run, watch, words):
    result = run("--duration", "1", "--watch", watch)
    assert result.code == 2
    assert result.err.startswith("automax run: error: --watch: ")
    assert words in result.err


def test_unreadable_file_is_wrong_usage(automax, tmp_path):
    (tmp_path / "folder" / "rack.yaml").mkdir(parents=True)
    for name in ("missing.yaml", "folder/rack.yaml/missing.yaml"):
        result = automax("run", name, "--simulated", "--duration", "1")
        assert result.code == 2, name
        assert result.err.startswith(f"automax run: error: {name}: the rack file "), result.err
        assert result.err.count("\n") == 1


def test_folder_means_its_rack_file(run, automax):
    result = automax("run", ".", "--simulated", "--duration", "0.1")
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith("ran 0.100 s")


def test_folder_without_a_rack_file_says_what_to_do(automax, tmp_path):
    result = automax("run", tmp_path, "--simulated", "--duration", "1")
    assert (result.code, result.out) == (2, "")
    assert "is a folder without a rack.yaml" in result.err
    assert "`automax new" in result.err


def test_task_in_place_of_a_rack_says_what_to_do(run, automax):
    result = automax("run", "TASK.BLK", "--simulated", "--duration", "1")
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith("automax run: error: TASK.BLK is a task, and a rack is made of its rack file (.yaml)")
    assert "`automax trace TASK.BLK --input IN.csv`" in result.err


def test_simulated_recording_needs_an_end(run, automax):
    result = run("--record", "bag")
    assert (result.code, result.out) == (2, "")
    assert "--record of a simulated run needs --duration" in result.err
    assert not (automax.folder / "bag").exists()


def test_simulated_run_without_an_end_says_so(automax):
    automax.write("rack.yaml", RACK)
    automax.write("TASK.BLK", TASK.replace("120 IF RUN@ THEN X% = 1 / NIL%", "120 IF TOTAL! > 20 THEN 120"))
    result = automax("run", "rack.yaml", "--simulated")
    assert result.code == 1
    assert result.out.startswith("simulated time without an end: Ctrl-C ends the run (or give --duration S)\n")


def test_text_that_is_no_yaml_is_wrong_usage(automax):
    for content in (b"rack: [", b"\xff\xfe\x00", b"a: &b 1\nc: *b\n"):
        result = automax("run", automax.write("bad.yaml", content), "--simulated", "--duration", "1")
        assert result.code in (1, 2), content
        assert "bad.yaml:" in result.err


def test_errors_of_the_rack_file_are_shown_with_their_places(automax):
    automax.write("TASK.BLK", TASK)
    result = automax("run", automax.write("rack.yaml", RACK.replace("57C435", "57C430")), "--simulated")
    assert result.code == 1
    assert "rack.yaml:4:" in result.err
    assert "error[AMX6" in result.err


def test_errors_of_a_task_are_shown_and_nothing_starts(automax):
    automax.write("rack.yaml", RACK)
    automax.write("TASK.BLK", TASK.replace("NIL%, X%", "NIL%"))
    result = automax("run", "rack.yaml", "--simulated", "--duration", "1", "--record", "bag")
    assert result.code == 1
    assert "TASK.BLK:5:" in result.err
    assert result.err.endswith("no task is started: errors in TASK.BLK (the rack shows E0)\n")
    assert result.out == ""
    assert not (automax.folder / "bag").exists()


def test_fault_ends_the_run(automax):
    automax.write("rack.yaml", RACK)
    automax.write("TASK.BLK", TASK.replace("120 IF RUN@ THEN X% = 1 / NIL%", "120 IF TOTAL! > 20 THEN 120"))
    result = automax("run", "rack.yaml", "--simulated", "--duration", "1000", "--record", "bag")
    assert result.code == 1
    assert "automax run: STOP ALL: task TASK: scan 5, line 120: AMX7040" in result.err
    assert "(code 14 on the rack)" in result.err
    assert "recorded bag: " in result.out


def test_a_recording_without_a_scan_is_told(run, automax):
    automax.write("stop.yaml", "- {at: 0, stop_all: true}\n")
    result = run("--duration", "0.1", "--record", "bag", "--stimuli", "stop.yaml")
    assert result.code == 0
    assert result.out.endswith("MB\n  it holds no scan: nothing of it can be replayed; do the tasks run?\n")
    assert automax("bag", "info", "--check", "bag").code == 1


def test_existing_folder_is_not_recorded_into(run, automax):
    (automax.folder / "bag").mkdir()
    result = run("--duration", "1", "--record", "bag")
    assert result.code == 2
    assert "bag: error[AMX6800]: exists already" in result.err
    assert list((automax.folder / "bag").iterdir()) == []


def test_recording_that_breaks_off_is_told_and_the_run_goes_on(run, automax, monkeypatch):
    from automax_ros.recordings.write import writer

    def full(self, data):
        if self._size > 20_000:
            raise OSError(28, "No space left on device")
        return original(self, data)

    original = writer.DataFile.write
    monkeypatch.setattr(writer.DataFile, "write", full)
    result = run("--duration", "100", "--record", "bag")
    assert result.code == 1
    assert "ran 100.000 s" in result.out
    assert result.err.count("AMX6801") == 1
    assert "No space left" in result.err
    assert "recording ended, the rack goes on" in result.out
    assert "not to the end of the run; to complete the file: automax bag repair bag" in result.out


def test_a_disk_that_vanishes_is_told_once(run, automax, monkeypatch):
    from automax_ros.recordings.write import writer

    def vanished(self, data):
        if self._size > 20_000:
            shutil.rmtree(automax.folder / "bag", ignore_errors=True)
            raise OSError(errno.ENOENT, os.strerror(errno.ENOENT))
        return original(self, data)

    original = writer.DataFile.write
    monkeypatch.setattr(writer.DataFile, "write", vanished)
    result = run("--duration", "100", "--record", "bag")
    assert result.code == 1
    assert "ran 100.000 s" in result.out
    assert "recorded bag: cannot be read any more, not to the end of the run" in result.out
    assert result.err.count("rror") == 1
    assert "AMX6801" in result.err


def test_recording_options(run, automax):
    result = run("--duration", "3.5", "--record", "bag", "--record-split-s", "1", "--record-compression", "none")
    assert result.code == 0
    names = [path.name for path in sorted((automax.folder / "bag").iterdir())]
    assert names == ["metadata.yaml", *(f"scans_{number}.mcap" for number in range(4))]
    data = (automax.folder / "bag" / "scans_1.mcap").read_bytes()
    assert b"zstd" not in data
    run(
        "--duration",
        "40",
        "--record",
        "locals",
        "--record-locals",
        "--record-tasks",
        "task",
        "--record-split-mb",
        "0.07",
    )
    assert (automax.folder / "locals" / "scans_1.mcap").exists()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--record-split-mb", "x"], "--record-split-mb: 'x' is not a number"),
        (["--record-split-mb", "nan"], "'nan' is not a number"),
        (["--record-split-mb", "1e999999999"], "is not a number"),
        (["--record-split-mb", "-1"], "-1 is not a number from 0 to 1000000"),
        (["--record-split-mb", "0.01"], "too small"),
        (["--record-split-s", "0.5"], "too short"),
        (["--record-split-s", "soon"], "not a number"),
        (["--record-compression", "lz5"], "did you mean lz4?"),
        (["--record-compression", ""], "no compression ''"),
        (["--record-tasks", "TSAK"], "did you mean TASK?"),
        (["--record-tasks", " , "], "names no task"),
    ],
)
def test_wrong_recording_options(run, automax, options, told):
    result = run("--duration", "1", "--record", "bag", *options)
    assert result.code == 2
    assert told in result.err
    assert not (automax.folder / "bag").exists()


def test_recording_options_need_a_recording(run):
    result = run("--duration", "1", "--record-locals")
    assert result.code == 2
    assert "add --record DIR" in result.err


# The status line


@pytest.fixture
def rack(automax):
    automax.write("TASK.BLK", TASK)
    automax.write("rack.yaml", RACK)
    return rack_at(automax.folder / "rack.yaml", stopwatch=itertools.count(0, 110_000).__next__)


def test_plain_line_comes_every_five_seconds(rack, capsys, monkeypatch):
    clock = iter([0, 1_000_000_000, 5_000_000_000, 9_000_000_000, 10_000_000_000])
    monkeypatch.setattr(status_module.time, "monotonic_ns", lambda: next(clock))
    display = StatusDisplay(rack, watched(rack.config, ["REF%"]), live=True)
    rack.start()
    for second in (1, 5, 9, 10):
        rack.scheduler.run_until(second * 1_000_000_000)
        display.update(rack.now_ns)
    lines = capsys.readouterr().out.splitlines()
    # 91 scans per second of 110 us each are 1 % of the Processor's time.
    assert [line.split("  ")[-3:] for line in lines] == [["91 scans/s", "P0 1.0 % late 0", "REF%=5"]] * 2


def test_a_value_is_shown_by_its_scale_and_with_its_unit(automax, capsys):
    rack = (
        "rack: D\nwatch: [P%, D%, A%]\nslots: {0: {module: 57C435}, 6: {module: 57C409}}\ncommon:\n  A%: {}\n"
        "  P%: {slot: 6, register: 0, ros: in, scale: {counts: [0, 4095], value: [0, 10]}, unit: bar}\n"
        "  D%: {unit: fpm}\n"
    )
    config = config_at(automax.write("rack.yaml", rack))
    rack = Rack(config)
    rack.start([("P%", 1000), ("D%", 7)])
    StatusDisplay(rack, watched(config, None), live=False).finish()
    assert "P%=2.442 bar  D%=7 fpm  A%=0\n" in capsys.readouterr().out


def test_the_example_that_make_run_runs_shows_the_motor(automax):
    """Finding 14: its panel's push-buttons stood there."""
    example = Path(__file__).parents[3] / "config" / "dc_drive"
    last = automax("run", example, "--simulated", "--duration", "0.1").out.splitlines()[-1]
    assert [part.partition("=")[0] for part in last.split("  ")[1:]][:5] == [
        "RPM", "SPD%", "SPEED_REF%", "CUR_FB%", "DELTA%"
    ]  # fmt: skip
    assert " rpm  " in last
    chosen = automax("run", example, "--simulated", "--duration", "0.1", "--watch", "FAULT@")
    assert chosen.out.splitlines()[-1] == "  FAULT@=0"


def test_text_of_a_string_cannot_drive_the_terminal(rack, capsys):
    display = StatusDisplay(rack, watched(rack.config, ["NOTE$"]), live=False)
    rack.start([("NOTE$", "\x1b[2Jx\r\n")])
    display.finish()
    assert "NOTE$=\N{REPLACEMENT CHARACTER}[2Jx" in capsys.readouterr().out


def test_unknown_option_shows_the_usage_of_run(automax):
    result = automax("run", "rack.yaml", "--simulate-d")
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith("usage: automax run ")
    assert result.err.endswith("automax run: error: unrecognized arguments: --simulate-d\n")


def test_printed_lines_are_shown(automax):
    automax.write("TASK.BLK", TASK.replace("130 END", '130 PRINT "REF", REF%\n140 END'))
    result = automax("run", automax.write("rack.yaml", RACK), "--simulated", "--duration", "0.02")
    assert result.out.splitlines()[0].startswith("TASK: REF ")


def test_no_part_of_the_status_line_is_cut():
    parts = ["  1.0 s", "291 scans/s", "LINE_REF%=1286", "SECT_REF%=1286"]
    whole = "  ".join(parts)
    assert fitting(parts, len(whole)) == whole
    assert fitting(parts, len(whole) - 1) == "  ".join(parts[:3])
    assert fitting(parts, 4) == "  1."


def test_line_that_a_narrower_terminal_has_wrapped_is_erased_whole():
    assert erasing(0, 80) == erasing(79, 80) == erasing(80, 80) == "\r\x1b[K"
    assert erasing(79, 40) == "\r\x1b[1A\x1b[J"
    assert erasing(79, 20) == "\r\x1b[3A\x1b[J"
    assert fitting(["1.0 s"], -1) == ""


def test_warnings_of_sources_are_counted_and_shown_by_check(automax):
    """A run is repeated often: it does not print the same warnings each time."""
    lines = "30 A% = 1\n40 B% = 1\n50 CALL SUMMER(INPUT1=A%, INPUT2=B%, OUTPUT=A%)\n60 END\n"
    task = f"10 COMMON A%, B%\n20 CALL SCAN_LOOP(TICKS=2)\n{lines}"
    automax.write("ONE.BLK", task)
    slots = "slots: {0: {module: 57C435, tasks: {ONE: {priority: 5}}}}"
    automax.write("r.yaml", f"rack: R1\n{slots}\ncommon: {{A%: {{}}, B%: {{}}}}\n")
    result = automax("run", "r.yaml", "--simulated", "--duration", "0.1")
    assert (result.code, result.err) == (0, "2 warnings of its tasks: automax check r.yaml shows them\n")
    checked = automax("check", "r.yaml")
    assert (checked.code, checked.out.count("warning[AMX4086]")) == (0, 2)
