"""A UDC's drive with a PMI: it turns its motor by registers, protects it, stops with the rack, goes on bit for bit."""

from __future__ import annotations

import json
from math import log

import pytest

from automax_ros.core.diagnostics import SourceText
from automax_ros.drive.pmi import registers as table
from automax_ros.rack.rack import Rack, RackState
from rack.helpers import rack_from, run_for
from rack.modules.pmi_racks import CURRENT, IDLE, SPEED_LOOP, breaks, built, rpm, started, winder

BASE_RPM = 1750
RATED_A = 245.8
RUN_UNLESS_OVERLOAD = "RUN@ = WANT@ AND NOT OVERLOAD@"


def word(rack: Rack, name: str) -> int:
    """A register's 16 bits."""
    return int(rack.value(name)) & 0xFFFF


def reset(rack: Rack) -> None:
    """Press the fault reset."""
    rack.write("FRESET@", True)
    rack.run(0.02)
    rack.write("FRESET@", False)


def runs(rack: Rack) -> bool:
    """Ask for the drive; return whether it runs 0.4 s later."""
    rack.write("WANT@", True)
    rack.run(0.4)
    return bool(rack.value("RUNNING@"))


def test_it_runs_to_the_speed_of_a_speed_loop(tmp_path):
    rack = started(tmp_path, reference=2000)
    rack.run(4.0)
    assert rpm(rack) == pytest.approx(2000 / 4095 * BASE_RPM, rel=0.01)
    assert rack.value("SPEED%") == pytest.approx(rpm(rack) / BASE_RPM * 4095, abs=2)
    assert word(rack, "STATUS%") & (table.RUNNING | table.LOCKED | table.FORWARD_ON) == 0b1011
    assert (word(rack, "FAULTS%"), rack.value("WARN%"), rack.value("LINK%")) == (0, 0, 0)
    assert rack.value("PERIOD%") == 16667
    emf_v = winder(rack).circuit.emf_v
    assert rack.value("ARM_V%") == pytest.approx(emf_v, abs=6)
    assert rack.value("ARM_C%") == pytest.approx(emf_v / 500 * 3000, abs=36)


def test_the_current_follows_its_reference_and_is_told_in_counts_of_the_overload_ratio(tmp_path):
    rack = started(tmp_path, CURRENT, plant="load: {speed_rpm: 0}", reference=2730)
    rack.run(0.5)
    told, amps = [], []
    for _ in range(100):
        rack.run(1 / 360)
        told.append(rack.value("CURRENT%"))
        amps.append(winder(rack).circuit.current_a)
    assert sum(told) / 100 == pytest.approx(2730, rel=0.01)
    assert winder(rack).motor.torque_n_m == pytest.approx(2.606 * RATED_A, rel=0.05)  # 2730 of 4095 at 150 %: rated
    rack.write("SREF%", -1365)
    rack.run(0.5)
    assert rack.value("CURRENT%") == pytest.approx(-1365, rel=0.05)
    assert word(rack, "STATUS%") & table.ON_BRIDGE_2


def test_a_lost_tachometer_is_found_by_the_block_and_the_task_stops_the_drive(tmp_path):
    rack = started(tmp_path, reference=2000)
    rack.run(2.0)
    before, position = rpm(rack), rack.value("POS%")
    breaks(rack, "lose_tach", "true")
    rack.run(0.004)
    assert rack.value("SPEED%") == 0
    assert rack.value("TACHLOSS@")
    position = rack.value("POS%")
    rack.run(0.2)
    assert not rack.value("RUNNING@")
    assert rpm(rack) == pytest.approx(before, rel=0.03)
    assert rack.value("POS%") == position
    assert word(rack, "FAULTS%") == 0


def test_a_held_shaft_trips_thermal_overload_in_its_time_and_the_task_stops_the_drive(tmp_path):
    """LIM_BAR 150, TRIP_TIME 10 (36): cold at 150 %, RISE goes to 2250 with w and trips at 1299.6; it ends at 1000."""
    source = CURRENT.replace("LIM_BAR=150,", "LIM_BAR=150, TRIP_TIME=10,").replace("RUN@ = WANT@", RUN_UNLESS_OVERLOAD)
    rack = started(tmp_path, source, plant="load: {speed_rpm: 0}", reference=4095)
    began_s = rack.now_ns / 1e9
    w = log((150**2 - 100**2) / (150**2 - 114**2)) / 10
    expected_s = log(2250 / (2250 - 1299.6)) / w
    rack.run(expected_s - 0.3)
    assert rack.value("CURRENT%") == pytest.approx(4095, rel=0.01)
    assert not rack.value("OVERLOAD@")
    while not rack.value("OVERLOAD@"):
        rack.run(0.01)
    assert rack.now_ns / 1e9 - began_s == pytest.approx(expected_s, rel=0.01)
    rack.run(0.1)
    assert not rack.value("RUNNING@")
    rack.run(log(1299.6 / 1000) / w - 0.5)
    assert rack.value("OVERLOAD@")
    rack.run(0.7)
    assert not rack.value("OVERLOAD@")


def test_without_permissive_nothing_starts_and_a_lost_one_coasts_without_a_fault(tmp_path):
    rack = run_for(built(tmp_path))
    rack.write("PERMIT@", False)
    rack.run(0.4)
    assert not word(rack, "STATUS%") & table.READY
    assert not runs(rack)
    assert rack.value("WARN%") == table.NOT_PERMITTED
    assert word(rack, "STATUS%") & table.WARNING
    rack.write("WANT@", False)
    rack.write("PERMIT@", True)
    rack.run(0.1)
    assert runs(rack)
    rack.write("PERMIT@", False)
    rack.run(0.01)
    assert not rack.value("RUNNING@")
    assert word(rack, "FAULTS%") == 0


@pytest.mark.parametrize(
    ("cause", "bit"),
    [
        (lambda rack: rack.write("IET@", True), table.EXTERNAL_TRIP),
        (lambda rack: breaks(rack, "lose_phase", "T1"), table.SYNC_LOSS),
        (lambda rack: breaks(rack, "short_scr", "1"), table.OVERCURRENT),
    ],
    ids=["external trip", "sync loss", "overcurrent"],
)
def test_a_fault_stops_the_drive_until_it_is_reset(tmp_path, cause, bit):
    rack = started(tmp_path, reference=1500)
    rack.run(0.8)
    cause(rack)
    rack.run(0.3)
    assert word(rack, "FAULTS%") == bit
    assert not rack.value("RUNNING@")
    assert word(rack, "STATUS%") & table.FAULT
    assert bool(rack.value("WARN%") & table.REFUSED) == rack.value("RUN@")
    assert not winder(rack).is_closed
    rack.write("FRESET@", True)
    rack.run(0.02)
    assert word(rack, "FAULTS%") & bit or bit == table.OVERCURRENT  # the cause is still there
    rack.write("FRESET@", False)
    breaks(rack, "repair", "all")
    rack.write("IET@", False)
    rack.write("WANT@", False)
    rack.run(0.5)
    reset(rack)
    assert word(rack, "FAULTS%") == 0
    rack.write("WANT@", True)
    rack.run(0.5)
    assert rack.value("RUNNING@")


def test_a_shorted_scr_is_found_before_the_start(tmp_path):
    rack = run_for(built(tmp_path))
    breaks(rack, "short_scr", "13")
    rack.run(0.4)
    rack.write("WANT@", True)
    rack.run(0.4)
    assert word(rack, "FAULTS%") & table.BAD_SCR
    assert rack.value("PAIR%") == 6
    assert not rack.value("RUNNING@")


def test_a_line_of_the_other_rotation_is_a_fault_unless_the_drive_may_take_either(tmp_path):
    rack = run_for(built(tmp_path, plant="line: {rotation: ABC}"), 0.4)
    assert word(rack, "FAULTS%") == table.ROTATION
    either = SPEED_LOOP.replace("130 CCLK@", "125 COMMON ANY@\n130 ANY@ = TRUE\n132 CCLK@")
    folder = tmp_path / "either"
    folder.mkdir()
    yaml = (tmp_path / "rack.yaml").read_text()
    assert "ANY@" not in yaml
    rack = built(folder, either, plant="line: {rotation: ABC}", points="  ANY@: {slot: 10, register: 100, bit: 6}\n")
    rack.start()
    rack.run(0.4)
    reset(rack)
    rack.write("WANT@", True)
    rack.run(0.4)
    rack.write("SREF%", 800)
    rack.run(1.0)
    assert rpm(rack) > 200


def test_stop_all_stops_the_drive_and_leaves_feedback_and_status(tmp_path):
    rack = started(tmp_path, reference=2000)
    rack.run(0.5)
    shown = {name: rack.value(name) for name in ("STATUS%", "SPEED%", "CURRENT%", "LINK%", "COUNT%", "POS%")}
    assert winder(rack).circuit.current_a > 100
    rack.operations.stop_all("for a test")
    assert (rack.value("CONTROL%"), rack.value("CREF%")) == (0, 0)
    rack.run(0.1)
    assert winder(rack).circuit.current_a == 0
    assert not winder(rack).is_closed
    assert {name: rack.value(name) for name in shown} == shown
    rack.operations.run("WIND_A")
    rack.run(0.01)
    assert word(rack, "FAULTS%") == table.COMMUNICATION
    assert not rack.value("RUNNING@")
    reset(rack)
    assert word(rack, "FAULTS%") == 0
    assert runs(rack)


def test_a_power_cycle_stops_the_drive_which_stays_locked_to_its_line(tmp_path):
    rack = started(tmp_path, reference=2000)
    rack.run(0.5)
    rack.operations.power_off()
    rack.run(0.1)
    assert not winder(rack).is_closed
    rack.operations.power_on(auto_run=True)
    rack.run(0.01)
    assert word(rack, "FAULTS%") == table.COMMUNICATION
    assert word(rack, "STATUS%") & table.LOCKED


def test_a_task_that_is_stopped_stops_its_drive(tmp_path):
    rack = started(tmp_path, reference=2000)
    rack.run(0.5)
    rack.operations.stop("WIND_A")
    rack.run(0.1)
    assert not winder(rack).is_closed
    rack.operations.run("WIND_A")
    rack.run(0.01)
    assert word(rack, "FAULTS%") == table.UDC_RUN


def test_without_the_common_clock_the_status_says_so_and_nothing_comes(tmp_path):
    rack = run_for(built(tmp_path, SPEED_LOOP.replace("130 CCLK@ = TRUE\n", "")), 0.4)
    assert rack.value("LINK%") == table.NO_CLOCK
    assert (rack.value("COUNT%"), rack.value("STATUS%")) == (0, 0)
    rack.write("CCLK@", True)
    rack.run(0.0201)
    assert rack.value("LINK%") == 0
    assert rack.value("COUNT%") == 10
    assert runs(rack)
    rack.write("CCLK@", False)
    rack.run(0.05)
    assert rack.value("LINK%") == table.NO_CLOCK
    assert not winder(rack).is_closed


def test_messages_are_counted_to_32000_and_counters_of_rails_reset(tmp_path):
    rack = run_for(built(tmp_path))
    rack.write("BADBITS%", 12)
    rack.run(0.05)
    assert (rack.value("COUNT%"), rack.value("BADBITS%")) == (25, 12)
    rack.write("COUNT%", 31_999)
    rack.write("CLEAR@", True)
    rack.run(0.002)
    assert (rack.value("COUNT%"), rack.value("BADBITS%")) == (32_000, 0)
    rack.run(0.002)
    assert rack.value("COUNT%") == 0


def test_a_rack_goes_on_from_any_instant_bit_for_bit(tmp_path):
    def end(rack: Rack) -> object:
        return rack.now_ns, tuple(rack.memory.image()), rack.plants.state(), rack.state().modules

    whole = started(tmp_path, reference=2000)
    cuts: list[RackState] = []
    for seconds in (0.0, 0.0413, 0.1, 0.25):
        whole.run(seconds)
        cuts.append(whole.state())
    breaks(whole, "lose_tach", "true")
    cuts.append(whole.state())
    whole.run(0.0029)
    cuts.append(whole.state())
    whole.run(0.2)
    for cut in cuts[-2:]:
        rack = built(tmp_path)
        rack.load(cut)
        rack.run((whole.now_ns - cut.now_ns) / 1e9)
        assert end(rack) == end(whole)
    for cut in cuts[:-2]:
        rack = built(tmp_path)
        rack.load(cut)
        rack.run((cuts[-2].now_ns - cut.now_ns) / 1e9)
        breaks(rack, "lose_tach", "true")
        rack.run((whole.now_ns - rack.now_ns) / 1e9)
        assert end(rack) == end(whole)
    json.dumps([module["pmis"] for slot, module in whole.state().modules.items() if slot == 10])


BOTH = """\
rack: PM1
slots:
  0: {module: 57C435, tick_ms: 5.5, tasks: {IDLE: {priority: 5}}}
  10: {module: 57552, tasks: {WIND_A: {drive: A}}, plants: {A: WINDER, B: REEL}}
plants:
  WINDER: {motor: dc_150hp_500v, load: {speed_rpm: 0}}
  REEL: {motor: dc_10hp_240v, motor_overload_ratio: 200, load: {speed_rpm: 0}}
common:
  CCLK@: {slot: 10, register: 2000, bit: 6}
  RUN_A@: {slot: 10, register: 100, bit: 0}
  REF_A%: {slot: 10, register: 101}
  RUN_B@: {slot: 10, register: 1100, bit: 0}
  REF_B%: {slot: 10, register: 1101}
  PERMIT_A@: {slot: 10, register: 201, bit: 0, ros: in, preset: true}
  PERMIT_B@: {slot: 10, register: 1201, bit: 0, ros: in, preset: true}
  AMPS_A%: {slot: 10, register: 207}
  AMPS_B%: {slot: 10, register: 1207}
  FAULTS_A%: {slot: 10, register: 202}
  FAULTS_B%: {slot: 10, register: 1202}
  COUNT_B%: {slot: 10, register: 1081}
"""
ONE_TASK = "10 COMMON CCLK@\n20 CCLK@ = TRUE\n100 CALL SCAN_LOOP(TICKS=4)\n900 END\n"


def test_both_drives_have_registers_and_currents_of_their_own(tmp_path):
    """Drive B has no task of its own: that of A commands it, or here somebody from outside while A's scans."""
    rack = run_for(rack_from(tmp_path, BOTH, IDLE=IDLE, WIND_A=ONE_TASK), 0.4)
    rack.write("RUN_A@", True)
    rack.write("RUN_B@", True)
    rack.write("REF_A%", 2730)
    rack.write("REF_B%", -2048)
    rack.run(0.8)
    assert rack.value("AMPS_A%") == pytest.approx(2730, rel=0.02)
    assert rack.value("AMPS_B%") == pytest.approx(-2048, rel=0.05)
    assert rack.plants["WINDER"].motor.torque_n_m == pytest.approx(2.606 * RATED_A, rel=0.08)  # 100 %
    assert rack.plants["REEL"].motor.torque_n_m == pytest.approx(-1.205 * 36.1, rel=0.2)  # 100 %, with ripple
    assert rack.value("COUNT_B%") == 600
    breaks(rack, "lose_phase", "T1", plant="REEL")
    rack.run(0.1)
    assert (word(rack, "FAULTS_A%"), word(rack, "FAULTS_B%")) == (0, table.SYNC_LOSS)
    assert rack.value("AMPS_A%") == pytest.approx(2730, rel=0.02)
    rack.operations.stop("WIND_A")
    rack.run(0.1)
    assert not rack.plants["WINDER"].is_closed


def test_a_reload_of_its_task_leaves_the_drive_running(tmp_path):
    rack = started(tmp_path, CURRENT, reference=800)
    rack.run(0.2)
    edited = CURRENT.replace("CREF% = SREF%", "CREF% = SREF% + 100")
    rack.operations.reload("WIND_A", SourceText("WIND_A.BLK", edited), keep_state=True)
    rack.run(0.3)
    assert rack.value("RUNNING@")
    assert word(rack, "FAULTS%") == 0
    assert rack.value("CURRENT%") == pytest.approx(900, rel=0.05)


def test_a_force_holds_against_what_the_pmi_sends_and_ends_with_it(tmp_path):
    rack = started(tmp_path, CURRENT, reference=800)
    rack.run(0.3)
    rack.force("CURRENT%", 4095)
    rack.run(0.1)
    assert rack.value("CURRENT%") == 4095
    assert rack.value("SPEED%") > 0
    rack.unforce("CURRENT%")
    rack.run(0.01)
    assert rack.value("CURRENT%") == pytest.approx(800, rel=0.1)
