"""Recordings of racks in which commons were forced: a replay holds them too, from any place of the recording."""

from __future__ import annotations

import pytest
from recordings.live_racks import build

from automax_ros.rack.rack import Rack
from replay.replays import SPEED, WORK, YAML, busy, edited, record, recorded, replayed

# Later blocks of the scan read what an earlier one writes: they must see the forced value.
CHAINED = edited(
    SPEED,
    ("TRIM% [", "SEEN%, TRIM% ["),
    ("140 END", "140 CALL SUMMER(INPUT1=OUT%, INPUT2=1, OUTPUT=SEEN%)\n150 END"),
)


def forcing(rack: Rack, number: int) -> None:
    busy(rack, number)
    if number % 6 == 2:
        rack.force("OUT%", number * 11)
    if number % 6 == 4:
        rack.force("GAIN", 0.25)
    if number % 6 == 5:
        rack.unforce("OUT%")
        rack.unforce("GAIN")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("forces") / "rack", forcing, SPEED=CHAINED)


@pytest.mark.parametrize(("from_ms", "more_than"), [(0, 400), (250, 0), (750, 0), (1450, 0)])
def test_a_run_with_forces_replays_bit_for_bit_from_any_place(bag, from_ms, more_than):
    report = replayed(bag, from_ns=from_ms * 10**6)
    assert report.identical
    assert report.scans > more_than


def test_an_edited_task_runs_against_the_same_forces(bag):
    """While OUT% is forced, from 0.2 to 0.5 s, what the block writes makes no difference; later it does."""
    halved = {"SPEED": edited(CHAINED, ("INPUT3=100", "INPUT3=50"))}
    assert replayed(bag, halved, from_ns=210 * 10**6, to_ns=490 * 10**6).identical
    report = replayed(bag, halved, from_ns=510 * 10**6, to_ns=790 * 10**6)
    assert "OUT%" in {item.name for item in report.differences}


def test_forces_that_change_in_the_middle_of_modeled_scans_replay_too(tmp_path):
    """Slices of 5.6 ms, scans each 5.5 ms: in turn a force begins, changes and ends at all places of a scan."""

    def each(rack: Rack, number: int) -> None:
        rack.write("REF%", number * 37 % 500)
        if number % 2:
            rack.force("OUT%", number)
        else:
            rack.unforce("OUT%")

    (tmp_path / "rack").mkdir()
    yaml = YAML.replace("rack: LINE1\n", "rack: LINE1\nexecution: modeled\n")
    rack = build(tmp_path / "rack", yaml, SPEED=CHAINED, WORK=WORK)
    bag = record(rack, tmp_path / "bag", each, slices=110, seconds=110 * 0.0056)
    report = replayed(bag)
    assert report.identical, report.differences[:3]
    assert report.scans > 150
