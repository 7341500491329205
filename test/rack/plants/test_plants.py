"""The section `plants`: motors by name or plate, one drive each, what is wrong with them and where."""

from __future__ import annotations

import pytest

from automax_ros.drive.nameplate import NamePlate
from automax_ros.rack.plants.config import PlantConfig

from ..helpers import good, loaded

HEAD = """\
rack: LINE1
slots:
  0: {{module: 57C435}}
  8: {{module: 57552, plants: {{{first}}}}}
  9: {{module: 57552, plants: {{{second}}}}}
plants:
  WINDER: {winder}
  REEL: {{}}
"""


def text(first: str = "A: WINDER", second: str = "B: REEL", winder: str = "{motor: dc_10hp_240v}") -> str:
    return HEAD.format(first=first, second=second, winder=winder)


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
        ({"winder": "{couple: {to: REEL}}"}, "AMX6472", 7),
        ({"winder": "{motor: dc_10hp_240v, inertia: 0.5}"}, "AMX6477", 7),
        ({"winder": "{inertia: 2.0}"}, "AMX6009", 7),
        ({"winder": "{moter: dc_10hp_240v}"}, "AMX6007", 7),
        ({"winder": "WINDER"}, "AMX6008", 7),
    ],
)
def test_a_fault_is_told_with_its_line(tmp_path, changed, code, line):
    result = loaded(tmp_path, text(**changed))
    assert [(item.code, item.span.line) for item in result.diagnostics] == [(code, line)]


def test_a_plant_with_a_wrong_name_is_told_once(tmp_path):
    result = loaded(tmp_path, text(first="A: W-1").replace("WINDER:", "W-1:"))
    assert [(item.code, item.span.line) for item in result.diagnostics] == [("AMX6476", 7)]
