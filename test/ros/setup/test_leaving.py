"""Programs that cannot leave the graph end all the same, with the exit code of their work."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from system.support import TYPES, automax

STUCK = "import ctypes\nstuck = ctypes.PyDLL(None).pause  # holds the interpreter as it waits, as rclpy does\n"
HEAD = STUCK + "from automax_ros.ros.setup.leaving import ended_within\n"
RUN = (
    STUCK
    + "import sys\nfrom automax_ros.ros.rack_nodes import RackNodes\nfrom automax_ros.ros.setup import leaving\n"
    + "leaving.ended_within.__wrapped__.__defaults__ = (0.3,)\nRackNodes.close = lambda *_, **__: stuck()\n"
    + "from automax_ros.cli.main import main\nsys.exit(main(sys.argv[1:]))\n"
)


def ended(program: str, *arguments: object) -> tuple[int, str]:
    words = [sys.executable, "-c", program, *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout


@pytest.mark.parametrize("code", [0, 1, 7])
def test_a_program_that_is_stuck_ends_with_the_code_of_its_work(code):
    assert ended(f"{HEAD}print('done')\nwith ended_within({code}, 0.2): stuck()") == (code, "done\n")


def test_an_error_that_was_not_shown_yet_is_no_success():
    program = f"{HEAD}try: 1 / 0\nfinally:\n    with ended_within(0, 0.2): stuck()"
    assert ended(program) == (1, "")


def test_who_leaves_in_time_goes_on():
    program = f"{HEAD}import time\nwith ended_within(7, 0.2): pass\ntime.sleep(0.5)\nprint('still there')"
    assert ended(program) == (0, "still there\n")


def test_a_rack_that_cannot_leave_has_saved_and_reported_before(ros_domain_id, tmp_path):
    report, bag = tmp_path / "report.json", tmp_path / "bag"
    options = ("--duration", "0.5", "--report", report, "--record", bag, "--state", tmp_path / "state")
    code, out = ended(RUN, "run", TYPES, *options)
    assert (code, "recorded" in out) == (0, True), out
    tasks = json.loads(report.read_text())["tasks"]
    assert tasks
    assert all(task["scans"] > 0 for task in tasks.values())
    assert list((tmp_path / "state").iterdir())
    assert automax("bag", "info", bag, "--check").code == 0
