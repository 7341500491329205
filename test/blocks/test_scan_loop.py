import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Form, Platform, Special
from automax_ros.blocks.declare.instance import Instance, InstanceError
from automax_ros.core.types import DataType
from blocks.support import TICK

SCAN_LOOP = CATALOGUE["SCAN_LOOP"]


def test_ticks_is_a_required_literal():
    ticks = SCAN_LOOP.parameter("TICKS")
    assert (ticks.type, ticks.form, ticks.required, ticks.low, ticks.high) == (
        DataType.INTEGER,
        Form.LITERAL,
        True,
        1,
        32767,
    )


def test_event_belongs_to_automax_tasks_only():
    event = SCAN_LOOP.parameter("EVENT")
    assert event.type is Special.EVENT
    assert not event.required
    assert event.default is None
    assert event.runs_on == {Platform.AUTOMAX}


def test_it_is_carried_out_by_the_task():
    assert SCAN_LOOP.step is None
    with pytest.raises(InstanceError, match="SCAN_LOOP has no step function"):
        Instance(SCAN_LOOP, TICK)
