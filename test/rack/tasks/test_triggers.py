"""What makes tasks scan: events, their place among other scans, and the time within which they must come."""

from __future__ import annotations

import pytest

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.triggers import Timeout
from automax_ros.runtime.tasks.task import Status
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler
from rack.helpers import rack_at, run_for

MS = 1_000_000
KEY = EventKey(EventClass.SCAN, 5, "TASK")
IO = EventKey(EventClass.IO, 0, "MODULE")


def timed(timeout_ns: int) -> tuple[Scheduler, Timeout, list[int]]:
    """A timeout, and the instants at which it has expired."""
    scheduler, expired = Scheduler(), []
    return scheduler, Timeout(timeout_ns, KEY, scheduler, lambda: expired.append(scheduler.now_ns)), expired


def test_a_time_runs_from_its_beginning_and_no_further_than_its_end():
    scheduler, timeout, expired = timed(100)
    timeout.begin(7)
    scheduler.run_until(107)
    assert expired == []
    scheduler.run_until(108)
    assert expired == [107]
    timeout.begin(200)
    timeout.end()
    timeout.end()
    scheduler.run_until(1000)
    assert expired == [107]


def test_what_comes_at_the_last_instant_is_in_time():
    scheduler, timeout, expired = timed(100)
    scheduler.at(100, IO, timeout.begin)
    timeout.begin(0)
    scheduler.run_until(500)
    assert expired == [200]


def test_a_host_that_is_late_lets_no_time_run_out():
    """Interrupts each 40 ns with 60 ns of time: a call 200 ns late carries out the last of them alone."""
    scheduler, timeout, expired = timed(60)
    interrupts = scheduler.every(40, 40, IO, lambda now, _: timeout.begin(now))
    timeout.begin(0)
    for now in (45, 245, 250, 290):
        scheduler.run_due(now)
    assert expired == []
    interrupts.cancel()
    scheduler.run_due(335)
    assert expired == []
    scheduler.run_due(345)
    assert expired == [345], "after all that was late: the last interrupt came at 280"


def test_after_a_long_delay_of_the_host_the_time_begins_again():
    """What interrupts may end only after the call that was late: a scan in modeled execution that is under way."""
    scheduler, timeout, expired = timed(5 * NS_PER_MS)
    timeout.begin(0)
    scheduler.run_due(20 * NS_PER_MS)
    scheduler.run_due(25 * NS_PER_MS - 1)
    assert expired == []
    scheduler.run_due(25 * NS_PER_MS + 1000)
    assert expired == [25 * NS_PER_MS + 1000], "20 ms and 5; late by less than a tick of a UDC it is over"


def rack_of(tmp_path, execution: str = "ideal", **tasks: tuple[int, str]) -> Rack:
    """A rack with a module that can interrupt, and never does: its clock is off."""
    for name, (_, text) in tasks.items():
        (tmp_path / f"{name}.BLK").write_text(text)
    listed = ", ".join(f"{name}: {{priority: {priority}}}" for name, (priority, _) in tasks.items())
    (tmp_path / "rack.yaml").write_text(
        f"rack: R\nexecution: {execution}\nslots:\n  0: {{module: 57C435, tick_ms: 1.0, tasks: {{{listed}}}}}\n"
        "  6: {module: 57C411}\ncommon:\n  ISCR%: {slot: 6, register: 3}\n  SEEN%: {}\n  ORDER%(9): {}\n  NEXT%: {}\n"
    )
    return rack_at(tmp_path / "rack.yaml")


WAITING = """\
10 COMMON SEEN%, ORDER%(9), NEXT%, ISCR%
20 EVENT NAME=GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=100
30 CALL SCAN_LOOP(TICKS=2, EVENT=GO)
40 SEEN% = SEEN% + 1
50 ORDER%(NEXT%) = {digit}
60 NEXT% = NEXT% + 1
70 END
"""
SETTING = """\
10 COMMON ORDER%(9), NEXT%
20 EVENT NAME=GO
30 CALL SCAN_LOOP(TICKS=5)
40 ORDER%(NEXT%) = 1
50 NEXT% = NEXT% + 1
60 SET GO
70 ORDER%(NEXT%) = 2
80 NEXT% = NEXT% + 1
90 END
"""


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_scan_that_an_event_starts_does_not_begin_inside_the_one_that_sets_it(tmp_path, execution):
    """In ideal execution; in modeled execution a higher priority suspends the task right after its SET."""
    rack = run_for(rack_of(tmp_path, execution, SETTER=(8, SETTING), WAITER=(4, WAITING.format(digit=7))), 0.004)
    expected = {"ideal": [1, 2, 7], "modeled": [1, 7, 2]}[execution]
    assert [rack.value("ORDER%", element) for element in range(3)] == expected
    assert (rack.value("SEEN%"), rack.task("WAITER").scan_number) == (1, 1)


def test_tasks_that_wait_for_one_event_scan_in_the_order_of_priority_and_name(tmp_path):
    tasks = {"C": (6, WAITING.format(digit=3)), "B": (6, WAITING.format(digit=4)), "A": (9, WAITING.format(digit=5))}
    rack = run_for(rack_of(tmp_path, SETTER=(8, SETTING), **tasks), 0.004)
    assert [rack.value("ORDER%", element) for element in range(5)] == [1, 2, 4, 3, 5]


def test_an_event_that_comes_while_its_scan_is_under_way_is_an_overlap(tmp_path):
    """Decision; the clock's rule of J2-3106-1 p. C-1 for events too."""
    remarks = "".join(f"{number} ! takes 9.88 us\n" for number in range(100, 700))
    slow = WAITING.format(digit=7).replace("70 END", f"{remarks}900 END")
    rack = run_for(rack_of(tmp_path, "modeled", SETTER=(4, SETTING), WAITER=(8, slow)), 0.02)
    stopped = rack.operations.stopped
    assert stopped is not None
    assert (stopped.code, stopped.task) == ("14", "WAITER")
    assert 5 * MS < stopped.time_ns < 6 * MS, "the second SET"
    assert rack.task("WAITER").errors.last.problem == "AMX7070"


HARDWARE = """\
10 COMMON ISCR%, SEEN%
20 EVENT NAME=GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=6
30 CALL SCAN_LOOP(TICKS=4, EVENT=GO)
40 SEEN% = SEEN% + 1
50 END
"""


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_hardware_event_must_come_within_its_time_out(tmp_path, execution):
    """TIMEOUT counts ticks: 6 ms from RUN, and from each event; at that instant it is still in time."""
    rack = rack_of(tmp_path, execution, WAITER=(5, HARDWARE))
    for instant in (6, 7, 13):
        rack.scheduler.at(instant * MS, IO, rack.events.event("GO").set)
    rack.start()
    rack.run(0.019)
    assert (rack.value("SEEN%"), rack.operations.stopped) == (3, None)
    rack.run(0.001)
    stopped = rack.operations.stopped
    assert stopped is not None
    assert (stopped.time_ns, stopped.code, stopped.task) == (19 * MS, None, "WAITER")
    waiter = rack.task("WAITER")
    assert (waiter.status, waiter.errors.last.problem, waiter.errors.last.scan) == (Status.FAULTED, "AMX7071", 4)
    rack.operations.clear_errors("WAITER")
    rack.operations.run("WAITER")
    assert rack.operations.stopped is None
    rack.run(0.007)
    assert rack.operations.stopped is None
    rack.run(0.001)
    assert rack.operations.stopped is not None
    assert rack.operations.stopped.time_ns == (20 + 1 + 6) * MS, "from the tick after RUN"


def test_a_state_goes_on_with_the_time_that_is_left(tmp_path):
    rack = rack_of(tmp_path, WAITER=(5, HARDWARE))
    rack.scheduler.at(3 * MS, IO, rack.events.event("GO").set)
    rack.start()
    rack.run(0.005)
    twin = Rack(rack.config)
    twin.load(rack.state())
    for one in (rack, twin):
        one.run(0.01)
        assert one.operations.stopped is not None
        assert one.operations.stopped.time_ns == 9 * MS
