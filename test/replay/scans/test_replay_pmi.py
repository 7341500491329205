"""Recordings of a UDC whose drive has a plant: its tasks replay without the plant, edited ones differ where they do."""

from __future__ import annotations

import pytest
from rack.modules.pmi_racks import IDLE, SPEED_LOOP, YAML

from automax_ros.rack.rack import Rack
from replay.replays import edited, recorded, replayed


def working(rack: Rack, number: int) -> None:
    """Start the drive, give it a reference, and trip it from outside."""
    if number == 4:
        rack.write("WANT@", True)
    if number == 9:
        rack.write("SREF%", 300)
    if number == 16:
        rack.write("IET@", True)


@pytest.fixture(scope="module", params=["", "execution: modeled\n"], ids=["ideal", "modeled"])
def bag(tmp_path_factory, request):
    folder = tmp_path_factory.mktemp("pmi")
    yaml = YAML.replace("PLANT", "inertia: 3.0").replace("slots:", request.param + "slots:")
    return recorded(folder / "rack", working, yaml=yaml, IDLE=IDLE, WIND_A=SPEED_LOOP)


def test_it_replays_bit_for_bit(bag):
    report = replayed(bag)
    assert report.identical, report.first
    assert {task.name for task in report.tasks if task.scans > 100} >= {"WIND_A"}


def test_an_edited_speed_loop_differs_from_the_scan_where_its_gain_matters(bag):
    """The reference comes at 0.9 s; before it the error is 0, so any gain gives the same."""
    report = replayed(bag, {"WIND_A": edited(SPEED_LOOP, ("KP=10.0", "KP=9.0"))})
    assert report.first is not None
    assert report.first.task == "WIND_A"
    # The scans of 2 ms begin 0.5 ms after the start, or later in modeled execution.
    assert report.first.scan in (451, 452)
    names = {item.name for item in report.differences if not item.name.startswith("SLOT:")}
    assert names == {"CREF%"}
