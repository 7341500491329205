"""Where `automax` writes what the user named, pipes, links, folders: refused before the work, waiting for nobody."""

import json
import os
import subprocess
import sys

import pytest
from scenario.stimuli.helpers import DRAW, RACK, SPEED

pytestmark = pytest.mark.usefixtures("no_waiting")
NOBODY = "it is a pipe without a reader"


@pytest.fixture
def run(automax):
    automax.write("rack.yaml", RACK)
    automax.write("SPEED.BLK", SPEED)
    automax.write("DRAW.BLK", DRAW)
    return lambda *options: automax("run", "rack.yaml", "--simulated", "--duration", "0.01", *options)


def shell(automax, command: str) -> subprocess.CompletedProcess[str]:
    """Run a command line of bash that calls `automax` by $A."""
    environment = {**os.environ, "A": f"{sys.executable} -m automax_ros.cli.main"}
    command = ["bash", "-c", command]
    return subprocess.run(
        command, cwd=automax.folder, env=environment, capture_output=True, text=True, timeout=240, check=False
    )


RUN = "$A run rack.yaml --simulated --duration 0.01"


def test_a_report_into_a_pipe_that_nobody_reads_is_refused_before_the_run(automax, run):
    os.mkfifo(automax.folder / "F")
    result = run("--report", "F", "--record", "out")
    assert (result.code, NOBODY in result.err) == (2, True)
    assert not (automax.folder / "out").exists()


@pytest.mark.parametrize("name", ["csv", "npz", "png"])
def test_trace_and_bridge_refuse_such_a_pipe_too(automax, name):
    os.mkfifo(automax.folder / f"F.{name}")
    case = ["bridge", "--alpha", "60", "--emf", "200", "--r", "0.05", "--l", "2e-3"]
    if name == "png":
        result = automax(*case, "--plot", f"F.{name}")
    else:
        result = automax.trace("scan,REF%\n1,5\n", "--output", f"F.{name}")
    assert (result.code, NOBODY in result.err) == (2, True)


def test_a_pipe_that_is_read_gets_the_report(automax, run):
    os.mkfifo(automax.folder / "F")
    done = shell(automax, f"timeout 20 cat F > got & {RUN} --report F; code=$?; wait; exit $code")
    assert done.returncode == 0, done.stderr
    assert json.loads((automax.folder / "got").read_text())["time_s"] == 0.01


@pytest.mark.parametrize("place", ["/dev/stdout", ">(cat)"])
def test_standard_output_and_substituted_processes_get_the_report(automax, run, place):
    done = shell(automax, f"{RUN} --report {place} 2>/dev/null | cat")
    assert '"time_s": 0.01' in done.stdout


def test_a_link_stays_and_what_it_leads_to_is_replaced(automax, run):
    real, link = automax.folder / "real.json", automax.folder / "link.json"
    real.write_text("old")
    link.symlink_to(real)
    assert run("--report", "link.json").code == 0
    assert link.is_symlink()
    assert json.loads(real.read_text())["time_s"] == 0.01


def test_a_planted_link_next_to_the_report_is_not_followed(automax, run):
    precious = automax.folder / "precious"
    precious.write_text("mine")
    for name in ("end.json.part", f".automax-{os.getpid()}-0.json"):
        (automax.folder / name).symlink_to(precious)
    assert run("--report", "end.json").code == 0
    assert precious.read_text() == "mine"
    assert json.loads((automax.folder / "end.json").read_text())["rack"] == "PM1"


@pytest.mark.parametrize("kind", ["file", "pipe", "device", "in a file", "dangling link"])
def test_a_state_that_cannot_be_a_folder_is_refused_before_the_run(automax, run, kind):
    place = automax.folder / "X"
    if kind == "pipe":
        os.mkfifo(place)
    elif kind == "dangling link":
        place.symlink_to("nowhere")
    else:
        place.write_text("mine")
    given = {"device": "/dev/null", "in a file": "X/state"}.get(kind, "X")
    result = run("--state", given, "--record", "out")
    assert result.code == 2
    assert f"{'/dev/null' if kind == 'device' else 'X'} is not a folder" in result.err
    assert not (automax.folder / "out").exists()


def test_a_folder_that_must_not_be_written_is_refused_before_the_run(automax, run, monkeypatch):
    """Root may write everything, so access is what the system would say to anybody else."""
    (automax.folder / "X").mkdir()
    monkeypatch.setattr("automax_ros.cli.output.files.os.access", lambda *_: False)
    result = run("--state", "X/deep")
    assert (result.code, "X must not be written" in result.err) == (2, True)


def test_a_report_that_must_not_be_written_is_refused_before_the_run(automax, run, monkeypatch):
    automax.write("end.json", "mine")
    monkeypatch.setattr("automax_ros.cli.output.files.os.access", lambda place, _: place.name != "end.json")
    result = run("--report", "end.json", "--record", "out")
    assert (result.code, "must not be written" in result.err) == (2, True)
    assert not (automax.folder / "out").exists()


def test_a_new_folder_is_made_for_the_state(automax, run):
    assert run("--state", "new/deep").code == 0


def test_an_empty_name_of_the_state_is_an_error_of_usage(run):
    result = run("--state", "")
    assert (result.code, "names no folder" in result.err) == (2, True)


@pytest.mark.parametrize("text", ["", "# later\n", "[]\n"])
def test_stimuli_without_entries_are_told(automax, run, text):
    result = run("--stimuli", automax.write("none.yaml", text))
    assert result.code == 0
    assert result.err.count("has no entries") == 1
    assert "AMX6744" in result.err
