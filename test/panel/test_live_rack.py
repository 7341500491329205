"""A rack in this process as a source of the panel: values, forces, faults, what stopped it, operations; without ROS."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from rack.helpers import rack_at, rack_from, run_for

from automax_ros.core.diagnostics import SourceText
from automax_ros.messages.stream.stream import RackStream
from automax_ros.panel.commands import OPERATIONS
from automax_ros.panel.live_rack import RackSource
from automax_ros.panel.source import Asked, RequestRefused
from automax_ros.rack.rack import Rack
from automax_ros.runtime.time.turns import Turns

CONFIGS = Path(__file__).parents[2] / "config"
DRIVE, SECTION = CONFIGS / "dc_drive" / "rack.yaml", CONFIGS / "section_drive" / "rack.yaml"
YAML = """\
rack: LINE1
operator: true
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {SPEED: {priority: 4}}}
  2: {module: 57C402}
common:
  REF%: {unit: fpm, scale: {counts: [0, 4095], value: [0.0, 2500.0]}, description: "a <b>reference</b>"}
  TABLE%(3): {}
  LAMP@: {slot: 2, register: 0, bit: 3}
  NOTE$: {}
  GO@: {ros: in}
"""
SPEED = """\
10 COMMON REF%, LAMP@, GO@, NOTE$, TABLE%(3)
20 LOCAL KP% [CURRENT=3, HIGH=9, LOW=1, STEP=1], COUNT%, RING%(2), BIG%, TURN%
30 CALL SCAN_LOOP( TICKS=1 )
40 COUNT% = COUNT% + 1
50 RING%(1) = REF% * KP%
60 LAMP@ = REF% > 100
70 IF GO@ THEN BIG% = 30000 * KP%
80 FOR TURN% = 0 TO 1 STEP 1
82 IF TABLE%(0) = 1 THEN TURN% = 0
84 NEXT TURN%
90 END
"""
HOSTILE = (
    "<img src=x onerror=alert(1)>",
    "REF%\x00",
    "\u202eREF%",
    "../../etc/passwd",
    "{verb}",
    "REF%" * 1000,
    "",
    ".",
    "/",
)


def source_of(rack: Rack, **options: Any) -> RackSource:
    return RackSource(rack, Turns().turn, title="a rack", **options)


@pytest.fixture
def rack(tmp_path) -> Rack:
    return rack_from(tmp_path, YAML, SPEED=SPEED)


@pytest.fixture
def source(rack) -> RackSource:
    made = source_of(rack)
    run_for(rack, 0.1)
    return made


def values(source: RackSource, *names: str) -> tuple[Any, ...]:
    return source.frames([Asked(names)])[0].values


def slot(source: RackSource, number: int) -> Mapping[str, Any]:
    return next(item for item in source.status(None)["slots"] if item["slot"] == number)


def lamps(source: RackSource, number: int) -> dict[str, bool]:
    return {lamp["name"]: lamp["on"] for lamp in slot(source, number)["lamps"]}


def test_values_by_names_as_ctl_takes_them(rack, source):
    rack.write("REF%", 7)
    rack.write("TABLE%", 5, element=2)
    rack.run(0.011)
    one, two = source.frames([Asked(("ref%", "TABLE%( 2 )", "speed.ring%(1)", "SPEED.KP%")), Asked(("SPEED.COUNT%",))])
    assert one.values == (7, 5, 21, 3)
    assert two.values == (rack.task("SPEED").value("COUNT%"),)
    assert one.time_ns == two.time_ns == rack.now_ns == 111_000_000
    names = ("NONE%", "TABLE%", "TABLE%(9)", "SPEED.NONE%", "SPEED.REF%", "GONE.COUNT%", "MOTOR/speed_rpm", *HOSTILE)
    assert source.unknown([*names, "REF%"]) == list(names)
    assert values(source, *names) == (None,) * len(names)


def test_hello_names_all_that_has_a_value(source):
    hello = source.hello()
    assert (hello["rack"], hello["kind"], hello["span"], hello["other"]) == ("LINE1", "rack", None, None)
    assert hello["operate"] == {"allowed": True, "why": ""}
    names = {item["name"]: item for item in hello["names"]}
    assert names["REF%"] == {
        "name": "REF%",
        "type": "integer",
        "dims": [],
        "unit": "fpm",
        "scale": {"counts": [0, 4095], "value": [0.0, 2500.0]},
        "text": "a <b>reference</b>",
        "place": "",
        "task": "",
        "tunable": None,
        "writers": [],
        "readers": ["SPEED"],
    }
    assert (names["LAMP@"]["place"], names["GO@"]["place"]) == ("slot 2, register 0, bit 3", "from ROS 2")
    assert (names["LAMP@"]["writers"], names["LAMP@"]["readers"]) == (["SPEED"], [])
    assert names["TABLE%"]["dims"] == [4]
    assert names["SPEED.KP%"]["tunable"] == {"low": 1, "high": 9, "step": 1}
    assert (names["SPEED.COUNT%"]["task"], names["SPEED.COUNT%"]["tunable"]) == ("SPEED", None)
    assert hello["tasks"] == [{"name": "SPEED", "slot": 1, "priority": 4, "period_ms": 5.5, "file": "SPEED.BLK"}]
    simple = [name for name, item in names.items() if not item["dims"]]
    assert source.unknown([*simple, *hello["watch"]]) == []
    json.dumps(hello, allow_nan=False)


def test_hello_of_a_drive_says_what_its_plant_and_its_switches_take():
    source = source_of(rack_at(DRIVE))
    hello = source.hello()
    (plant,) = hello["plants"]
    assert (plant["name"], plant["module_slot"]) == ("MOTOR", 7)
    assert {"name": "MOTOR/speed_rpm", "unit": "rpm"} in plant["signals"]
    assert source.unknown([item["name"] for item in plant["signals"]]) == []
    choices = {item["control"]: item["values"] for item in plant["controls"]}
    assert choices["short_scr"] == [*"123456", *(f"1{number}" for number in range(1, 7))]
    assert (choices["blow_fuse"], choices["repair"], choices["line_sag"]) == (["T1", "T2", "T3"], ["all"], [])
    for control, words in choices.items():
        for word in words:
            assert source.describe("plant", {"name": "MOTOR", "control": control, "value": word})
    assert {"slot": 7, "control": "test_switch", "values": ["A", "B", "centre"]} in hello["switches"]


def test_the_cabinet(rack, source):
    assert slot(source, 0)["title"] == "common memory module"
    assert lamps(source, 0) == {"BAT.OK": True, "SYSTEM WATCHDOG": True}
    one = slot(source, 1)
    assert (one["title"], one["tasks"], one["late"], one["load_percent"]) == ("AutoMax 7010", ["SPEED"], 0, None)
    assert one["display"] == {"code": "", "meaning": "no fault"}
    assert lamps(source, 2) == {**{f"0.{bit}": False for bit in range(16) if bit != 3}, "LAMP@": False}
    rack.write("REF%", 101)
    rack.run(0.011)
    assert lamps(source, 2)["LAMP@"]
    assert source.operate("power", {"what": "off"})["powered"] is False
    assert source.status(None)["powered"] is False
    assert not any(lamps(source, number)[name] for number in range(3) for name in lamps(source, number))
    assert slot(source, 1)["display"] == {"code": "", "meaning": "the power is off"}


def test_a_force_is_shown_held_and_listed(rack, source):
    assert source.describe("force", {"name": "ref%", "value": " 200 "}) == "force REF% to 200: it is 0 now"
    assert values(source, "REF%") == (0,)
    assert source.log(0) == [], "what is only described is not an operation"
    assert source.operate("force", {"name": "ref%", "value": "200"}) == {
        "ok": True,
        "reason": "",
        "before": "0",
        "now": "200",
    }
    rack.write("REF%", 1)
    assert values(source, "REF%") == (200,)
    assert source.status(None)["forced"] == [{"name": "REF%", "value": "200"}]
    (entry,) = source.log(0)
    assert (entry["kind"], entry["what"], entry["text"], entry["ok"]) == ("operation", "force", "REF% = 200", True)
    refused = source.operate("set", {"name": "REF%", "value": "5"})
    assert (refused["ok"], refused["now"]) == (False, "200")
    assert "forced at 200" in refused["reason"]
    (second,) = source.log(entry["n"])
    assert (second["ok"], second["what"]) == (False, "set")
    assert source.describe("unforce", {"names": []}) == "end the force of all that is forced: REF% is forced now"
    assert source.operate("unforce", {"names": []})["forced"] == []
    assert source.status(None)["forced"] == []


@pytest.mark.parametrize(
    ("verb", "fields", "why"),
    [
        ("set", {"name": "RFE%", "value": "1"}, "did you mean REF%"),
        ("set", {"name": "REF%", "value": "40000"}, "it takes a whole number from -32768 to 32767"),
        ("set", {"name": "REF%", "value": "<script>"}, "'<script>' is not a value for REF%"),
        ("set", {"name": "TABLE%", "value": "1"}, "is an array"),
        ("set", {"name": "SPEED.COUNT%", "value": "1"}, "only common variables can be set"),
        ("set", {"name": "NOTE$", "value": "x" * 200}, "a text of at most 31 characters"),
        ("tune", {"name": "SPEED.KP%", "value": "10"}, "lies outside 1 to 9"),
        ("tune", {"name": "SPEED.COUNT%", "value": "1"}, "is not a tunable"),
        ("tune", {"name": "REF%", "value": "1"}, "is not a tunable"),
        ("stop", {"task": "SPED"}, "did you mean SPEED"),
        ("run", {"task": ""}, "no task ''"),
        ("plant", {"name": "MOTOR", "control": "repair", "value": "all"}, "no plant 'MOTOR'"),
        *(("force", {"name": name, "value": "1"}, "") for name in HOSTILE),
    ],
)
def test_what_cannot_be_is_refused_before_it_is_done(rack, source, verb, fields, why):
    before = rack.state()
    with pytest.raises(RequestRefused) as refused:
        source.describe(verb, fields)
    assert why in str(refused.value)
    assert "\x00" not in str(refused.value)
    assert "\u202e" not in str(refused.value)
    answer = source.operate(verb, fields)
    assert answer["ok"] is False
    assert answer["reason"]
    assert rack.state() == before


def test_every_operation_has_words(source):
    fields = {
        "task": "SPEED",
        "what": "off",
        "name": "REF%",
        "value": "1",
        "names": [],
        "control": "test_switch",
        "count": 1,
    }
    named = {"tune": {"name": "SPEED.KP%", "value": "4"}, "plant": {"name": "x", "control": "y", "value": "z"}}
    for verb in OPERATIONS.keys() - {"plant", "web"}:
        assert source.describe(verb, named.get(verb, fields)).strip(": "), verb
    assert source.describe("stop", {"task": "speed"}) == "stop task SPEED: it is running now"
    assert source.describe("stop_all", {}).endswith("1 of 1 tasks run now")


def test_errors_are_listed_with_their_line_and_once_a_second(rack, source):
    rack.write("GO@", True)
    rack.run(2.5)
    errors = [entry for entry in source.log(0) if entry["kind"] == "error"]
    assert [(entry["task"], entry["line"], entry["ok"]) for entry in errors] == [("SPEED", 70, False)] * 3
    assert len({entry["code"] for entry in errors}) == 1
    assert errors[1]["t"] - errors[0]["t"] >= 1_000_000_000
    (task,) = source.status(None)["tasks"]
    assert (task["name"], task["status"], task["mean_us"]) == ("SPEED", "running", None)
    assert task["errors"]["count"] == rack.task("SPEED").errors.count > 400
    first = task["errors"]["entries"][0]
    assert (first["place"], first["line"], first["code"]) == ("first", 70, errors[0]["code"])
    page = source.answer("explain", {"code": errors[0]["code"]})
    assert page["title"] == f"{errors[0]['code']}: {errors[0]['text']}"
    assert len(page["text"].splitlines()) > 5


def test_what_stopped_it_is_explained(rack, source):
    assert source.status(None)["stopped"] is None
    rack.write("TABLE%", 1, element=0)
    rack.run(0.02)
    stopped = source.status(None)["stopped"]
    assert (stopped["code"], stopped["task"], stopped["title"]) == ("14", "SPEED", "STOP ALL (code 14)")
    assert stopped["t"] == 104_500_000
    assert "too many statements" in stopped["reason"]
    code = rack.task("SPEED").errors.entries[-1].problem
    assert stopped["explain"] == source.answer("explain", {"code": code})["text"]
    assert slot(source, 1)["display"]["code"] == "14"
    assert [task["status"] for task in source.status(None)["tasks"]] == ["faulted"]
    entry = source.log(0)[-1]
    assert (entry["what"], entry["task"]) == ("stop_all", "SPEED")
    rack.write("TABLE%", 0, element=0)
    assert not source.operate("run_all", {})["ok"]
    assert source.operate("clear_errors", {"task": ""})["ok"]
    assert source.operate("run_all", {})["message"] == "1 of 1 task run"
    assert source.status(None)["stopped"] is None
    source.operate("stop_all", {})
    by_hand = source.status(None)["stopped"]
    assert (by_hand["code"], by_hand["task"], by_hand["explain"]) == ("", "", "")


@pytest.fixture(scope="module")
def running() -> tuple[Rack, RackSource]:
    """A drive that turns at its speed."""
    rack = rack_at(DRIVE)
    stream = RackStream(rack, 1)
    source = source_of(rack, stream=stream)
    stream.begin()
    run_for(rack, 6.0)
    return rack, source


def test_a_drive_that_turns_and_then_has_a_fault(running):
    rack, source = running
    (drive,) = source.status(None)["drives"]
    assert (drive["plant"], drive["slot"], drive["state"], drive["bridge"]) == ("MOTOR", 7, "run", "forward")
    assert drive["speed_rpm"] == pytest.approx(1200, abs=20)
    assert 30 < drive["delta_deg"] < 180
    assert drive["contactors"] == [{"name": "M", "on": True}]
    assert (list(drive["faults"]), list(drive["broken"])) == ([], [])
    assert set(drive["conducting"]) | set(drive["gates"]) <= set(range(1, 7))
    mean_a, rms_a, rpm = values(source, "MOTOR/current_a", "MOTOR/current_rms_a", "MOTOR/speed_rpm")
    assert 0 < mean_a < rms_a
    assert rpm == drive["speed_rpm"]
    described = source.describe("plant", {"name": "motor", "control": "short_scr", "value": "3"})
    assert described == "plant motor: short_scr 3"
    assert source.operate("plant", {"name": "MOTOR", "control": "short_scr", "value": "3"})["ok"]
    rack.run(1.0)
    (drive,) = source.status(None)["drives"]
    assert list(drive["broken"]) == ["short_scr 3"]
    assert (drive["state"], drive["delta_deg"], drive["contactors"][0]["on"]) == ("standby", None, False)
    assert drive["faults"][0].startswith("instantaneous overcurrent (IOC) at 6.0 s")
    texts = [(entry["kind"], entry["task"], entry["text"]) for entry in source.log(0)]
    place = texts.index(("operation", "", "MOTOR short_scr 3"))
    assert texts[place + 1] == ("error", "CML", "drive fault: instantaneous overcurrent (IOC)")
    json.dumps(source.status(None), allow_nan=False)


def test_a_rack_that_is_watched_runs_as_one_that_is_not():
    def state(*, watched: bool) -> Any:
        rack = rack_at(DRIVE)
        source = source_of(rack) if watched else None
        run_for(rack)
        names = [item["name"] for item in source_of(rack_at(DRIVE)).hello()["names"]]
        for _ in range(10):
            rack.run(0.05)
            if source is not None:
                source.frames([Asked((*names, "MOTOR/speed_rpm"))])
                source.status(None)
        return rack.state()

    assert state(watched=True) == state(watched=False)


def test_a_simulated_rack_is_halted_and_stepped_by_its_turns(rack):
    turns = Turns()
    source = RackSource(rack, turns.turn, title="simulated", pace=turns)
    run_for(rack, 0.1)
    assert not source.operate("step", {"what": "scan"})["ok"]
    assert source.operate("pause", {})["ok"]
    assert turns.halted
    assert source.status(None)["halted"] is True
    scans = rack.statistics["SPEED"].scans
    assert source.operate("step", {"what": "scan", "task": "SPEED", "count": 2})["scans"] == 2
    assert rack.statistics["SPEED"].scans == scans + 2
    assert source.operate("resume", {})["ok"]
    assert not turns.halted


def test_without_a_past_and_without_an_operator(tmp_path):
    rack = rack_from(tmp_path, YAML.replace("operator: true", "operator: false"), SPEED=SPEED)
    source = source_of(rack)
    assert source.hello()["operate"] == {"allowed": False, "why": "its rack file does not say operator: true"}
    for what, fields in (("scan", {"task": "SPEED", "scan": 1}), ("history", {}), ("seek", {"t": 0})):
        with pytest.raises(RequestRefused, match="no past"):
            source.answer(what, fields)
    with pytest.raises(RequestRefused, match="no problem code"):
        source.answer("explain", {"code": "<script>"})
    with pytest.raises(RequestRefused, match="no task 'NONE'"):
        source.answer("diagram", {"task": "NONE"})
    with pytest.raises(RequestRefused, match="one version"):
        source.answer("diagram", {"task": "speed", "which": "other"})


def test_a_diagram_is_that_of_the_present_source(rack, source):
    before = source.answer("diagram", {"task": "speed"})["source"]
    assert any("RING%" in row["text"] for row in before)
    rack.operations.reload("SPEED", SourceText("SPEED.BLK", SPEED.replace("RING%", "ROUND%")))
    after = source.answer("diagram", {"task": "SPEED", "which": "own"})["source"]
    assert any("ROUND%" in row["text"] for row in after)
    assert values(source, "SPEED.RING%(1)", "SPEED.COUNT%") == (None, 0)


def test_a_run_that_has_ended_says_so(source):
    assert not source.is_over
    source.over = "the run is over"
    assert source.is_over
    assert source.status(None)["over"] == "the run is over"


def test_loads_are_measured_on_the_wall_clock(tmp_path, monkeypatch):
    clock = iter(range(0, 10**18, 1_000_000))
    rack = rack_from(tmp_path, YAML, SPEED=SPEED)
    timed = Rack(rack.config, stopwatch=lambda: next(clock))
    now_ns = 5_000_000_000
    monkeypatch.setattr("automax_ros.panel.live_rack.time.monotonic_ns", lambda: now_ns)
    source = source_of(timed, measured=True, operators=["operator node of /line1"])
    run_for(timed, 1.0)
    assert slot(source, 1)["load_percent"] is None
    now_ns += 2_000_000_000
    status = source.status(None)
    busy_ns = timed.statistics["SPEED"].total_ns
    assert status["slots"][1]["load_percent"] == pytest.approx(100 * busy_ns / 2e9)
    assert status["tasks"][0]["mean_us"] == pytest.approx(1000.0)
    assert status["operators"] == ["operator node of /line1"]
    assert math.isfinite(status["tasks"][0]["longest_us"])
