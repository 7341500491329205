"""The pacer: deadlines on a clock of the test's own, late hosts, and a rack in real time without ROS."""

import ast
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
from rack.helpers import rack_at

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.runtime.time.pacer import LONGEST_WAIT_NS, START_LEAD_NS, Pacer
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler
from runtime.time.walls import Wall

ROOT = Path(__file__).parents[3]
TYPES = ROOT / "test" / "system" / "racks" / "types" / "rack.yaml"
PERIOD_NS = 5 * NS_PER_MS
KEY = EventKey(EventClass.SCAN, 4, "T")


@pytest.fixture
def wall():
    return Wall()


@pytest.fixture
def scans():
    """Instants and skipped deadlines of a scan every 5 ms from time 0."""
    return []


@pytest.fixture
def scheduler(scans):
    made = Scheduler()
    made.every(PERIOD_NS, 0, KEY, lambda now, skipped: scans.append((now, skipped)))
    return made


@pytest.fixture
def pacer(scheduler, wall):
    return Pacer(scheduler, clock=wall, wait=wall.wait)


def test_scans_stand_on_the_grid(pacer, wall, scans):
    start = wall.now_ns
    pacer.run(50 * NS_PER_MS)
    assert scans == [(number * PERIOD_NS, 0) for number in range(10)]
    assert wall.now_ns == start + 50 * NS_PER_MS


def test_second_run_goes_on_where_the_first_ended(pacer, scans):
    pacer.run(20 * NS_PER_MS)
    pacer.run(50 * NS_PER_MS)
    assert scans == [(number * PERIOD_NS, 0) for number in range(10)]


def test_lead_delays_the_start(pacer, wall, scans):
    begun = wall.now_ns
    pacer.begin(START_LEAD_NS)
    assert pacer.now_ns == -START_LEAD_NS
    pacer.run(1)
    assert scans == [(0, 0)]
    assert wall.now_ns == begun + START_LEAD_NS + 1


def test_late_host_skips_deadlines_counts_them_and_keeps_the_grid(pacer, wall, scans):
    def stall(now_ns: int) -> None:
        if not stalled and now_ns >= 20 * NS_PER_MS:
            stalled.append(now_ns)
            wall.now_ns += 23 * NS_PER_MS

    stalled: list[int] = []
    pacer.run(300 * NS_PER_MS, stall)
    assert stalled == [100 * NS_PER_MS]
    at = dict(scans)
    assert at[120 * NS_PER_MS] == 3, "105, 110 and 115 ms were missed"
    assert sum(at.values()) == 3
    assert len(scans) + 3 == 60
    assert all((after - before) == PERIOD_NS * (1 + at[after]) for (before, _), (after, _) in pairwise(scans))


def test_deadlines_missed_before_the_end_are_counted(pacer, wall, scans):
    pacer.begin()
    wall.now_ns += 40 * NS_PER_MS
    pacer.run(33 * NS_PER_MS)
    assert scans == [(30 * NS_PER_MS, 6)]


def test_wait_that_returns_early_changes_nothing(scheduler, wall, scans):
    """As when a message comes: the loop waits for the rest."""
    wait = lambda seconds: wall.wait(min(seconds, 0.0011))  # noqa: E731
    Pacer(scheduler, clock=wall, wait=wait).run(50 * NS_PER_MS)
    assert scans == [(number * PERIOD_NS, 0) for number in range(10)]


def test_catch_up_brings_the_present_but_nothing_that_is_due(pacer, wall, scans):
    pacer.begin()
    pacer.step()
    wall.now_ns += 2 * NS_PER_MS
    pacer.catch_up()
    assert pacer._scheduler.now_ns == 2 * NS_PER_MS
    wall.now_ns += 9 * NS_PER_MS
    pacer.catch_up()
    assert pacer._scheduler.now_ns == PERIOD_NS
    assert scans == [(0, 0)]


def test_step_tells_how_long_to_wait(pacer, wall):
    pacer.begin()
    assert pacer.step() == pytest.approx(0.005)
    wall.now_ns += 2 * NS_PER_MS
    assert pacer.step() == pytest.approx(0.003)


def test_empty_queue_wakes_now_and_then_for_signals(wall):
    asked = iter([False, False, True])
    Pacer(Scheduler(), clock=wall, wait=wall.wait).run(should_stop=lambda: next(asked))
    assert wall.waits == [LONGEST_WAIT_NS / NS_PER_S] * 2


def test_on_idle_is_called_every_tenth_of_a_second(pacer):
    idle: list[int] = []
    pacer.run(350 * NS_PER_MS, idle.append)
    assert idle == [0, 100 * NS_PER_MS, 200 * NS_PER_MS, 300 * NS_PER_MS]


def test_scheduler_with_a_past_goes_on_from_its_present(scheduler, pacer, scans):
    """A rack may first run in simulated time, then in real time."""
    scheduler.run_until(10 * NS_PER_S)
    scans.clear()
    pacer.run(10 * NS_PER_S + 12 * NS_PER_MS)
    assert scans == [(10 * NS_PER_S + number * PERIOD_NS, 0) for number in range(3)]


def test_rack_on_a_made_up_clock_is_the_simulated_rack(wall):
    """The same scans and values, since a host that is never late lets every event happen at its own instant."""
    racks = [rack_at(TYPES) for _ in range(2)]
    for rack in racks:
        rack.start([("REF%", 12)])
    Pacer(racks[0].scheduler, clock=wall, wait=wall.wait).run(200 * NS_PER_MS)
    racks[1].run(0.2)
    assert racks[0].memory.image() == racks[1].memory.image()
    assert [list(task.snapshot()) for task in racks[0].tasks] == [list(task.snapshot()) for task in racks[1].tasks]
    assert [rack.statistics for rack in racks[:1]] == [rack.statistics for rack in racks[1:]]


def test_rack_keeps_real_time_without_ros():
    """In a process of its own, which must not have loaded anything of ROS."""
    program = f"""
import sys, time
from automax_ros.rackfile.loader import load
from automax_ros.rack.rack import Rack
from automax_ros.runtime.time.pacer import Pacer
rack = Rack(load({str(TYPES)!r}).config)
rack.start([("REF%", 12)])
began = time.monotonic()
Pacer(rack.scheduler).run(300_000_000)
print(time.monotonic() - began, rack.value("TWICE%"), rack.statistics["FAST"].scans, rack.statistics["FAST"].skipped)
assert not [name for name in sys.modules if name.partition(".")[0] in ("rclpy", "automax_msgs")]
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    took, twice, scans, skipped = done.stdout.split()
    assert float(took) >= 0.29
    assert (int(twice), int(scans) + int(skipped)) == (24, 55)


def test_default_waits_in_real_time():
    scheduler, late = Scheduler(), []
    pacer = Pacer(scheduler)
    scheduler.every(PERIOD_NS, 0, KEY, lambda now, _: late.append(pacer.now_ns - now))
    began = time.monotonic_ns()
    pacer.run(100 * NS_PER_MS)
    assert time.monotonic_ns() - began >= 100 * NS_PER_MS
    assert all(item >= 0 for item in late)


def test_no_other_source_below_ros_asks_a_clock():
    package = ROOT / "automax_ros"
    asking = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if path.relative_to(package).parts[0] not in {"ros", "panel", "cli"}
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in ([alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module])
        if name in {"time", "datetime"}
    }
    assert asking == {"runtime/time/pacer.py"}


def test_halted_time_stands_still_and_nothing_is_late_afterwards(pacer, wall, scans):
    pacer.run(12 * NS_PER_MS)
    assert [now for now, _ in scans] == [0, 5 * NS_PER_MS, 10 * NS_PER_MS]
    wall.now_ns += NS_PER_MS
    pacer.halt()
    assert pacer.now_ns == 13 * NS_PER_MS, "the present at which it was halted, not that of the last event"
    looks = []
    pacer.while_halted = lambda: looks.append(wall.now_ns)
    chores = []
    wall.waits.clear()
    stop_ns = wall.now_ns + NS_PER_S
    pacer.run(on_idle=lambda now: chores.append((now, wall.now_ns)), should_stop=lambda: wall.now_ns >= stop_ns)
    assert len(scans) == 3
    assert set(wall.waits) == {LONGEST_WAIT_NS / NS_PER_S}
    assert len(looks) == NS_PER_S // LONGEST_WAIT_NS
    assert {now for now, _ in chores} == {13 * NS_PER_MS}
    assert len(chores) == 10, "chores go by the wall clock"
    pacer.catch_up()
    assert pacer.step() == LONGEST_WAIT_NS / NS_PER_S
    assert pacer.now_ns == 13 * NS_PER_MS
    pacer.resume()
    resumed = wall.now_ns
    pacer.run(21 * NS_PER_MS)
    assert scans[3:] == [(15 * NS_PER_MS, 0), (20 * NS_PER_MS, 0)], "on the grid, and none was skipped"
    assert wall.now_ns == resumed + 8 * NS_PER_MS


def test_time_that_was_stepped_is_where_a_halted_pacer_goes_on(pacer, wall, scans):
    pacer.run(1)
    pacer.halt()
    scheduler = pacer._scheduler
    assert scheduler.zero_ns is None
    assert scheduler.step(7 * NS_PER_MS)
    assert not scheduler.step(7 * NS_PER_MS)
    assert pacer.now_ns == 7 * NS_PER_MS
    wall.now_ns += NS_PER_S
    pacer.resume()
    assert scheduler.zero_ns == wall.now_ns - 7 * NS_PER_MS
    pacer.run(11 * NS_PER_MS)
    assert scans == [(0, 0), (5 * NS_PER_MS, 0), (10 * NS_PER_MS, 0)]
