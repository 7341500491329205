"""The force table: locals of tasks are lines of it, next to commons, whatever happens to tasks and rack."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.operator.requests import OperatorRequests
from automax_ros.rack.operator.retention import Retention
from automax_ros.rack.rack import Rack
from automax_ros.runtime.memory.views import MemoryValueError
from automax_ros.scenario.report import report_of
from rack.helpers import Told
from rack.modules.udc_racks import built as udc_rack

YAML = """\
rack: LINE1
{top}slots:
  0: {{module: 57C413}}
  1: {{module: 57C435, tick_ms: 5.5, tasks: {{LINE: {{priority: 4}}, BACK: {{file: BACK.BAS, priority: 9}}}}}}
common:
  REF%: {{}}
  SEEN%: {{}}
  FORCINGSTATUS@: {{}}
"""
LINE = """\
10 COMMON REF%, SEEN%
20 LOCAL COUNT%, SUM!, GAIN, ON@, TEXT$:8, LIST%(3), KP [CURRENT=0.5, HIGH=2.0, LOW=0.0, STEP=0.1]
100 CALL SCAN_LOOP(TICKS=1)
110 COUNT% = COUNT% + 1
120 SUM! = SUM! + 2
130 GAIN = GAIN + 0.5
140 ON@ = NOT ON@
150 SEEN% = COUNT%
900 END
"""
BACK = "10 LOCAL N%\n20 N% = N% + 1\n30 DELAY 1 TICKS\n40 GOTO 20\n50 END\n"


def line1(folder: Path, top: str = "", line: str = LINE) -> Rack:
    (folder / "BACK.BAS").write_text(BACK)
    return build(folder, YAML.format(top=top), LINE=line)


@pytest.fixture(params=["", "execution: modeled\n"], ids=["ideal", "modeled"])
def rack(request, tmp_path):
    rack = line1(tmp_path, request.param)
    rack.start()
    rack.run(0.05)
    return rack


def table(rack: Rack) -> list[tuple[str, object]]:
    return [(item.name, item.value) for item in rack.forces()]


def test_locals_of_each_simple_type_are_held_and_listed_after_commons(rack):
    told = Told()
    rack.observe(told)
    values = {"LINE.COUNT%": 3, "line . sum!": -70000, "LINE.GAIN": 0.25, "LINE.ON@": True, "BACK.N%": 9, "REF%": 1}
    for name, value in values.items():
        rack.adjust.force(name, value)
    lines = [("REF%", 1), ("LINE.COUNT%", 3), ("LINE.SUM!", -70000), ("LINE.GAIN", 0.25), ("LINE.ON@", True)]
    assert table(rack) == [*lines, ("BACK.N%", 9)]
    assert report_of(rack)["forced"] == [name for name, _ in table(rack)]
    rack.run(0.05)
    line, back = rack.task("LINE"), rack.task("BACK")
    assert [line.value(name) for name in ("COUNT%", "SUM!", "GAIN", "ON@")] == [3, -70000, 0.25, True]
    assert (back.value("N%"), rack.value("SEEN%"), rack.value("FORCINGSTATUS@")) == (9, 3, True)
    scans = line.scan_number
    rack.adjust.unforce()
    assert (table(rack), rack.value("FORCINGSTATUS@")) == ([], False)
    rack.run(0.05)
    assert rack.value("SEEN%") == 3 + line.scan_number - scans
    assert back.value("N%") > 9
    forces = [item for item in told.operations if item.what == "force"]
    assert [(item.task, item.detail) for item in forces[:2]] == [
        ("LINE", "LINE.COUNT% = 3"),
        ("LINE", "LINE.SUM! = -70000"),
    ]
    assert told.operations[-1].detail == " ".join(name for name, _ in [*lines, ("BACK.N%", 9)])


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("LINE.TEXT$", "it is a string"),
        ("LINE.LIST%(1)", "it is an element of an array"),
        ("LINE.KP", "it is a tunable"),
    ],
)
def test_what_is_not_a_simple_local_cannot_be_forced(rack, name, why):
    with pytest.raises(MemoryValueError, match=why):
        rack.force(name, 1)
    with pytest.raises(KeyError):
        rack.force("LINE.REF%", 1)
    assert (table(rack), rack.value("FORCINGSTATUS@")) == ([], False)


def test_a_local_counts_among_the_most_that_are_forced(tmp_path):
    names = [f"N{number}%" for number in range(16)]
    line = LINE.replace("LOCAL ", f"LOCAL {', '.join(names)}, ")
    rack = line1(tmp_path, "executive: 3.9\n", line.replace("TICKS=1", "TICKS=2"))
    rack.force("REF%", 1)
    for name in names[:15]:
        rack.force(f"LINE.{name}", 1)
    for name in ("LINE.N15%", "SEEN%"):
        with pytest.raises(MemoryValueError, match="16 variables are forced, the most with"):
            rack.force(name, 1)
    rack.force("LINE.N3%", 2)
    rack.unforce("LINE.N4%")
    rack.force("SEEN%", 1)
    assert len(rack.forces()) == 16


def test_a_force_survives_what_stops_tasks(rack):
    rack.adjust.force("LINE.COUNT%", 3)
    operations = rack.operations
    operations.stop("LINE")
    operations.run("LINE")
    operations.stop_all("for the test")
    operations.run_all()
    rack.run(0.03)
    operations.power_off()
    operations.power_on(battery=True, auto_run=True)
    rack.run(0.03)
    assert (rack.value("SEEN%"), table(rack), rack.value("FORCINGSTATUS@")) == (3, [("LINE.COUNT%", 3)], True)
    operations.power_off()
    operations.power_on(battery=False, auto_run=True)
    assert (table(rack), rack.value("FORCINGSTATUS@"), rack.task("LINE").value("COUNT%")) == ([], False, 0)
    rack.run(0.03)
    assert rack.value("SEEN%") == rack.task("LINE").scan_number > 2


def test_the_part_before_scan_loop_heeds_a_force(tmp_path):
    rack = line1(tmp_path, line=LINE.replace("100 CALL", "30 COUNT% = 50\n40 SEEN% = COUNT%\n100 CALL"))
    rack.force("LINE.COUNT%", 3)
    rack.task("LINE").run()
    assert rack.value("SEEN%") == 3


def test_of_a_udc_only_what_is_forced_survives_stop_all(tmp_path):
    drive = "10 LOCAL N%, M%\n20 CALL SCAN_LOOP(TICKS=4)\n30 N% = N% + 1\n40 M% = M% + 1\n50 END\n"
    rack = udc_rack(tmp_path, "", WIND_A=drive, WIND_B=drive)
    rack.start()
    task = rack.task("WIND_A")
    rack.adjust.force("WIND_A.N%", 7)
    task.scan(0)
    assert (task.value("N%"), task.value("M%")) == (7, 1)
    rack.operations.stop_all("for the test")
    assert (task.value("N%"), task.value("M%"), table(rack)) == (7, 0, [("WIND_A.N%", 7)])
    rack.operations.power_off()
    rack.operations.power_on()
    assert (task.value("N%"), table(rack)) == (7, [("WIND_A.N%", 7)])


def test_a_reload_releases_what_the_new_source_has_not(rack):
    told = Told()
    rack.observe(told)
    for name, value in {"COUNT%": 3, "GAIN": 0.25, "ON@": True}.items():
        rack.adjust.force(f"LINE.{name}", value)
    text = LINE.replace("GAIN, ON@,", "GAIN [CURRENT=0.5, HIGH=2.0, LOW=0.0, STEP=0.1],")
    text = text.replace("130 GAIN = GAIN + 0.5\n140 ON@ = NOT ON@\n", "")
    rack.operations.reload("LINE", SourceText("LINE.BLK", text))
    rack.run(0.03)
    assert (table(rack), rack.value("SEEN%"), rack.task("LINE").value("GAIN")) == ([("LINE.COUNT%", 3)], 3, 0.5)
    assert [(item.what, item.task, item.detail) for item in told.operations[-2:]] == [
        ("reload", "LINE", ""),
        ("unforce", "LINE", "LINE.GAIN LINE.ON@"),
    ]
    rack.operations.stop("LINE")
    rack.operations.delete("LINE")
    assert (table(rack), rack.value("FORCINGSTATUS@"), rack.task("LINE").value("COUNT%")) == ([], False, 0)
    assert told.operations[-1].detail == "LINE.COUNT%"


@pytest.mark.parametrize("top", ["", "execution: modeled\n"], ids=["ideal", "modeled"])
def test_a_rack_goes_on_from_a_state_with_forced_locals(tmp_path, top):
    """At each of many instants, some in the middle of a modeled scan that ends before the force is heeded."""
    one = line1(tmp_path, top)
    one.start()
    for number in range(60):
        one.run(0.00051)
        one.force("LINE.COUNT%", number)
        if number % 5 == 4:
            one.unforce("LINE.COUNT%")
        other = line1(tmp_path, top)
        other.load(one.state())
        assert other.state() == one.state()
        one.run(0.0021), other.run(0.0021)
        assert other.state() == one.state()
        other.unforce("LINE.COUNT%")
        assert other.value("FORCINGSTATUS@") is False


def test_a_forced_local_outlives_a_run(tmp_path):
    rack = line1(tmp_path)
    retention = Retention(rack, tmp_path / "state")
    rack.start(retention.restore().settings)
    rack.adjust.force("LINE.COUNT%", 3)
    rack.adjust.force("BACK.N%", 4)
    rack.run(0.03)
    assert retention.save()
    assert json.loads(retention.path.read_text())["forced"] == {"LINE.COUNT%": 3, "BACK.N%": 4}
    again = line1(tmp_path, line=LINE.replace("COUNT%", "AMOUNT%"))
    restored = Retention(again, tmp_path / "state").restore()
    assert (restored.forces, table(again)) == (1, [("BACK.N%", 4)])
    assert "LINE.COUNT% was forced and is not defined any more" in restored.notes
    again.start(restored.settings)
    assert again.value("FORCINGSTATUS@") is True


def test_orders_in_words_force_locals(rack):
    orders = OperatorRequests(rack)
    orders.force("line.on@", "on")
    orders.force("LINE.SUM!", "-70000")
    assert orders.forces() == [("LINE.ON@", "TRUE"), ("LINE.SUM!", "-70000")]
    orders.unforce(["LINE.on@"])
    assert table(rack) == [("LINE.SUM!", -70000)]


def test_operations_tell_of_the_force(rack):
    told = Told()
    rack.observe(told)
    rack.force("LINE.COUNT%", 3)
    assert told.operations == []
    rack.adjust.force("LINE.COUNT%", 4)
    assert told.operations == [Operation(rack.now_ns, "force", "LINE", detail="LINE.COUNT% = 4")]
