"""Recordings of racks in which locals of tasks were forced: a replay holds them too, from any place of the recording."""

from __future__ import annotations

import pytest

from automax_ros.rack.rack import Rack

from . import test_replay_udc as udc
from .replays import SPEED, WORK, YAML, busy, edited, recorded, replayed

BASIC = YAML.replace("WORK: {priority: 8}", "WORK: {priority: 8}\n      BACK: {file: BACK.BAS, priority: 9}")
MODELED = YAML.replace("slots:", "execution: modeled\nslots:", 1)
LONG = edited(WORK, ("I% = 0 TO 2", "I% = 0 TO 2 STEP 1"))


def forcing(rack: Rack, number: int) -> None:
    busy(rack, number)
    if number % 6 == 1:
        rack.force("SPEED.SUM%", number * 7)
    if number % 6 == 2:
        rack.adjust.force("WORK.J%", number)
        rack.adjust.force("SPEED.FILTERED%", 44)
    if number % 6 == 4:
        rack.adjust.force("WORK.J%", -number)
        rack.unforce("SPEED.SUM%")
    if number % 6 == 5:
        rack.adjust.unforce()


@pytest.fixture(scope="module", params=[YAML, MODELED], ids=["ideal", "modeled"])
def bag(request, tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("forces") / "rack", forcing, yaml=request.param)


def test_a_run_with_forced_locals_replays_bit_for_bit(bag):
    report = replayed(bag)
    assert report.identical
    assert report.scans > 400
    assert sum(task.states for task in report.tasks) > 20


@pytest.mark.parametrize("from_ms", [250, 450, 750, 1450])
def test_a_range_that_begins_while_a_local_is_forced_replays_too(bag, from_ms):
    assert replayed(bag, from_ns=from_ms * 10**6).identical


def test_an_edited_task_has_the_same_locals_forced(bag):
    """While FILTERED% is forced, from 0.2 to 0.5 s, what LAG writes makes no difference; later it does."""
    slow = {"SPEED": edited(SPEED, ("WLG=10.0", "WLG=1.0"))}
    assert replayed(bag, slow, from_ns=230 * 10**6, to_ns=470 * 10**6).identical
    report = replayed(bag, slow, from_ns=530 * 10**6, to_ns=700 * 10**6)
    assert "OUT%" in {item.name for item in report.differences}
