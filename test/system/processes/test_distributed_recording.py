"""A distributed rack that is recorded: the recording begins before the first scan, and lacks nothing."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from automax_ros.recordings.info.info import bag_info
from automax_ros.replay.engine import replay
from system.distributed import Distributed, copied
from system.support import wait_until

TASKS = {"CML", "RING_1", "RING_2", "RING_3", "RING_4", "SPEED", "WIND_A"}


def recorder_of(run: Distributed) -> int:
    """Return the id of the recorder of a run, as soon as it is there."""
    found: list[int] = []

    def look() -> bool:
        for path in Path("/proc").glob("[0-9]*/stat"):
            try:
                if int(path.read_text().rpartition(")")[2].split()[1]) == run.pid:
                    words = (path.parent / "cmdline").read_bytes().decode().split("\0")
                    found.extend([int(path.parent.name)] if "record" in words else [])
            except (OSError, ValueError, IndexError):
                continue  # it has just ended
        return bool(found)

    wait_until(look)
    return found[0]


@pytest.mark.timeout(900)
def test_a_recording_has_all_of_the_run(ros_domain_id, tmp_path):
    """Seven processes wait for a recorder that is late, say so, and then nothing of the run is lost."""
    rack, bag = copied(tmp_path), tmp_path / "bag"
    with Distributed(rack, "--record", bag, "--duration", "3") as run:
        recorder = recorder_of(run)
        os.kill(recorder, signal.SIGSTOP)
        try:
            run.wait_for_line("waiting for the recorder")
        finally:
            os.kill(recorder, signal.SIGCONT)
        ended = run.end()
    assert ended.code == 0, ended
    assert "gap" not in ended.out.replace("0 gaps", ""), ended.out
    info = bag_info(bag, check=True)
    assert info.problems == []
    assert "gaps" not in info.custom_data
    assert set(info.tasks) == TASKS
    assert {name: task.first for name, task in info.tasks.items() if task.first > 1} == {}
    assert {name: task.missing for name, task in info.tasks.items() if task.missing} == {}
    report = replay(bag)
    assert report.identical
    assert [note for task in report.tasks for note in task.notes if "missing" in note] == [], ended


@pytest.mark.timeout(900)
def test_a_recorder_that_is_held_up_for_seconds_loses_nothing(ros_domain_id, tmp_path):
    """Each process keeps its messages for it: 1,100 writes come in a second, and most of them find its socket full."""
    rack, bag = copied(tmp_path), tmp_path / "bag"
    with Distributed(rack, "--record", bag, "--duration", "6") as run:
        run.wait_for_line("recording since")
        recorder = recorder_of(run)
        os.kill(recorder, signal.SIGSTOP)
        try:
            time.sleep(3.0)
        finally:
            os.kill(recorder, signal.SIGCONT)
        ended = run.end()
    assert ended.code == 0, ended
    info = bag_info(bag, check=True)
    assert (info.problems, "gaps" in info.custom_data) == ([], False)
    assert {name: task.missing for name, task in info.tasks.items() if task.missing} == {}
    assert replay(bag).identical


@pytest.mark.timeout(300)
def test_a_run_without_its_recorder_does_not_begin(ros_domain_id, tmp_path):
    rack, bag = copied(tmp_path), tmp_path / "bag"
    with Distributed(rack, "--record", bag) as run:
        os.kill(recorder_of(run), signal.SIGKILL)
        ended = run.end()
    assert ended.code != 0
    assert "ran " not in ended.out
