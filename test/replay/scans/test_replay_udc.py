"""Recordings of racks with a UDC: its scans, copies and interrupts replay bit for bit."""

from __future__ import annotations

import pytest

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from automax_ros.replay.scans.report import Difference, ReplayReport
from replay.replays import edited, recorded, replayed

YAML = """\
rack: LINE1
{top}slots:
  0: {{module: 57C413}}
  1: {{module: 57C435, tick_ms: 5.5, tasks: {{SPEED: {{priority: 4}}, WORK: {{priority: 8}}}}}}
  10: {{module: 57552, tasks: {{WIND_A: {{drive: A}}, WIND_B: {{drive: B}}}}}}
common:
  CCLK@: {{slot: 10, register: 2000, bit: 6}}
  ISCR%: {{slot: 10, register: 2000}}
  NTH%: {{slot: 10, register: 2001}}
  REF%: {{slot: 10, register: 300}}
  A_OUT%: {{slot: 10, register: 302}}
  B_OUT%: {{slot: 10, register: 304}}
  RUN@: {{slot: 10, register: 306, bit: 2}}
  ON@: {{slot: 10, register: 308, bit: 2}}
  GAIN: {{slot: 10, register: 310}}
  SLOW%: {{slot: 10, register: 1300}}
  BACK!: {{slot: 10, register: 1302}}
  FB%: {{slot: 10, register: 207, ros: in}}
  SEEN%: {{}}
"""
SPEED = """\
10 COMMON REF%, ISCR%, SLOW%, BACK!, NTH%, GAIN, RUN@
20 LOCAL N%
30 EVENT NAME=UDC_INT, INTERRUPT_STATUS=ISCR%, TIMEOUT=100
40 NTH% = 4
100 CALL SCAN_LOOP(TICKS=4, EVENT=UDC_INT)
110 CALL SUMMER(INPUT1=SLOW%, INPUT2=3, OUTPUT=REF%)
120 BACK! = BACK! + SLOW%
130 GAIN = GAIN + 0.25
140 RUN@ = SLOW% > 20
900 END
"""
WORK = """\
10 COMMON A_OUT%, B_OUT%, SEEN%, ON@
100 CALL SCAN_LOOP(TICKS=2)
110 SEEN% = A_OUT% + B_OUT%
900 END
"""
A = """\
10 COMMON CCLK@, REF%, A_OUT%, FB%, RUN@, GAIN, SLOW%, BACK!
20 LOCAL N%, X
30 CCLK@ = TRUE
100 CALL SCAN_LOOP(TICKS=4)
110 CALL LAG(INPUT=REF%, WLG=50.0, RESET=FALSE, OUTPUT=A_OUT%)
120 N% = N% + 1
130 IF RUN@ THEN N% = N% + FB%
140 SLOW% = N%
150 X = GAIN * 2.0 + BACK!
900 END
"""
B = """\
10 COMMON A_OUT%, B_OUT%, ON@, FB%
100 CALL SCAN_LOOP(TICKS=4)
110 CALL SUMMER(INPUT1=A_OUT%, INPUT2=FB%, OUTPUT=B_OUT%)
120 ON@ = FB% > 2
900 END
"""
SOURCES = {"SPEED": SPEED, "WORK": WORK, "WIND_A": A, "WIND_B": B}


def turning(rack: Rack, number: int) -> None:
    rack.write("FB%", number * 7 % 23)
    if number % 9 == 4:
        rack.force("A_OUT%", 5)
    if number % 9 == 7:
        rack.unforce("A_OUT%")


@pytest.fixture(scope="module", params=["", "execution: modeled\n"], ids=["ideal", "modeled"])
def bag(tmp_path_factory, request):
    folder = tmp_path_factory.mktemp("udc")
    return recorded(folder / "rack", turning, yaml=YAML.format(top=request.param), **SOURCES)


def test_a_udc_replays_bit_for_bit(bag):
    report = replayed(bag)
    assert report.identical, report.first
    assert {task.name for task in report.tasks if task.scans > 100} == set(SOURCES)


@pytest.mark.parametrize("from_ms", [150, 703, 1500])
def test_a_range_replays_too(bag, from_ms):
    assert replayed(bag, from_ns=from_ms * 10**6).identical


def named(report: ReplayReport) -> dict[str, Difference]:
    """Return what differs by name, the registers of the module left out."""
    return {item.name: item for item in report.differences if not item.name.startswith("SLOT:")}


def test_an_edited_task_differs_where_it_does(bag):
    report = replayed(bag, {"WIND_B": edited(B, ("INPUT1=A_OUT%, INPUT2=FB%", "INPUT1=A_OUT%, INPUT2=700"))})
    assert report.first is not None
    assert (report.first.task, report.first.scan) == ("WIND_B", 1)
    assert set(named(report)) == {"B_OUT%"}
    assert replayed(bag, {"WIND_B": B.replace("FB%", "  FB%")}).identical


def test_an_edited_task_finds_its_own_output_again(bag):
    """What the edited task has written it reads in the next scan: the recorded copies out are its own writes."""
    counting = edited(A, ("120 N% = N% + 1\n", "120 N% = SLOW% + 2\n"))
    difference = named(replayed(bag, {"WIND_A": counting}))["SLOW%"]
    assert difference.first.scan == 1
    assert difference.greatest is not None
    assert difference.greatest.difference > 500


def operating(rack: Rack, number: int) -> None:
    turning(rack, number)
    if number == 3:
        rack.operations.stop("WIND_B")
    if number == 5:
        rack.operations.run("WIND_B")
    if number == 7:
        rack.operations.stop_all("for a test")
    if number == 8:
        rack.operations.run_all()
    if number == 10:
        rack.operations.reload("WIND_A", SourceText("WIND_A.BLK", edited(A, ("N% = N% + 1\n", "N% = N% + 3\n"))))
    if number == 13:
        rack.operations.power_off()
    if number == 14:
        rack.operations.power_on()
        rack.operations.run_all()


@pytest.mark.parametrize("top", ["", "execution: modeled\n"], ids=["ideal", "modeled"])
def test_an_operated_udc_replays_bit_for_bit(tmp_path, top):
    """Its locals are 0 after STOP ALL and a power cycle, here as there."""
    report = replayed(recorded(tmp_path / "rack", operating, yaml=YAML.format(top=top), **SOURCES))
    assert report.identical, (report.first, report.differences)
    scans = {task.name: task.scans for task in report.tasks}
    assert min(scans["WIND_A"], scans["WIND_B"]) > 600


def operated(rack: Rack, number: int) -> None:
    """Stop and start it in all ways, the last time without the battery."""
    turning(rack, number)
    steps = {
        5: lambda: rack.operations.stop_all("operator"),
        6: rack.operations.run_all,
        9: lambda: rack.operations.power(30_000_000),
        12: rack.operations.run_all,
        15: lambda: rack.operations.power(0, battery=False),
        16: rack.operations.run_all,
    }
    steps.get(number, lambda: None)()


@pytest.mark.parametrize("top", ["", "execution: modeled\n"], ids=["ideal", "modeled"])
def test_a_udc_that_loses_its_locals_loses_them_in_the_replay(tmp_path, top):
    keeping = "120 N% = N% + 1\n"
    text = edited(A, ("30 CCLK@ = TRUE\n", "30 CCLK@ = TRUE\n40 N% = N% + 1000\n"))
    assert keeping in text
    report = replayed(recorded(tmp_path / "rack", operated, yaml=YAML.format(top=top), **{**SOURCES, "WIND_A": text}))
    assert report.identical, report.first
    assert {task.name for task in report.tasks if task.scans > 100} == set(SOURCES)
