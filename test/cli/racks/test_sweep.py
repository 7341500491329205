"""`automax sweep`: its table and files, the command that repeats a run, what is refused, how it ends."""

import csv
import errno
import json
import os
import shlex
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from sweep.helpers import LOOP, RACK

from automax_ros.cli.racks.sweep_output import prepared
from automax_ros.rack.rack import Rack
from automax_ros.recordings.write.data_file import DataFile
from cli.support import Automax, Result

DRIVE = Path(__file__).parents[3] / "config" / "dc_drive"
MEASURES = "rms(ERR%) settle(FDBK%, 2 %) final(FDBK%)"


@pytest.fixture
def sweep(automax: Automax) -> Callable[..., Result]:
    automax.write("rack.yaml", RACK)
    automax.write("LOOP.BLK", LOOP)

    def call(*options: str, measure: str = MEASURES) -> Result:
        return automax("sweep", "rack.yaml", "--duration", "0.2", "--measure", measure, *options)

    return call


@pytest.fixture
def signals() -> Iterator[None]:
    """Whatever handlers a command leaves, the next test has its own."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def rows_of(folder: Path) -> list[dict[str, str]]:
    with open(folder / "runs.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_best_stand_first_with_the_command_of_the_first(sweep):
    result = sweep("--vary", "LOOP.KP=0.2:2.2:6", "--best", "min settle(FDBK%, 2 %)")
    assert (result.code, result.err) == (0, "")
    table, _, command = result.out.partition("\n\n")
    headings, *lines = (line.split("  ") for line in table.splitlines())
    assert [cell.strip() for cell in headings if cell] == [
        "run", "LOOP.KP", "rms(ERR%)", "settle(FDBK%, 2 %)", "final(FDBK%)",
    ]  # fmt: skip
    settled = [float(line.split()[-2]) for line in table.splitlines()[1:]]
    assert settled == sorted(settled)
    assert len(lines) == 6
    assert "automax sweep rack.yaml --vary LOOP.KP=2.2 --duration 0.2 --measure" in command


def test_files_hold_every_run(sweep, tmp_path):
    options = ("--vary", "LOOP.KP=0.5:1.5:3", "--vary", "REF%=500,800", "--vary", "RUN@=true,false")
    result = sweep(*options, "--output", "out")
    assert result.code == 1
    assert "6 runs, run 2 first: task LOOP" in result.err
    rows = rows_of(tmp_path / "out")
    assert [row["run"] for row in rows] == [str(number) for number in range(1, 13)]
    assert [(row["LOOP.KP"], row["REF%"], row["RUN@"]) for row in rows[:5]] == [
        ("0.5", "500", "1"), ("0.5", "500", "0"), ("0.5", "800", "1"), ("0.5", "800", "0"), ("1.0", "500", "1"),
    ]  # fmt: skip
    assert [bool(row["fault"]) for row in rows] == [False, True] * 6
    with np.load(tmp_path / "out" / "runs.npz") as arrays:
        assert list(arrays["names"]) == ["LOOP.KP", "REF%", "RUN@"]
        for name in arrays["measures"]:
            texts = [row[str(name)] for row in rows]
            np.testing.assert_array_equal(arrays[str(name)], [float(text) if text else np.nan for text in texts])
        assert arrays["RUN@"].dtype == np.bool_
        assert list(arrays["fault"]) == [row["fault"] for row in rows]
    facts = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert (facts["runs"], facts["done"], facts["faults"]) == (12, 12, 6)
    assert facts["vary"] == ["LOOP.KP=0.5:1.5:3", "REF%=500,800", "RUN@=true,false"]
    assert (tmp_path / "out" / "sweep.png").read_bytes().startswith(b"\x89PNG")


def test_the_same_sweep_writes_the_same_bytes(sweep, tmp_path):
    options = ("--vary", "LOOP.KP=0.1:2.5", "--vary", "REF%=0:3000", "--sample", "9", "--seed", "3")
    assert sweep(*options, "--output", "one").code == 0
    assert sweep(*options, "--output", "two", "--jobs", "2").code == 0
    for name in ("runs.csv", "runs.npz", "sweep.json", "sweep.png"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_each_row_is_repeated_by_its_command(sweep, automax, tmp_path):
    automax.write("stimuli.yaml", "- {at: 0.05, ramp: {REF%: {to: 100, over: 0.1}}}\n")
    options = ("--vary", "LOOP.KP=0.1:2.5", "--vary", "SLOW=1.5:9", "--sample", "4", "--stimuli", "stimuli.yaml")
    assert sweep(*options, "--output", "out").code == 0
    for row in rows_of(tmp_path / "out"):
        command, *words = shlex.split(row["repeat"])
        assert command == "automax"
        (again,) = json.loads(automax(*words, "--json").out)
        assert {name: float(row[name]) for name in again["measures"]} == again["measures"]
        assert {name: np.float32(row[name]) for name in again["values"]} == again["values"]
        assert again["repeat"] == row["repeat"]


def test_native_scans_change_no_number(sweep):
    options = ("--vary", "LOOP.KP=0.3,1.9", "--vary", "REF%=300,-900", "--json", "--verbose")
    python, native = sweep(*options, "--native", "off"), sweep(*options, "--native", "on")
    assert python.code == native.code == 0
    assert native.out == python.out
    assert python.err == "LOOP: in Python: native scans are off\n"
    assert native.err.startswith("LOOP: ")


def test_a_recorded_run_has_the_same_measures_and_replays(sweep, automax):
    one = ("--vary", "LOOP.KP=1.3", "--vary", "TABLE%(2)=7", "--json")
    plain = sweep(*one)
    recorded = sweep(*one, "--record", "bag")
    assert plain.code == recorded.code == 0
    assert json.loads(plain.out) == json.loads(recorded.out)
    assert automax("replay", "bag").code == 0
    result = sweep("--vary", "LOOP.KP=1,2", "--record", "other")
    assert (result.code, result.err.splitlines()[0]) == (2, "automax sweep: error: --record: there are 2 runs")


def test_a_recorded_run_has_its_tables_too(sweep, tmp_path):
    assert sweep("--vary", "LOOP.KP=1.3", "--record", "bag", "--output", "out").code == 0
    (row,) = rows_of(tmp_path / "out")
    assert row["LOOP.KP"] == "1.3"
    assert sweep("--vary", "LOOP.KP=1.3", "--record", "other", "--output", "out").code == 2
    assert not (tmp_path / "other").exists()


@pytest.mark.usefixtures("signals")
def test_ctrl_c_ends_a_run_that_is_recorded(sweep, automax, monkeypatch: pytest.MonkeyPatch):
    start = Rack.start

    def interrupted(self: Rack, *given) -> None:
        start(self, *given)
        os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(Rack, "start", interrupted)
        result = sweep("--vary", "LOOP.KP=1.3", "--record", "bag", "--duration", "1000000")
    assert result.code == 128 + signal.SIGINT
    assert "ended after 0 of 1 run" in result.err
    assert automax("bag", "info", "bag").code == 0


def test_a_disk_that_is_full_is_told(sweep, monkeypatch: pytest.MonkeyPatch):
    def full(self: DataFile, data: bytes) -> int:
        if self.tell() > 5_000:
            raise OSError(28, "No space left on device")
        return original(self, data)

    original = DataFile.write
    monkeypatch.setattr(DataFile, "write", full)
    result = sweep("--vary", "LOOP.KP=1.3", "--record", "bag")
    assert result.code == 2
    assert "No space left on device" in result.err


def test_jobs_are_a_number_that_a_machine_bears(sweep):
    for number in ("0", "1025", "x"):
        result = sweep("--jobs", number)
        assert (result.code, f"{number} is not a" in result.err or "not a whole number" in result.err) == (2, True)


def test_a_recorded_run_with_another_plant_replays(automax):
    one = ("--vary", "MOTOR.inertia=1.5", "--vary", "MOTOR.load.torque_nm=120", "--vary", "SPEED_SP%=900")
    measures = ("--measure", "final(RPM) max(CUR_REF%)", "--duration", "1.5", "--json")
    recorded = automax("sweep", DRIVE, *one, *measures, "--record", "bag")
    assert recorded.code == 0
    assert json.loads(recorded.out) == json.loads(automax("sweep", DRIVE, *one, *measures).out)
    assert json.loads(recorded.out)[0]["measures"]["final(RPM)"] > 1
    assert automax("replay", "bag").code == 0


def test_json_has_null_where_a_run_has_no_measure(sweep):
    result = sweep("--vary", "RUN@=false", "--json")
    (row,) = json.loads(result.out)
    assert result.code == 1
    assert row["values"] == {"RUN@": False}
    assert set(row["measures"].values()) == {None}
    assert row["fault"].startswith("task LOOP")


def test_without_anything_that_varies_the_rack_runs_as_it_is(sweep, tmp_path):
    assert sweep("--output", "out").code == 0
    (row,) = rows_of(tmp_path / "out")
    assert float(row["final(FDBK%)"]) == pytest.approx(1000, abs=4)
    assert not (tmp_path / "out" / "sweep.png").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--vary", "LOOP.KP=0:3:4"), "--vary: LOOP.KP = 0 lies outside 0.1 to 2.5"),
        (("--vary", "LOOP.KP=1:2"), "--vary: LOOP.KP has two ends and no number of values"),
        (("--vary", "REF%=1", "--vary", "ref%=2"), "--vary: REF% is given twice"),
        (("--sample", "5"), "--sample: nothing varies"),
        (("--vary", "LOOP.KP=1:2", "--sample", "0"), "--sample takes 1 or more, --seed 0 or more"),
        (("--seed", "5"), "--seed belongs to --sample"),
        (("--jobs", "2", "--scheduler", "tcp://x:1"), "--jobs and --scheduler exclude each other"),
        (("--scheduler", " "), "--scheduler needs an address"),
        (("--best", "rms(ERR%)"), "--best: 'rms(ERR%)' is not min MEASURE or max MEASURE"),
        (("--best", "min rsm(ERR%)"), "--best: there is no measure 'rsm'"),
        (("--measure", "rms(REFF%)"), "--measure: the rack has no common variable 'REFF%'"),
        (("--stimuli", "missing.yaml"), "missing.yaml cannot be used"),
        (("--output", "rack.yaml"), "--output: rack.yaml is not a folder"),
        (("--output", "."), "--output: . has files already"),
    ],
)
def test_what_is_refused_before_the_first_run(sweep, options, message, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(Rack, "start", None)
    result = sweep(*options)
    assert result.code == 2
    assert f"automax sweep: error: {message}" in result.err


def test_a_rack_with_errors_is_not_run(sweep, automax):
    automax.write("LOOP.BLK", "10 CALL SCAN_LOOP(TICKS=4)\n20 X% = 1\n30 END\n")
    result = sweep()
    assert result.code == 1
    assert "error[AMX" in result.err


@pytest.mark.usefixtures("signals")
def test_ctrl_c_keeps_the_runs_that_are_done(sweep, tmp_path, monkeypatch: pytest.MonkeyPatch):
    start, begun = Rack.start, []

    def interrupted(self: Rack, *given) -> None:
        begun.append(1)
        if len(begun) == 4:
            os.kill(os.getpid(), signal.SIGINT)
        start(self, *given)

    monkeypatch.setattr(Rack, "start", interrupted)
    result = sweep("--vary", "REF%=100:900:9", "--output", "out")
    assert result.code == 128 + signal.SIGINT
    assert "ended after 3 of 9 runs" in result.err
    assert [row["REF%"] for row in rows_of(tmp_path / "out")] == ["100", "200", "300"]
    assert json.loads((tmp_path / "out" / "sweep.json").read_text())["done"] == 3
    assert len(begun) == 4


@pytest.mark.parametrize("written", [False, True])
def test_a_folder_that_stays_empty_is_taken_away(tmp_path, written):
    """As where the disk is full when the tables are written; what was written stays."""
    folder = tmp_path / "out"

    def write() -> None:
        if written:
            (folder / "runs.csv").write_text("x")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space"), prepared(folder):
        write()
    assert folder.exists() == written
