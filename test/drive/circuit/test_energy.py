"""Energy: source = losses + stored + shaft over start, reversal through both bridges and a load step."""

from math import radians

import numpy as np
import pytest

from automax_ros.drive.base.motor import Motor
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.conduction import EventKind
from automax_ros.drive.circuit.firing import ConstantAlpha
from drive.support import circuit_of, fire_all, oracle_gates, plan
from drive.switched import Switched

SECOND = 1_000_000_000


class Regulated:
    """A motor on both bridges with the least that keeps a current: alpha follows the error of the mean."""

    def __init__(self, plate="150hp", **options):
        self.parameters = parameters = derive(EXAMPLES[plate])
        line = AcLine(parameters.line_v, inductance_h=parameters.source_h, resistance_ohm=0.004)
        self.motor = Motor(parameters.motor)
        self.circuit = Circuit(line, Bridge(drop_v=1.3), self.motor, energy=True, **options)
        self.firing = ConstantAlpha(self.circuit, radians(90), pulse_rad=radians(10))
        self.least_deg = 15.0

    def hold(self, current_a, until_ns):
        """Let the active bridge carry a current; returns what was sampled each firing interval."""
        samples = []
        while self.circuit.now_ns < until_ns:
            self.firing.advance(min(until_ns, self.circuit.now_ns + 2_777_778))
            sample = self.circuit.sample()
            samples.append(sample)
            mean = sample.mean_current_a if self.firing.bridge == 1 else -sample.mean_current_a
            step = 0.03 * (current_a - mean) / self.parameters.amps * 90
            angle = self.firing.alpha_rad - radians(min(max(step, -2.0), 2.0))
            self.firing.alpha_rad = min(max(angle, radians(self.least_deg)), radians(145))
        return samples

    def change_bridge(self, bridge):
        """Phase back until no current flows, then fire the other bridge from far back."""
        self.firing.alpha_rad = radians(150)
        self.firing.advance(self.circuit.now_ns + SECOND // 20)
        assert self.circuit.current_a == 0.0
        self.circuit.bridge.cancel(self.circuit.now_ns)
        self.firing.use_bridge(bridge)


def kinetic_j(motor):
    return 0.5 * motor.inertia_kg_m2 * motor.speed_rad_s**2


def assert_balanced(drive):
    energy, motor = drive.circuit.energy, drive.motor
    moved = abs(energy.source_j) + abs(motor.shaft_j)
    assert energy.source_j == pytest.approx(energy.loss_j + energy.stored_j + motor.shaft_j, abs=0.0005 * moved)
    assert motor.shaft_j == pytest.approx(kinetic_j(motor) + motor.friction_j + motor.load_j, abs=1e-9 * moved)


def test_start_reversal_and_load_step_balance():
    drive = Regulated()
    amps = drive.parameters.amps
    samples = drive.hold(1.2 * amps, SECOND)
    assert drive.motor.speed_rad_s > 100
    assert_balanced(drive)
    started = drive.circuit.energy.source_j
    drive.motor.load = 0.6 * drive.parameters.values["shaft_torque_n_m"].value
    samples += drive.hold(0.8 * amps, 3 * SECOND // 2)
    assert_balanced(drive)
    drive.motor.load = 0.0
    drive.change_bridge(2)
    before = drive.motor.speed_rad_s
    samples += drive.hold(1.0 * amps, 3 * SECOND)
    assert_balanced(drive)
    # Bridge 2 braked the motor through zero and drove it the other way; braking gave energy back to the line.
    assert before > 100
    assert drive.motor.speed_rad_s < -50
    assert min(sample.mean_current_a for sample in samples) < -0.8 * amps
    assert drive.circuit.energy.source_j < started + drive.circuit.energy.loss_j + abs(drive.motor.load_j) + kinetic_j(
        drive.motor
    )
    assert EventKind.COMMUTATION_FAILURE not in {event.kind for event in drive.circuit.take_events()}


def started(step_ns=0):
    """Speeds of a motor that starts at alpha 75 degrees without current control: torque changes at its fastest."""
    parameters = derive(EXAMPLES["150hp"])
    line = AcLine(parameters.line_v, inductance_h=parameters.source_h, resistance_ohm=0.004)
    motor = Motor(parameters.motor, load=0.0)
    circuit = Circuit(line, Bridge(turn_off_s=0.0), motor, step_ns=step_ns)
    alphas = [75.0] * 80
    fire_all(circuit, plan(alphas))
    speeds = []
    for part in range(1, 11):
        circuit.advance(part * 20_000_000)
        speeds.append(motor.speed_rad_s)
    return circuit, speeds, oracle_gates(plan(alphas))


def test_speed_held_within_an_interval_errs_by_less_than_a_hundredth_percent():
    """Against an integration in which current and speed move together, in a start at full voltage."""
    circuit, speeds, gates = started()
    motor, z = circuit.machine, circuit.line
    oracle = Switched(z.v_ll_v, z.inductance_h, z.resistance_ohm, motor.resistance_ohm, motor.inductance_h, step=100e-6)
    oracle.motor = (motor.data.k_v_s, motor.data.inertia_kg_m2, motor.data.viscous_n_m_s, 0.0)
    oracle.gates = gates
    theirs = []
    for part in range(1, 11):
        oracle.run(part * 0.02)
        theirs.append(oracle.speed)
    assert max(theirs) > 50
    worst = max(abs(ours - speed) for ours, speed in zip(speeds, theirs, strict=True))
    assert worst < 1e-4 * max(theirs)
    assert circuit.current_a == pytest.approx(oracle.currents["d"], abs=0.5)


def test_sample_is_the_integral_of_what_is_seen():
    """Mean, rms, mean voltage and zero-current time of a stretch that begins and ends anywhere, by quadrature."""
    for emf in (150.0, 320.0):
        circuit, watched = circuit_of(emf=emf), circuit_of(emf=emf)
        for one in (circuit, watched):
            fire_all(one, plan([60.0] * 20))
            one.advance(40_123_457)
            one.sample()
        times = np.arange(40_123_457, 52_345_678, 1000)
        currents, volts = [], []
        for time in times:
            watched.advance(int(time))
            currents.append(watched.current_a)
            volts.append(watched.armature_v)
        circuit.advance(int(times[-1]))
        sample = circuit.sample()
        mean = np.trapezoid(currents, times) / (times[-1] - times[0])
        rms = np.sqrt(np.trapezoid(np.square(currents), times) / (times[-1] - times[0]))
        assert sample.duration_s == pytest.approx((times[-1] - times[0]) * 1e-9)
        assert sample.mean_current_a == pytest.approx(mean, rel=1e-5)
        assert sample.rms_current_a == pytest.approx(rms, rel=1e-5)
        assert sample.mean_voltage_v == pytest.approx(np.mean(volts), rel=2e-3)
        zero = np.mean(np.array(currents) == 0.0) * sample.duration_s
        assert sample.zero_current_s == pytest.approx(zero, abs=10e-6)


def test_a_sample_over_many_intervals_keeps_its_rms():
    """Only the last intervals are kept as such; what is older is summed."""
    one, many = circuit_of(emf=150), circuit_of(emf=150)
    for circuit in (one, many):
        fire_all(circuit, plan([60.0] * 400))
    square = 0.0
    for window in range(1, 400):
        many.advance(window * 2_777_778)
        sample = many.sample()
        square += sample.rms_current_a**2 * sample.duration_s
    one.advance(399 * 2_777_778)
    whole = one.sample()
    assert whole.rms_current_a**2 * whole.duration_s == pytest.approx(square, rel=1e-9)


def test_an_empty_sample_is_zero():
    sample = circuit_of().sample()
    assert (sample.duration_s, sample.mean_current_a, sample.rms_current_a, sample.mean_voltage_v) == (0, 0, 0, 0)


def test_the_energy_meter_agrees_with_quadrature():
    circuit = circuit_of(ls=300e-6, rs=0.02, emf=150.0, drop_v=1.5, energy=True)
    fire_all(circuit, plan([60.0] * 12))
    circuit.advance(30_000_000)
    before = circuit.energy.source_j
    copy = circuit_of(ls=300e-6, rs=0.02, emf=150.0, drop_v=1.5)
    fire_all(copy, plan([60.0] * 12))
    copy.advance(30_000_000)

    def power(time_ns):
        copy.advance(int(time_ns))
        return sum(copy.line.phase_voltage(x, copy.now_ns) * copy.phase_currents()[x] for x in range(3))

    times = np.arange(30_000_000, 36_000_001, 2000)
    theirs = np.trapezoid([power(time) for time in times], times) * 1e-9
    circuit.advance(36_000_000)
    assert circuit.energy.source_j - before == pytest.approx(theirs, rel=1e-4)
