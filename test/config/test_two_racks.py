"""The example of two racks does what its README says."""

import pytest
from rack.modules.network_racks import Cable

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.tasks import check_tasks
from config.examples import CONFIG, loaded, play

FOLDER = CONFIG / "two_racks"
CRUISE, WINDER_CRUISE = 2457, 2481
"""Counts of the preset 1500 fpm, 1500 * 4095 / 2500, and 1 % more."""
CYCLE_S = 0.0055


def checked(name: str) -> Rack:
    config = loaded(FOLDER / name)
    assert [item.result.diagnostics for item in check_tasks(config)] == [[]]
    return Rack(config)


@pytest.fixture
def line() -> Rack:
    return checked("line")


@pytest.fixture
def winder() -> Rack:
    return checked("winder")


def cycles(seconds: float) -> int:
    return round(seconds / CYCLE_S)


def test_the_winder_follows_the_line_and_each_stops_without_the_other(line, winder):
    cable = Cable(line, winder)
    cable.start()
    cable.cycles(cycles(20.0))
    assert line.value("LINE_REF%") == CRUISE
    assert line.value("WIND_SPEED%") == winder.value("WIND_SPEED%") == WINDER_CRUISE
    cable.cut = {winder}
    cable.cycles(cycles(0.2))
    assert not line.value("WIND_THERE@")
    assert not line.value("WIND_RUN@")
    assert line.value("WIND_READY@"), "it keeps what came last"
    assert line.value("WIND_SPEED%") == WINDER_CRUISE
    assert not winder.value("LINE_THERE@")
    cable.cycles(cycles(9.0))
    assert winder.value("WIND_SPEED%") == 0
    cable.cycles(cycles(7.0))
    assert line.value("LINE_REF%") == 0
    cable.cut = set()
    cable.cycles(cycles(20.0))
    assert winder.value("WIND_SPEED%") == WINDER_CRUISE
    assert [task.errors.count for rack in (line, winder) for task in rack.tasks] == [0, 0]


def test_neither_starts_without_the_other(line, winder):
    for rack in (line, winder):
        rack.start()
        rack.run(2.0)
    assert line.value("LINE_REF%") == 0
    assert winder.value("WIND_SPEED%") == 0


def test_the_winder_alone_with_its_stimuli(winder):
    played = play(winder, FOLDER / "winder" / "line.yaml")
    winder.run(19.9)
    assert winder.value("WIND_SPEED%") == WINDER_CRUISE
    winder.run(10.1)
    assert winder.value("WIND_SPEED%") == 0
    assert played.refused == 0
