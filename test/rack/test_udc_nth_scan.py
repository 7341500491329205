"""The application registers of every Nth scan, the interrupt that goes with them, and states in between."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.rack.rack import Rack
from rack.helpers import rack_at, run_for
from rack.modules.udc_racks import Seen, built, written

POINTS = """\
  SLOW_OUT%: {slot: 10, register: 1300}
  SLOW_IN%: {slot: 10, register: 1302}
  FAST_OUT%: {slot: 10, register: 300}
  FAST_IN%: {slot: 10, register: 302}
  GOT%: {slot: 10, register: 304}
  GAIN: {slot: 10, register: 306}
  WIDE!: {slot: 10, register: 1304}
"""
UDC = """\
10 COMMON CCLK@, SLOW_OUT%, SLOW_IN%, FAST_OUT%, FAST_IN%, GOT%
20 LOCAL N%
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS=2)
110 N% = N% + 1
120 FAST_OUT% = N%
130 SLOW_OUT% = N%
140 GOT% = SLOW_IN%
900 END
"""
LINE = """\
10 COMMON ISCR%, FAST_IN%, SLOW_IN%, NTH%, SLOW_OUT%
20 LOCAL N%, AT%(20)
30 EVENT NAME=UDC_INT, INTERRUPT_STATUS=ISCR%, TIMEOUT=100
40 NTH% = {n}
100 CALL SCAN_LOOP(TICKS=2, EVENT=UDC_INT)
110 N% = N% + 1
120 SLOW_IN% = 100 * N%
130 AT%(N%) = SLOW_OUT%
900 END
"""


def with_interrupt(folder, n: int) -> Rack:
    return built(folder, POINTS, tasks="WIND_A: {drive: A}", WIND_A=UDC, LINE=LINE.format(n=n))


@pytest.mark.parametrize("n", [1, 2, 5])
def test_registers_go_out_after_scan_n_less_1_and_the_interrupt_follows(tmp_path, n):
    """Scan k is at (k - 0.5) x 1 ms here: the Nth ones are n, 2n ...; out and interrupt one scan before."""
    rack = with_interrupt(tmp_path, n)
    seen = Seen(rack).start()
    rack.run(0.0105)
    before = [k for k in range(1, 11) if k % n == (n - 1) % n]
    assert seen.of("SLOW_OUT%") == [(1000 * k - 500, k) for k in before]
    assert [time for time, task, scan in seen.scans if task == "LINE" and scan] == [
        1_000_000 * k - 500_000 for k in before
    ]
    assert [rack.task("LINE").value("AT%")[number] for number in range(1, len(before) + 1)] == before


@pytest.mark.parametrize("n", [1, 2, 5])
def test_what_the_interrupted_task_answers_is_read_in_the_nth_scan(tmp_path, n):
    """The UDC's copy changes only in scans n, 2n ...: GOT% shows there what was written after the interrupt before."""
    rack = with_interrupt(tmp_path, n)
    seen = Seen(rack).start()
    rack.run(0.0105)
    expected = []
    answers = 0
    for k in range(1, 11):
        if k % n == 0 and answers:
            expected.append((1000 * k - 500, 100 * answers))
        answers += k % n == (n - 1) % n
    assert seen.of("GOT%") == expected
    assert [value for _, value in expected] == [100 * number for number in range(1, len(expected) + 1)]


def test_the_counter_shows_scans_since_the_nth(tmp_path):
    rack = with_interrupt(tmp_path, 5)
    seen = Seen(rack).start()
    rack.run(0.0125)
    assert [value for _, value in seen.of("COUNT%")] == [1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1, 2]
    rack.write("NTH%", 0)
    rack.run(0.01)
    assert rack.value("COUNT%") == 0
    assert not [time for time, task, _ in seen.scans if task == "LINE" and time > 12_500_000]


def test_every_scan_registers_come_in_at_the_start_of_the_next_scan(tmp_path):
    source = UDC.replace("140 GOT% = SLOW_IN%", "140 GOT% = FAST_IN%")
    rack = built(tmp_path, POINTS, tasks="WIND_A: {drive: A}", WIND_A=source)
    seen = Seen(rack).start()
    rack.run(0.0007)
    rack.write("FAST_IN%", 12)
    rack.run(0.0008)
    assert rack.value("GOT%") == 0
    rack.run(0.0001)
    assert seen.of("GOT%") == [(1500, 12)]


@given(st.floats(-(2.0**62), 2.0**62, width=32), st.integers(-(2**31), 2**31 - 1))
@settings(deadline=None, derandomize=True, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_two_registers_hold_a_real_or_a_double_integer(tmp_path, real, whole):
    source = """\
10 COMMON CCLK@, GAIN, WIDE!, NTH%, FAST_IN%
20 LOCAL X, Y!
30 CCLK@ = TRUE
40 NTH% = 1
100 CALL SCAN_LOOP(TICKS=1)
110 X = GAIN
120 Y! = WIDE!
900 END
"""
    rack = run_for(built(tmp_path, POINTS, tasks="WIND_A: {drive: A}", WIND_A=source))
    rack.write("GAIN", real)
    rack.write("WIDE!", whole)
    rack.run(0.0016)
    task = rack.task("WIND_A")
    assert (task.value("X"), task.value("Y!")) == (rack.value("GAIN"), whole)
    bank = rack.backplane.bank(10)
    words = [int(rack.memory.read_now(bank.view, number)) & 0xFFFF for number in (1304, 1305)]
    assert (words[0] << 16 | words[1]) == whole & 0xFFFFFFFF


def snapshot(rack: Rack) -> list[object]:
    return [rack.value(item.name) for item in rack.config.declared] + [task.snapshot() for task in rack.tasks]


@given(st.integers(0, 40), st.sampled_from([1, 2, 5]))
@settings(deadline=None, derandomize=True, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_rack_that_goes_on_from_a_state_has_the_same_future(tmp_path, quarters, n):
    first, second = with_interrupt(tmp_path, n), with_interrupt(tmp_path, n)
    first.start()
    first.run(quarters * 0.00025)
    second.load(first.state())
    first.write("FAST_IN%", 9)
    second.write("FAST_IN%", 9)
    for _ in range(12):
        first.run(0.0007)
        second.run(0.0007)
        assert snapshot(first) == snapshot(second)


FORCED = """\
10 COMMON CCLK@, FAST_OUT%, GOT%
20 LOCAL N%
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS=2)
110 N% = N% + 1
120 CALL SUMMER(INPUT1=N%, INPUT2=0, OUTPUT=FAST_OUT%)
130 CALL SUMMER(INPUT1=FAST_OUT%, INPUT2=1, OUTPUT=GOT%)
900 END
"""


def test_a_force_holds_in_the_local_memory_too(tmp_path):
    rack = run_for(built(tmp_path, POINTS, tasks="WIND_A: {drive: A}", WIND_A=FORCED), 0.0021)
    assert (rack.value("FAST_OUT%"), rack.value("GOT%")) == (2, 3)
    rack.force("FAST_OUT%", 70)
    rack.run(0.002)
    assert (rack.value("FAST_OUT%"), rack.value("GOT%")) == (70, 71)
    rack.unforce("FAST_OUT%")
    rack.run(0.001)
    assert (rack.value("FAST_OUT%"), rack.value("GOT%")) == (5, 6)


BITS = """\
10 COMMON CCLK@, RUN@, GOT%
20 LOCAL N%
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS=2)
110 N% = N% + 1
120 RUN@ = N% > 2
900 END
"""


def test_a_boolean_output_overwrites_its_pair_of_registers(tmp_path):
    points = POINTS + "  RUN@: {slot: 10, register: 320, bit: 3}\n  LOST%: {slot: 10, register: 321}\n"
    rack = built(tmp_path, points, tasks="WIND_A: {drive: A}", WIND_A=BITS)
    assert [item.code for _, items in rack.warnings for item in items] == ["AMX4097", "AMX6483"]
    rack.start()
    rack.write("LOST%", 99)
    rack.run(0.0004)
    assert rack.value("LOST%") == 99
    rack.run(0.0002)
    assert rack.value("LOST%") == 0
    rack.run(0.002)
    assert rack.value("RUN@") is True


def test_a_basic_task_waits_for_the_interrupt_too(tmp_path):
    """Every third scan from the second on, to scan 29: ten times, each with the register that has just gone out."""
    basic = """\
10 COMMON ISCR%, SLOW_OUT%, SEEN%
20 LOCAL N%
30 EVENT NAME=UDC_INT, INTERRUPT_STATUS=ISCR%, TIMEOUT=100
100 WAIT ON UDC_INT
110 SEEN% = SLOW_OUT%
120 N% = N% + 1
130 GOTO 100
900 END
"""
    (tmp_path / "BG.BAS").write_text(basic)
    source = UDC.replace("30 CCLK@ = TRUE", "30 CCLK@ = TRUE\n40 NTH% = 3").replace("COMMON ", "COMMON NTH%, ")
    path = written(tmp_path, POINTS + "  SEEN%: {}\n", tasks="WIND_A: {drive: A}", WIND_A=source)
    path.write_text(path.read_text().replace("LINE: {priority: 5}", "LINE: {priority: 5}, BG: {priority: 9}"))
    rack = run_for(rack_at(path), 0.0301)
    assert (rack.value("SEEN%"), rack.task("BG").value("N%")) == (29, 10)


def test_a_late_host_leaves_scans_out_but_not_their_interrupt(tmp_path):
    """Scan k is at (k - 0.5) ms. Of 3 to 30 only the last happens, in place of 4, 9 ... 29; of 31 to 100 likewise.

    TIMEOUT is 50 ms here: a host that is late by more than that must not look like a UDC that does not interrupt.
    """
    rack = with_interrupt(tmp_path, 5)
    seen = Seen(rack).start()
    for now_ms in (1, 2, 30, 100, 102):
        rack.scheduler.run_due(now_ms * 1_000_000)
    assert rack.operations.stopped is None
    udc = [(time, scan) for time, task, scan in seen.scans if task == "WIND_A" and scan]
    assert udc == [(500_000, 1), (1_500_000, 2), (29_500_000, 3), (99_500_000, 4), (101_500_000, 5)]
    line = [(time, scan) for time, task, scan in seen.scans if task == "LINE" and scan]
    assert line == [(29_500_000, 1), (99_500_000, 2)]
    assert rack.statistics["LINE"].skipped == 5 + 13
    assert rack.value("COUNT%") == 102 % 5
    assert rack.value("GOT%") == 100
