"""Racks on the wall clock whose tasks scan natively, in one process and in several: Python finds each scan the same."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Sequence
from pathlib import Path

import pytest

from automax_ros.messages.types.messages import NAMES, Scan
from automax_ros.recordings.read.reader import BagReader
from system.support import Automax, Ended, automax_here, wait_until

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="native code needs a C compiler")

RACK = """
rack: PAIR
on_module_loss: hold
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {LEAD: {priority: 5}, SHAPE: {priority: 6}}}
  2: {module: 57C435, tick_ms: 5.5, tasks: {FOLLOW: {priority: 5}}}
common:
  REF%: {}
  SHAPED%: {}
  TRIM%: {}
  N!: {}
  GAIN: {}
  WAY: {}
"""
LEAD = """10 COMMON REF%, N!, TRIM%
20 LOCAL SAW%
30 CALL SCAN_LOOP(TICKS=2)
40 N! = N! + 1
50 SAW% = N! * 37 - (N! * 37 / 4096) * 4096
60 CALL SUMMER(INPUT1=SAW%, INPUT2=TRIM%, OUTPUT=REF%)
70 END
"""
SHAPE = """10 COMMON REF%, SHAPED%, GAIN
20 LOCAL RAMPED%
30 CALL SCAN_LOOP(TICKS=3)
40 CALL RAMP(INPUT=REF%, ACCEL_RATE=400, DECEL_RATE=300, OUTPUT=RAMPED%)
50 CALL LAG(INPUT=RAMPED%, WLG=5.0, OUTPUT=SHAPED%)
60 GAIN = RAMPED% * 0.001 + SQRT(ABS(RAMPED%))
70 END
"""
FOLLOW = """10 COMMON SHAPED%, TRIM%, GAIN, WAY
30 CALL SCAN_LOOP(TICKS=2)
40 WAY = WAY * 0.99 + GAIN
50 CALL PROP_INT(INPUT=SHAPED%, KP=0.01, WLD=1.5, LIMIT_PLUS=50, LIMIT_MINUS=-50, OUTPUT=TRIM%)
60 END
"""
TASKS = {"LEAD": LEAD, "SHAPE": SHAPE, "FOLLOW": FOLLOW}
RECORDED_BYTES = 100_000
"""A recording that has some hundred scans of each task: in a busy rack of several it begins with writes alone."""


@pytest.fixture
def rack(tmp_path: Path) -> Path:
    folder = tmp_path / "pair"
    folder.mkdir()
    for name, text in TASKS.items():
        (folder / f"{name}.BLK").write_text(text)
    (folder / "rack.yaml").write_text(RACK)
    return folder


def lived(rack: Path, *options: str) -> tuple[Ended, Path]:
    """The rack with native scans, built then and there, until its recording has many."""
    bag = rack.parent / "bag"
    environment = {**os.environ, "XDG_CACHE_HOME": str(rack.parent / "cache")}
    wanted = ("--native", "on", "--verbose", "--record", bag)
    with Automax("run", rack, *wanted, *options, environment=environment) as run:
        wait_until(lambda: run.process.poll() is not None or size_of(bag) > RECORDED_BYTES)
        return run.end(signal.SIGTERM), bag


def size_of(bag: Path) -> int:
    return sum(path.stat().st_size for path in bag.glob("*.mcap"))


def assert_same_in_python(ended: Ended, bag: Path, told: Sequence[str]) -> None:
    """Every task was native, and Python finds in each of its scans what native code found."""
    assert ended.code == 0, f"{ended.out}\n{ended.err}"
    assert sorted(line for line in ended.err.splitlines() if "native" in line or "Python" in line) == sorted(told)
    values: dict[str, set[float]] = {name: set() for name in TASKS}
    for item in BagReader(bag).messages(types={NAMES[Scan]}):
        scan = item.message
        values[scan.task].update((*scan.committed.value, *scan.written.value))
    assert all(len(found) > 10 for found in values.values()), {name: len(values[name]) for name in values}
    replayed = automax_here("replay", bag, "--native", "off", "--verbose")
    assert (replayed.code, replayed.err.count("in Python")) == (0, len(TASKS)), replayed


@pytest.mark.timeout(300)
def test_a_live_rack_scans_natively(ros_domain_id, rack):
    ended, bag = lived(rack)
    assert_same_in_python(ended, bag, [f"{name}: native" for name in TASKS])


@pytest.mark.timeout(300)
@pytest.mark.soak
def test_each_process_of_a_distributed_rack_scans_natively(ros_domain_id, rack):
    """Each process builds its own tasks, at the same time as the others, in one cache."""
    ended, bag = lived(rack, "--distributed")
    told = ["processor_1: LEAD: native", "processor_1: SHAPE: native", "processor_2: FOLLOW: native"]
    assert_same_in_python(ended, bag, told)
    assert {path.suffix for path in (rack.parent / "cache" / "automax_ros").iterdir()} == {".so", ".text"}
