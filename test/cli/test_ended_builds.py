"""Ctrl-C and SIGTERM while tasks are built: the program ends at once, with its compilers, and leaves no folder."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from compile.native.support import begun_compiler_of
from rack.helpers import written_in
from waiting import has_ended, wait_until

from automax_ros.cli.main import main

RACK = """
rack: ALONE
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {LEAD: {priority: 5}, SHAPE: {priority: 6}}}
common:
  REF%: {}
  OUT%: {}
"""
TASK = """10 COMMON REF%, OUT%
20 CALL SCAN_LOOP(TICKS=2)
30 CALL SUMMER(INPUT1=REF%, INPUT2=12, OUTPUT=OUT%)
40 END
"""
RUN = ("run", "rack.yaml", "--simulated", "--duration", "1000")
WITH_ROS = (*RUN, "--ros", "--rate", "1")
SWEEP = ("sweep", "rack.yaml", "--vary", "REF%=1,2,3", "--measure", "max(OUT%)", "--jobs", "2")
TRACE = ("trace", "LEAD.BLK", "--input", "IN.csv")
REPLAY = ("replay", "bag")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A rack, a table and a recording."""
    made: Path = tmp_path_factory.mktemp("alone")
    written_in(made, RACK, LEAD=TASK, SHAPE=TASK.replace("12", "13").replace("OUTPUT=OUT%", "OUTPUT=REF%"))
    (made / "IN.csv").write_text("REF%\n5\n")
    options = ("--simulated", "--duration", "0.1", "--record", str(made / "bag"), "--native", "off")
    assert main(["run", str(made / "rack.yaml"), *options]) == 0
    return made


@pytest.mark.usefixtures("ros_domain_id")
@pytest.mark.parametrize(
    ("command", "number", "code"),
    [
        (RUN, signal.SIGINT, 128 + signal.SIGINT),
        (RUN, signal.SIGTERM, 128 + signal.SIGTERM),
        (WITH_ROS, signal.SIGTERM, 0),  # a rack in ROS runs until it is stopped
        (SWEEP, signal.SIGTERM, 128 + signal.SIGTERM),
        (TRACE, signal.SIGTERM, 128 + signal.SIGTERM),
        (REPLAY, signal.SIGINT, 128 + signal.SIGINT),
        (REPLAY, signal.SIGTERM, 128 + signal.SIGTERM),
    ],
)
def test_a_signal_ends_the_compilers_too(folder, tmp_path, command, number, code):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    compiler = begun_compiler_of(tmp_path)
    environment = {"CC": str(compiler), "TMPDIR": str(temporary), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    process = subprocess.Popen(
        [sys.executable, "-m", "automax_ros.cli.main", *command, "--native", "on"],
        cwd=folder,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        begun = int((tmp_path / "begun").read_text().split()[0])  # blocks until a compiler has begun
        process.send_signal(number)
        _, err = process.communicate(timeout=110)  # a compiler has 120 s: it is not waited for
    finally:
        process.kill()
    told = "automax run: ended before its first scan; nothing was recorded or reported\n" if command is RUN else ""
    assert (process.returncode, err) == (code, told)
    wait_until(lambda: has_ended(begun))
    wait_until(lambda: list(temporary.iterdir()) == [])
