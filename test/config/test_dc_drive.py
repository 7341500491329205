"""The example of a DC drive does what its README says; its BASIC task names what is broken; it replays bit for bit."""

from __future__ import annotations

import shutil

import pytest

from automax_ros.cli.main import main
from automax_ros.rack.rack import Rack
from config.examples import CONFIG, built, play

FOLDER = CONFIG / "dc_drive"
TURN_RPM = 1200
COUNTS_A_RPM = 4095 / 1750


def started(set_point: int, seconds: float = 7.0) -> Rack:
    """The rack some time after its start with a set-point of speed, in rpm."""
    rack = built(FOLDER)
    rack.start([("SPEED_SP%", set_point)])
    run_to(rack, seconds)
    return rack


def run_to(rack: Rack, seconds: float) -> None:
    rack.scheduler.run_until(round(seconds * 1e9))


@pytest.fixture(scope="module")
def tour() -> dict[float, dict[str, object]]:
    """The values of the simple commons at the instants of the README's table."""
    rack = built(FOLDER)
    play(rack, FOLDER / "tour.yaml")
    names = [item.name for item in rack.config.variables if not item.dimensions and not item.name.endswith("$")]
    seen = {}
    first = (0.9, 1.1, 1.3, 3.0, 6.9, 7.3, 9.9, 12.1, 12.2)
    for instant in (*first, 17.0, 19.9, 22.9, 25.9, 26.2, 28.9, 29.1, 31.4, 39.9):
        run_to(rack, instant)
        seen[instant] = {name: rack.value(name) for name in names if ":" not in name}
    seen[40.0] = {"errors": [(entry.code, entry.scan) for entry in rack.task("CML").errors.entries]}
    return seen


def test_a_start_tests_the_scrs_and_takes_a_quarter_of_a_second(tour):
    assert tour[0.9]["SYNC@"] is True
    assert tour[0.9]["FMCR@"] is False
    assert (tour[1.1]["FMCR@"], tour[1.1]["CML_STATE@"]) == (True, False)
    assert tour[1.3]["CML_STATE@"] is True


def test_the_ramp_takes_the_motor_to_speed_without_an_error_that_lasts(tour):
    assert 850 <= tour[3.0]["CUR_FB%"] <= 1000
    assert abs(tour[6.9]["SPD%"] - TURN_RPM * COUNTS_A_RPM) <= 2
    assert abs(tour[6.9]["RPM"] - TURN_RPM) < 1


def test_current_carries_the_load_by_the_motors_own_constant(tour):
    """400 N m more are 400 / (2.606 V s) amperes, 4095 counts being 1.5 x 245.8 A."""
    more = tour[9.9]["CUR_FB%"] - tour[6.9]["CUR_FB%"]
    assert more == pytest.approx(400 / 2.606 * 4095 / (1.5 * 245.8), rel=0.01)
    assert tour[7.3]["SPD%"] < tour[6.9]["SPD%"] - 100


def test_reversal_changes_bridges_and_brakes_into_the_line(tour):
    assert (tour[12.1]["BRIDGE@"], tour[12.2]["BRIDGE@"]) == (False, True)
    assert tour[12.2]["SPD%"] > 2000, "it still turns forward while bridge 2 brakes"
    assert tour[12.2]["DELTA%"] < 4167
    assert abs(tour[19.9]["RPM"] + TURN_RPM) < 1
    assert tour[19.9]["BRIDGE@"] is True


def test_a_stop_brings_it_to_rest_and_opens_the_contactor(tour):
    assert (tour[22.9]["CML_STATE@"], tour[22.9]["FMCR@"]) == (False, False)
    assert abs(tour[22.9]["RPM"]) < 20


def test_a_shorted_scr_is_found_at_the_next_start_and_reset(tour):
    assert (tour[25.9]["F_SCR@"], tour[25.9]["SCR_NUM%"]) == (False, 0)
    assert (tour[26.2]["F_SCR@"], tour[26.2]["SCR_NUM%"], tour[26.2]["FMCR@"]) == (True, 3, False)
    assert tour[28.9]["F_SCR@"] is True, "a new SCR alone does not reset"
    assert tour[29.1]["F_SCR@"] is False
    assert tour[40.0]["errors"][0][0] == 7116
    assert abs(tour[39.9]["RPM"] - 600) < 1


@pytest.mark.parametrize(("set_point", "number"), [(1200, 1), (1200, 4), (300, 6), (-900, 13)])
def test_diag_names_an_open_gate(set_point, number):
    rack = started(set_point)
    circuit = rack.plants["MOTOR"].circuit
    assert (rack.value("OPEN_GATE%"), rack.value("LOST_PHASE%")) == (0, 0)
    circuit.open_gate(number)
    run_to(rack, 9.2)
    assert (rack.value("OPEN_GATE%"), rack.value("LOST_PHASE%")) == (number, 0)
    circuit.open_gate(number, is_open=False)
    run_to(rack, 12.0)
    assert (rack.value("OPEN_GATE%"), rack.value("LOST_PHASE%")) == (0, 0)
    assert any(f"SCR {number}" in line for line in rack.task("DIAG").printed)


@pytest.mark.parametrize(("set_point", "terminal"), [(1200, 1), (1200, 2), (300, 3), (-900, 1)])
def test_diag_names_a_missing_phase(set_point, terminal):
    rack = started(set_point)
    rack.plants["MOTOR"].circuit.open_phase(terminal - 1)
    run_to(rack, 9.2)
    assert (rack.value("LOST_PHASE%"), rack.value("OPEN_GATE%")) == (terminal, 0)
    assert rack.value("FAULT@") is False


@pytest.mark.parametrize("terminal", [1, 2, 3])
def test_diag_names_a_missing_phase_under_a_great_current(terminal):
    """At 300 rpm with the rated torque what is left of the current never ends: it is least where it begins."""
    rack = started(300, 5.0)
    rack.plants["MOTOR"].load_torque_nm = 600.0
    run_to(rack, 7.5)
    assert rack.value("CUR_FB%") > 2500
    rack.plants["MOTOR"].circuit.open_phase(terminal - 1)
    run_to(rack, 9.5)
    assert (rack.value("LOST_PHASE%"), rack.value("OPEN_GATE%")) == (terminal, 0)
    assert rack.value("FAULT@") is False


def test_a_runaway_load_trips_the_overspeed_fault():
    rack = started(1700)
    assert rack.value("F_OSV@") is False
    rack.plants["MOTOR"].load_torque_nm = -1500.0
    run_to(rack, 8.0)
    assert rack.value("RPM") > 4505 / COUNTS_A_RPM
    assert rack.value("F_OSV@") is True


@pytest.mark.parametrize("set_point", [1750, -1750])
def test_the_largest_set_point_is_kept_by_a_regulator_that_sees_what_lies_above_it(set_point):
    rack = started(set_point, 12.0)
    assert abs(rack.value("RPM") - set_point) < 10
    assert rack.value("FAULT@") is False


def test_an_emergency_stop_lets_it_coast_and_needs_a_new_start():
    rack = built(FOLDER)
    rack.start()
    run_to(rack, 6.0)
    rack.write("ESTOP_OK@", False)
    run_to(rack, 6.1)
    assert (rack.value("CML_STATE@"), rack.value("FMCR@")) == (False, False)
    assert rack.value("RPM") > 900
    rack.write("START_PB@", False)
    rack.write("ESTOP_OK@", True)
    run_to(rack, 7.0)
    assert rack.value("CML_STATE@") is False
    rack.write("START_PB@", True)
    run_to(rack, 7.5)
    assert rack.value("CML_STATE@") is True
    run_to(rack, 12.0)
    assert abs(rack.value("RPM") - TURN_RPM) < 2
    assert rack.value("FAULT@") is False, "a start on a turning motor trips nothing"


@pytest.mark.timeout(300)
def test_the_tour_replays_and_an_edited_speed_loop_differs_where_it_acts(tmp_path, capsys):
    bag = tmp_path / "tour"
    arguments = ["run", str(FOLDER), "--simulated", "--duration", "6", "--stimuli", str(FOLDER / "tour.yaml")]
    assert main([*arguments, "--record", str(bag)]) == 0
    assert main(["replay", str(bag)]) == 0
    edited = tmp_path / "SPEED.BLK"
    text = (FOLDER / "SPEED.BLK").read_text()
    assert "CURRENT=5.6" in text
    edited.write_text(text.replace("CURRENT=5.6", "CURRENT=5.7"))
    capsys.readouterr()
    assert main(["replay", str(bag), "--task", f"SPEED={edited}"]) == 1
    # The loop begins to run at 1.194 s; the first error of speed after it is multiplied by another gain.
    told = capsys.readouterr().out
    assert "First difference: task SPEED, scan 110 at 1.199 s" in told
    assert "CUR_REF%: recorded 62, replayed 63" in told


@pytest.mark.parametrize("is_wired", [False, True])
def test_a_fast_change_at_full_speed_trips_only_without_the_armature_voltage(tmp_path, is_wired):
    folder = tmp_path / "drive"
    shutil.copytree(FOLDER, folder)
    rack_file = folder / "rack.yaml"
    if not is_wired:
        rack_file.write_text(rack_file.read_text().replace(", drive: 7}", "}"))
    rack = built(folder)
    rack.start([("SPEED_SP%", 1750)])
    run_to(rack, 7.0)
    # A load that pulls along wants bridge 2 at once, while the EMF is that of full speed.
    rack.plants["MOTOR"].load_torque_nm = -300.0
    run_to(rack, 8.0)
    assert rack.value("F_IOC@") is not is_wired
    assert rack.value("BRIDGE@") is True
