"""Parameters from a name plate: the example motors' known numbers, and that each value has its rule."""

from math import pi

import pytest

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.nameplate import EXAMPLES, NamePlate, derive

# amps, ohm, mH, EMF, k, shaft torque, kg m2, source mH
KNOWN = {
    "10hp": (36.1, 0.531, 7.25, 220.8, 1.205, 40.7, 0.063, 0.478),
    "150hp": (245.8, 0.0915, 2.22, 477.5, 2.606, 610, 1.475, 0.140),
    "800hp": (906.6, 0.0216, 0.534, 680.4, 5.650, 4954, 18.96, 0.0683),
}
LINES = {"10hp": 230, "150hp": 460, "800hp": 660}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_motors(name):
    parameters = derive(EXAMPLES[name])
    values = {key: value.value for key, value in parameters.values.items()}
    found = (
        values["amps"], values["resistance_ohm"], values["inductance_h"] * 1e3, values["emf_v"], values["k_v_s"],
        values["shaft_torque_n_m"], values["inertia_kg_m2"], values["source_h"] * 1e3,
    )  # fmt: skip
    assert found == pytest.approx(KNOWN[name], rel=5e-3)
    assert parameters.line_v == LINES[name]
    assert all(value.rule and value.unit for value in parameters.values.values())
    assert values["inertia_time_s"] == pytest.approx({"10hp": 0.284, "150hp": 0.441, "800hp": 0.459}[name], rel=5e-3)
    assert parameters.motor.k_v_s == values["k_v_s"]


def test_rated_current_turns_the_motor_at_base_speed_with_the_rated_torque():
    for plate in EXAMPLES.values():
        motor, values = derive(plate).motor, derive(plate).values
        speed = plate.rpm * pi / 30
        shaft = motor.k_v_s * values["amps"].value - motor.viscous_n_m_s * speed
        assert shaft * speed == pytest.approx(plate.hp * 745.7, rel=1e-9)


def test_measured_values_replace_their_rules():
    plate = NamePlate(
        75, 500, 1750, amps=128.0, resistance_ohm=0.2, inductance_h=5e-3, inertia_kg_m2=0.9, wk2_lb_ft2=1.0
    )
    parameters = derive(plate)
    assert (parameters.amps, parameters.motor.resistance_ohm, parameters.motor.inductance_h) == (128.0, 0.2, 5e-3)
    assert parameters.motor.inertia_kg_m2 == 0.9
    rules = {key: value.rule for key, value in parameters.values.items()}
    assert (rules["amps"], rules["resistance_ohm"], rules["inertia_kg_m2"]) == ("name plate", "measured", "measured")


def test_what_is_not_on_the_plate_is_estimated():
    parameters = derive(NamePlate(75, 500, 1750))
    rules = {key: value.rule for key, value in parameters.values.items()}
    assert "efficiency 0.9" in rules["amps"]
    assert "Umanskii-Lindvill" in rules["inductance_h"]
    assert "inertia time of 0.4 s" in rules["inertia_kg_m2"]
    per_unit = parameters.motor.resistance_ohm * parameters.amps / 500
    assert 0.04 < per_unit < 0.08
    assert parameters.values["inertia_time_s"].value == pytest.approx(0.4, rel=0.01)
    assert derive(NamePlate(75, 440, 1750)).values["line_v"].rule.startswith("volts / 1.08")


@pytest.mark.parametrize(
    ("plate", "told"),
    [
        (NamePlate(0, 500, 1750), "hp is 0"),
        (NamePlate(75, -500, 1750), "volts is -500"),
        (NamePlate(75, 500, 1750, efficiency=1.2), "efficiency is 1.2"),
        (NamePlate(75, 500, 1750, amps=128, resistance_ohm=4.0), "more than the rated 500 V"),
        (NamePlate(75, 500, 1750, inductance_h=0.0), "inductance in H is 0"),
    ],
)
def test_a_plate_that_cannot_be(plate, told):
    with pytest.raises(ParameterError, match=told):
        derive(plate)
