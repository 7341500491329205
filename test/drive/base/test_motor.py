"""Motor, field, loads, coupling and sensors: against the closed solutions of their equations."""

from itertools import pairwise
from math import cos, exp, pi, radians, sqrt
from random import Random
from statistics import fmean, pstdev

import pytest

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.motor import FieldWinding, FixedLoad, Motor, MotorData
from automax_ros.drive.base.sensors import Resolver, Tachometer
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.firing import ConstantAlpha
from automax_ros.drive.plant.coupling import Coupling

SECOND = 1_000_000_000
DATA = MotorData(0.1, 2e-3, 2.5, 1.5, 0.2, 0.0)


def coast(motor, seconds, charge_a=0.0, step_s=2.7e-3):
    """Let the mechanics turn with a constant armature current."""
    for _ in range(round(seconds / step_s)):
        motor.emf(step_s)
        motor.advance(step_s, charge_a * step_s, 0.0)


def test_viscous_coast_down():
    motor = Motor(DATA, speed_rad_s=180.0)
    coast(motor, 2.7)
    assert motor.speed_rad_s == pytest.approx(180 * exp(-0.2 / 1.5 * 2.7), rel=1e-6)


def test_constant_torque_turns_it_up():
    motor = Motor(DATA, load=50.0)
    coast(motor, 2.7, charge_a=100.0)
    final = (2.5 * 100 - 50) / 0.2
    assert motor.speed_rad_s == pytest.approx(final * (1 - exp(-0.2 / 1.5 * 2.7)), rel=1e-6)
    assert motor.torque_n_m == pytest.approx(250)


def test_coulomb_friction_stops_it_at_a_definite_time_and_holds_it():
    motor = Motor(MotorData(0.1, 2e-3, 2.5, 1.5, 0.0, 30.0), speed_rad_s=10.0)
    coast(motor, 0.27)
    assert motor.speed_rad_s == pytest.approx(10 - 30 / 1.5 * 0.27, rel=1e-9)
    coast(motor, 0.27)
    assert motor.speed_rad_s == 0.0
    assert motor.friction_j == pytest.approx(0.5 * 1.5 * 10**2)
    coast(motor, 0.27, charge_a=11.9)  # 29.75 N m do not break it loose
    assert motor.speed_rad_s == 0.0
    coast(motor, 0.27, charge_a=-16.0)
    assert motor.speed_rad_s == pytest.approx(-(40 - 30) / 1.5 * 0.27, rel=1e-9)


def test_an_overhauling_load_goes_through_zero_where_friction_does_not_hold_it():
    motor = Motor(MotorData(0.1, 2e-3, 2.5, 1.5, 0.0, 10.0), load=40.0, speed_rad_s=5.0)
    coast(motor, 0.54)
    stop_s = 5 * 1.5 / 50
    assert motor.speed_rad_s == pytest.approx(-30 / 1.5 * (0.54 - stop_s), rel=1e-6)


def test_a_fans_torque_is_a_function_of_speed():
    motor = Motor(MotorData(0.1, 2e-3, 2.5, 1.5), load=lambda speed: 0.01 * speed * abs(speed), speed_rad_s=200.0)
    coast(motor, 2.7)
    assert motor.speed_rad_s == pytest.approx(1 / (1 / 200 + 0.01 / 1.5 * 2.7), rel=1e-4)


def test_a_callback_is_asked_with_time_and_speed():
    asked = []

    def load(time_s, speed):
        asked.append((time_s, speed))
        return 30.0 if time_s >= 0.27 else 0.0

    motor = Motor(MotorData(0.1, 2e-3, 2.5, 1.5), load_callback=load, speed_rad_s=100.0)
    coast(motor, 0.54)
    assert motor.speed_rad_s == pytest.approx(100 - 30 / 1.5 * 0.27, rel=1e-3)
    assert asked[0] == (0.0, 100.0)
    assert asked[-1][0] == pytest.approx(0.54 - 2.7e-3)


def test_field_follows_its_voltage_and_saturates():
    field = FieldWinding(tau_s=0.8, knee=0.5, current=1.0, voltage=0.4)
    assert field.flux(0.0) == pytest.approx(1.0)
    field.advance(0.3)
    field.advance(0.5)
    assert field.current == pytest.approx(0.4 + 0.6 * exp(-1))
    assert field.flux(0.0) == pytest.approx(1.5 * field.current / (0.5 + field.current))
    assert field.flux_of(-0.7) == -field.flux_of(0.7)
    assert FieldWinding().flux(0.1) == 1.0


def test_a_weak_field_makes_less_emf_and_less_torque():
    motor = Motor(DATA, field=FieldWinding(tau_s=0.5, voltage=0.5), speed_rad_s=100.0)
    assert motor.emf(0.0) == pytest.approx(250.0)
    coast(motor, 8.1)
    assert motor.k_v_s == pytest.approx(1.25, rel=1e-6)
    motor.advance(1e-3, 100e-3, 0.0)
    assert motor.torque_n_m == pytest.approx(125, rel=1e-6)


def test_angle_counts_the_turns():
    motor = Motor(MotorData(0.1, 2e-3, 2.5, 1.5), speed_rad_s=20.0)
    coast(motor, 0.27)
    assert motor.angle_rad == pytest.approx(20 * 0.27 % (2 * pi))


def test_speed_at_no_load_is_where_the_emf_is_the_mean_voltage():
    line = AcLine(460.0, inductance_h=60e-6, resistance_ohm=0.005)
    motor = Motor(MotorData(0.05, 20e-3, 1.7, 0.5, 0.5))
    circuit = Circuit(line, Bridge(), motor)
    firing = ConstantAlpha(circuit, radians(60))
    firing.advance(6 * SECOND)
    circuit.sample()
    firing.advance(7 * SECOND)
    sample = circuit.sample()
    # friction speed = k i; voltage = k speed + R i
    assert 1.7 * sample.mean_current_a == pytest.approx(0.5 * motor.speed_rad_s, rel=1e-3)
    assert sample.mean_voltage_v == pytest.approx(1.7 * motor.speed_rad_s + 0.05 * sample.mean_current_a, rel=1e-4)
    ideal = 3 * sqrt(2) / pi * 460 * cos(radians(60))
    assert sample.mean_voltage_v == pytest.approx(
        ideal - (2 * 0.005 + 6 * 60 * 60e-6) * sample.mean_current_a, rel=2e-3
    )


def coupled(*, first=1.5, second=3.0, speed=(0.0, 0.0), k=2.5, **options):
    circuits = []
    for inertia, start in ((first, speed[0]), (second, speed[1])):
        motor = Motor(MotorData(0.1, 2e-3, k, inertia), speed_rad_s=start)
        circuits.append(Circuit(AcLine(460.0, inductance_h=60e-6), Bridge(), motor))
    return Coupling(*circuits, **options)


def test_stiff_motors_share_speed_and_torque():
    shaft = coupled(speed=(30.0, 0.0))
    one, two = shaft.first.machine, shaft.second.machine
    assert one.speed_rad_s == two.speed_rad_s == pytest.approx(10.0)
    one.load = 90.0
    shaft.advance(SECOND)
    assert one.speed_rad_s == two.speed_rad_s == pytest.approx(10 - 90 / 4.5, rel=1e-6)
    # The load sits on the first; the second's inertia pulls it on.
    assert shaft.torque_n_m == pytest.approx(-90 + 1.5 * 20, rel=1e-6)


def test_stiff_motors_do_what_one_of_both_inertias_does():
    shaft = coupled()
    alone = Circuit(AcLine(460.0, inductance_h=60e-6), Bridge(), Motor(MotorData(0.1, 2e-3, 2.5, 4.5)))
    firing, lone_firing = ConstantAlpha(shaft.first, radians(70)), ConstantAlpha(alone, radians(70))
    for step in range(1, 400):
        lone_firing.advance(step * 2_500_000)
        target = step * 2_500_000
        while shaft.first.now_ns < target:
            # Posts the first drive's gates, then lets both pass time.
            following = min(target, shaft.first.now_ns + shaft.slice_ns)
            firing.post(following)
            shaft.advance(following)
    assert shaft.first.machine.speed_rad_s == pytest.approx(alone.machine.speed_rad_s, rel=1e-3)
    assert alone.machine.speed_rad_s > 50


def test_an_elastic_coupling_swings_at_its_frequency():
    shaft = coupled(speed=(1.0, -0.5), k=1e-6, stiffness_n_m_rad=4000.0)
    one, two = shaft.first.machine, shaft.second.machine
    frequency = sqrt(4000 * (1 / 1.5 + 1 / 3.0)) / (2 * pi)
    crossings, before = [], 1.5
    for step in range(1, 4000):
        shaft.advance(step * 250_000)
        slip = one.speed_rad_s - two.speed_rad_s
        if before < 0 <= slip:
            crossings.append(step * 250e-6)
        before = slip
    periods = [later - earlier for earlier, later in pairwise(crossings)]
    assert fmean(periods) == pytest.approx(1 / frequency, rel=2e-3)
    assert 1.5 * one.speed_rad_s + 3.0 * two.speed_rad_s == pytest.approx(0.0, abs=1e-9)
    energy = 0.75 * one.speed_rad_s**2 + 1.5 * two.speed_rad_s**2 + 2000 * shaft.twist_rad**2
    assert energy == pytest.approx(0.75 + 1.5 * 0.25, rel=5e-3)


def test_a_damped_coupling_comes_to_one_speed():
    shaft = coupled(speed=(30.0, 0.0), k=1e-6, stiffness_n_m_rad=4000.0, damping_n_m_s=40.0)
    shaft.advance(SECOND)
    speeds = shaft.first.machine.speed_rad_s, shaft.second.machine.speed_rad_s
    assert speeds == pytest.approx((10.0, 10.0), rel=1e-4)
    assert shaft.twist_rad == pytest.approx(0.0, abs=1e-4)


def test_what_a_coupling_refuses():
    fixed = Circuit(AcLine(460.0), Bridge(), FixedLoad(0.1, 1e-3))
    with pytest.raises(ParameterError, match="only circuits that feed a Motor"):
        Coupling(fixed, fixed)
    with pytest.raises(ParameterError, match="stiffness"):
        coupled(stiffness_n_m_rad=0.0)


def test_tachometer():
    tachometer = Tachometer(50.0, noise_v=0.2, seed=7)
    readings = [tachometer.read(1000 * pi / 30) for _ in range(4000)]
    assert fmean(readings) == pytest.approx(50.0, abs=0.02)
    assert pstdev(readings) == pytest.approx(0.2, rel=0.05)
    assert [Tachometer(50.0, noise_v=0.2, seed=7).read(1000 * pi / 30)] == readings[:1]
    tachometer.lost = True
    assert abs(tachometer.read(100.0)) < 2
    assert Tachometer(50.0).read(-1000 * pi / 30) == pytest.approx(-50.0)


def test_resolver():
    resolver = Resolver(4096)
    assert [resolver.read(angle) for angle in (0.0, pi, 2 * pi - 1e-9, -pi / 2, 4 * pi)] == [0, 2048, 4095, 3072, 0]
    assert Resolver(4096, speed=5).read(0.2 * pi) == 2048
    resolver.read(1.0)
    held = resolver.read(1.0)
    resolver.lost = True
    assert resolver.read(2.0) == held
    noisy = [Resolver(4096, noise_rad=0.01, seed=seed).read(pi) for seed in range(2000)]
    assert pstdev(noisy) == pytest.approx(0.01 * 4096 / (2 * pi), rel=0.1)


def test_sensors_leave_the_modules_random_source_alone():
    before = Random(3).random()
    Tachometer(50.0, noise_v=1.0, seed=3).read(1.0)
    assert Random(3).random() == before


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: MotorData(-0.1, 2e-3, 2.5, 1.5),
        lambda: MotorData(0.1, 0.0, 2.5, 1.5),
        lambda: MotorData(0.1, 2e-3, 0.0, 1.5),
        lambda: MotorData(0.1, 2e-3, 2.5, -1.0),
        lambda: MotorData(0.1, 2e-3, 2.5, 1.5, -0.1),
        lambda: FixedLoad(0.1, float("nan")),
        lambda: FieldWinding(tau_s=-1.0),
        lambda: FieldWinding(knee=0.0),
        lambda: Tachometer(50.0, noise_v=-1.0),
        lambda: Resolver(1),
    ],
)
def test_parameters_out_of_range_are_told(wrong):
    with pytest.raises(ParameterError):
        wrong()
