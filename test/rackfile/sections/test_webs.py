"""The section `webs`, and rolls and rollers of plants: what is read, and what is told of each bad input."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.core.names import NameFault
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UserError
from automax_ros.drive.web.data import Dancer, Roll, Roller, SurfaceData, WebData
from automax_ros.rackfile.loader import LoadResult, load
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.rack_names import RackNames, SignalName
from automax_ros.rackfile.plant_numbers import plant_number, with_numbers

STOCK = "diameter_m: 1.25, core_m: 0.15, width_m: 2.5, caliper_um: 90, density_kg_m3: 780"
ROLL = f"{{motor: dc_150hp_500v, gear: 4.0, roll: {{{STOCK}}}}}"
ROLLER = "{motor: dc_150hp_500v, gear: 5.25, roller: {diameter_m: 0.5}}"
SPAN = "length_m: 4.0, stiffness_n: 2.0e5"


def text(
    unwind: str = ROLL, press: str = ROLLER, winder: str = ROLL, webs: str = f"W1: {{from: UNWIND, to: PRESS, {SPAN}}}"
) -> str:
    plants = f"plants:\n  UNWIND: {unwind}\n  PRESS: {press}\n  WINDER: {winder}\n"
    listed = "".join(f"  {line}\n" for line in webs.splitlines())
    head, commons = "rack: LINE1\nslots:\n  0: {module: 57C435}\n", "common:\n  T%: {}\n  B@: {}\n  X: {}\n"
    return f"{head}{plants}webs:\n{listed}{commons}"


def found(folder: Path, yaml: str) -> LoadResult:
    (folder / "rack.yaml").write_text(yaml, encoding="utf-8")
    return load(folder / "rack.yaml")


def good(folder: Path, yaml: str) -> RackConfig:
    result = found(folder, yaml)
    assert result.config is not None, result.diagnostics
    assert result.diagnostics == []
    return result.config


def test_rolls_rollers_and_webs_are_what_the_file_says(tmp_path):
    roll = f"{{motor: dc_150hp_500v, roll: {{{STOCK}, runs_from: bottom, core_inertia_kg_m2: 3, wound_at_n: 200}}}}"
    press = "{motor: dc_150hp_500v, gear: 5.25, roller: {diameter_m: 0.5, wrap_deg: 180, friction: 0.2}}"
    dancer = "dancer: {force_n: 600, mass_kg: 40, damping_ns_m: 400, range_m: 0.5}"
    first = f"w1: {{from: unwind, to: PRESS, {SPAN}, breaks_above_n: 1500}}"
    second = f"W2: {{from: PRESS, to: WINDER, length_m: 6, stiffness_n: 1e5, threaded: false, {dancer}}}"
    result = found(tmp_path, text(roll, press, webs=f"{first}\n{second}"))
    assert [item.code for item in result.diagnostics] == ["AMX6411"]  # lower case
    assert result.config is not None
    unwind, middle, winder = (plant.surface for plant in result.config.plants)
    stock = (1.25, 0.15, 2.5, 90.0, 780.0)
    assert unwind == SurfaceData(Roll(*stock, runs_from="bottom", core_inertia_kg_m2=3.0, wound_at_n=200.0), 1.0)
    assert middle == SurfaceData(Roller(0.5, 180.0, 0.2), 5.25)
    assert winder == SurfaceData(Roll(*stock), 4.0)
    one, two = result.config.webs
    assert (one.name, one.start, one.end, one.line) == ("W1", "UNWIND", "PRESS", 9)
    assert one.data == WebData(4.0, 2e5, True, 1500.0)
    assert two.data == WebData(6.0, 1e5, False, None, Dancer(600.0, 40.0, 400.0, 0.5))


@pytest.mark.parametrize("webs", ["A: {from: UNWIND, to: PRESS, length_m: 4, modulus_mpa: 900}"])
def test_the_stiffness_follows_from_modulus_and_roll(tmp_path, webs):
    two = f"{webs}\nB: {{from: PRESS, to: WINDER, length_m: 6, modulus_mpa: 900}}"
    config = good(tmp_path, text(winder=ROLL.replace("2.5", "1.0"), webs=two))
    # 900 MPa on 2.5 m x 90 um: 202.5 kN. The second is the same web, so it has the roll that it comes from.
    assert [web.data.stiffness_n for web in config.webs] == pytest.approx([2.025e5, 2.025e5])


def test_feeds_of_webs_and_rolls(tmp_path):
    scale = "scale: {counts: [0, 4095], value: [0.0, 1000.0]}"
    feeds = f"feeds: {{T%: {{signal: tension_n, every_ms: 5, {scale}}}, B@: {{signal: broken}}}}"
    unwind = ROLL[:-1] + ", feeds: {X: {signal: diameter_m}}}"
    config = good(tmp_path, text(unwind, webs=f"W1: {{from: UNWIND, to: PRESS, {SPAN}, {feeds}}}"))
    assert [(feed.owner, feed.common, feed.signal) for feed in config.feeds] == [
        ("plant UNWIND", "X", "diameter_m"),
        ("web W1", "T%", "tension_n"),
        ("web W1", "B@", "broken"),
    ]


W1 = f"W1: {{from: UNWIND, to: PRESS, {SPAN}}}"
W2 = f"W2: {{from: PRESS, to: WINDER, {SPAN}}}"
BARE = "{motor: dc_150hp_500v}"


@pytest.mark.parametrize(
    ("changed", "code", "line", "message"),
    [
        ({"webs": W1.replace("PRESS", "PRES")}, "AMX6502", 9, "web W1 goes to PRES, which the rack does not have"),
        ({"press": BARE}, "AMX6502", 9, "web W1 goes to PRESS, which has neither roll nor roller"),
        ({"press": "{}"}, "AMX6502", 9, "web W1 goes to PRESS, which has no motor: it is not simulated"),
        (
            {"webs": f"PRESS: {{from: UNWIND, to: PRESS, {SPAN}}}"},
            "AMX6502",
            9,
            "web PRESS has the name of a plant (line 6)",
        ),
        (
            {"webs": f"1W: {{from: UNWIND, to: PRESS, {SPAN}}}"},
            "AMX6502",
            9,
            "'1W': a web's name has 1 to 16 letters, digits and underscores, a letter first",
        ),
        (
            {"webs": f"{W1}\n{W2}\nW3: {{from: UNWIND, to: WINDER, {SPAN}}}"},
            "AMX6503",
            11,
            "web W3 hangs on the roll of UNWIND, as web W1 does",
        ),
        (
            {"webs": f"{W1}\nW3: {{from: WINDER, to: PRESS, {SPAN}}}"},
            "AMX6503",
            10,
            "web W3 hangs on the roller of PRESS, as web W1 does",
        ),
        (
            {"winder": ROLLER, "unwind": ROLLER, "webs": f"{W1}\n{W2}\nW3: {{from: WINDER, to: UNWIND, {SPAN}}}"},
            "AMX6503",
            11,
            "web W3 closes a ring: UNWIND is before WINDER already",
        ),
        (
            {"unwind": ROLLER, "webs": f"W1: {{from: UNWIND, to: UNWIND, {SPAN}}}"},
            "AMX6503",
            9,
            "web W1 closes a ring: UNWIND is before UNWIND already",
        ),
        (
            {"unwind": ROLL.replace("1.25", "0.1")},
            "AMX6504",
            5,
            "roll of plant UNWIND is smaller than its core: 0.1 m on 0.15 m",
        ),
        (
            {"unwind": ROLL.replace("780", "0")},
            "AMX6504",
            5,
            "density_kg_m3 of roll of plant UNWIND is 0; it must be 1 to 30000",
        ),
        (
            {"unwind": ROLL.replace("gear: 4.0", "gear: 0")},
            "AMX6504",
            5,
            "gear of plant UNWIND is 0; it must be 0.01 to 1000",
        ),
        (
            {"unwind": BARE[:-1] + ", gear: 4.0}"},
            "AMX6504",
            5,
            "plant UNWIND has a gear and neither roll nor roller: it turns nothing",
        ),
        ({"unwind": ROLL[:-1] + ", roller: {diameter_m: 0.5}}"}, "AMX6504", 5, "plant UNWIND has a roll and a roller"),
        (
            {"unwind": ROLL.replace("core_m", "runs_from: left, core_m")},
            "AMX6504",
            5,
            "runs_from of roll of plant UNWIND is 'left'; it must be top or bottom",
        ),
        (
            {"press": ROLLER.replace("0.5", "0.5, wrap_deg: 90")},
            "AMX6504",
            6,
            "roller of plant PRESS has wrap_deg and no friction: its grip follows from both",
        ),
        ({"unwind": ROLL.replace("core_m: 0.15, ", "")}, "AMX6009", 5, "roll of plant UNWIND lacks the key 'core_m'"),
        ({"winder": f"{{roll: {{{STOCK}}}}}"}, "AMX6009", 7, "plant WINDER has roll and no motor: it is not simulated"),
        (
            {"webs": "W1: {from: UNWIND, to: PRESS, length_m: 4}"},
            "AMX6504",
            9,
            "web W1 has neither stiffness_n nor modulus_mpa",
        ),
        ({"webs": W1[:-1] + ", modulus_mpa: 900}"}, "AMX6504", 9, "web W1 has stiffness_n and modulus_mpa"),
        (
            {"unwind": ROLLER, "webs": "W1: {from: UNWIND, to: PRESS, length_m: 4, modulus_mpa: 9}"},
            "AMX6504",
            9,
            "web W1 has modulus_mpa, and no roll of its chain says width and caliper",
        ),
        ({"webs": W1.replace("4.0", "0.05")}, "AMX6504", 9, "length_m of web W1 is 0.05; it must be 0.1 to 1000"),
        ({"webs": W1.replace("2.0e5", "99")}, "AMX6504", 9, "stiffness_n of web W1 is 99; it must be 100 to 1e+09"),
        (
            {"webs": W1[:-1] + ", dancer: {force_n: 600, mass_kg: 40, damping_ns_m: 400, range_m: 3.9}}"},
            "AMX6504",
            9,
            "web W1: a dancer with a range of 3.9 m takes up the span of 4 m: take a longer span or a shorter range",
        ),
        (
            {"webs": W1[:-1] + ", dancer: {force_n: 600}}"},
            "AMX6009",
            9,
            "dancer of web W1 lacks the keys 'mass_kg', 'damping_ns_m', 'range_m'",
        ),
        ({"webs": f"{W1}\n{W1}"}, "AMX6006", 10, "web W1 is already defined in line 9"),
        ({"webs": W1.replace("to: PRESS, ", "")}, "AMX6009", 9, "web W1 lacks the key 'to'"),
        (
            {"webs": W1[:-1] + ", feeds: {B@: {signal: tension_n}}}"},
            "AMX6479",
            9,
            "feed B@ of web W1: B@ is a BOOLEAN: a signal is a number",
        ),
        ({"webs": W1[:-1] + ", feeds: {X: {signal: diameter_m}}}"}, "AMX6479", 9, "a web has no signal 'diameter_m'"),
        ({"winder": BARE[:-1] + ", feeds: {X: {signal: web_mps}}}"}, "AMX6479", 7, "a plant has no signal 'web_mps'"),
    ],
)
def test_bad_input_is_told_with_its_line(tmp_path, changed, code, line, message):
    told = [(item.code, item.span.line, item.message) for item in found(tmp_path, text(**changed)).diagnostics]
    assert (code, line, message) in told


def test_what_hangs_is_not_judged_while_plants_have_errors(tmp_path):
    told = [item.code for item in found(tmp_path, text(unwind=ROLL.replace("780", "0"))).diagnostics]
    assert told == ["AMX6504"]


def test_a_rack_has_31_webs(tmp_path):
    many = "\n".join(f"W{number}: {{from: UNWIND, to: PRESS, {SPAN}}}" for number in range(32))
    told = [(item.code, item.message) for item in found(tmp_path, text(webs=many)).diagnostics]
    assert told == [("AMX6503", "the rack file has 32 webs; at most 31 hang between its plants")]


QUICK = ROLL.replace("gear: 4.0", "gear: 0.1").replace("90", "900")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        # 1750 rpm on 1.25 m with gear 0.1: 1145 m/s; pi / 4 (1.25^2 - 0.15^2) / 0.9 mm: 1344 m.
        (
            {"unwind": QUICK.replace("gear: 0.1", "gear: 0.05")},
            "at its motor's 2291 m/s the roll of UNWIND is empty after 0.59 s: 1344 m are on it",
        ),
        (
            {"unwind": QUICK.replace("gear: 0.1", "gear: 0.05").replace("780", "780, runs_from: bottom")},
            "at its motor's 2291 m/s the roll of UNWIND is empty after 0.59 s: 1344 m are on it",
        ),
        (
            {
                "unwind": QUICK.replace("gear: 0.1", "gear: 0.05, load: {speed_rpm: -1750}").replace(
                    "780", "780, runs_from: bottom"
                )
            },
            "at its motor's 2291 m/s the roll of UNWIND is empty after 0.59 s: 1344 m are on it",
        ),
        (
            {
                "webs": W1[:-1]
                + ", breaks_above_n: 290, dancer: {force_n: 600, mass_kg: 40, damping_ns_m: 1, range_m: 1}}"
            },
            "the dancer of web W1 pulls with 300 N, and it breaks above 290",
        ),
        (
            {"unwind": ROLL.replace("780", "780, wound_at_n: 900"), "webs": W1[:-1] + ", breaks_above_n: 800}"},
            "web W1 was wound at 900 N, and it breaks above 800",
        ),
    ],
)
def test_what_does_not_last_is_a_warning(tmp_path, changed, message):
    result = found(tmp_path, text(**changed))
    assert result.config is not None
    assert [(item.code, item.span.line, item.message) for item in result.diagnostics] == [("AMX6505", 9, message)]
    assert (result.diagnostics[0].span.column, result.diagnostics[0].span.end_column) == (3, 5)


def test_a_roll_that_lasts_longer_than_a_second_is_not_told(tmp_path):
    good(tmp_path, text(unwind=QUICK))
    held = QUICK.replace("gear: 0.1", "gear: 0.05, load: {speed_rpm: 10}")
    good(tmp_path, text(unwind=held))
    winds_up = QUICK.replace("gear: 0.1", "gear: 0.05, load: {speed_rpm: 1750}").replace(
        "780", "780, runs_from: bottom"
    )
    good(tmp_path, text(unwind=winds_up))


def test_signals_have_names(tmp_path):
    names = RackNames(good(tmp_path, text()), ())
    assert names.find("w1/TENSION_N") == SignalName("W1", "tension_n")
    assert names.find("UNWIND/diameter_m") == SignalName("UNWIND", "diameter_m")
    assert names.signals_of("W1")["broken"] is DataType.BOOLEAN
    with pytest.raises(NameFault, match="no signal 'tension_n'"):
        names.find("UNWIND/tension_n")
    with pytest.raises(NameFault, match="no plant or web 'W2'"):
        names.find("W2/tension_n")


def test_numbers_of_rolls_and_webs_can_vary(tmp_path):
    config = good(tmp_path, text())
    diameter, stiffness = plant_number(config, "UNWIND.roll.diameter_m"), plant_number(config, "w1.stiffness_n")
    assert (stiffness.label, stiffness.low, stiffness.high) == ("W1.stiffness_n", 1e2, 1e9)
    with pytest.raises(UserError, match="web W1 has no number 'width_m'"):
        plant_number(config, "W1.width_m")
    other = good(tmp_path, with_numbers(config.text, {diameter: "0.8", stiffness: "1e5"}))
    assert other.plants[0].surface is not None
    assert other.plants[0].surface.surface.diameter_m == 0.8
    assert other.webs[0].data.stiffness_n == 1e5
