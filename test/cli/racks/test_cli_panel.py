"""`automax panel` and `automax run --panel`: what they refuse, what they print, how they end."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from panel.support import Browser

import automax_ros.cli.options.panel as options
from cli.support import Automax

ROOT = Path(options.__file__).parents[3]
BAG = str(ROOT / "bags" / "section_drive")
RACK = str(ROOT / "config" / "section_drive" / "rack.yaml")
BIG = 240


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (["--port", "70000"], "argument --port: 70000 is not a port: give 0 to 65535"),
        (["--port", "-1"], "argument --port"),
        (["--port", "x"], "argument --port"),
        (["--host", "0.0.0.0"], "--host 0.0.0.0 needs the names by which browsers ask for it"),
        (["--host", " "], "--host needs an address"),
        (["--allow-host", "http://pc7/"], "--allow-host 'http://pc7/' is not the name of a host"),
        (["--allow-host", ""], "--allow-host '' is not the name of a host"),
        (["--allow-host", "a\nb"], "--allow-host 'a\ufffdb' is not the name of a host"),
        (["--host", "192.0.2.1", "--allow-host", "pc7"], "of 192.0.2.1: "),
    ],
)
def test_options_that_make_no_sense(automax: Automax, given, text):
    for command in (["panel", BAG], ["run", RACK, "--simulated", "--duration", "0.01", "--panel"]):
        result = automax(*command, *given)
        assert (result.code, result.out) == (2, "")
        assert text in result.err
        assert "Traceback" not in result.err


def test_without_websockets_it_says_what_to_install(automax: Automax, monkeypatch):
    for name in [name for name in sys.modules if name.startswith(("websockets", "automax_ros.panel"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "websockets", None)
    for command in (["panel", BAG], ["run", RACK, "--simulated", "--panel"]):
        result = automax(*command)
        assert (result.code, result.out) == (2, "")
        assert result.err.endswith(
            "error: the panel needs the package websockets\n  hint: pip install 'automax_ros[panel]'\n"
        )


def test_a_port_that_is_taken(automax: Automax):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        for command in (["panel", BAG], ["run", RACK, "--simulated", "--duration", "0.01", "--panel"]):
            result = automax(*command, "--port", port)
            assert (result.code, result.out) == (2, "")
            assert (
                f"error: the panel cannot have port {port} of 127.0.0.1: another program has it\n  hint: --port N "
                in result.err
            )


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (["PM1", "--against", BAG], "--against is for recordings, and PM1 is not one"),
        (["PM1", "--task", "SPEED=x"], "--task is for recordings, and PM1 is not one"),
        (["Pä 1"], "'Pä 1' is neither a rack's name or namespace nor a YAML file or its folder"),
        (["no.yaml"], "no.yaml"),
        (["PM1", "--wait", "0"], "argument --wait"),
        ([BAG, "--task", "SPEED"], "--task 'SPEED' is not NAME=FILE"),
        ([BAG, "--task", "SPEED=a", "--task", "speed=b"], "--task SPEED is given twice"),
        ([BAG, "--task", "SPEED=no.BLK"], "--task SPEED: no.BLK"),
        ([BAG, "--ros-args", "-r", "__ns:=/a"], "--ros-args: nothing of ROS is started for a recording"),
    ],
)
def test_what_cannot_be_shown(automax: Automax, ros_domain_id, given, text):
    result = automax("panel", *given)
    assert (result.code, result.out) == (2, "")
    assert text in result.err


def test_a_folder_and_a_file_that_are_no_recordings(automax: Automax):
    (automax.folder / "empty").mkdir()
    automax.write("bad.mcap", b"nonsense")
    for name in ("empty", "bad.mcap", "no.mcap"):
        result = automax("panel", name)
        assert (result.code, result.out) == (2, "")
        assert f"{name}" in result.err
        assert "error[AMX68" in result.err


def test_no_such_rack_is_told_with_those_that_are_there(automax: Automax, ros_domain_id):
    result = automax("panel", "nobody", "--wait", "0.2")
    assert (result.code, result.out) == (2, "")
    assert "no rack /nobody is seen within 0.2 s" in result.err


@pytest.mark.parametrize("option", ["--operate", "--port 1", "--host ::1", "--allow-host a", "--open"])
def test_options_of_the_panel_need_it(automax: Automax, option):
    result = automax("run", RACK, "--simulated", "--duration", "0.01", *option.split())
    assert (result.code, result.out) == (2, "")
    assert f"error: {option.split()[0]} belongs to --panel" in result.err


def test_a_distributed_rack_is_joined(automax: Automax):
    result = automax("run", RACK, "--distributed", "--panel")
    assert (result.code, result.out) == (2, "")
    assert result.err.endswith("--panel shows a rack in one process\n  hint: join this one: automax panel RACK\n")


class Started:
    """`automax` as a process that prints the address of a panel."""

    def __init__(self, *arguments: str) -> None:
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, "-m", "automax_ros.cli.main", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )

    def __enter__(self) -> "Started":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()

    def wait_for(self, pattern: str) -> str:
        """Read lines until one matches, and return its group."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line)
            if found := re.search(pattern, line):
                return found[1]
        raise AssertionError(f"no {pattern} in {self.lines}: {self.process.communicate()[1]}")

    @property
    def address(self) -> str:
        """The address of the panel, once it is printed."""
        return self.wait_for(r"^panel: (http://127\.0\.0\.1:\d+/\?token=[\w-]{32})$")

    def end(self, number: int = signal.SIGINT) -> tuple[int, str]:
        """Send a signal and return exit code and errors."""
        self.process.send_signal(number)
        _, err = self.process.communicate(timeout=BIG)
        return self.process.returncode, err


class At:
    """What a browser needs of a server."""

    def __init__(self, address: str) -> None:
        self.address = address


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_recording_is_shown_until_a_signal(number):
    with Started("panel", BAG) as started:
        with Browser(At(started.address)) as browser:
            hello = browser.next("hello")
            assert (hello["rack"], hello["kind"], hello["operate"]["allowed"]) == ("PM1", "recording", False)
            browser.ask("watch", names=["SPEED_FPM%"])
            assert browser.next("frame")["t"] == hello["span"]["to_ns"]
        assert started.wait_for("(Ctrl-C) ends the panel")
        assert started.end(number) == (0, "")


def test_a_simulated_run_that_has_ended_is_shown_until_ctrl_c(tmp_path):
    out = tmp_path / "out"
    with Started("run", RACK, "--simulated", "--duration", "2", "--panel", "--record", str(out)) as started:
        address = started.address
        started.wait_for("(the panel shows how it ended), until Ctrl-C")
        with Browser(At(address)) as browser:
            status = browser.next("status")
            assert (status["over"], status["time_ns"]) == ("the run is over", 2_000_000_000)
            assert "start the panel with --operate" in str(browser.ask("prepare", verb="run_all", fields={}))
        assert started.end() == (0, "")
    assert (out / "metadata.yaml").exists()


def test_a_simulated_run_is_operated_while_it_lasts():
    with Started("run", RACK, "--simulated", "--panel", "--operate") as started:
        with Browser(At(started.address)) as browser:
            assert browser.next("hello")["operate"] == {"allowed": True, "why": ""}
            for verb, is_halted in (("pause", True), ("resume", False), ("pause", True)):
                ticket = browser.ask("prepare", verb=verb, fields={})["ok"]["ticket"]
                assert browser.ask("confirm", ticket=ticket)["ok"]["ok"]
                while browser.next("status").get("halted") is not is_halted:
                    pass
            before = browser.ask("watch", names=[]) and browser.next("frame")["t"]
            time.sleep(0.3)
            browser.ask("watch", names=["SPEED_FPM%"])
            assert browser.next("frame")["t"] == before, "a halted rack stands still"
        code, _ = started.end()
        assert code == 0


def test_a_live_run_prints_the_address_in_its_opening_lines(ros_domain_id, tmp_path):
    with Started("run", RACK, "--panel", "--operate", "--state", str(tmp_path)) as started:
        with Browser(At(started.address)) as browser:
            assert len(started.lines) == 3
            hello = browser.next("hello")
            browser.ask("watch", names=hello["watch"])
            first = browser.next("frame")["t"]
            assert browser.next("frame")["t"] > first
            ticket = browser.ask("prepare", verb="stop_all", fields={})["ok"]["ticket"]
            assert browser.ask("confirm", ticket=ticket)["ok"]["ok"]
            assert "STOP ALL by the operator" in str(browser.next("log")) + str(browser.shown)
        code, err = started.end()
        assert (code, err.splitlines()[-1:]) == (0, ["automax run: STOP ALL: STOP ALL by the operator"])


def test_the_recording_that_is_broken_is_the_one_to_repair(automax: Automax):
    """The hint named the recording that is shown where that of --against was broken."""
    broken = automax.folder / "broken"
    broken.mkdir()
    for file in Path(BAG).iterdir():
        data = file.read_bytes()
        (broken / file.name).write_bytes(data[:3000] if file.suffix == ".mcap" else data)
    for command in (["panel", BAG, "--against", str(broken)], ["panel", str(broken), "--against", BAG]):
        result = automax(*command)
        assert (result.code, result.out) == (2, "")
        assert f"`automax bag repair {broken}`" in result.err
