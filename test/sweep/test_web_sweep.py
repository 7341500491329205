"""Rolls and webs vary in a sweep, and their signals are measured."""

from __future__ import annotations

from math import pi

import pytest
from rack.helpers import rack_from

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UserError
from automax_ros.rack.rack import Rack
from automax_ros.sweep.measures import read_measures
from automax_ros.sweep.points import grid, read_varied
from automax_ros.sweep.run import Plan, RackTemplate, run_point

RACK = """\
rack: PM1
slots:
  0: {module: 57C435}
plants:
  FIRST: {motor: dc_150hp_500v, gear: 4.0, roller: {diameter_m: 0.5}, load: {speed_rpm: 600}}
  SECOND: {motor: dc_150hp_500v, gear: 4.0, roller: {diameter_m: 0.5}, load: {speed_rpm: 600.6}}
webs:
  W1: {from: FIRST, to: SECOND, length_m: 0.5, stiffness_n: 2.0e5}
"""


@pytest.fixture
def rack(tmp_path) -> Rack:
    return rack_from(tmp_path, RACK)


def results(rack: Rack, varied: list[str], measures: str, seconds: int = 2) -> list[list[float | None]]:
    """The measures of each run."""
    quantities = [read_varied(rack, text) for text in varied]
    found = read_measures(measures, rack.config, seconds * NS_PER_S)
    plan = Plan(RackTemplate.of(rack), tuple(item.quantity for item in quantities), found, seconds * NS_PER_S)
    return [list(run_point(plan, point).measures) for point in grid(quantities)]


def test_a_stiffer_web_is_tighter(rack):
    measured = results(rack, ["W1.stiffness_n=1e5,2e5,4e5"], "final(W1/tension_n)")
    assert [row[0] for row in measured] == pytest.approx([100.0, 200.0, 400.0], rel=1e-3)


def test_signals_of_rolls_and_webs_are_measured(rack):
    text = "max(w1/tension_n, from=1.5) min(W1/tension_n, to=1.9) mean(FIRST/web_mps) time(W1/broken) count(W1/broken)"
    (row,) = results(rack, ["W1.length_m=0.5"], text)
    speed = 600 * pi / 30 / 4 * 0.25
    assert row == [pytest.approx(200, rel=1e-3), 0.0, pytest.approx(speed), 0.0, 0.0]


def test_another_diameter_is_another_speed(rack):
    measured = results(rack, ["FIRST.roller.diameter_m=0.4,0.5"], "final(FIRST/web_mps)", 1)
    assert measured[0][0] == pytest.approx(0.8 * measured[1][0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max(W2/tension_n)", "the rack has no plant or web 'W2'"),
        ("max(W1/tension)", "the rack has no signal 'tension'"),
        ("max(W1/broken)", "max is of an INTEGER, DOUBLE INTEGER or REAL; W1/broken is a BOOLEAN"),
        ("time(W1/slack_m)", "time is of a BOOLEAN; W1/slack_m is a REAL"),
    ],
)
def test_what_cannot_be_measured(rack, text, message):
    with pytest.raises(UserError, match=message):
        read_measures(text, rack.config, NS_PER_S)


def test_an_impossible_roll_is_told(rack):
    with pytest.raises(UserError, match="lies outside 100 to 1000000000"):
        read_varied(rack, "W1.stiffness_n=10")
    with pytest.raises(UserError, match="no task and no plant 'W2'"):
        read_varied(rack, "W2.stiffness_n=1e5")
