"""A plant that a rack fires: what breaks shows at the loop's outputs, and a rack that is cut anywhere goes on alike."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from rack.helpers import good, rack_at, rack_from

RACK = """\
rack: LINE1
slots:
  0: {{module: 57C435, tasks: {{LINE: {{priority: 4}}}}}}
  7: {{module: 57C406, plant: UNWIND}}
  8: {{module: 57C408}}
plants:
  UNWIND:
    motor: dc_150hp_500v
    load: {load}
    line: {{rotation: {rotation}}}
    inertia: 3.0
    couple: {{to: REEL, ratio: 2.0, stiffness_nm_per_rad: 3000}}
    feeds:
      SPD%: {{signal: tach_rpm, scale: {{counts: [-4095, 4095], value: [-1750.0, 1750.0]}}}}
      ARM_A: {{signal: armature_a, every_ms: 0.7}}
  REEL: {{motor: dc_10hp_240v}}
common:
  RUN_PERM@: {{slot: 8, register: 0, bit: 0, ros: in, preset: true}}
  RUN@: {{}}
  REF%: {{preset: 1000}}
  SPD%: {{}}
  ARM_A: {{}}
  STATE@: {{}}
  SYNC@: {{}}
  FB%: {{}}
  TACH@: {{}}
  PHROT@: {{}}
  LOST@: {{}}
"""
LINE = """\
10 COMMON RUN@, REF%, SPD%, STATE@, SYNC@, FB%, LOST@, TACH@, PHROT@
20 LOCAL RESET@
1000 CALL DC_DRIVE_CML( IO_CNTL_SLOT=7, DIG_IO_SLOT=8, REFERENCE=REF%, KP=0.2, PI_W_LEAD=50.0, AG_FACTOR=20, &
     CC_THRESH=680, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, SPEED_FDBK=SPD%, FAULT_RESET=RESET@, &
     DC_CML_STATE=STATE@, SYNC_LOCKED=SYNC@, I_FDBK=FB%, SYNC_LOSS_OUT=LOST@, TACH_LOSS_OUT=TACH@, &
     PHROT_FLT_OUT=PHROT@ )
1010 END
"""


def rack_of(folder: Path, *, rotation: str = "CBA", load_of: str = "{friction_nm: 5}") -> Rack:
    config = good(folder, RACK.format(rotation=rotation, load=load_of))
    (folder / "LINE.BLK").write_text(LINE)
    return Rack(config)


def started(rack: Rack) -> Rack:
    rack.start()
    rack.run(0.6)
    rack.write("RUN@", value=True)
    return rack


def test_the_loop_turns_both_motors_as_the_ratio_says(tmp_path):
    rack = started(rack_of(tmp_path))
    rack.run(2.0)
    assert (rack.value("SYNC@"), rack.value("STATE@")) == (True, True)
    unwind, reel = rack.plants["UNWIND"].motor, rack.plants["REEL"].motor
    assert unwind.speed_rad_s > 50.0
    assert unwind.speed_rad_s == pytest.approx(2.0 * reel.speed_rad_s, rel=1e-2)
    assert rack.value("FB%") == pytest.approx(1000, abs=80), "the EMF rises meanwhile: the loop is a little late"
    assert rack.value("SPD%") == pytest.approx(unwind.speed_rad_s * 9.5493 / 1750 * 4095, rel=2e-3)


def test_a_line_of_the_other_rotation_is_a_fault_of_the_drive(tmp_path):
    rack = started(rack_of(tmp_path, rotation="ABC"))
    rack.run(0.6)
    assert (rack.value("PHROT@"), rack.value("STATE@")) == (True, False)


@pytest.mark.parametrize(
    ("verb", "value", "output"),
    [("lose_phase", "T1", "LOST@"), ("line_hz", "59", "LOST@"), ("lose_tach", "true", "TACH@")],
)
def test_what_breaks_stops_the_drive(tmp_path, verb, value, output):
    """A held shaft at three quarters of base speed: the loop fires far enough ahead for the loss of the tachometer."""
    rack = started(rack_of(tmp_path, load_of="{speed_rpm: 1312}"))
    rack.run(0.6)
    assert rack.value("STATE@")
    assert not rack.value(output)
    SwitchOperations(rack).plant("UNWIND", verb, value)
    rack.run(1.0)
    assert not rack.value("STATE@")
    assert rack.value(output)
    assert not rack.plants["UNWIND"].is_closed
    assert rack.plants["UNWIND"].circuit.current_a == 0.0


@pytest.mark.parametrize("cut_us", [0, 1, 430_000, 600_001, 655_555, 713_333, 1_002_777, 1_250_000])
def test_a_rack_that_is_cut_goes_on_bit_for_bit(tmp_path, cut_us):
    """Before lock, in the contactor's closing, in the first pulses, in run, at an interrupt, after something broke."""
    whole = rack_of(tmp_path)
    later = rack_at(tmp_path / "rack.yaml")
    racks, now_us = [whole], 0
    whole.start()
    moves = {600_000: "run", 1_100_000: "open_gate", 1_200_000: "line_sag"}
    for until_us in sorted({cut_us, *moves, 1_400_000}):
        for rack in racks:
            rack.run((until_us - now_us) * 1e-6)
        now_us = until_us
        if until_us == cut_us:
            later.load(whole.state())
            racks.append(later)
        for rack in racks:
            if until_us in moves:
                if moves[until_us] == "run":
                    rack.write("RUN@", value=True)
                else:
                    value = {"open_gate": "4", "line_sag": "80 0.05"}[moves[until_us]]
                    SwitchOperations(rack).plant("UNWIND", moves[until_us], value)
    assert whole.state() == later.state()
    assert whole.value("STATE@")


TWO = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {LINE: {priority: 4}}}
  2: {module: 57C435, tasks: {DRAW: {priority: 4}}}
  7: {module: 57C406, plant: UNWIND}
  8: {module: 57C408}
  9: {module: 57C406, plant: WINDER}
  10: {module: 57C408}
plants:
  UNWIND: {motor: dc_150hp_500v, inertia: 3.0, couple: {to: WINDER, stiffness_nm_per_rad: 4000}}
  WINDER: {motor: dc_150hp_500v, inertia: 3.0, line: {rotation: ABC}}
common:
  PERM_A@: {slot: 8, register: 0, bit: 0, ros: in, preset: true}
  PERM_B@: {slot: 10, register: 0, bit: 0, ros: in, preset: true}
  RUN@: {}
  REF_A%: {}
  REF_B%: {}
  STATE_A@: {}
  STATE_B@: {}
"""
PART = """\
10 COMMON RUN@, REF_{drive}%, STATE_{drive}@
20 LOCAL RESET@
1000 CALL DC_DRIVE_CML( IO_CNTL_SLOT={slot}, DIG_IO_SLOT={digital}, REFERENCE=REF_{drive}%, KP=0.2, PI_W_LEAD=50.0, &
     AG_FACTOR=20, CC_THRESH=680, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, FAULT_RESET=RESET@, AUTO_PHROT=TRUE, &
     DC_CML_STATE=STATE_{drive}@ )
1010 END
"""


def test_two_drives_pull_on_one_web(tmp_path):
    """One pulls with 30 % of LIM_BAR, the other brakes with 20 %: the difference turns both inertias."""
    parts = {"LINE": PART.format(drive="A", slot=7, digital=8), "DRAW": PART.format(drive="B", slot=9, digital=10)}
    rack = started(rack_from(tmp_path, TWO, **parts))
    rack.run(0.4)
    assert (rack.value("STATE_A@"), rack.value("STATE_B@")) == (True, True)
    rack.write("REF_A%", 1229)
    rack.write("REF_B%", -819)
    rack.run(0.5)
    unwind, winder = rack.plants["UNWIND"], rack.plants["WINDER"]
    begun = unwind.motor.speed_rad_s + winder.motor.speed_rad_s
    for plant in (unwind, winder):
        plant.begin_metering()
    rack.run(1.0)
    inertia = unwind.motor.inertia_kg_m2 + winder.motor.inertia_kg_m2
    driving, braking = unwind.meter.look().current_a, winder.meter.look().current_a
    assert driving == pytest.approx(1229 / 4095 * 1.5 * unwind.rated_amps, rel=0.1)
    assert braking == pytest.approx(-819 / 4095 * 1.5 * unwind.rated_amps, rel=0.1)
    ended = unwind.motor.speed_rad_s + winder.motor.speed_rad_s
    drag = unwind.motor.data.viscous_n_m_s * (begun + ended) / 2
    torque = unwind.motor.k_v_s * (driving + braking) - drag
    assert (ended - begun) / 2 == pytest.approx(torque / inertia, rel=2e-3)
    assert winder.motor.speed_rad_s == pytest.approx(unwind.motor.speed_rad_s, rel=0.02)
    assert unwind.circuit.current_a > 0.0 > winder.circuit.current_a
    assert unwind.now_ns == winder.now_ns
