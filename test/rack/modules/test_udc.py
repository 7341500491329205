"""A UDC in a rack: the common clock, A before B, copies of registers, interrupt, what it keeps and loses."""

from __future__ import annotations

import pytest

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.runtime.tasks.task import Status
from rack.helpers import run_for
from rack.modules.udc_racks import Seen, built

A = """\
10 COMMON CCLK@, A_OUT%, B_SEES%
20 LOCAL N%
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS={ticks})
110 N% = N% + 1
120 A_OUT% = N%
900 END
"""
B = """\
10 COMMON A_OUT%, B_SEES%
20 LOCAL M%
100 CALL SCAN_LOOP(TICKS={ticks})
110 CALL SUMMER(INPUT1=A_OUT%, INPUT2=1000, OUTPUT=B_SEES%)
900 END
"""
OUTS = """\
  A_OUT%: {slot: 10, register: 300}
  B_SEES%: {slot: 10, register: 302}
"""


def plain(folder, ticks=2, **more):
    return built(folder, OUTS, WIND_A=A.format(ticks=ticks), WIND_B=B.format(ticks=ticks), **more)


def test_b_acts_on_what_a_has_written_in_the_same_scan(tmp_path):
    rack = plain(tmp_path)
    seen = Seen(rack).start()
    rack.run(0.0031)
    assert [item for item in seen.scans if item[1] != "LINE"] == [
        (0, "WIND_A", 0),
        (0, "WIND_B", 0),
        (500_000, "WIND_A", 1),
        (500_000, "WIND_B", 1),
        (1_500_000, "WIND_A", 2),
        (1_500_000, "WIND_B", 2),
        (2_500_000, "WIND_A", 3),
        (2_500_000, "WIND_B", 3),
    ]
    assert seen.of("A_OUT%") == [(500, 1), (1500, 2), (2500, 3)]
    assert seen.of("B_SEES%") == [(500, 1001), (1500, 1002), (2500, 1003)]


@pytest.mark.parametrize("ticks", [1, 3, 20])
def test_a_scan_comes_every_ticks_of_half_a_millisecond(tmp_path, ticks):
    rack = plain(tmp_path, ticks)
    seen = Seen(rack).start()
    rack.run(0.0305)
    instants = [time for time, task, scan in seen.scans if task == "WIND_B" and scan]
    assert instants == list(range(500_000, 30_500_000, ticks * 500_000))


def test_without_the_common_clock_no_task_passes_scan_loop(tmp_path):
    source = A.format(ticks=2).replace("30 CCLK@ = TRUE\n", "30 A_OUT% = 7\n")
    rack = built(tmp_path, OUTS, WIND_A=source, WIND_B=B.format(ticks=2))
    seen = Seen(rack).start()
    rack.run(0.01)
    assert [(task, scan) for _, task, scan in seen.scans if task != "LINE"] == [("WIND_A", 0), ("WIND_B", 0)]
    rack.write("CCLK@", True)
    rack.run(0.0011)
    assert [time for time, task, scan in seen.scans if task == "WIND_A" and scan] == [10_500_000]
    rack.write("CCLK@", False)
    rack.run(0.01)
    assert len([1 for _, task, scan in seen.scans if task == "WIND_A" and scan]) == 1
    rack.write("CCLK@", True)
    rack.run(0.0006)
    assert [time for time, task, scan in seen.scans if task == "WIND_A" and scan] == [10_500_000, 21_600_000]


def test_a_task_that_is_run_later_joins_the_scans_of_the_module(tmp_path):
    rack = plain(tmp_path, 4)
    seen = Seen(rack).start()
    rack.operations.stop("WIND_B")
    rack.run(0.0052)
    rack.operations.run("WIND_B")
    rack.run(0.004)
    assert [time for time, task, scan in seen.scans if task == "WIND_A" and scan] == [
        500_000, 2_500_000, 4_500_000, 6_500_000, 8_500_000,
    ]  # fmt: skip
    assert [(time, scan) for time, task, scan in seen.scans if task == "WIND_B"] == [
        (0, 0), (5_200_000, 0), (6_500_000, 1), (8_500_000, 2),
    ]  # fmt: skip


def test_two_modules_share_the_time_base(tmp_path):
    points = OUTS + "  C_OUT%: {slot: 11, register: 300}\n"
    other = "}\n  11: {module: 57552, tasks: {WIND_C: {drive: B}}"
    third = "10 COMMON C_OUT%\n20 LOCAL N%\n100 CALL SCAN_LOOP(TICKS=3)\n110 N% = N% + 1\n120 C_OUT% = N%\n900 END\n"
    rack = built(tmp_path, points, more=other, WIND_A=A.format(ticks=2), WIND_B=B.format(ticks=2), WIND_C=third)
    seen = Seen(rack).start()
    rack.run(0.0045)
    assert [time for time, task, scan in seen.scans if task == "WIND_C" and scan] == [500_000, 2_000_000, 3_500_000]
    assert [time for time, task, scan in seen.scans if task == "WIND_A" and scan][:3] == [500_000, 1_500_000, 2_500_000]


def test_two_modules_that_drive_the_clock_are_code_38(tmp_path):
    points = OUTS + "  OTHER@: {slot: 11, register: 2000, bit: 6}\n"
    rack = built(tmp_path, points, more="}\n  11: {module: 57552", WIND_A=A.format(ticks=2), WIND_B=B.format(ticks=2))
    rack.start()
    rack.run(0.0031)
    rack.write("OTHER@", True)
    rack.run(0.001)
    stopped = rack.operations.stopped
    assert (stopped.code, stopped.time_ns) == ("38", 3_100_000)
    assert rack.clock_since_ns is None
    assert {task.status for task in rack.tasks} == {Status.STOPPED}
    assert (rack.value("CCLK@"), rack.value("OTHER@")) == (False, False)


def test_the_clock_is_off_after_stop_all_until_a_task_enables_it_again(tmp_path):
    rack = plain(tmp_path)
    seen = Seen(rack).start()
    rack.run(0.0032)
    rack.operations.stop_all("for a test")
    assert rack.value("A_OUT%") == 0
    rack.run(0.001)
    assert rack.clock_since_ns is None
    rack.operations.run("WIND_B")
    rack.run(0.002)
    assert [scan for time, task, scan in seen.scans if task == "WIND_B" and time > 3_200_000] == [0]
    rack.operations.run("WIND_A")
    rack.run(0.001)
    assert rack.clock_since_ns == 6_200_000
    assert [(time, scan) for time, task, scan in seen.scans if task == "WIND_B" and time > 6_200_000] == [
        (6_700_000, 1)
    ]


KEEP = """\
10 COMMON CCLK@, A_OUT%
20 LOCAL N%, GAIN% [CURRENT=5, LOW=0, HIGH=50, STEP=1]
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS=2)
110 N% = N% + GAIN%
115 CALL DIVIDE(INPUT1=1, INPUT2=A_OUT%, OUTPUT=N%)
120 A_OUT% = N%
900 END
"""


def kept(folder):
    source = KEEP.replace(
        "115 CALL DIVIDE(INPUT1=1, INPUT2=A_OUT%, OUTPUT=N%)\n", "115 IF N% = 7 THEN N% = N% / A_OUT%\n"
    )
    points = OUTS + "  FB%: {slot: 10, register: 200}\n  SW%: {slot: 10, register: 1000, ros: in}\n"
    points += "  STATE%: {slot: 10, register: 80}\n  CMD%: {slot: 10, register: 100}\n"
    return built(folder, points, WIND_A=source, WIND_B=B.format(ticks=2))


@pytest.mark.parametrize("how", ["stop_all", "power"])
def test_a_udc_loses_locals_and_registers_and_keeps_tunables_and_feedback(tmp_path, how):
    rack = run_for(kept(tmp_path))
    task = rack.task("WIND_A")
    rack.tune(task, "GAIN%", 7)
    for name in ("FB%", "SW%", "STATE%", "CMD%"):
        rack.write(name, 42)
    rack.write("NTH%", 3)
    rack.run(0.006)
    assert task.value("N%") != 0
    assert rack.value("COUNT%") != 0 or rack.value("NTH%") == 3
    if how == "stop_all":
        rack.operations.stop_all("for a test")
    else:
        rack.operations.power_off()
        rack.operations.power_on()
    assert (task.value("N%"), task.value("GAIN%")) == (0, 7)
    assert [rack.value(name) for name in ("FB%", "SW%", "STATE%")] == [42, 42, 42]
    assert [rack.value(name) for name in ("CMD%", "A_OUT%", "B_SEES%", "NTH%", "COUNT%", "ISCR%")] == [0] * 6


def test_the_error_log_of_a_udc_task_outlives_stop_all(tmp_path):
    source = A.format(ticks=2).replace("120 A_OUT% = N%", "120 A_OUT% = 1 / (N% - N%)")
    rack = run_for(built(tmp_path, OUTS, WIND_A=source, WIND_B=B.format(ticks=2)), 0.002)
    count = rack.task("WIND_A").errors.count
    assert count == 4  # each scan logs the division by zero and the clamp
    rack.operations.stop_all("for a test")
    assert rack.task("WIND_A").errors.count == count


def test_a_reload_with_other_ticks_than_the_other_task_is_refused(tmp_path):
    from automax_ros.core.diagnostics import SourceText
    from automax_ros.rack.tasks.installation import RackError

    rack = run_for(plain(tmp_path))
    with pytest.raises(RackError) as refused:
        rack.operations.reload("WIND_A", SourceText("WIND_A.BLK", A.format(ticks=4)))
    codes = {item.code for _, items in refused.value.findings for item in items}
    assert "AMX6482" in codes
    rack.operations.reload("WIND_A", SourceText("WIND_A.BLK", A.format(ticks=2).replace("N% + 1", "N% + 5")))
    rack.run(0.0011)
    assert rack.value("A_OUT%") == 5
    with pytest.raises(OperationRefused):
        rack.operations.run("WIND_A")


def test_on_the_wall_clock_scans_that_are_late_are_skipped_and_counted(tmp_path):
    """At 20.2 ms the scans of 0.5, 1.5 ... 19.5 ms are due: the last one happens, 19 are skipped, the grid stays."""
    rack = run_for(plain(tmp_path))
    for now_ns in (0, 1, 20_200_000, 20_400_000, 20_500_000):
        rack.scheduler.run_due(now_ns)
    assert [rack.statistics[name].skipped for name in ("WIND_A", "WIND_B")] == [19, 19]
    assert [rack.statistics[name].scans for name in ("WIND_A", "WIND_B")] == [2, 2]
    assert rack.scheduler.next_ns is not None
    assert rack.value("B_SEES%") == 1002


def test_an_io_module_can_drive_the_clock_of_a_udc(tmp_path):
    points = OUTS + "  RES%: {slot: 5, register: 3}\n"
    source = A.format(ticks=2).replace("30 CCLK@ = TRUE\n", "")
    rack = run_for(built(tmp_path, points, more="}\n  5: {module: 57C411", WIND_A=source, WIND_B=B.format(ticks=2)))
    rack.run(0.001)
    rack.write("RES%", 64)
    rack.run(0.0016)
    assert rack.value("A_OUT%") == 2
    rack.write("CCLK@", True)
    rack.run(0.0001)
    assert rack.operations.stopped.code == "38"


def test_a_task_that_ends_itself_ends_the_scans_of_the_module(tmp_path):
    source = A.format(ticks=2).replace("120 A_OUT% = N%", "115 A_OUT% = N%\n120 IF N% = 3 THEN STOP")
    rack = built(tmp_path, OUTS + "  IN%: {slot: 10, register: 304}\n", tasks="WIND_A: {drive: A}", WIND_A=source)
    rack.start()
    rack.write("NTH%", 30000)
    rack.run(0.1)
    assert (rack.value("A_OUT%"), rack.value("COUNT%")) == (3, 3)
    assert rack.task("WIND_A").status is Status.ENDED
    rack.operations.run("WIND_A")
    rack.run(0.0006)
    assert (rack.value("A_OUT%"), rack.value("COUNT%")) == (4, 4)
