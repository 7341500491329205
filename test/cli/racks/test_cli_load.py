"""`automax load`: times, shares and totals of a rack, and what it warns of."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from automax_ros.compile.base.cost import Model
from automax_ros.compile.scan_times import ScanTimes
from automax_ros.rackfile.checks.cpu_load import ModuleLoad, TaskLoad, faults
from automax_ros.rackfile.model.config import RackConfig

RACK = """\
rack: PM1
{executive}slots:
  0: {{module: 57C413}}
  1:
    module: 57C435
    tasks:
      SPEED: {{priority: 5}}
      SLOW: {{priority: 9}}
  2: {{module: 57C431, tick_ms: {tick}, tasks: {{OLD: {{priority: 5, file: SPEED.BLK}}}}}}
common:
  REF%: {{}}
  RUN@: {{}}
"""
SPEED = """\
10 COMMON REF%, RUN@
20 LOCAL OUT%
30 CALL SCAN_LOOP(TICKS=2)
40 CALL DIFFERENCE(INPUT1=REF%, INPUT2=100, OUTPUT=OUT%)
50 CALL LAG(INPUT=OUT%, WLG=2.0, OUTPUT=OUT%)
60 END
"""
SLOW = """\
10 COMMON REF%, RUN@
30 CALL SCAN_LOOP(TICKS=10)
40 IF RUN@ THEN
50 CALL DIFFERENCE(INPUT1=REF%, INPUT2=100, OUTPUT=REF%)
60 END_IF
70 END
"""
SPEED_7010 = (80.00 + 2 * 1.6 + 2.5 + 3.8) + 10.80 + 26.52 + (13.82 + 2 * 2.0 + 1.6 + 2.2)
SPEED_6011 = (326 + 2 * 2.4 + 4.4 + 6.8) + 44 + 118 + (60 + 2 * 3.2 + 2.8 + 4.3)
SLOW_7010 = (80.00 + 2 * 1.6 + 2.5 + 3.8) + 4.0 + (13.82 + 2 * 2.0 + 1.6 + 2.2)
"""Summed by hand from table 4; 4.0 is the estimate of an IF."""


@pytest.fixture
def plant(automax):
    def write(executive: str = "", tick: str = "5.5") -> str:
        automax.write("SPEED.BLK", SPEED)
        automax.write("SLOW.BLK", SLOW)
        return automax.write("rack.yaml", RACK.format(executive=executive, tick=tick))

    return write


def test_each_task_and_module_as_json(automax, plant):
    result = automax("load", plant(), "--json")
    assert (result.code, result.err) == (0, "")
    first, second = json.loads(result.out)
    speed, slow = first.pop("tasks")
    assert speed == {
        "task": "SPEED",
        "scan_us": {"least": pytest.approx(SPEED_7010, abs=0.01), "most": pytest.approx(SPEED_7010, abs=0.01)},
        "period_us": 11000.0,
        "load_percent": pytest.approx(100 * SPEED_7010 / 11000, abs=0.01),
        "estimated": False,
    }
    assert slow["scan_us"] == {
        "least": pytest.approx(SLOW_7010, abs=0.01),
        "most": pytest.approx(SLOW_7010 + 10.80, abs=0.01),
    }
    assert (slow["period_us"], slow["estimated"]) == (55000.0, True)
    total = 100 * SPEED_7010 / 11000 + 100 * (SLOW_7010 + 10.80) / 55000
    assert first == {
        "module": "processor_1",
        "model": "7010",
        "tick_ms": 5.5,
        "load_percent": pytest.approx(total, abs=0.01),
    }
    assert second["model"] == "6011"
    assert second["tasks"][0]["scan_us"]["most"] == pytest.approx(SPEED_6011, abs=0.01)


def test_a_table_for_people(automax, plant):
    result = automax("load", plant())
    assert result.out == (
        "processor_1 (7010, tick 5.5 ms): 1.58 %\n"
        "  task   least us  most us  period us  load %\n"
        f"  SPEED    {SPEED_7010:.2f}   {SPEED_7010:.2f}      11000    1.35\n"
        f"  SLOW     {SLOW_7010:.2f}   {SLOW_7010 + 10.8:.2f}      55000    0.23  estimated\n"
        "\n"
        "processor_2 (6011, tick 5.5 ms): 5.25 %\n"
        "  task  least us  most us  period us  load %\n"
        f"  OLD     {SPEED_6011:.2f}   {SPEED_6011:.2f}      11000    5.25\n"
        "\n"
        "estimated: BASIC statements or a drive's loop are in the sum, whose times no manual prints\n"
    )


def test_more_than_all_of_the_time_is_warned_of(automax, plant):
    """One task of 577.5 us takes 57.75 % of 2 x 0.5 ms; two of them take too much."""
    config = plant(tick="0.5")
    text = (
        Path(config).read_text().replace("file: SPEED.BLK}", "file: SPEED.BLK}, OLD2: {priority: 6, file: SPEED.BLK}")
    )
    Path(config).write_text(text)
    result = automax("load", config)
    percent = 2 * 100 * SPEED_6011 / 1000
    assert result.code == 0
    assert f"rack.yaml:9:1: warning[AMX6770]: the tasks of processor_2 take {percent:.2f} % of its time" in result.err


@pytest.mark.parametrize(("model", "warned"), [("57C430A", True), ("57C431", True), ("57C435", False)])
def test_a_current_minor_loop_that_takes_more_than_half_of_a_sixth_is_warned_of(automax, tmp_path, model, warned):
    example = Path(__file__).parents[3] / "config" / "dc_drive"
    for file in example.glob("*.B*"):
        (tmp_path / file.name).write_text(file.read_text())
    (tmp_path / "rack.yaml").write_text((example / "rack.yaml").read_text().replace("57C435", model))
    result = automax("load", tmp_path)
    assert result.code == 0
    assert ("warning[AMX6774]: CML takes " in result.err) == warned
    assert ("more than half of a sixth of a line cycle (2778 us)" in result.err) == warned
    checked = automax("check", tmp_path / "rack.yaml")
    assert checked.code == 0
    assert [line for line in checked.out.splitlines() if "AMX6774" in line] == [
        line for line in result.err.splitlines() if "AMX6774" in line
    ]
    assert ("warning[AMX6774]: CML takes " in checked.out) == warned


@pytest.mark.parametrize(("version", "warned"), [("3.3", True), ("3.4", False), ("4.2", False)])
def test_an_executive_older_than_the_tables(automax, plant, version, warned):
    result = automax("load", plant(f"executive: {version}\n"))
    assert result.code == 0
    assert ("AMX6772" in result.err) == warned
    assert (f"this rack has {version}" in result.err) == warned


def test_a_task_with_errors_is_told_and_left_out(automax, plant):
    config = plant()
    automax.write("SLOW.BLK", SLOW.replace("OUTPUT=REF%", "OUTPUT=NONE%"))
    result = automax("load", config, "--json")
    assert result.code == 1
    assert "SLOW.BLK:4:52: error" in result.err
    assert [task["task"] for task in json.loads(result.out)[0]["tasks"]] == ["SPEED"]


def test_a_rack_file_with_errors(automax):
    result = automax("load", automax.write("rack.yaml", "rack: PM1\nslots: {0: {module: 57C999}}\n"))
    assert (result.code, result.out) == (1, "")
    assert "rack.yaml:2:21: error[AMX6202]" in result.err


@dataclass(frozen=True)
class _Udc:
    """A UDC module with two tasks."""

    name: str = "udc_10"
    line: int = 7
    tick_ns: int = 500_000
    times: Model = Model.UDC


@pytest.mark.parametrize(
    ("a_us", "b_us", "ticks", "code"),
    [
        (900.0, 600.0, 3, None),  # exactly 3 ticks of the four that it has
        (900.0, 1100.01, 5, "AMX6770"),
        (9000.0, 1000.0, 20, "AMX6770"),
        (9000.0, 1000.01, 21, "AMX6771"),
    ],
)
def test_least_ticks_of_a_udc(a_us, b_us, ticks, code):
    """The fewest TICKS are the next whole number of (A + B) / 500 us; above 20 it cannot run (53.2)."""
    tasks = [
        TaskLoad(name, ScanTimes(0, round(us * 1000), estimated=False), period_ns=2_000_000)
        for name, us in (("WIND_A", a_us), ("WIND_B", b_us))
    ]
    load = ModuleLoad(_Udc(), "UDC", tuple(tasks))  # type: ignore[arg-type]
    assert load.least_ticks == ticks
    config = RackConfig("PM1", "pm1", Path("rack.yaml"), "", operator=False, modules=(), variables=())
    assert [item.code for item in faults(config, [load])] == ([code] if code else [])


def test_what_latching_registers_of_a_57c406_costs_it_is_told(automax, tmp_path):
    """52.7: a control-block task reads them at each scan; the estimate is 5 us each."""
    example = Path(__file__).parents[3] / "config" / "dc_drive"
    for file in example.glob("*.B*"):
        (tmp_path / file.name).write_text(file.read_text())
    (tmp_path / "rack.yaml").write_text((example / "rack.yaml").read_text())
    assert "accesses_57c406" not in automax("load", tmp_path, "--json").out
    point = next(
        line.split(":")[0].strip() for line in (tmp_path / "rack.yaml").read_text().splitlines() if "4146" in line
    )
    cml = (tmp_path / "CML.BLK").read_text().replace("COMMON CUR_REF%", f"COMMON {point}, CUR_REF%")
    (tmp_path / "CML.BLK").write_text(cml)
    tasks = [task for module in json.loads(automax("load", tmp_path, "--json").out) for task in module["tasks"]]
    assert [task["accesses_57c406"] for task in tasks if "accesses_57c406" in task] == [{"7": 1}]
    told = "CML latches 1 register of the 57C406 in slot 7 each scan: 0.18 % of the time of its microprocessor (52.7)"
    assert told in automax("load", tmp_path).out
