"""The drive faults (52.1.5, 52.2.2, 52.4), each provoked on a plant: cause, output, latch, reaction, reset, log."""

import pytest

from automax_ros.core.problems import PROBLEMS
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop.signals import EXTERNAL_TRIP, PERMISSIVE
from automax_ros.drive.plant.plant import DrivePlant, PlantData
from drive.current_loop.protected import CLOSED_S, CODES, LOCKED_S, Drive, resets, starts_again, tripped


def running(speed_rad_s=60.0, **changes):
    """A drive with a current, its motor turning."""
    drive = Drive(**{"reference": 2000} | changes)
    drive.plant.motor.speed_rad_s = speed_rad_s
    drive.start()
    drive.run(0.2)
    assert drive.faults == set()
    return drive


# What is caused and taken away by hand: (output, inputs, status bits, plant)
TRIPS = {
    "OSV_OUT": ({"osv_fdbk": 4300, "osv_thresh": 4299}, {"osv_fdbk": 4299}),
    "EXT_IET_OUT": (EXTERNAL_TRIP, 0),
    "PHROT_FLT_OUT": ({"nonstand_phrot": True}, {"nonstand_phrot": False}),
}


def put(drive, change):
    """Bring a cause about, or take it away."""
    if isinstance(change, int):
        drive.status = PERMISSIVE | change
    else:
        drive.inputs = drive.inputs._replace(**change)


@pytest.mark.parametrize("output", TRIPS)
@pytest.mark.parametrize("state", ["standby", "closing", "run"])
def test_a_trip_latches_stops_and_waits_for_its_reset(output, state):
    cause, end = TRIPS[output]
    drive = Drive(osv_thresh=4299, reference=1500)
    drive.run(LOCKED_S)
    if state != "standby":
        drive.run(0.03 if state == "closing" else 0.4, cml_run=True)
        assert (drive.relay, drive["DC_CML_STATE"]) == (True, state == "run")
    put(drive, cause)
    drive.run(0.012)
    assert tripped(drive, output)
    drive.run(0.02, cml_run=False)
    drive.run(0.1, cml_run=True)
    assert tripped(drive, output)
    assert not resets(drive)
    put(drive, end)
    drive.run(0.2)
    assert tripped(drive, output)
    assert resets(drive)
    assert starts_again(drive)
    assert drive.codes == [CODES[output]]


def test_a_fault_is_logged_each_time_it_comes():
    drive = Drive()
    drive.run(LOCKED_S)
    for times in range(1, 4):
        drive.status |= EXTERNAL_TRIP
        drive.run(0.1)
        drive.status = PERMISSIVE
        drive.run(0.1)
        assert drive.codes == ["AMX7114"] * times
        assert resets(drive)


def test_a_reset_that_is_held_hides_no_fault():
    """However short its cause is, and whatever tick it meets, a fault is shown at one tick at least."""
    for delay in range(12):
        drive = Drive(fault_reset=True)
        drive.run(LOCKED_S)
        for _ in range(delay):
            drive.scan()
        rows = len(drive.rows)
        drive.status |= EXTERNAL_TRIP
        drive.scan()
        drive.status = PERMISSIVE
        drive.run(0.05)
        assert [row["EXT_IET_OUT"] for _, row in drive.rows[rows:]].count(True) >= 1
        assert drive.faults == set()


def test_a_reset_counts_in_standby_alone():
    drive = Drive(reference=1500, tach_loss_stop=False, speed_fdbk=0)
    drive.plant.motor.speed_rad_s = 130.0
    drive.start()
    drive.run(0.4)
    assert (drive.faults, drive["DC_CML_STATE"]) == ({"TACH_LOSS_OUT"}, True)
    drive.run(0.1, fault_reset=True)
    assert drive.faults == {"TACH_LOSS_OUT"}
    drive.run(0.1, fault_reset=False, cml_run=False)
    assert (drive.faults, drive["DC_CML_STATE"]) == ({"TACH_LOSS_OUT"}, False)
    assert resets(drive)


def test_a_reset_that_was_held_from_before_the_run_does_nothing_in_it():
    drive = Drive(reference=1500, tach_loss_stop=False, speed_fdbk=0, fault_reset=True)
    drive.plant.motor.speed_rad_s = 130.0
    drive.start()
    drive.run(0.4)
    drive.run(0.2, speed_fdbk=4000)
    assert (drive.faults, drive["DC_CML_STATE"], drive.codes) == ({"TACH_LOSS_OUT"}, True, ["AMX7112"])
    drive.run(0.1, cml_run=False)
    assert drive.faults == set()


def test_drive_ok_goes_away_with_a_fault():
    drive = Drive()
    assert all(outcome.command.ok for outcome in drive.run(LOCKED_S))
    drive.status |= EXTERNAL_TRIP
    assert not drive.scan().command.ok
    drive.status = PERMISSIVE
    assert not any(outcome.command.ok for outcome in drive.run(0.1))
    assert resets(drive)
    assert drive.scan().command.ok
    assert not any(outcome.command.ok for outcome in Drive(lim_bar=0).run(0.1))


def test_a_start_with_the_reset_is_refused():
    drive = Drive()
    drive.run(LOCKED_S)
    drive.status |= EXTERNAL_TRIP
    drive.run(0.02)
    drive.status = PERMISSIVE
    drive.run(0.3, fault_reset=True, cml_run=True)
    assert (drive.faults, drive.relay) == (set(), False)


# IOC


@pytest.mark.parametrize("thresh", [120, 200])
def test_ioc_trips_above_its_threshold(thresh):
    """A shaft that stands, open loop: alpha falls until the current is too large."""
    drive = Drive(cml_test=True, ioc_thresh=thresh, test_alpha=100).start()
    highest = 0.0
    for alpha in range(99, 40, -1):
        drive.run(0.03, test_alpha=alpha)
        if drive.faults:
            break
        highest = max(highest, abs(drive["I_FDBK"]) * 150 / 4095)
    assert tripped(drive, "IOC_OUT")
    assert 0.5 * thresh < highest < thresh
    assert resets(drive)
    drive.run(0.02, test_alpha=120)
    assert starts_again(drive)


@pytest.mark.parametrize("scr", [1, 2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 16])
def test_an_scr_that_fails_in_run_trips_ioc(scr):
    drive = running(0.0)
    drive.plant.circuit.short_scr(scr)
    drive.run(0.02)
    assert tripped(drive, "IOC_OUT")


# Sync loss


@pytest.mark.parametrize("state", ["standby", "run"])
@pytest.mark.parametrize("register", [1, 2])
@pytest.mark.parametrize("value", [0, -1])
def test_a_pll_register_of_0_or_less_is_a_sync_loss(state, register, value):
    drive = running() if state == "run" else Drive()
    drive.run(LOCKED_S)
    registers = [109, 4, 2, 0]
    registers[register] = value
    drive.registers = tuple(registers)
    drive.run(0.05)
    assert tripped(drive, "SYNC_LOSS_OUT")
    assert not drive["SYNC_LOCKED"]
    assert not resets(drive)
    drive.registers = (109, 4, 2, 0)
    drive.run(1.5)
    assert (drive["SYNC_LOCKED"], drive.faults) == (True, {"SYNC_LOSS_OUT"})
    assert resets(drive)
    assert starts_again(drive)


@pytest.mark.parametrize("registers", [(109, 0, 2, 0), (109, 4, 0, 0)])
def test_a_pll_register_of_0_counts_before_the_first_lock(registers):
    drive = Drive()
    drive.scan()
    drive.registers = registers
    drive.run(0.02)
    assert drive.faults == {"SYNC_LOSS_OUT"}


def test_the_registers_of_before_the_task_do_not_count():
    drive = Drive()
    drive.registers = (0, 0, 0, 3)
    assert drive.scan().initialised
    drive.registers = (109, 4, 2, 0)
    drive.run(LOCKED_S)
    assert (drive["SYNC_LOCKED"], drive.faults) == (True, set())


@pytest.mark.parametrize("state", ["standby", "run"])
def test_a_lost_sync_phase_is_a_sync_loss(state):
    drive = running() if state == "run" else Drive()
    drive.run(LOCKED_S)
    drive.plant.line.lose_phase(drive.plant.now_ns, 0)
    drive.run(0.05)
    assert drive.faults >= {"SYNC_LOSS_OUT"}
    assert not drive["SYNC_LOCKED"]
    assert not resets(drive)
    drive.plant.line.restore_phase(drive.plant.now_ns, 0)
    drive.run(1.5)
    assert resets(drive)


def test_no_line_is_a_sync_loss_after_a_second():
    drive = Drive()
    drive.hardware.plant = None
    drive.run(0.9)
    assert drive.faults == set()
    drive.run(0.2)
    assert (drive.faults, drive.codes) == ({"SYNC_LOSS_OUT"}, ["AMX7111"])


# Overspeed, overvoltage


@pytest.mark.parametrize(
    ("feedback", "thresh", "trips"),
    [
        (4299, 4299, False), (4300, 4299, True), (-4299, 4299, False), (-4300, 4299, True), (0, 0, False), (1, 0, True),
        (-32768, 32767, True), (32767, 32767, False), (None, 0, False),
    ],
)  # fmt: skip
def test_osv_compares_magnitudes(feedback, thresh, trips):
    drive = Drive(osv_fdbk=feedback, osv_thresh=thresh)
    drive.run(0.1)
    assert drive.faults == ({"OSV_OUT"} if trips else set())


# Phase rotation


@pytest.mark.parametrize("standard", [True, False])
@pytest.mark.parametrize("nonstand", [True, False])
@pytest.mark.parametrize("auto", [True, False])
def test_the_rotation_must_be_the_programmed_one_or_be_followed(standard, nonstand, auto):
    plant = DrivePlant(PlantData(derive(EXAMPLES["150hp"]), inertia=1000.0, standard_rotation=standard))
    drive = Drive(plant=plant, nonstand_phrot=nonstand, auto_phrot=auto, reference=1500)
    drive.run(LOCKED_S)
    drive.run(0.5, cml_run=True)
    if standard == nonstand and not auto:
        assert tripped(drive, "PHROT_FLT_OUT")
    else:
        # Fired in the order of the line: the current is regulated as ever, one pair after the other.
        assert (drive.faults, drive["DC_CML_STATE"]) == (set(), True)
        assert drive["I_FDBK"] > 0
        drive.plant.circuit.take_events()
        drive.run(0.2)
        assert drive.plant.circuit.take_events() == []


def test_nonstand_phrot_is_read_as_the_fault_is_looked_for():
    drive = Drive()
    drive.run(0.2)
    drive.inputs = drive.inputs._replace(nonstand_phrot=True)
    drive.scan()
    assert drive.codes == ["AMX7115"]


# Several


def test_faults_that_come_at_once_are_all_logged():
    drive = running()
    drive.status |= EXTERNAL_TRIP
    drive.inputs = drive.inputs._replace(osv_fdbk=9999, nonstand_phrot=True)
    assert drive.scan().problems == (7113, 7114, 7115)
    drive.run(0.02)
    assert drive.faults == {"OSV_OUT", "EXT_IET_OUT", "PHROT_FLT_OUT"}
    drive.status = PERMISSIVE
    drive.run(0.02, fault_reset=True)
    assert drive.faults == {"OSV_OUT", "PHROT_FLT_OUT"}


def test_one_fault_of_the_table_has_the_hardwares_code():
    assert {code for code in CODES.values() if PROBLEMS[code].hardware} == {"AMX7116"}


def test_a_restart_of_the_task_forgets_faults_but_not_their_causes():
    drive = Drive(osv_fdbk=1)
    drive.run(LOCKED_S)
    drive.loop.restart()
    drive.run(0.02)
    assert drive.codes == ["AMX7113"] * 2
    drive.loop.restart()
    drive.run(LOCKED_S, osv_fdbk=0)
    assert drive.faults == set()
    drive.run(0.02, cml_run=False)
    drive.run(CLOSED_S, cml_run=True)
    assert drive["DC_CML_STATE"]
