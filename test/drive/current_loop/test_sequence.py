"""Start, stop, coast stop and test mode (52.1.3, 52.1.4, 52.3.1), end to end with a plant."""

from dataclasses import replace
from math import atan, cos, exp, pi, sin, sqrt

import pytest

from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop.sequence import Phase
from automax_ros.drive.current_loop.signals import FMCR, PERMISSIVE, RMCR
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData
from drive.current_loop.protected import CLOSED_S, LOCKED_S, Drive

HALF_PERIOD_US = 8333


def closed(drive):
    """Whether the contactor is closed."""
    return drive.plant.bridge.wiring.armature_closed and not drive.plant.bridge.wiring.armature_arc_v


def test_it_runs_within_half_a_second_of_the_edge():
    drive = Drive(reference=1000)
    drive.run(LOCKED_S)
    assert (drive["SYNC_LOCKED"], drive["DC_CML_STATE"], drive.relay, closed(drive)) == (True, False, False, False)
    edge_ns = drive.now_ns
    drive.run(0.5, cml_run=True)
    ran_ns = next(now for now, row in drive.rows if row["DC_CML_STATE"])
    assert 0.025 < (ran_ns - edge_ns) / 1e9 < 0.5
    assert (drive.relay, closed(drive), drive["I_FDBK"] > 0) == (True, True, True)


def test_the_contactor_is_closed_before_a_gate_is_fired():
    drive = Drive(reference=4000)
    drive.run(LOCKED_S)
    drive.inputs = drive.inputs._replace(cml_run=True)
    while not drive.scan().command.pulses:
        assert drive.plant.circuit.current_a == 0.0
    assert closed(drive)


@pytest.mark.parametrize(("select", "relay"), [(False, FMCR), (True, RMCR)])
def test_mcr_select_counts_at_the_edge(select, relay):
    drive = Drive()
    drive.run(LOCKED_S, mcr_select=not select)
    assert {outcome.command.relays for outcome in drive.run(CLOSED_S, cml_run=True, mcr_select=select)[2:]} == {relay}
    assert {outcome.command.relays for outcome in drive.run(CLOSED_S, mcr_select=not select)} == {relay}


def test_a_start_needs_an_edge():
    drive = Drive(cml_run=True)
    drive.run(1.0)
    assert (drive["SYNC_LOCKED"], drive.relay) == (True, False)
    drive.run(0.02, cml_run=False)
    drive.run(CLOSED_S, cml_run=True)
    assert drive["DC_CML_STATE"]


@pytest.mark.parametrize("hinder", ["permissive", "lock", "fault", "coast stop before"])
def test_an_edge_that_comes_too_early_is_forgotten(hinder):
    drive = Drive()
    drive.run(0.02 if hinder == "lock" else LOCKED_S)
    assert drive["SYNC_LOCKED"] == (hinder != "lock")
    if hinder == "permissive":
        drive.status = 0
    elif hinder == "fault":
        drive.run(0.02, osv_fdbk=100)
    elif hinder == "coast stop before":
        drive.run(CLOSED_S, cml_run=True)
        drive.run(0.02, cml_coast_stop=True)
        drive.run(0.02, cml_coast_stop=False)
    drive.run(0.02, cml_run=True)
    assert not drive.relay
    drive.status = PERMISSIVE
    drive.run(0.02, osv_fdbk=0)
    drive.run(LOCKED_S, fault_reset=True)
    assert (drive["SYNC_LOCKED"], drive.faults, drive.relay) == (True, set(), False)
    drive.run(0.02, fault_reset=False, cml_run=False)
    drive.run(CLOSED_S, cml_run=True)
    assert drive["DC_CML_STATE"]


def test_a_start_that_is_taken_back_opens_the_contactor():
    drive = Drive(reference=1000)
    drive.run(LOCKED_S)
    drive.inputs = drive.inputs._replace(cml_run=True)
    while not closed(drive):
        drive.scan()
    assert (drive.relay, closed(drive), drive["DC_CML_STATE"]) == (True, True, False)
    drive.run(0.01, cml_run=False)
    assert not drive.relay
    drive.run(0.5)
    assert not closed(drive)
    assert not any(row["DC_CML_STATE"] for _, row in drive.rows)


@pytest.mark.parametrize(("rate", "lag"), [(0.0, 400.0), (10.0, 1.0)])
def test_a_stop_waits_for_discontinuous_conduction(rate, lag):
    drive = Drive(reference=2500, ref_lag=lag).start()
    drive.run(5.0 if lag == 1.0 else 0.3)
    assert (drive["DC_TIME"], drive["I_FDBK"] > 2400) == (0, True)
    drive.run(0.02, ref_rate=rate)
    stop_ns = drive.now_ns
    drive.inputs = drive.inputs._replace(cml_run=False)
    while drive.relay:
        assert drive["DC_CML_STATE"]
        drive.scan()
    assert drive.loop.control.discontinuous
    assert 0.0055 < (drive.now_ns - stop_ns) / 1e9 < 0.1
    # No arc: the current has ended before the contacts open.
    while closed(drive):
        drive.scan()
        assert drive.plant.bridge.wiring.armature_arc_v == 0.0
    drive.run(0.02)
    assert (drive["DC_CML_STATE"], drive.plant.circuit.current_a) == (False, 0.0)


def slow_drive(**changes):
    """A motor that turns backwards in a circuit with a time constant of 200 s: its current lasts."""
    parameters = derive(EXAMPLES["150hp"])
    slow = replace(parameters, motor=replace(parameters.motor, inductance_h=20.0))
    drive = Drive(plant=DrivePlant(PlantData(slow, inertia=1000.0)), reference=4000, kp=1.0, **changes)
    drive.plant.motor.speed_rad_s = -100.0
    return drive


@pytest.mark.parametrize("dropout", [0.1, 0.3, 1.0])
def test_max_m_dropout_ends_a_stop_whose_current_lasts(dropout):
    drive = slow_drive(max_m_dropout=dropout).start()
    drive.run(2.0)
    assert drive["DC_TIME"] == 0
    stop_ns = drive.now_ns
    drive.inputs = drive.inputs._replace(cml_run=False)
    while drive.relay:
        drive.scan()
    assert (drive.now_ns - stop_ns) / 1e9 == pytest.approx(dropout, abs=0.012)
    assert drive.plant.circuit.current_a > 0.0
    drive.run(3.0)
    assert drive.plant.circuit.current_a == 0.0


def test_run_again_during_a_stop_is_no_start():
    drive = slow_drive().start()
    drive.run(2.0)
    drive.run(0.02, cml_run=False)
    assert (drive["DC_CML_STATE"], drive.loop.sequence.phase) == (True, Phase.STOPPING)
    drive.run(0.05, cml_run=True)
    assert drive.loop.sequence.phase == Phase.STOPPING
    drive.run(0.5)
    assert (drive["DC_CML_STATE"], drive.relay) == (False, False)


@pytest.mark.parametrize("cause", ["input", "permissive", "fault"])
def test_a_coast_stop_takes_the_gates_away_at_once(cause):
    drive = Drive(reference=2500).start()
    drive.run(0.3)
    if cause == "permissive":
        drive.status = 0
    drive.inputs = drive.inputs._replace(cml_coast_stop=cause == "input", osv_fdbk=30000 if cause == "fault" else None)
    outcomes = drive.run(0.008)
    stopped = next(place for place, outcome in enumerate(outcomes) if not outcome.command.relays)
    assert stopped <= 2
    assert all(outcome.command.pulses == () and outcome.command.block for outcome in outcomes[stopped:])
    assert not drive["DC_CML_STATE"]
    assert drive.codes == (["AMX7113"] if cause == "fault" else [])
    drive.status = PERMISSIVE
    drive.run(0.5, cml_coast_stop=False, osv_fdbk=None)
    assert (drive["DC_CML_STATE"], drive.relay, closed(drive)) == (False, False, False)


def test_a_contactor_that_opens_under_current_draws_an_arc():
    drive = slow_drive().start()
    drive.run(1.0)
    coasted_ns = drive.now_ns
    drive.run(0.02, cml_coast_stop=True)
    assert drive.plant.circuit.current_a > 10.0
    assert closed(drive)
    while not drive.plant.bridge.wiring.armature_arc_v:
        drive.scan()
    assert 0.02 < (drive.now_ns - coasted_ns) / 1e9 < 0.035
    drive.run(2.0)
    assert (drive.plant.circuit.current_a, drive.plant.bridge.wiring.armature_closed) == (0.0, False)


# Test mode


def locked_rotor(**changes):
    """A drive in test mode whose shaft is held."""
    plant = DrivePlant(PlantData(derive(EXAMPLES["150hp"]), load=LoadData(held_rpm=0.0)))
    return Drive(plant=plant, cml_test=True, **changes)


@pytest.mark.parametrize(("alpha", "delta"), [(180, 0), (150, 1389), (120, 2778), (100, 3704), (90, 4167)])
@pytest.mark.parametrize("bridge_2", [False, True])
def test_the_test_mode_fires_at_test_alpha(alpha, delta, bridge_2):
    drive = locked_rotor(test_alpha=alpha, test_brpol=bridge_2).start()
    drive.run(0.2)
    assert (drive["LINE_PERIOD"], drive["DELTA"], drive["BRIDGE_POL"]) == (16667, delta, bridge_2)
    assert drive.codes == []
    current = drive["I_FDBK"] * (-1 if bridge_2 else 1)
    assert (current > 0) == (alpha < 120)


def test_alpha_0_is_half_a_period():
    """A motor that turns as fast as the open bridge drives it."""
    drive = Drive(cml_test=True, test_alpha=0, inertia=1000.0)
    drive.plant.motor.speed_rad_s = 620.0 / drive.plant.data.parameters.motor.k_v_s
    drive.start()
    drive.run(0.1)
    assert (drive["DELTA"], drive.codes) == (HALF_PERIOD_US, [])


def test_a_locked_rotor_at_90_degrees_has_no_mean_voltage():
    drive = locked_rotor(test_alpha=90).start()
    drive.run(0.1)
    volts = []
    for _ in range(60):
        drive.scan()
        drive.plant.advance(drive.now_ns)
        volts.append(drive.plant.circuit.sample().volt_s)
    assert abs(sum(volts) / (60 / 360)) < 0.02 * 621


def boundary_current_a(parameters, alpha):
    """The mean current at the edge of discontinuous conduction: section 12.4 of the fact sheet."""
    r, l = parameters.motor.resistance_ohm + 0.01, parameters.motor.inductance_h + 2 * parameters.source_h  # noqa: E741
    omega, peak = 2 * pi * 60, sqrt(2) * parameters.line_v
    phi = atan(omega * l / r)
    psi, e3 = pi / 3 + alpha - phi, exp(-pi / 3 / (omega * l / r))
    emf = peak * cos(phi) * (sin(pi / 3 + psi) - sin(psi) * e3) / (1 - e3)
    return (3 / pi * peak * cos(alpha) - emf) / r


@pytest.mark.parametrize("alpha", [90, 95, 100, 110])
def test_the_current_of_a_locked_rotor_is_discontinuous(alpha):
    drive = locked_rotor(test_alpha=alpha).start()
    drive.run(0.2)
    rated = drive.plant.rated_amps
    highest = boundary_current_a(drive.plant.data.parameters, alpha * pi / 180) / (1.5 * rated) * 4095
    assert 0 < drive["DC_TIME"] <= 2778
    assert 0 < drive["I_FDBK"] <= highest


def test_test_mode_makes_no_records_and_stops_like_a_run():
    drive = locked_rotor(test_alpha=95).start()
    drive.run(0.2)
    assert drive["I_FDBK"] > 0
    assert drive.records == []
    drive.run(0.1, cml_run=False)
    assert (drive["DC_CML_STATE"], drive.relay) == (False, False)


def test_an_overcurrent_trips_in_test_mode():
    drive = locked_rotor(test_alpha=60)
    drive.run(LOCKED_S)
    drive.run(0.2, cml_run=True)
    assert any(row["DC_CML_STATE"] for _, row in drive.rows)
    assert (drive.faults, drive["DC_CML_STATE"]) == ({"IOC_OUT"}, False)


# Records


def test_records_are_made_while_the_loop_regulates():
    drive = Drive(reference=1500)
    drive.run(LOCKED_S)
    assert drive.records == []
    drive.start()
    first = len(drive.records)
    scans = drive.run(0.2)
    assert len(drive.records) - first == len(scans)
    feedback, wanted, _ = drive.records[-1][1]
    assert (feedback, wanted) == (drive.loop.outputs.i_fdbk, 1500)
    drive.run(0.02, cml_coast_stop=True)
    count = len(drive.records)
    drive.run(0.2)
    assert len(drive.records) == count


def test_a_record_holds_the_gates_that_make_the_next_feedback():
    """The SCRs of a record are those that turn on before the next interrupt, two at a time in firing order."""
    drive = Drive(reference=2500).start()
    drive.run(0.3)
    for _ in range(24):
        command = drive.scan().command
        gates = drive.records[-1][1][2]
        drive.plant.advance(drive.now_ns - 1)
        fired = sum(1 << (number - 1) for number in drive.plant.bridge.gated_numbers(drive.plant.now_ns))
        assert gates == fired
        assert command.pulses[0].gates == gates
        assert gates in {0x21, 0x03, 0x06, 0x0C, 0x18, 0x30}
