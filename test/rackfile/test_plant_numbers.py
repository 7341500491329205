"""Numbers of plants by dotted path: which there are, and racks with others."""

from dataclasses import replace
from pathlib import Path

import pytest
from rack.helpers import config_at

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.user_error import UserError
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.plants import PlantConfig
from automax_ros.rackfile.plant_numbers import plant_number, with_numbers

CONFIG = Path(__file__).parents[2] / "config" / "dc_drive" / "rack.yaml"


@pytest.fixture(scope="module")
def config() -> RackConfig:
    return config_at(CONFIG)


def loaded(text: str) -> RackConfig:
    result = load_stored(SourceText("rack.yaml", text), CONFIG)
    assert result.config is not None, result.diagnostics
    return result.config


def plant(config: RackConfig, values: dict[str, str]) -> PlantConfig:
    text = with_numbers(config.text, {plant_number(config, path): value for path, value in values.items()})
    return loaded(text).plants[0]


def test_numbers_of_every_depth_vary_and_nothing_else_changes(config: RackConfig):
    was = loaded(config.text).plants[0]
    values = {"MOTOR.inertia": "3.5", "motor.load.torque_nm": "-120", "MOTOR.line.v_ll": "437.5"}
    expected = replace(
        was,
        inertia=3.5,
        load=replace(was.load, torque_nm=-120.0),
        supply=replace(was.supply, v_ll=437.5),
    )
    assert replace(plant(config, values), line=was.line) == expected


def test_keys_that_the_file_lacks_are_made(config: RackConfig):
    was = loaded(config.text).plants[0]
    text = config.text.replace("    inertia: 2.0 ", "    #").replace("    line: {", "    #line: {")
    bare = loaded(text)
    assert bare.plants[0].inertia == 1.0
    assert bare.plants[0].supply.ls_mh is None
    varied = plant(bare, {"MOTOR.inertia": "2.0", "MOTOR.line.ls_mh": "0.14"})
    assert varied.inertia == was.inertia
    assert varied.supply.ls_mh == was.supply.ls_mh


def test_without_values_the_text_is_the_file_itself(config: RackConfig):
    assert with_numbers(config.text, {}) == config.text


def test_limits_are_those_of_the_rack_file(config: RackConfig):
    number = plant_number(config, "MOTOR.line.hz")
    low = loaded(with_numbers(config.text, {number: repr(number.low)}))
    assert low.plants[0].supply.hz == number.low
    beyond = load_stored(SourceText("rack.yaml", with_numbers(config.text, {number: repr(number.low - 1)})), CONFIG)
    assert beyond.config is None


@pytest.mark.parametrize(
    ("path", "message", "hint"),
    [
        ("MOTR.inertia", "the rack has no plant 'MOTR'", "did you mean MOTOR?"),
        ("MOTOR.load.torqe_nm", "plant MOTOR has no number 'load.torqe_nm'", "did you mean MOTOR.load.torque_nm?"),
        ("MOTOR", "plant MOTOR has no number ''", None),
        ("MOTOR.feeds", "plant MOTOR has no number 'feeds'", None),
    ],
)
def test_what_is_no_number_of_a_plant_is_refused(config: RackConfig, path: str, message: str, hint: str | None):
    with pytest.raises(UserError) as caught:
        plant_number(config, path)
    assert caught.value.message == message
    assert hint is None or caught.value.hint == hint


def test_the_plate_of_a_motor_that_has_a_name_does_not_vary(config: RackConfig):
    with pytest.raises(UserError, match="cannot vary"):
        with_numbers(config.text, {plant_number(config, "MOTOR.motor.hp"): "150"})
