"""The hardware's overspeed circuit of DIGITAL_TACH: it trips a drive whose loop does not see the speed, or rests."""

from __future__ import annotations

from pathlib import Path

import pytest
from replay.replays import record, replayed

from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from rack.drives.test_drive_faults import CML, YAML, active, logged, rack_of, reset, start, turning

BLIND = CML.replace("OSV_FDBK=SPD%, ", "")
"""Without OSV_FDBK the loop looks for no overspeed (52.1.5); the threshold is 3600 counts, 1538.5 rpm."""
LIMIT_RPM = 3600 / 4095 * 1750
OVERHAULING_NM = "-2000"
"""A load that drives the shaft."""


def blind(folder: Path, **changes: str) -> Rack:
    """Return a rack whose drive keeps a speed below the threshold."""
    return turning(folder, **{"cml": BLIND, **changes})


def rpm(rack: Rack) -> float:
    return rack.plants["UNWIND"].motor.speed_rad_s * 30 / 3.141592653589793


def beyond(rack: Rack) -> float:
    """Let the drive turn beyond the threshold; return the speed at which it tripped, or the last."""
    rack.write("WANTED%", 4000)
    for _ in range(2000):
        rack.run(0.001)
        if rack.value("OSV@"):
            break
    return rpm(rack)


def slow_down(rack: Rack) -> None:
    """Let the load brake the shaft to 500 rpm."""
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", "2000")
    while rpm(rack) > 500.0:
        rack.run(0.01)
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", "0")


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_drive_whose_loop_does_not_see_the_speed_trips(tmp_path, execution):
    rack = blind(tmp_path, execution=execution)
    speed = beyond(rack)
    assert LIMIT_RPM < speed < 1.1 * LIMIT_RPM
    assert active(rack) == {"OSV@"}
    assert [f"AMX{code}" for code in logged(rack)] == ["AMX7119"]
    assert not rack.value("STATE@")
    assert not rack.value("FMCR@")
    rack.run(0.05)
    assert not rack.plants["UNWIND"].is_closed
    # A trip whose cause is still there cannot be reset.
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", "-200")
    assert not reset(rack)
    slow_down(rack)
    assert not start(rack)
    assert reset(rack)
    rack.write("WANTED%", 1000)
    assert start(rack)
    assert logged(rack) == [7119]


@pytest.mark.parametrize("text", ["DIGITAL_TACH=FALSE, ", "OSV_THRESH=0, "])
def test_without_a_digital_tachometer_or_a_threshold_nothing_trips(tmp_path, text):
    cml = BLIND.replace("OSV_THRESH=3600, ", "OSV_THRESH=3600, " + text if "FALSE" in text else text)
    rack = turning(tmp_path, cml=cml)
    assert beyond(rack) > 1.1 * LIMIT_RPM
    assert active(rack) == set()


def test_a_sound_osv_fdbk_trips_first_and_is_logged_once(tmp_path):
    rack = turning(tmp_path)
    beyond(rack)
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", "-200")
    rack.run(0.2)
    assert (active(rack), logged(rack)) == ({"OSV@"}, [7113])
    assert not reset(rack)


def test_the_threshold_follows_the_scale_of_the_tachometer(tmp_path):
    """4095 counts are what the feed says, not the motor's base speed."""
    yaml = YAML.replace("value: [-1750.0, 1750.0]", "value: [-1400.0, 1400.0]")
    rack = blind(tmp_path, yaml=yaml)
    assert 3600 / 4095 * 1400 < beyond(rack) < 1.1 * 3600 / 4095 * 1400


def test_it_stays_on_guard_while_the_task_is_stopped(tmp_path):
    """The motor runs away with the drive off; the trip is told as the task runs again, and holds the drive off."""
    rack = blind(tmp_path)
    rack.operations.stop("CML")
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", OVERHAULING_NM)
    rack.run(1.0)
    assert rpm(rack) > LIMIT_RPM
    slow_down(rack)
    rack.operations.run("CML")
    rack.run(0.6)
    assert (active(rack), logged(rack)) == ({"OSV@"}, [7119])
    assert not start(rack)
    assert reset(rack)
    assert start(rack)


def test_a_loss_of_power_forgets_the_trip(tmp_path):
    rack = blind(tmp_path)
    beyond(rack)
    rack.operations.power_off()
    slow_down(rack)
    rack.operations.power_on()
    rack.operations.run_all()
    rack.write("PERMIT@", True)
    rack.run(0.6)
    assert active(rack) == set()


def test_the_trip_needs_no_scan(tmp_path):
    """Interrupts whose scans never end: the hardware takes gates and contactor away by itself."""
    rack = blind(tmp_path)
    port = rack.drives.port(7)
    port._interrupts._due = lambda *_: None
    port._controller.overspeed.counts = 2600
    SwitchOperations(rack).plant("UNWIND", "load_torque_nm", OVERHAULING_NM)
    rack.run(0.5)
    assert port._controller.overspeed.tripped
    assert not rack.value("FMCR@")
    assert not rack.plants["UNWIND"].is_closed


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_recording_with_a_trip_runs_again(tmp_path, execution):
    def steps(rack, number):
        if number == 0:
            rack.write("PERMIT@", True)
        elif number == 6:
            rack.write("RUN@", True)
        elif number == 12:
            rack.write("WANTED%", 4000)

    rack = rack_of(tmp_path, cml=BLIND, execution=execution)
    bag = record(rack, tmp_path / "bag", steps, seconds=4.0)
    assert logged(rack) == [7119]
    report = replayed(bag)
    assert report.identical, report.text()


def test_a_state_goes_on_bit_for_bit(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    rack = blind(tmp_path / "a")
    rack.write("WANTED%", 4000)
    while rpm(rack) < LIMIT_RPM + 5:
        rack.run(0.001)
    assert not rack.value("OSV@"), "it still counts"
    state = rack.state()
    again = rack_of(tmp_path / "b", cml=BLIND)
    for task in rack.tasks:
        again.task(task.name).restore(task.snapshot())
    again.load(state)
    for one in (rack, again):
        one.run(0.1)
        assert one.value("OSV@")
    assert again.state() == rack.state()
