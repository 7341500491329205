"""``--native`` and ``--verbose``: the same results to the byte, and what became of each task."""

import shutil
from pathlib import Path

import pytest

from automax_ros.cli.options.work import native_forms
from automax_ros.compile.native.run.forms import NativeMode

CONFIG = Path(__file__).parents[3] / "config"
TASK = """
10 COMMON REF%, RUN@, OUT%, GAIN
20 LOCAL COUNT%, SUM!, REST, TABLE%(4)
30 CALL SCAN_LOOP(TICKS=2)
40 CALL LAG(INPUT=REF%, WLG=10.0, RESET=RUN@, OUTPUT=OUT%)
50 FOR COUNT% = 0 TO 4
60 TABLE%(COUNT%) = OUT% * 3 - COUNT%
70 SUM! = SUM! + TABLE%(COUNT%)
80 NEXT COUNT%
90 REST = SUM! * 0.25 + GAIN
100 GAIN = REST * 3
110 END
"""


@pytest.fixture(scope="module")
def cache_home(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(autouse=True)
def own_cache(cache_home, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache_home))


def recording(automax, config, mode, *options):
    folder = Path(f"bag_{mode}")
    result = automax("run", config, "--simulated", "--native", mode, "--verbose", "--record", folder, *options)
    assert result.code == 0, result.err
    return {path.name: path.read_bytes() for path in folder.iterdir()}, result.err


@pytest.mark.parametrize(
    ("rack", "seconds", "stimuli", "native"),
    [
        ("section_drive", "2", None, {"LINE", "SEQUENCE", "SPEED", "MOTOR"}),
        ("web_line", "3", "start.yaml", {"SECTION", "UNWIND", "WINDER", "MOTORS", "WIND_A", "WIND_B"}),
        ("dc_drive", "2", "tour.yaml", {"SPEED"}),
    ],
)
def test_recordings_are_the_same_to_the_byte(automax, rack, seconds, stimuli, native):
    shutil.copytree(CONFIG / rack, rack)
    config = Path(rack, "rack.yaml")
    config.write_text(config.read_text().replace("execution: modeled", "execution: ideal  "))
    options = ["--duration", seconds, *([] if stimuli is None else ["--stimuli", Path(rack, stimuli)])]
    expected, said = recording(automax, config, "off", *options)
    assert "in Python: native scans are off" in said
    found, said = recording(automax, config, "on", *options)
    assert found == expected
    for mode in ("off", "on"):
        assert automax("replay", f"bag_{mode}", "--native", "on").code == 0
    assert {line.partition(":")[0] for line in said.splitlines() if line.endswith(": native")} >= native


def test_modeled_time_has_no_native_scans(automax):
    shutil.copytree(CONFIG / "web_line", "web_line")
    options = ["--simulated", "--duration", "0.01", "--native", "on", "--verbose"]
    said = automax("run", "web_line/rack.yaml", *options).err
    assert "LINE: in Python: scans in modeled time are executed in steps\n" in said


def test_replays_say_what_is_native(automax):
    config = CONFIG / "section_drive" / "rack.yaml"
    recording(automax, config, "off", "--duration", "1")
    result = automax("replay", "bag_off", "--native", "on", "--verbose")
    assert result.code == 0
    assert "MOTOR: native\n" in result.err
    assert result.out == automax("replay", "bag_off", "--native", "off").out


def test_traces_are_the_same(automax):
    automax.write("TASK.BLK", TASK)
    automax.write("IN.csv", "REF%,RUN@\n" + "".join(f"{n * 37 % 4096},{n // 50 % 2}\n" for n in range(300)))
    results = {}
    for mode in ("off", "on"):
        results[mode] = automax("trace", "TASK.BLK", "--input", "IN.csv", "--native", mode, "--verbose")
    assert results["on"].out == results["off"].out
    assert results["on"].err.startswith("TASK: native\n")


def test_without_a_compiler_everything_runs_in_python_and_says_so(automax, monkeypatch):
    automax.write("TASK.BLK", TASK)
    automax.write("IN.csv", "REF%,RUN@\n5,0\n")
    monkeypatch.setenv("CC", "no-such-compiler")
    result = automax("trace", "TASK.BLK", "--input", "IN.csv", "--native", "on", "--verbose")
    assert result.code == 0
    assert result.err == "TASK: in Python: CC names no-such-compiler, which is not there\n"


def test_a_short_run_gains_nothing(automax):
    automax.write("TASK.BLK", TASK)
    automax.write("IN.csv", "REF%,RUN@\n5,0\n")
    result = automax("trace", "TASK.BLK", "--input", "IN.csv", "--verbose")
    assert result.err == "TASK: in Python: a run this short gains nothing by it (--native on)\n"


@pytest.mark.parametrize(
    ("mode", "wall_clock", "expected"),
    [
        ("auto", False, NativeMode.AUTO),
        ("auto", True, NativeMode.OFF),
        ("on", True, NativeMode.ON),
        ("off", False, NativeMode.OFF),
    ],
)
def test_on_the_wall_clock_only_what_is_asked_for_is_native(mode, wall_clock, expected):
    class Arguments:
        native = mode

    assert native_forms(Arguments(), None, wall_clock=wall_clock).mode is expected
