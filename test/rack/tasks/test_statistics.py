"""The arithmetic of scan statistics, on a clock of the test's own and against a plain model."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings.live_racks import build
from runtime.time.walls import Wall

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.scheduled_task import TaskStatistics
from automax_ros.runtime.time.pacer import Pacer

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.0, tasks: {SPEED: {priority: 4}}}
common:
  COUNT!: {}
"""
SPEED = "10 COMMON COUNT!\n100 CALL SCAN_LOOP(TICKS=1)\n110 COUNT! = COUNT! + 1\n120 END\n"
SCAN = st.tuples(st.integers(0, 10**9), st.integers(0, 10**9), st.integers(0, 3))


@given(st.lists(st.lists(SCAN, max_size=8), max_size=5))
def test_counts_and_times_of_each_window_and_of_all(windows) -> None:
    statistics = TaskStatistics()
    taken = []
    for window in windows:
        for time_ns, late_ns, skipped in window:
            if skipped:
                statistics.skip(skipped)
            statistics.add(time_ns, late_ns)
        taken.append(statistics.take_window())
    everything = [scan for window in windows for scan in window]
    for found, scans in [*zip(taken, windows, strict=True), (statistics, everything)]:
        times, late = [scan[0] for scan in scans], [scan[1] for scan in scans]
        assert (found.scans, found.skipped) == (len(scans), sum(scan[2] for scan in scans))
        assert (found.least_ns, found.longest_ns) == (min(times, default=0), max(times, default=0))
        assert found.latest_ns == max(late, default=0)
        assert found.mean_ns == pytest.approx(float(Fraction(sum(times), len(scans) or 1)))
        assert found.mean_late_ns == pytest.approx(float(Fraction(sum(late), len(scans) or 1)))
    assert statistics.last_ns == next((scan[0] for scan in reversed(everything)), 0)


class Host(Wall):
    """A clock that stands where it is told to; its stopwatch finds that each scan takes 0.4 ms."""

    def __init__(self) -> None:
        super().__init__()
        self.looks = 0

    def stopwatch(self) -> int:
        self.looks += 1
        if self.looks % 2 == 0:
            self.now_ns += 400_000
        return self.now_ns


def test_execution_and_lateness_are_those_of_the_host(tmp_path) -> None:
    """Each scan takes 0.4 ms; one begins 1.5 ms late, one misses two deadlines and begins 2 ms after the third."""
    host = Host()
    rack = Rack(build(tmp_path, YAML, SPEED=SPEED).config, stopwatch=host.stopwatch)
    pacer = Pacer(rack.scheduler, clock=host, wait=host.wait)
    pacer.begin()
    rack.start()
    pacer.run(10 * NS_PER_MS - 1)
    statistics = rack.statistics["SPEED"]
    assert dataclasses.asdict(statistics.take_window()) == {
        "scans": 2,
        "skipped": 0,
        "total_ns": 800_000,
        "least_ns": 400_000,
        "longest_ns": 400_000,
        "late_ns": 0,
        "latest_ns": 0,
    }
    host.now_ns += 1 + 1_500_000
    pacer.step()
    host.now_ns += 15 * NS_PER_MS + 100_000
    pacer.step()
    window = statistics.take_window()
    assert (window.scans, window.skipped) == (2, 2)
    assert (window.late_ns, window.latest_ns) == (1_500_000 + 2_000_000, 2_000_000)
    pacer.halt()
    host.now_ns += NS_PER_S
    rack.scheduler.run_until(rack.now_ns + 5 * NS_PER_MS)
    stepped = statistics.take_window()
    assert (stepped.scans, stepped.late_ns) == (1, 0), "time stands still: nothing is late"
    pacer.resume()
    pacer.run(rack.now_ns + 10 * NS_PER_MS)
    assert (statistics.take_window().latest_ns, statistics.scans) == (0, 7)
    assert statistics.total_ns == 7 * 400_000
