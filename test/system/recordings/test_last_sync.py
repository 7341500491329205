"""A disk that refuses the last sync of a recording: the run and the recorder say so and end with 1."""

import re
import signal
import subprocess
import sys
from pathlib import Path

from automax_ros.recordings.read.reader import BagReader
from system.support import PATIENCE_S, ROOT, TYPES, Automax

READY = "Ctrl-C ends the run"
REFUSING = """\
import os, sys
from automax_ros.cli.main import main
from automax_ros.cli.run import saving

def refuse(_):
    raise OSError(5, "Input/output error")

os.fsync = refuse
saving.SYNC_PERIOD_S = 1000.0  # so that no sync but the last one is ever made
sys.exit(main(sys.argv[1:]))
"""


def refused(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", REFUSING, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, timeout=PATIENCE_S, check=False)


def check(ended: subprocess.CompletedProcess[str], bag: Path) -> None:
    assert ended.returncode == 1, ended.stderr
    assert "error[AMX6801]: cannot write the recording: Input/output error" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not re.search(r"^recorded \S+: [0-9.]+ MB$", ended.stdout, re.MULTILINE), "told as if all were well"
    assert len(list(BagReader(bag).messages())) > 10


def test_run_tells_it(ros_domain_id, tmp_path):
    bag = tmp_path / "bag"
    check(refused("run", TYPES, "--record", bag, "--duration", "1"), bag)


def test_record_tells_it(ros_domain_id, tmp_path):
    bag = tmp_path / "bag"
    with Automax("run", TYPES) as rack:
        rack.wait_for_line(READY)
        check(refused("record", "TYPES", "--output", bag, "--duration", "1"), bag)
        assert rack.end(signal.SIGINT).code == 0
