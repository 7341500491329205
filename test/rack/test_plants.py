"""The section `plants`: motors by name or plate, one drive each, what is wrong with them and where."""

from __future__ import annotations

from dataclasses import replace

import pytest

from automax_ros.drive.base.nameplate import NamePlate
from automax_ros.drive.circuit.ac_line import Rotation
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.plants import PlantConfig
from rack.helpers import good, loaded, run_for

HEAD = """\
rack: LINE1
slots:
  0: {{module: 57C435}}
  8: {{module: 57552, plants: {{{first}}}}}
  9: {{module: 57552, plants: {{{second}}}}}
plants:
  WINDER: {winder}
  REEL: {reel}
"""


MOTOR = "{motor: dc_10hp_240v}"


def text(first: str = "A: WINDER", second: str = "B: REEL", winder: str = MOTOR, reel: str = "{}") -> str:
    return HEAD.format(first=first, second=second, winder=winder, reel=reel)


def test_each_drive_has_its_plant(tmp_path):
    plate = "{motor: {hp: 158, volts: 500, rpm: 1750, amps: 245.8, inductance_h: 0.00222}, motor_overload_ratio: 200}"
    config = good(tmp_path, text(winder=plate))
    expected = NamePlate(158.0, 500.0, 1750.0, amps=245.8, inductance_h=0.00222)
    first, second = (module.plants for module in config.modules[1:])
    assert first == {"A": PlantConfig("WINDER", expected, 200, 7)}
    assert second == {"B": PlantConfig("REEL", line=8)}


@pytest.mark.parametrize(
    ("changed", "code", "line"),
    [
        ({"second": "B: WINDER"}, "AMX6474", 5),
        ({"first": "A: REEL, B: REEL", "second": ""}, "AMX6474", 4),
        ({"first": "A: WINDR"}, "AMX6474", 4),
        ({"first": "C: WINDER"}, "AMX6007", 4),
        ({"first": "A: [WINDER]"}, "AMX6008", 4),
        ({"winder": "{motor: {hp: 10, volts: 240}}"}, "AMX6009", 7),
        ({"winder": "{motor: {hp: 0, volts: 240, rpm: 1750}}"}, "AMX6473", 7),
        ({"winder": "{motor: {hp: ten, volts: 240, rpm: 1750}}"}, "AMX6008", 7),
        ({"winder": "{motor: {hp: 10, volts: 240, rpm: 1750, poles: 4}}"}, "AMX6007", 7),
        ({"winder": "{motor: [dc_10hp_240v]}"}, "AMX6008", 7),
        ({"winder": "{motor_overload_ratio: 114}"}, "AMX6475", 7),
        ({"winder": "{motor_overload_ratio: 401}"}, "AMX6475", 7),
        ({"winder": "{motor_overload_ratio: 150.5}"}, "AMX6008", 7),
        ({"winder": "{motor: dc_10hp_240v, couple: {to: REEL}}"}, "AMX6478", 7),
        ({"winder": "{motor: dc_10hp_240v, couple: {to: WINDER}}"}, "AMX6478", 7),
        ({"winder": "{motor: dc_10hp_240v, couple: {to: REAL}}"}, "AMX6478", 7),
        ({"winder": "{motor: dc_10hp_240v, couple: {}}"}, "AMX6009", 7),
        (
            {"winder": "{motor: dc_10hp_240v, couple: {to: REEL, ratio: 0}}", "reel": MOTOR},
            "AMX6478",
            7,
        ),
        (
            {
                "winder": "{motor: dc_10hp_240v, couple: {to: REEL, damping_nms_per_rad: 1}}",
                "reel": MOTOR,
            },
            "AMX6478",
            7,
        ),
        (
            {"winder": "{motor: dc_10hp_240v, couple: {to: REEL, stiffnes: 1}}", "reel": MOTOR},
            "AMX6007",
            7,
        ),
        ({"winder": "{motor: dc_10hp_240v, line: {v_ll: 10}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, line: {hz: 47.9}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, line: {ls_mh: 0}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, line: {rs_mohm: -1}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, line: {rotation: ACB}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, line: {volts: 460}}"}, "AMX6007", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {torque_nm: 1e7}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {friction_nm: -1}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {speed_rpm: 10001}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {speed_rpm: 0, ros: in}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {ros: out}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {torque_per_rpm: [[0, 0]]}}"}, "AMX6008", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {torque_per_rpm: [[0, 0], [0, 1]]}}"}, "AMX6477", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {torque_per_rpm: [[0, 0], [10]]}}"}, "AMX6008", 7),
        ({"winder": "{motor: dc_10hp_240v, load: {torque_per_rpm: [[0, 0], [10, x]]}}"}, "AMX6008", 7),
        ({"winder": "{motor: {hp: 10, volts: 240, rpm: 1750, resistance_ohm: 10}}"}, "AMX6473", 7),
        ({"winder": "{motor: {hp: 10, volts: 240, rpm: 1750, inertia_kg_m2: 1e-6}}"}, "AMX6473", 7),
        ({"winder": "{motor: dc_10hp_240v, inertia: 0.5}"}, "AMX6477", 7),
        ({"winder": "{inertia: 2.0}"}, "AMX6009", 7),
        ({"winder": "{moter: dc_10hp_240v}"}, "AMX6007", 7),
        ({"winder": "WINDER"}, "AMX6008", 7),
    ],
)
def test_a_fault_is_told_with_its_line(tmp_path, changed, code, line):
    result = loaded(tmp_path, text(**changed))
    assert [(item.code, item.span.line) for item in result.diagnostics] == [(code, line)]


PLANTS = """\
rack: LINE1
slots:
  0: {module: 57C435}
plants:
  UNWIND:
    motor: dc_150hp_500v
    line: {v_ll: 440, hz: 50, ls_mh: 0.2, rs_mohm: 7, rotation: ABC}
    load: {torque_nm: 100, torque_per_rpm: [[0, 0], [1750, 300]], friction_nm: 20, ros: in}
    inertia: 2.5
    couple: {to: WINDER, ratio: 2.0, stiffness_nm_per_rad: 5000}
  WINDER: {motor: dc_10hp_240v}
  BARE: {motor_overload_ratio: 150}
"""


def test_a_rack_makes_its_plants_as_the_file_says(tmp_path):
    rack = Rack(good(tmp_path, PLANTS))
    assert sorted(rack.plants) == ["UNWIND", "WINDER"]
    unwind, winder = rack.plants["UNWIND"], rack.plants["WINDER"]
    line, usual = unwind.line, winder.line
    assert (line.v_ll_v, line.frequency_hz) == (440.0, 50.0)
    assert (line.inductance_h, line.resistance_ohm) == pytest.approx((0.2e-3, 7e-3))
    assert (line.rotation, usual.rotation) == (Rotation.CBA, Rotation.ABC)
    assert (usual.v_ll_v, usual.frequency_hz, usual.inductance_h) == (230.0, 60.0, pytest.approx(0.478e-3, rel=1e-2))
    assert unwind.motor.inertia_kg_m2 == pytest.approx(2.5 * 35 * 0.04214)
    rpm = 3.141592653589793 / 30
    assert unwind.motor.load_torque(875.0 * rpm) == pytest.approx(250.0)
    assert unwind.motor.data.coulomb_n_m == 20.0
    assert rack.config.plants[0].load.from_ros
    rack.plants["WINDER"].advance(100_000_000)
    assert unwind.now_ns == winder.now_ns == 100_000_000
    assert unwind.motor.speed_rad_s < -1.0
    assert winder.motor.speed_rad_s < 0.0


def test_a_rack_goes_on_from_its_state_with_its_plants(tmp_path):
    config = good(tmp_path, PLANTS)
    whole = run_for(Rack(config))
    for seconds in (0.013, 0.3):
        whole.run(seconds)
        if seconds < 0.1:
            saved = whole.state()
    later = Rack(config)
    later.load(saved)
    later.run(0.3)
    assert later.state() == whole.state()
    assert abs(later.plants["WINDER"].motor.speed_rad_s) > 1.0
    with pytest.raises(ValueError, match="other plants"):
        Rack(config).load(replace(saved, plants={}))


def test_a_plant_with_a_wrong_name_is_told_once(tmp_path):
    result = loaded(tmp_path, text(first="A: W-1").replace("WINDER:", "W-1:"))
    assert [(item.code, item.span.line) for item in result.diagnostics] == [("AMX6476", 7)]
