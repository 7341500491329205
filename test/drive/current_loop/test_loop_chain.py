"""Reference chain, feedback, gains and their limits, against the numbers of section 52; the proposals for gains."""

from dataclasses import replace
from math import exp, pi, sqrt

import pytest

from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop import proposals
from automax_ros.drive.current_loop.regulator import ReferenceChain, Regulator
from automax_ros.drive.current_loop.signals import LINE, PERMISSIVE, VOLTAGE, VOLTS, Command, Pulse, gate_bits
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData
from drive.current_loop.support import Bench, parameters_of

PERIOD_US = 1e6 / 60


@pytest.mark.parametrize(
    ("rate_s", "hertz", "counts"),
    [(0.00035, 60, 32500.0), (11.37, 60, 1.00044), (0.00042, 50, 32500.0), (13.65, 50, 1.0), (1.0, 48, 14.21875)],
)
def test_rate_limit_in_counts_a_scan(rate_s, hertz, counts):
    chain = ReferenceChain()
    chain.scan(32767, rate_s, 200.0, 1 / (6 * hertz))
    assert chain.rate_out == pytest.approx(counts, rel=2e-5)
    chain.scan(-32767, rate_s, 200.0, 1 / (6 * hertz))
    assert chain.rate_out == pytest.approx(0.0, abs=1e-9)


def test_rate_is_limited_to_32767_counts():
    chain = ReferenceChain()
    chain.begin()
    chain.rate_out = -32767.0
    chain.scan(32767, 0.0003, 200.0, 1 / 288)
    assert chain.rate_out == 0.0


def test_no_rate_is_no_limit():
    chain = ReferenceChain()
    chain.scan(4095, 0.0, 200.0, 1 / 360)
    assert chain.rate_out == 4095.0


@pytest.mark.parametrize("lag", [1.0, 50.0, 200.0])
def test_lag_settles_as_a_first_order_lag(lag):
    chain, scans = ReferenceChain(), round(360 / lag)
    for _ in range(scans):
        chain.scan(4000, 0.0, lag, 1 / 360)
    # The project's form of the lag lies within a scan of the continuous one.
    early, late = (4000 * (1 - exp(-lag * (scans + ahead) / 360)) for ahead in (-1, 1))
    assert early <= chain.lag_out <= late


def test_feedback_gain_and_limits_at_their_published_ends():
    regulator = Regulator()
    assert regulator.feedback(4095.0, 1.0) == 4095
    assert regulator.fdbk_gain == 1280
    assert regulator.feedback(1e6, 1.0) == 10238
    assert regulator.feedback(-1e6, 1.0) == -10238
    assert regulator.feedback(0.0, 0.0) == 0
    assert regulator.fdbk_gain == 512
    assert regulator.feedback(123.4, 0.5) == 123
    assert 512 < regulator.fdbk_gain < 1280


def test_integral_gain_follows_the_conduction_time_up_to_ag_factor():
    gain, thresh = 0.03, 700
    shown = []
    for part in (0.999, 0.7, 0.4, 0.2, 0.06):
        regulator = Regulator()
        regulator.begin(2000.0)
        regulator.discontinuous(10.0, 0.2, gain, 50, thresh, part, PERIOD_US)
        shown.append(regulator.integral_gain)
        wanted = 0.55 / (3 * thresh * part**2 / (PERIOD_US / 12))
        assert regulator.integral_gain == round(1024 * min(50 * gain, max(gain, wanted)))
    assert shown == sorted(shown)
    assert shown[-1] == round(1024 * 50 * gain)
    regulator = Regulator()
    regulator.begin(2000.0)
    regulator.discontinuous(10.0, 0.2, gain, 1, thresh, 0.3, PERIOD_US)
    assert regulator.integral_gain == round(1024 * gain), "AG_FACTOR 1 adapts nothing"
    regulator.continuous(10.0, 4.0, 40.0, PERIOD_US, 0.0)
    assert regulator.integral_gain == 32767


def test_delta_stays_in_its_range_and_above_the_inversion_limit():
    regulator = Regulator()
    regulator.begin(4000.0)
    for _ in range(50):
        regulator.continuous(4095.0, 4.0, 1.0, PERIOD_US, 1250.0)
    assert regulator.delta_us == pytest.approx(PERIOD_US / 2)
    for _ in range(50):
        regulator.continuous(-4095.0, 4.0, 1.0, PERIOD_US, 1250.0)
    assert regulator.delta_us == 1250.0


def test_test_mode_shows_the_delta_of_its_alpha():
    # Acceptance: DELTA 8333 at alpha 0 and 0 at alpha 180, LINE_PERIOD 16667, DC_TIME at most 2778.
    bench = Bench("150hp", cml_test=True, test_alpha=180)
    bench.start()
    for alpha in (180, 150, 120):
        bench.set(test_alpha=alpha)
        bench.run(0.1)
        assert bench["DELTA"] == round((180 - alpha) / 360 * 16_666.667)
        assert bench["LINE_PERIOD"] == 16667
        assert 0 < bench["DC_TIME"] <= 2778


@pytest.mark.parametrize("size", sorted(EXAMPLES))
@pytest.mark.parametrize("lim_bar", [150, 250])
def test_proposed_gains_of_a_motor(size, lim_bar):
    drive = parameters_of(size)
    circuit = proposals.circuit_of(drive, lim_bar)
    henry = drive.motor.inductance_h + 2 * drive.source_h
    counts_a = 4095 / (lim_bar / 100 * drive.amps)
    peak_mean = 3 * sqrt(2) / pi * drive.line_v
    # A microsecond earlier adds Vd0 x w x 1 us for a scan of 1/360 s over L.
    slope = peak_mean * 2 * pi * 60 * 1e-6 / 360 / henry * counts_a
    assert proposals.kp(circuit) == pytest.approx(0.65 / slope, abs=1 / 1024)
    assert (proposals.kp(circuit) * 1024).is_integer()
    boundary_a = 0.0931 * peak_mean / (2 * pi * 60 * henry)
    assert proposals.cc_thresh(circuit) == pytest.approx(boundary_a * counts_a, abs=1)
    ohm = drive.motor.resistance_ohm + 0.01 + 360 * drive.source_h
    assert proposals.pi_w_lead(circuit) == pytest.approx(ohm / henry, abs=0.51)
    assert 1 <= proposals.ag_factor(circuit) <= 300
    assert proposals.ref_lag(circuit) == 400


def test_a_command_that_comes_late_begins_its_pulses_at_once():
    plant = DrivePlant(PlantData(derive(EXAMPLES["150hp"])))
    hardware = DriveController(plant)
    gates = gate_bits(1, 6)
    pulses = (Pulse(100_000, 300_000, gates), Pulse(500_000, 2_000_000, gates), Pulse(1_500_000, 1_000_000, gates))
    hardware.command(Command(2_777_778, pulses=pulses), 1_000_000, 2_000_000)
    assert plant.now_ns == 2_000_000
    assert [(on, off) for on, off, _ in sorted(plant.bridge.pending)] == [
        (2_000_000, 3_500_000),
        (2_500_000, 3_500_000),
    ]


def test_voltage_is_scaled_by_the_line_and_the_line_must_be_there():
    drive = derive(EXAMPLES["150hp"])
    data = PlantData(drive, load=LoadData(held_rpm=1000.0))
    measured = DriveController(DrivePlant(data)).measure(5_000_000, VOLTAGE | PERMISSIVE)
    emf = drive.motor.k_v_s * 1000 * pi / 30
    assert measured.voltage == round(emf / 460 * VOLTS)
    assert measured.status & LINE
    assert DriveController(DrivePlant(data)).measure(5_000_000, PERMISSIVE).voltage == 0
    low = DrivePlant(replace(data, parameters=drive))
    low.line.step_voltage(1_000_000, 0.2 * 460)
    assert not DriveController(low).measure(5_000_000).status & LINE
