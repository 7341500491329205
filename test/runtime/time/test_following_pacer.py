"""Time after another's clock: the same scans whatever the steps of the clock, jumps as the page says."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rack.helpers import Observer, config_at

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.rack.rack import Rack
from automax_ros.runtime.time.following_pacer import LONGEST_JUMP_NS, FollowingPacer
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

TYPES = Path(__file__).parents[2] / "system" / "racks" / "types" / "rack.yaml"
KEY = EventKey(EventClass.SCAN, 4, "T")
PERIOD_NS = 5 * NS_PER_MS
EPOCH_NS = 1_700_000_000 * NS_PER_S


@pytest.fixture
def scans():
    return []


@pytest.fixture
def jumps():
    return []


@pytest.fixture
def pacer(scans, jumps):
    scheduler = Scheduler()
    scheduler.every(PERIOD_NS, 0, KEY, lambda now, skipped: scans.append((now, skipped)))
    return FollowingPacer(scheduler, jumps.append, wait=lambda _: None)


def begun(pacer, at=EPOCH_NS):
    pacer.follow_to(at)
    assert pacer.begin() == at
    pacer.step()
    return pacer


def grid(until_ns):
    return [(at, 0) for at in range(0, until_ns, PERIOD_NS)]


def test_nothing_happens_before_the_first_time(pacer, scans):
    assert not pacer.has_clock
    pacer.step()
    assert scans == []
    pacer.follow_to(0)
    assert not pacer.has_clock
    pacer.follow_to(EPOCH_NS)
    assert pacer.has_clock
    assert scans == []


def test_rack_begins_at_the_time_that_was_heard_last_and_carries_its_instant_out(pacer, scans):
    pacer.follow_to(1)
    begun(pacer)
    assert scans == [(0, 0)]
    assert pacer.now_ns == 0
    pacer.step()
    assert scans == [(0, 0)]


@settings(deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.integers(0, 25 * NS_PER_MS), min_size=1, max_size=12))
def test_events_up_to_and_at_each_time_have_happened_at_their_own_instants(steps):
    scans: list[tuple[int, int]] = []
    scheduler = Scheduler()
    scheduler.every(PERIOD_NS, 0, KEY, lambda now, skipped: scans.append((now, skipped)))
    pacer = begun(FollowingPacer(scheduler, lambda _: None))
    passed = 0
    for step in steps:
        passed += step
        pacer.follow_to(EPOCH_NS + passed)
        assert pacer.now_ns == passed
        assert scans == grid(passed + 1)


def test_clock_that_goes_back_leaves_rack_time_where_it_is(pacer, scans, jumps):
    begun(pacer)
    pacer.follow_to(EPOCH_NS + NS_PER_S)
    pacer.follow_to(EPOCH_NS + 1)
    assert pacer.now_ns == NS_PER_S
    assert jumps == [1 - NS_PER_S]
    pacer.follow_to(EPOCH_NS + 1 + NS_PER_S)
    assert pacer.now_ns == 2 * NS_PER_S
    assert scans == grid(2 * NS_PER_S + 1)


def test_clock_that_leaps_ahead_leaves_the_time_between_out(pacer, scans, jumps):
    begun(pacer)
    pacer.follow_to(EPOCH_NS + LONGEST_JUMP_NS)
    assert jumps == []
    pacer.follow_to(EPOCH_NS + 2 * LONGEST_JUMP_NS + 1)
    assert jumps == [LONGEST_JUMP_NS + 1]
    assert pacer.now_ns == LONGEST_JUMP_NS
    pacer.follow_to(EPOCH_NS + 2 * LONGEST_JUMP_NS + 1 + PERIOD_NS)
    assert scans == grid(LONGEST_JUMP_NS + PERIOD_NS + 1)


def test_run_ends_at_its_time_and_leaves_what_is_due_then(pacer, scans):
    begun(pacer)
    times = iter(range(EPOCH_NS, EPOCH_NS + NS_PER_S, 3 * NS_PER_MS))
    pacer._wait = lambda _: pacer.follow_to(next(times))
    pacer.run(20 * NS_PER_MS)
    assert scans == grid(20 * NS_PER_MS)
    assert pacer.now_ns == 20 * NS_PER_MS
    pacer.follow_to(EPOCH_NS + NS_PER_S)
    assert pacer.now_ns == 20 * NS_PER_MS


def told(writes):
    return tuple(str(entry) for group in writes for entry in group.entries())


class Log(Observer):
    """All scans of a rack with what they wrote."""

    def __init__(self) -> None:
        self.scans: list[object] = []

    def scanned(self, task, record, writes):
        self.scans.append((task.name, record.scan, record.time_ns, record.skipped, told(writes)))

    def written(self, writes):
        self.scans.append(told(writes))


@pytest.fixture
def config():
    return config_at(TYPES)


def followed(config, step_ns, settings):
    """The log of a rack that follows a clock of some step, with settings by rack time."""
    rack, log = Rack(config), Log()
    pacer = FollowingPacer(rack.scheduler, lambda _: None)
    pacer.follow_to(EPOCH_NS)
    pacer.begin()
    rack.observe(log)
    rack.start()
    pacer.step()
    for at in range(0, 400 * NS_PER_MS + 1, step_ns):
        pacer.follow_to(EPOCH_NS + at)
        if at in settings:
            pacer.catch_up()
            rack.write("REF%", settings[at])
    return log.scans


def test_same_times_and_writes_give_the_same_scans_as_simulated_time(config):
    settings = {40 * NS_PER_MS: 17, 120 * NS_PER_MS: -5, 200 * NS_PER_MS: 300}
    rack, log = Rack(config), Log()
    rack.observe(log)
    rack.start()
    for at, value in settings.items():
        rack.scheduler.run_through(at)
        rack.write("REF%", value)
    rack.scheduler.run_through(400 * NS_PER_MS)
    assert len(log.scans) > 200
    for step_ms in (1, 4, 40):
        assert followed(config, step_ms * NS_PER_MS, settings) == log.scans
