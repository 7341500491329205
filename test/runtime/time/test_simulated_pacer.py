"""Simulated time that tells itself: every instant is carried out, then told; at a rate it keeps to the wall clock."""

from itertools import pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.runtime.time.pacer import BREATH_S, LONGEST_WAIT_NS
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler
from automax_ros.runtime.time.simulated_pacer import LEAST_TICK_NS, MOST_LATE_NS, MOST_TICK_NS, SimulatedPacer
from runtime.time.walls import Wall

KEY = EventKey(EventClass.SCAN, 4, "T")


def made(period_ns, *, rate=None, wall=None, cost_ns=0):
    """A pacer of one periodic event, and what happened in its order: ('scan' or 'clock', time)."""
    wall = Wall() if wall is None else wall
    happened: list[tuple[str, int]] = []
    scheduler = Scheduler()

    def scan(now_ns: int, skipped: int) -> None:
        assert skipped == 0
        wall.now_ns += cost_ns
        happened.append(("scan", now_ns))

    scheduler.every(period_ns, 0, KEY, scan)
    return SimulatedPacer(
        scheduler, lambda now: happened.append(("clock", now)), rate=rate, clock=wall, wait=wall.wait
    ), happened


@settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(100_000, 30 * NS_PER_MS), st.integers(1, 40 * NS_PER_MS))
def test_all_instants_happen_and_the_clock_is_told_as_often_as_it_says(period_ns, until_ns):
    pacer, happened = made(period_ns)
    pacer.run(until_ns)
    scans = [at for what, at in happened if what == "scan"]
    clocks = [at for what, at in happened if what == "clock"]
    assert scans == list(range(0, until_ns, period_ns))
    assert pacer.now_ns == until_ns
    assert clocks[0] == 0
    assert all(LEAST_TICK_NS <= after - before <= MOST_TICK_NS + LEAST_TICK_NS for before, after in pairwise(clocks))
    assert until_ns - clocks[-1] <= MOST_TICK_NS
    assert [at for _, at in happened] == sorted(at for _, at in happened)


def test_clock_is_told_after_everything_of_its_instant():
    pacer, happened = made(2 * NS_PER_MS)
    pacer.run(5 * NS_PER_MS)
    assert happened == [(what, at * NS_PER_MS) for at in (0, 2, 4) for what in ("scan", "clock")]


def test_second_run_goes_on_with_the_instant_where_the_first_ended():
    pacer, happened = made(2 * NS_PER_MS)
    pacer.run(4 * NS_PER_MS)
    pacer.run(5 * NS_PER_MS)
    assert [at for what, at in happened if what == "scan"] == [0, 2 * NS_PER_MS, 4 * NS_PER_MS]


@pytest.mark.parametrize("rate", [0.1, 1.0, 20.0])
def test_rate_is_that_of_the_wall_clock(rate):
    wall = Wall()
    begun = wall.now_ns
    pacer, happened = made(5 * NS_PER_MS, rate=rate, wall=wall)
    pacer.run(NS_PER_S)
    assert len([at for what, at in happened if what == "scan"]) == 200
    # What is due at the end is left, so the last instant waited for lies up to 5 ms before it.
    assert wall.now_ns - begun == pytest.approx(NS_PER_S / rate, rel=0.006)
    assert max(wall.waits) <= LONGEST_WAIT_NS / NS_PER_S


def test_as_fast_as_it_goes_waits_only_so_that_others_have_their_turn():
    wall = Wall()
    made(5 * NS_PER_MS, wall=wall, cost_ns=100_000)[0].run(NS_PER_S)
    assert set(wall.waits) == {BREATH_S}
    # 200 scans of 0.1 ms are 20 ms, with a breath each 2 ms.
    assert 8 <= len(wall.waits) <= 12


def test_slow_host_skips_nothing_and_does_not_race_afterwards():
    wall = Wall()
    pacer, happened = made(5 * NS_PER_MS, rate=1.0, wall=wall, cost_ns=8 * NS_PER_MS)
    begun = wall.now_ns
    pacer.run(NS_PER_S)
    assert [at for what, at in happened if what == "scan"] == list(range(0, NS_PER_S, 5 * NS_PER_MS))
    # A scan lasts 8 ms; other threads have their turn after it.
    assert wall.now_ns - begun == 200 * (8 * NS_PER_MS + round(BREATH_S * NS_PER_S))
    slow_by = wall.now_ns - begun - NS_PER_S
    pacer._scheduler.every(NS_PER_S * 100, pacer.now_ns, EventKey(EventClass.OBSERVE, 0, "X"), lambda *_: None)
    assert slow_by > MOST_LATE_NS
    assert pacer._pause_ns() >= -MOST_LATE_NS


def test_it_stops_when_asked_and_does_chores():
    pacer, _ = made(5 * NS_PER_MS, rate=1.0)
    told: list[int] = []
    pacer.run(on_idle=told.append, should_stop=lambda: len(told) == 4)
    assert len(told) == 4
    assert all(90 * NS_PER_MS <= after - before <= 160 * NS_PER_MS for before, after in pairwise(told))


def test_time_stands_still_while_halted_and_goes_on_at_its_rate():
    wall = Wall()
    pacer, happened = made(5 * NS_PER_MS, rate=1.0, wall=wall)
    pacer.run(20 * NS_PER_MS)
    pacer.halt()
    before = list(happened)
    wall.now_ns += NS_PER_S
    assert pacer.step() == LONGEST_WAIT_NS / NS_PER_S
    assert [item for item in happened if item not in before] == [("clock", 20 * NS_PER_MS)]
    pacer.resume()
    begun = wall.now_ns
    pacer.run(120 * NS_PER_MS)
    assert [at for what, at in happened if what == "scan"] == list(range(0, 120 * NS_PER_MS, 5 * NS_PER_MS))
    assert wall.now_ns - begun == pytest.approx(100 * NS_PER_MS, abs=6 * NS_PER_MS)
