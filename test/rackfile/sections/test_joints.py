"""The key ``joint``: what it means, what it refuses."""

import math
from pathlib import Path

import pytest
from rack.helpers import good, loaded

from automax_ros.rackfile.reading.scale import Scale
from automax_ros.rackfile.sections.joints import INTERFACES

HEAD = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {LINE: {priority: 5}}}
  10: {module: 57552, plants: {A: WINDER, B: REEL}}
common:
  SPEED_SP%: {ros: in, scale: {counts: [0, 1000], value: [0.0, 100.0]}}
  TORQUE: {ros: in}
  LONG!: {ros: in}
  SHOWN%: {}
  TABLE(3): {ros: in}
  FLAG@: {ros: in}
"""
SCALE = "scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}"
VELOCITY = f"velocity: {{common: SPEED_SP%, {SCALE}}}"


def text(joint: str, other: str = "") -> str:
    plants = f"  WINDER: {{motor: dc_150hp_500v, joint: {{{joint}}}}}\n  REEL: {{motor: dc_10hp_240v{other}}}\n"
    return f"{HEAD}plants:\n{plants}"


def test_a_joint_has_a_name_and_commands(tmp_path: Path):
    config = good(tmp_path, text(f"name: winder_shaft, {VELOCITY}, effort: {{common: torque}}"))
    assert [plant.joint_name for plant in config.plants] == ["winder_shaft", "REEL"]
    velocity, effort = config.joint_commands
    assert (velocity.plant, velocity.joint, velocity.interface) == ("WINDER", "winder_shaft", "velocity")
    assert (velocity.common, velocity.scale) == ("SPEED_SP%", Scale((-4095, 4095), (-1750.0, 1750.0)))
    assert (effort.interface, effort.common, effort.scale) == ("effort", "TORQUE", None)


def test_a_plant_without_the_key_has_a_joint_of_its_own_name_and_no_commands(tmp_path: Path):
    config = good(tmp_path, text("")).plants[0]
    assert (config.joint, config.joint_name) == ("WINDER", "WINDER")
    assert good(tmp_path, text("")).joint_commands == ()


def test_rpm_are_radians_per_second_on_ros():
    assert 1750.0 * INTERFACES["velocity"] == pytest.approx(1750.0 / 60.0 * 2.0 * math.pi)
    assert INTERFACES["effort"] == 1.0


@pytest.mark.parametrize(
    ("joint", "codes"),
    [
        ("speed: {}", ["AMX6007"]),
        ("name: 2nd", ["AMX6310"]),
        ("name: a__b", ["AMX6310"]),
        ("name: ends_", ["AMX6310"]),
        (f"name: {'n' * 41}", ["AMX6310"]),
        ("name: [a]", ["AMX6008"]),
        ("velocity: SPEED_SP%", ["AMX6008"]),
        ("velocity: {}", ["AMX6009"]),
        ("velocity: {common: GONE%}", ["AMX6310"]),
        (f"velocity: {{common: SHOWN%, {SCALE}}}", ["AMX6310"]),
        ("velocity: {common: TABLE}", ["AMX6310"]),
        ("velocity: {common: TABLE(1)}", ["AMX6310"]),
        ("velocity: {common: FLAG@}", ["AMX6310"]),
        ("velocity: {common: SPEED_SP%}", ["AMX6310"]),
        (f"velocity: {{common: TORQUE, {SCALE}}}", ["AMX6450"]),
        ("velocity: {common: LONG!, scale: {counts: [0, 0], value: [0.0, 1.0]}}", ["AMX6450"]),
        ("velocity: {common: TORQUE}, effort: {common: TORQUE}", ["AMX6310"]),
        ("velocity: {common: TORQUE, rpm: 5}", ["AMX6007"]),
    ],
)
def test_a_fault_is_told_with_its_line(tmp_path: Path, joint, codes):
    result = loaded(tmp_path, text(joint))
    line = text(joint).splitlines().index("plants:") + 2
    assert [(item.code, item.span.line) for item in result.diagnostics] == [(code, line) for code in codes]


def test_two_joints_of_one_name_are_refused(tmp_path: Path):
    """Also one whose name is another plant's."""
    (found,) = loaded(tmp_path, text("name: REEL")).diagnostics
    assert (found.code, found.message) == (
        "AMX6310",
        "the joint of plant REEL is called REEL, and so is that of plant WINDER",
    )
    (found,) = loaded(tmp_path, text("name: shaft", ", joint: {name: shaft}")).diagnostics
    assert found.code == "AMX6310"


def test_a_roller_is_a_joint_too(tmp_path: Path):
    found = loaded(tmp_path, text("name: REEL_roll", ", roller: {diameter_m: 0.5}")).diagnostics
    assert ("AMX6310", "the joint of plant WINDER is called REEL_roll, and so is that of the roll of plant REEL") in [
        (item.code, item.message) for item in found
    ]


def test_a_plant_without_a_motor_has_no_joint(tmp_path: Path):
    found = loaded(tmp_path, text("").replace("motor: dc_150hp_500v, ", "")).diagnostics
    assert [item.code for item in found] == ["AMX6009"]
