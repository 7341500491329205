"""Webs of a running rack: feeds, operators, what is kept; the unwinder of docs/webs.md from full to core."""

from __future__ import annotations

import json
from math import exp, pi
from pathlib import Path

import pytest
from docs.fences import ROOT, fences

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.requests import VERBS, OperatorRequests
from automax_ros.rack.operator.retention import Retention
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack, RackState
from automax_ros.rackfile.plant_numbers import plant_number, with_numbers
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import read_for_rack
from rack.helpers import Told, config_at, rack_at, run_for, written_in

HELD = """\
rack: LINE1
{auto}slots:
  0: {{module: 57C435}}
plants:
  FIRST:
    motor: dc_150hp_500v
    gear: 4.0
    roller: {{diameter_m: 0.5}}
    load: {{speed_rpm: 600}}
    feeds: {{MPS: {{signal: web_mps}}}}
  SECOND: {{motor: dc_150hp_500v, gear: 4.0, roller: {{diameter_m: 0.5}}, load: {{speed_rpm: {second}}}}}
webs:
  W1:
    from: FIRST
    to: SECOND
    length_m: 4.0
    stiffness_n: 2.0e5
    feeds:
      NEWTONS: {{signal: tension_n}}
      TENS%: {{signal: tension_n, scale: {{counts: [0, 4095], value: [0.0, 1000.0]}}}}
      BROKEN@: {{signal: broken}}
      TORN%: {{signal: broken}}
common:
  MPS: {{}}
  NEWTONS: {{}}
  TENS%: {{}}
  BROKEN@: {{}}
  TORN%: {{}}
"""
MPS = 600 * pi / 30 / 4 * 0.25
PLAIN = "rack: LINE1\nslots:\n  0: {module: 57C435}\nplants:\n  FAN: {motor: dc_150hp_500v}\n"


def held(folder: Path, second: float = 600.6, auto: str = "") -> Rack:
    return rack_at(written_in(folder, HELD.format(second=second, auto=auto)))


def test_a_tension_is_fed_as_the_closed_form_has_it(tmp_path):
    rack = held(tmp_path)
    rack.start()
    ratio, tau_s = 600.6 / 600, 4.0 / (MPS * 600.6 / 600)
    for second in range(1, 6):
        rack.run(1.0)
        m = 4.0 / ratio + (4.0 - 4.0 / ratio) * exp(-second / tau_s)
        expected = 2e5 * (4.0 / m - 1.0)
        assert rack.value("NEWTONS") == pytest.approx(expected, rel=1e-3)
        assert rack.value("TENS%") == pytest.approx(expected * 4.095, rel=1e-3, abs=1)
        assert rack.value("MPS") == pytest.approx(MPS, rel=1e-6)
    assert (rack.value("BROKEN@"), rack.value("TORN%")) == (False, 0)


def test_the_parts_have_names(tmp_path):
    rack = run_for(held(tmp_path), 0.1)
    assert list(rack.plants) == ["FIRST", "SECOND"]
    assert list(rack.plants.ends) == ["FIRST", "SECOND"]
    assert list(rack.plants.webs) == ["W1"]
    assert list(rack.state().plants) == ["FIRST", "SECOND", "FIRST.surface", "SECOND.surface", "web W1"]
    assert rack.plants.reader("W1", "tension_n")() == rack.plants.webs["W1"].tension_n
    assert rack.plants.reader("FIRST", "web_mps")() == pytest.approx(MPS)
    assert rack.plants.reader("FIRST", "speed_rpm")() == pytest.approx(600)
    with pytest.raises(KeyError):
        rack.plants.reader("FIRST", "tension_n")


def test_an_operator_breaks_threads_and_changes_a_web(tmp_path):
    rack, told = held(tmp_path), Told()
    rack.observe(told)
    run_for(rack, 2.0)
    requests = OperatorRequests(rack)
    VERBS["web"].act(requests, name="w1", control="stiffness_n", value="1e5")
    rack.run(0.001)
    assert rack.value("NEWTONS") == pytest.approx(172.2 / 2, rel=0.01)
    with pytest.raises(OperationRefused, match="web W1 is not broken: there is nothing to thread"):
        requests.web("W1", "thread")
    rack.run(0.001)
    assert rack.value("NEWTONS") > 50
    requests.web("W1", "break")
    rack.run(0.01)
    assert (rack.value("NEWTONS"), rack.value("BROKEN@"), rack.value("TORN%")) == (0.0, True, 1)
    with pytest.raises(OperationRefused, match=r"cannot be threaded while an end runs at 3\.93 m/s"):
        requests.web("W1", "thread")
    assert [(item.what, item.detail, item.ok) for item in told.operations if item.what == "web"] == [
        ("web", "W1 stiffness_n 1e5", True),
        ("web", "W1 thread", False),
        ("web", "W1 break", True),
        ("web", "W1 thread", False),
    ]


@pytest.mark.parametrize(
    ("verb", "of", "control", "value", "reason"),
    [
        ("web", "W2", "break", "", "the rack has no web 'W2'"),
        ("web", "W1", "tear", "", "a web has no 'tear'"),
        ("web", "W1", "break", "now", "break cannot be 'now': it takes no value"),
        ("web", "W1", "stiffness_n", "10", "stiffness_n cannot be '10': it takes N, 100 to 1e9"),
        ("plant", "FIRST", "splice", "1.0", "only a roll can be spliced"),
        ("plant", "FIRST", "slip", "1.5", "slip cannot be '1.5'"),
        ("plant", "FIRST", "wind", "1", "a plant has no 'wind'"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_reason(tmp_path, verb, of, control, value, reason):
    rack = run_for(held(tmp_path), 0.1)
    with pytest.raises(OperationRefused, match=reason):
        getattr(SwitchOperations(rack), verb)(of, control, value)


def test_a_plant_without_a_roll_is_not_spliced(tmp_path):
    rack = run_for(rack_at(written_in(tmp_path, PLAIN)), 0.01)
    with pytest.raises(OperationRefused, match="plant FAN has neither roll nor roller"):
        SwitchOperations(rack).plant("FAN", "splice", "1.0")
    with pytest.raises(OperationRefused, match="the rack has no web 'W1': it has none"):
        SwitchOperations(rack).web("W1", "break")


def test_stimuli_do_the_same_at_their_time(tmp_path):
    rack, told = held(tmp_path, 600.0), Told()
    rack.observe(told)
    (tmp_path / "do.yaml").write_text(
        "- {at: 0.5, web: {w1: {stiffness_n: 1.5e5}}}\n"
        "- {at: 0.6, web: {W1: break}}\n"
        "- {at: 0.7, plant: {SECOND: {slip: 0.4}}}\n"
        "- {at: 0.8, plant: {SECOND: {repair: all}}}\n"
    )
    stimuli = read_for_rack(tmp_path / "do.yaml", rack)
    player = StimuliPlayer(stimuli.stimuli, rack.scheduler)
    rack.start(first=player.begin)
    rack.run(0.75)
    assert rack.plants.ends["SECOND"].slip == 0.4
    assert rack.plants["SECOND"].notes == ["slip 0.4"]
    rack.run(0.25)
    assert rack.plants["SECOND"].notes == []
    assert [(item.at_ns, item.detail) for item in told.operations if item.what in ("web", "plant")] == [
        (500_000_000, "W1 stiffness_n 1.5e5"),
        (600_000_000, "W1 break"),
        (700_000_000, "SECOND slip 0.4"),
        (800_000_000, "SECOND repair all"),
    ]


@pytest.mark.parametrize(
    ("entry", "code", "message"),
    [
        ("{W1: {stiffness_n: 10}}", "AMX6736", "stiffness_n of web W1 cannot be '10': it takes N, 100 to 1e9"),
        ("{W1: stiffness_n}", "AMX6736", "stiffness_n of web W1 needs a value: it takes N, 100 to 1e9"),
        ("{W2: break}", "AMX6742", "the rack has no web 'W2' that can be operated"),
        ("{W1: braek}", "AMX6742", "web W1 has no control 'braek'"),
        ("{W1: {}}", "AMX6008", "web W1 names nothing"),
        ("{W1: {break: 7}}", "AMX6736", "break of web W1 cannot be '7': it takes no value"),
    ],
)
def test_wrong_stimuli_are_told_before_the_run(tmp_path, entry, code, message):
    rack = held(tmp_path)
    (tmp_path / "do.yaml").write_text(f"- {{at: 0.5, web: {entry}}}\n")
    found = read_for_rack(tmp_path / "do.yaml", rack)
    assert [(item.code, item.message) for item in found.diagnostics] == [(code, message)]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("PRESS: {splice: 1.25}", "splice of PRESS: only a roll can be spliced, and this plant has a roller"),
        ("UNWIND: {slip: 0.4}", "slip of UNWIND: only a roller can slip, and this plant has a roll"),
        ("UNWIND: {splice: 0.1}", "splice of UNWIND: the roll's diameter of 0.1 m is less than the 0.15 m of its core"),
        ("UNWIND: {splice: 11}", "splice of plant UNWIND cannot be '11'"),
        ("PRESS: {slip: 1.5}", "slip of plant PRESS cannot be '1.5'"),
    ],
)
def test_what_a_roll_can_never_do_is_told_before_the_run_with_its_line(tmp_path, entry, message):
    rack = unwinder(tmp_path)
    (tmp_path / "do.yaml").write_text(f"- {{at: 0.5, web: {{W1: break}}}}\n- {{at: 1.0, plant: {{{entry}}}}}\n")
    found = read_for_rack(tmp_path / "do.yaml", rack)
    assert found.stimuli is None
    (problem,) = found.diagnostics
    assert (problem.code, problem.span.line) == ("AMX6736", 2)
    assert problem.message.startswith(message)


def test_a_splice_of_a_plant_without_a_roll_is_told_before_the_run(tmp_path):
    rack = rack_at(written_in(tmp_path, PLAIN))
    (tmp_path / "do.yaml").write_text("- {at: 0.5, plant: {FAN: {splice: 1.0}}}\n")
    (problem,) = read_for_rack(tmp_path / "do.yaml", rack).diagnostics
    assert problem.message == "splice of FAN: plant FAN has neither roll nor roller"


def test_a_power_cycle_leaves_the_web_as_it_hangs(tmp_path):
    rack = run_for(held(tmp_path), 2.0)
    before = rack.plants.webs["W1"].tension_n
    rack.operations.power_off()
    rack.run(2.0)
    assert rack.plants.reader("W1", "tension_n")() > before
    rack.operations.power_on()
    rack.run(0.01)
    assert rack.value("NEWTONS") == pytest.approx(196.1, rel=1e-3)


EXAMPLE = {fence.file: fence.text for fence in fences(ROOT / "docs" / "webs.md") if fence.file}


def unwinder(folder: Path, diameter_m: float = 1.25, more: str = "") -> Rack:
    """The rack of the page, with another roll; ``more`` stands below its name."""
    path = written_in(folder, EXAMPLE["rack.yaml"], UNW_A=EXAMPLE["UNW_A.BLK"])
    (folder / "start.yaml").write_text(EXAMPLE["start.yaml"])
    config = config_at(path)
    other = with_numbers(config.text, {plant_number(config, "UNWIND.roll.diameter_m"): str(diameter_m)})
    path.write_text(other.replace("rack: MYLINE\n", f"rack: MYLINE\n{more}"))
    return rack_at(path)


def play(rack: Rack, folder: Path) -> None:
    rack.start(first=StimuliPlayer(read_for_rack(folder / "start.yaml", rack).stimuli, rack.scheduler).begin)


@pytest.mark.parametrize("more", ["", "execution: modeled\n"], ids=["ideal", "modeled"])
@pytest.mark.parametrize("diameter_m", [1.25, 0.16])
def test_the_unwinder_of_the_page_is_stable_from_full_to_core(tmp_path, diameter_m, more):
    rack = unwinder(tmp_path, diameter_m, more)
    play(rack, tmp_path)
    rack.run(9.9)
    # At the core a count of current is 11 N, and the loop's own slow mode has a second and a half.
    assert rack.value("TENS%") / 4.095 == pytest.approx(400, abs=15)
    rack.run(7.0)
    settled = []
    for _ in range(30):
        rack.run(0.1)
        settled.append(rack.value("TENS%") / 4.095)
    assert max(settled) - min(settled) < 10
    assert settled[-1] == pytest.approx(600, abs=6)
    assert not rack.value("BROKEN@")


def test_a_roll_that_shrinks_to_its_core_keeps_its_tension_until_the_tail_goes(tmp_path):
    rack = unwinder(tmp_path)
    path = rack.config.path
    # A board of 6 mm in place of paper: 14 m are on the roll, and it is empty half a minute later.
    stock = "diameter_m: 0.36, core_m: 0.15, width_m: 2.5, caliper_um: 6000, density_kg_m3: 780"
    path.write_text(EXAMPLE["rack.yaml"].replace(EXAMPLE["rack.yaml"].split("roll: {")[1].split("}")[0], stock, 1))
    rack = rack_at(path)
    play(rack, tmp_path)
    rack.run(14.0)
    looked, diameters = [], []
    while not rack.value("BROKEN@"):
        rack.run(0.5)
        looked.append(rack.value("TENS%") / 4.095)
        diameters.append(rack.plants.ends["UNWIND"].diameter_m)
        assert rack.now_ns < 120e9
    assert min(looked[:-1]) > 560
    assert max(looked[:-1]) < 700  # Near the core each turn makes the roll a twentieth faster.
    assert diameters[0] > 0.3
    assert diameters[-1] == pytest.approx(0.15, abs=0.01)
    assert rack.plants.ends["UNWIND"].wound_m == 0.0


def test_the_same_run_has_the_same_bits_and_a_restored_state_goes_on_alike(tmp_path):
    first, second = unwinder(tmp_path), unwinder(tmp_path)
    for rack in (first, second):
        play(rack, tmp_path)
        rack.run(3.5)
    state = first.state()
    assert as_text(state) == as_text(second.state())
    other = unwinder(tmp_path)
    other.load(state)
    for rack in (first, other):
        rack.run(0.7)
        SwitchOperations(rack).plant("UNWIND", "splice", "1.0")
        SwitchOperations(rack).web("W1", "stiffness_n", "1e5")
        rack.run(0.7)
    assert as_text(other.state()) == as_text(first.state())


def test_a_roll_begins_with_the_bits_that_it_is_restored_with(tmp_path):
    """0.6 m on a core of 0.15 m: the radius of the length that is wound is not half of the diameter in the last bit."""
    rack, other = unwinder(tmp_path, 0.6), unwinder(tmp_path, 0.6)
    for web in (rack, other):
        web.plants.webs["W1"].part()
    other.load(rack.state())
    assert other.plants.ends["UNWIND"].radius_m == rack.plants.ends["UNWIND"].radius_m
    assert other.plants["UNWIND"].motor.inertia_kg_m2 == rack.plants["UNWIND"].motor.inertia_kg_m2


def as_text(state: RackState) -> str:
    return json.dumps([state.plants, state.image, state.now_ns], default=str)


def test_a_state_of_another_line_is_refused(tmp_path):
    rack = unwinder(tmp_path)
    state = {**rack.plants.state()}
    del state["web W1"]
    with pytest.raises(ValueError, match="other plants"):
        rack.plants.load(state | {"web W9": {}})


def test_the_web_on_rolls_is_kept_between_two_runs(tmp_path):
    rack = unwinder(tmp_path)
    kept = Retention(rack, tmp_path / "state")
    kept.restore()
    play(rack, tmp_path)
    rack.run(4.0)
    end, span = rack.plants.ends["UNWIND"], rack.plants.webs["W1"]
    kept.save()
    again = unwinder(tmp_path)
    restored = Retention(again, tmp_path / "state").restore()
    assert restored.notes == ()
    after = again.plants.ends["UNWIND"]
    assert (after.wound_m, after.web_m, after.turns) == (end.wound_m, end.web_m, end.turns)
    assert after.diameter_m == pytest.approx(end.diameter_m, rel=1e-6)
    assert after.diameter_m < 1.25
    assert after.motor.inertia_kg_m2 == pytest.approx(end.motor.inertia_kg_m2, rel=1e-6)
    assert not again.plants.webs["W1"].broken
    assert again.plants.webs["W1"].m == span.m
    assert after.motor.speed_rad_s == 0.0
    edited = unwinder(tmp_path, 0.9)
    assert [note.split(" ")[0] for note in Retention(edited, tmp_path / "state").restore().notes] == ["UNWIND"]
    assert edited.plants.ends["UNWIND"].diameter_m == pytest.approx(0.9)


@pytest.mark.parametrize("wound_m", ["all", -1.0, 1e12, 1e300, float("nan"), None, True])
def test_a_damaged_stock_is_refused(tmp_path, wound_m):
    rack = unwinder(tmp_path)
    stock = rack.plants.stock()
    stock["UNWIND"]["wound_m"] = wound_m
    with pytest.raises(ValueError, match="what was kept of UNWIND"):
        rack.plants.restock(stock)
