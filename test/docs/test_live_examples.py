"""The examples of the pages that speak to a rack that runs: each is carried out, over real DDS."""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from system.support import Automax

from docs.fences import PAGES, ROOT, Fence, fences
from docs.scratch import commands, prepare

LIVE = [fence for page in PAGES for fence in fences(page) if fence.word("live")]
RACKS = {
    "pm1": ROOT / "test" / "docs" / "stages" / "pm1",
    "section_drive": ROOT / "config" / "section_drive",
    "dc_drive": ROOT / "config" / "dc_drive",
}
ENDLESS = {"watch": "", "record": "scans/s"}
"""What goes on until Ctrl-C, which comes when a line with this text was printed."""


@pytest.fixture
def environment(ros_domain_id) -> dict[str, str]:
    return {**os.environ, "ROS_DOMAIN_ID": str(ros_domain_id), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def of(rack: str, *languages: str) -> list[Fence]:
    return [fence for fence in LIVE if fence.word("live") == rack and fence.language in languages]


def test_every_rack_is_known():
    assert {fence.word("live") for fence in LIVE} <= set(RACKS)


def programs(rack: str) -> Iterator[list[str]]:
    """The `automax` commands on a rack; the one that runs it is running."""
    for fence in of(rack, "sh"):
        for command in commands(fence.text):
            words = shlex.split(command)
            if words[0] == "automax" and (words[1] != "run" or "--simulated" in words):
                yield words[1:]


@pytest.mark.parametrize("name", ["section_drive", pytest.param("dc_drive", marks=pytest.mark.soak)])
def test_programs_in_python(name, environment, tmp_path):
    """Each ends by itself and says nothing on standard error."""
    found = of(name, "python")
    assert found
    with Automax("run", RACKS[name], environment=environment) as rack:
        rack.wait_for_line("Ctrl-C")
        for fence in found:
            result = subprocess.run(
                [sys.executable, "-c", fence.text],
                capture_output=True,
                text=True,
                cwd=tmp_path,
                env=environment,
                timeout=60,
                check=False,
            )
            assert (result.returncode, result.stderr) == (0, ""), fence
        assert rack.end(signal.SIGINT).code == 0


@pytest.mark.soak
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", RACKS)
def test_commands(name, environment, tmp_path):
    """Each is done, in the order of the pages; they take a few seconds each to find the rack."""
    for page in dict.fromkeys(fence.page for fence in of(name, "sh")):
        folder = tmp_path / page.stem / str(len(page.parts))
        folder.mkdir(parents=True)
        prepare(page, folder)
        if name == "pm1":
            (folder / "new").mkdir(exist_ok=True)
            (folder / "new" / "SPEED.BLK").write_bytes((RACKS[name] / "SPEED.BLK").read_bytes())
    with Automax("run", RACKS[name], environment=environment) as rack:
        rack.wait_for_line("Ctrl-C")
        for words in programs(name):
            carried_out(words, folder, environment)
        assert rack.end(signal.SIGINT).code == 0


def carried_out(words: list[str], folder: Path, environment: dict[str, str]) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "automax_ros.cli.main", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=folder,
        env={**environment, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
    )
    assert process.stdout is not None
    text = ""
    for wanted in (ENDLESS[word] for word in words if word in ENDLESS):
        for line in process.stdout:
            text += line
            if wanted in line:
                process.send_signal(signal.SIGINT)
                break
    text += process.stdout.read()
    assert process.wait(60) == 0, (words, text)


ROS2 = re.compile(r"^ros2 .*$", re.MULTILINE)


@pytest.mark.parametrize("name", ["pm1", "section_drive"])
def test_what_ros2_is_asked_for_is_there(name, environment, tmp_path):
    """The names, types and messages of `ros2` commands are those of the graph; the tools are not in the environment."""
    lines = [line for fence in of(name, "sh") for line in ROS2.findall(fence.text)]
    assert lines
    asked = tmp_path / "asked.txt"
    asked.write_text("\n".join(lines))
    with Automax("run", RACKS[name], environment=environment) as rack:
        rack.wait_for_line("Ctrl-C")
        result = subprocess.run(
            [sys.executable, Path(__file__).parent / "ask_graph.py", asked],
            capture_output=True,
            text=True,
            env=environment,
            timeout=90,
            check=False,
        )
        assert (result.returncode, result.stderr) == (0, "")
        assert result.stdout.split() == ["found"] * len(lines)
        assert rack.end(signal.SIGINT).code == 0
