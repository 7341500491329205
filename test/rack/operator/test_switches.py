"""Controls of modules and faults of plants: moved by name, refused with a reason, told to observers."""

from __future__ import annotations

from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.modules.module import QuietModule
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from rack.helpers import Told

YAML = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {SPEED: {priority: 4}}}
  5: {module: 57C419}
"""
SPEED = "100 CALL SCAN_LOOP(TICKS=1)\n120 END\n"


class Panel(QuietModule):
    """A module with two switches, one of them stuck."""

    controls = {"test_switch": ("A", "B", "centre"), "fault_reset_switch": ("true",)}  # noqa: RUF012

    def operate(self, verb: str, value: str) -> None:
        if verb == "fault_reset_switch":
            raise OperationRefused("the switch is stuck")
        self.moved = (*getattr(self, "moved", ()), (verb, value))


@pytest.fixture
def rack(tmp_path: Path) -> Rack:
    made = build(tmp_path, YAML, SPEED=SPEED)
    place = next(number for number, module in enumerate(made.modules) if module.config.slot == 5)
    made.modules[place] = Panel(made.modules[place].config)
    made.start()
    made.run(0.02)
    return made


@pytest.fixture
def told(rack: Rack) -> Told:
    found = Told()
    rack.observe(found)
    return found


def test_switch_is_moved_to_a_position_in_any_case(rack: Rack, told: Told) -> None:
    SwitchOperations(rack).module("5", "test_switch", "CENTRE")
    assert rack.modules[1].moved == (("test_switch", "centre"),)  # type: ignore[attr-defined]
    assert told.operations == [Operation(20_000_000, "module", "", ok=True, reason="", detail="5 test_switch centre")]


@pytest.mark.parametrize(
    ("slot", "control", "value", "reason"),
    [
        ("7", "test_switch", "A", "the rack has no module in slot 7"),
        ("x" * 9, "test_switch", "A", "the rack has no module in slot xxxxxxxxx"),
        ("7\x1b[2J", "test_switch", "A", "the rack has no module in slot 7\ufffd[2J"),
        ("0", "test_switch", "A", "the 57C435 in slot 0 has no 'test_switch': it has no controls"),
        ("5", "test_swich", "A", "the 57C419 in slot 5 has no 'test_swich': did you mean test_switch?"),
        ("5", "test_switch", "C", "test_switch cannot be 'C': it takes A, B, centre"),
        ("5", "fault_reset_switch", "true", "the switch is stuck"),
    ],
)
def test_what_cannot_be_moved_is_refused_and_told(rack: Rack, told: Told, slot, control, value, reason) -> None:
    with pytest.raises(OperationRefused) as refused:
        SwitchOperations(rack).module(slot, control, value)
    assert str(refused.value) == reason
    detail = f"{slot} {control} {value}".replace("\x1b", "\ufffd")
    assert told.operations == [Operation(20_000_000, "module", "", ok=False, reason=reason, detail=detail)]
    assert not hasattr(rack.modules[1], "moved")
