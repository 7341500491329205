"""A day of a rack, recorded by the hour and replayed side by side, by the ordinary commands; it prints what it took."""

import json
import os
import shutil
import subprocess
import sys
import time
from math import floor
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HOURS = float(os.environ.get("AUTOMAX_SOAK_HOURS", "24"))
"""Simulated; less of them for a trial. The day is always recorded in 24 files."""
FILES = 24
PERIODS_S = {"LINE": 0.011, "SEQUENCE": 0.055, "SPEED": 0.011, "MOTOR": 0.011}


def automax(*arguments):
    """Run the command; return its output and the wall time that it took."""
    start = time.monotonic()
    command = [Path(sys.executable).parent / "automax", *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert result.returncode == 0, result.stderr[-2000:]
    return result.stdout, time.monotonic() - start


@pytest.mark.soak
@pytest.mark.timeout(6 * 3600)
def test_a_day_is_recorded_by_the_hour_and_replays_bit_for_bit(tmp_path, capsys):
    duration = round(HOURS * 3600)
    bag = tmp_path / "day"
    rack = ROOT / "config" / "section_drive" / "rack.yaml"
    split = ("--record-split-s", duration / FILES)
    _, recorded = automax("run", rack, "--simulated", "--duration", duration, "--record", bag, *split)
    files = sorted(bag.glob("*.mcap"))
    size = sum(file.stat().st_size for file in files)
    found, replayed = automax("replay", bag, "--json", "--jobs", "auto")
    report = json.loads(found)
    shutil.rmtree(bag)  # a gigabyte and a half
    with capsys.disabled():
        machine = f"{len(os.sched_getaffinity(0))} cores"
        print(f"\n{duration} s of rack time on {machine}: {size / 1e6:.0f} MB in {len(files)} files")
        print(f"recorded in {recorded:.0f} s ({duration / recorded:.0f} times real time)")
        print(f"replayed in {replayed:.0f} s ({duration / replayed:.0f} times real time)")
    assert len(files) in {FILES, FILES + 1}
    assert report["identical"]
    assert report["to_s"] > duration - 0.1
    scans = {task["name"]: task["scans"] for task in report["tasks"]}
    # One at time 0, one a period after it, and what stands before SCAN_LOOP.
    assert scans == {name: floor(duration / period) + 2 for name, period in PERIODS_S.items()}
    assert all(task["states"] > duration / 10 and not task["notes"] for task in report["tasks"])
