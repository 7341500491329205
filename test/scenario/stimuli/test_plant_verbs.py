"""What stimuli and operators do to plants: at its instant, told to observers, refused with a reason."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import Told, good

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.switches import MOST_CHARACTERS, SwitchOperations
from automax_ros.rack.rack import Rack
from scenario.stimuli.helpers import playing

RACK = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {LINE: {priority: 5}}}
plants:
  UNWIND: {motor: dc_150hp_500v, load: {speed_rpm: 875}}
  REEL: {motor: dc_10hp_240v}
"""


def rack_of(folder: Path) -> tuple[Rack, Told]:
    rack, told = Rack(good(folder, RACK)), Told()
    rack.observe(told)
    return rack, told


def test_stimuli_break_load_and_mend_plants_at_their_instants(tmp_path):
    rack, told = rack_of(tmp_path)
    found = playing(
        rack,
        tmp_path,
        """\
- {at: 0.1, plant: {UNWIND: {short_scr: 3, open_gate: 12}, reel: {load_torque_nm: -4.5}}}
- {at: 0.2, plant: {UNWIND: {lose_tach: true, blow_fuse: 2, lose_phase: A}}}
- {at: 0.3, plant: {REEL: {line_sag: {to_percent: 70, for_s: 0.05}, line_hz: 59.5}}}
- {at: 0.5, plant: {UNWIND: {repair: all}}}
""",
    )
    unwind, reel = rack.plants["UNWIND"], rack.plants["REEL"]
    rack.run(0.1)
    assert unwind.notes == []
    rack.run(0.15)
    assert unwind.notes == ["short_scr 3", "open_gate 12", "lose_tach", "blow_fuse T2", "lose_phase T3"]
    assert reel.load_torque_nm == -4.5
    rack.run(0.07)
    assert reel.line.v_ll_v == pytest.approx(161.0)
    rack.run(0.1)
    assert (reel.line.v_ll_v, reel.line.frequency_hz) == (230.0, 59.5)
    rack.run(0.1)
    assert unwind.notes == []
    assert reel.motor.speed_rad_s > 1.0
    assert found.refused == 0
    assert [(item.at_ns, item.what, item.detail) for item in told.operations if item.what == "plant"] == [
        (100_000_000, "plant", "UNWIND short_scr 3"),
        (100_000_000, "plant", "UNWIND open_gate 12"),
        (100_000_000, "plant", "REEL load_torque_nm -4.5"),
        (200_000_000, "plant", "UNWIND lose_tach true"),
        (200_000_000, "plant", "UNWIND blow_fuse 2"),
        (200_000_000, "plant", "UNWIND lose_phase A"),
        (300_000_000, "plant", "REEL line_sag 70 0.05"),
        (300_000_000, "plant", "REEL line_hz 59.5"),
        (500_000_000, "plant", "UNWIND repair all"),
    ]
    assert [(item.what, item.of) for item in found.happened][:3] == [
        ("plant", "UNWIND"),
        ("plant", "UNWIND"),
        ("plant", "REEL"),
    ]


@pytest.mark.parametrize(
    ("name", "verb", "text", "why"),
    [
        ("UNWND", "short_scr", "3", "no plant 'UNWND'"),
        ("UNWIND", "shrt_scr", "3", "no 'shrt_scr'"),
        ("UNWIND", "short_scr", "x" * (MOST_CHARACTERS + 1), "101 characters"),
        ("UNWIND", "line_sag", "200", "percent"),
    ],
)
def test_what_cannot_be_done_is_refused_and_told(tmp_path, name, verb, text, why):
    rack, told = rack_of(tmp_path)
    rack.start()
    before = rack.plants.state()
    with pytest.raises(OperationRefused, match=why):
        SwitchOperations(rack).plant(name, verb, text)
    assert rack.plants.state() == before
    (operation,) = [item for item in told.operations if item.what == "plant"]
    assert not operation.ok
    assert why in operation.reason


def test_a_load_of_many_samples_is_no_operation(tmp_path):
    rack, told = rack_of(tmp_path)
    rack.start()
    for torque in (1.0, 2.0, 3.5):
        SwitchOperations(rack).load("REEL", torque)
    assert rack.plants["REEL"].load_torque_nm == 3.5
    assert [item for item in told.operations if item.what == "plant"] == []
    with pytest.raises(OperationRefused, match="load torque"):
        SwitchOperations(rack).load("REEL", float("inf"))
    with pytest.raises(OperationRefused, match="no plant"):
        SwitchOperations(rack).load("GONE", 1.0)


def test_a_plant_goes_on_without_power(tmp_path):
    rack, _ = rack_of(tmp_path)
    rack.start()
    rack.operations.power_off()
    SwitchOperations(rack).plant("REEL", "load_torque_nm", "-5")
    rack.run(1.0)
    assert rack.plants["REEL"].motor.speed_rad_s > 10.0
