"""UDC tasks in modeled execution: the times of table 5, summed by hand, A before B, overlap of the module's scan."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.runtime.tasks.task import Status
from rack.helpers import run_for
from rack.modules.udc_racks import Seen, built

TOP = "execution: modeled\n"
POINTS = """\
  A_OUT%: {slot: 10, register: 300}
  B_OUT%: {slot: 10, register: 302}
  IN%: {slot: 10, register: 304}
  FB%: {slot: 10, register: 207}
"""
A = """\
10 COMMON CCLK@, A_OUT%
20 LOCAL N%
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS=2)
110 CALL COUNTER(INPUT_PLUS=1, INPUT_MINUS=0, RESET=FALSE, OUTPUT=N%)
120 CALL SUMMER(INPUT1=N%, INPUT2=0, OUTPUT=A_OUT%)
900 END
"""
"""SCAN_LOOP 350 + i 2.20 + b 2.00, COUNTER 16.90, SUMMER 10.00, END 130 + i 2.40 + b 2.50: 516.00 us."""
B = """\
10 COMMON A_OUT%, B_OUT%
100 CALL SCAN_LOOP(TICKS=2)
110 CALL SUMMER(INPUT1=A_OUT%, INPUT2=1000, OUTPUT=B_OUT%)
{more}900 END
"""
"""SCAN_LOOP 350 + 2 i 2.20, SUMMER 10.00, END 130 + 2 i 2.40: 499.20 us."""


def modeled(folder, *, a: str = A, b: str = B.format(more=""), ticks: int = 3, **more: str):
    sources = {"WIND_A": a, "WIND_B": b}
    sources = {name: text.replace("TICKS=2", f"TICKS={ticks}") for name, text in sources.items() if name not in more}
    return built(folder, POINTS, top=TOP, **sources, **more)


def test_outputs_reach_the_dual_port_when_the_modeled_scans_end(tmp_path):
    rack = modeled(tmp_path)
    seen = Seen(rack).start()
    rack.run(0.0049)
    assert [(time, value) for time, name, value in seen.writes if name == "A_OUT%"] == [
        (1_016_000, 1), (2_516_000, 2), (4_016_000, 3),
    ]  # fmt: skip
    assert [(time, value) for time, name, value in seen.writes if name == "B_OUT%"] == [
        (1_515_200, 1001), (3_015_200, 1002), (4_515_200, 1003),
    ]  # fmt: skip


def test_one_task_alone_pays_for_the_messages_of_both(tmp_path):
    """With 312 us more in SCAN_LOOP and 100 in END: 928.00 us."""
    rack = built(tmp_path, POINTS, top=TOP, tasks="WIND_A: {drive: A}", WIND_A=A)
    seen = Seen(rack).start()
    rack.run(0.0016)
    assert [(time, value) for time, name, value in seen.writes if name == "A_OUT%"] == [(1_428_000, 1)]


@pytest.mark.parametrize(("remarks", "overlaps"), [(1, False), (2, True)])
def test_both_together_beyond_their_ticks_are_an_overlap(tmp_path, remarks, overlaps):
    """A with a DIFFERENCE (7.97) in place of its blocks has 497.07 us, both 996.27; a remark in B takes 2.37 more."""
    a = A.replace("110 CALL COUNTER(INPUT_PLUS=1, INPUT_MINUS=0, RESET=FALSE, OUTPUT=N%)\n", "")
    a = a.replace(
        "CALL SUMMER(INPUT1=N%, INPUT2=0, OUTPUT=A_OUT%)", "CALL DIFFERENCE(INPUT1=5, INPUT2=2, OUTPUT=A_OUT%)"
    )
    more = "".join(f"{200 + number} ! NOTE\n" for number in range(remarks))
    rack = run_for(modeled(tmp_path, a=a, b=B.format(more=more), ticks=2), 0.0049)
    stopped = rack.operations.stopped
    assert (stopped is not None) == overlaps
    if stopped is not None:
        assert (stopped.code, stopped.task, stopped.time_ns) == ("14", "WIND_B", 1_500_000)
        assert rack.task("WIND_B").status is Status.FAULTED
        assert rack.value("A_OUT%") == 0


def test_an_input_is_that_of_the_start_of_the_scan(tmp_path):
    """The application registers come in at 0.5 ms, before the latch of B; feedback is read when B latches."""
    b = B.format(more="").replace("A_OUT%, B_OUT%", "IN%, FB%, B_OUT%")
    b = b.replace("INPUT1=A_OUT%, INPUT2=1000", "INPUT1=IN%, INPUT2=FB%")
    rack = run_for(modeled(tmp_path, b=b), 0.0008)
    rack.write("IN%", 5)
    rack.write("FB%", 300)
    rack.run(0.0010)
    assert rack.value("B_OUT%") == 300
    rack.run(0.0015)
    assert rack.value("B_OUT%") == 305


def test_a_task_that_is_stopped_in_its_scan_leaves_the_other_to_go_on(tmp_path):
    rack = modeled(tmp_path)
    seen = Seen(rack).start()
    rack.run(0.0007)
    rack.operations.stop("WIND_A")
    rack.run(0.0008)
    assert [(time, value) for time, name, value in seen.writes if name == "B_OUT%"] == [(1_199_200, 1000)]
    rack.run(0.002)
    assert rack.operations.stopped is None
    assert [time for time, task, scan in seen.scans if task == "WIND_B" and scan] != []


def test_ideal_and_modeled_leave_the_same_values(tmp_path):
    (tmp_path / "ideal").mkdir()
    (tmp_path / "modeled").mkdir()
    ideal = built(
        tmp_path / "ideal", POINTS, WIND_A=A.replace("=2)", "=3)"), WIND_B=B.format(more="").replace("=2)", "=3)")
    )
    other = modeled(tmp_path / "modeled")
    for rack in (ideal, other):
        rack.start()
    for _ in range(5):
        ideal.run(0.0015)
        other.run(0.0015)
    other.run(0.0004)
    assert [ideal.value(name) for name in ("A_OUT%", "B_OUT%")] == [other.value(name) for name in ("A_OUT%", "B_OUT%")]


NTH = """\
  SLOW%: {slot: 10, register: 1300}
  BACK%: {slot: 10, register: 1302}
"""
WITH_NTH = """\
10 COMMON CCLK@, A_OUT%, SLOW%, BACK%, IN%
20 LOCAL N%, M%
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS=3)
110 CALL COUNTER(INPUT_PLUS=1, INPUT_MINUS=0, RESET=FALSE, OUTPUT=N%)
120 A_OUT% = N% + IN%
130 M% = M% + A_OUT%
140 CALL SUMMER(INPUT1=N%, INPUT2=BACK%, OUTPUT=SLOW%)
900 END
"""
ANSWER = """\
10 COMMON ISCR%, NTH%, SLOW%, BACK%, IN%
20 LOCAL N%
30 EVENT NAME=UDC_INT, INTERRUPT_STATUS=ISCR%, TIMEOUT=100
40 NTH% = 2
100 CALL SCAN_LOOP(TICKS=6, EVENT=UDC_INT)
110 N% = N% + 1
120 CALL SUMMER(INPUT1=SLOW%, INPUT2=7, OUTPUT=BACK%)
130 IN% = N%
900 END
"""


@given(st.integers(0, 800))
@settings(deadline=None, derandomize=True, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_state_from_the_middle_of_a_scan_has_the_same_future(tmp_path, tens_of_us):
    def rack():
        sources = {"WIND_A": WITH_NTH, "WIND_B": B.format(more="").replace("TICKS=2", "TICKS=3"), "LINE": ANSWER}
        return built(tmp_path, POINTS + NTH, top=TOP, **sources)

    def shown(one):
        tasks = [(task.scan_number, task.value("N%")) for task in one.tasks if task.name != "WIND_B"]
        return tasks, [one.value(item.name) for item in one.config.declared]

    first, second, whole = rack(), rack(), rack()
    first.start()
    whole.start()
    first.run(tens_of_us * 1e-5)
    second.load(first.state())
    for _ in range(9):
        first.run(0.0007)
        second.run(0.0007)
        assert shown(first) == shown(second)
    whole.run((tens_of_us * 10 + 9 * 700) * 1e-6)
    assert shown(whole) == shown(first)
    assert whole.operations.stopped is None
