"""Steps of the current with the gains that are proposed: rise, overshoot, settled mean; three motors, both bridges."""

from dataclasses import replace

import pytest

from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant
from drive.current_loop.support import Bench

SIZES = {"10hp": 210.0, "150hp": 450.0, "800hp": 640.0}
"""Motors, with an EMF near base speed."""
MS = 1e-6
FULL = 4095


def crossing_ns(scans, before, level, rising):
    """When the feedback first passes a level, between scans by a straight line."""
    last_ns, last = scans[0].now_ns, before
    for scan in scans:
        if (scan.feedback >= level) if rising else (scan.feedback <= level):
            if scan.feedback == last:
                return last_ns
            return last_ns + (level - last) / (scan.feedback - last) * (scan.now_ns - last_ns)
        last_ns, last = scan.now_ns, scan.feedback
    raise AssertionError(f"the feedback never reached {level}")


def step(bench, start, end):
    """Step the reference (counts); return rise in ms, overshoot in % of the step, mean at the end."""
    bench.set(reference=start)
    bench.run(0.4)
    bench.set(reference=end)
    scans = bench.run(0.5)
    way, rising = end - start, end > start
    low, high = (crossing_ns(scans, start, start + part * way, rising) for part in (0.1, 0.9))
    over = max((scan.feedback - end) * (1 if rising else -1) for scan in scans)
    tail = scans[-60:]
    return (high - low) * MS, 100 * over / abs(way), sum(scan.feedback for scan in tail) / len(tail)


CASES = [
    (size, hertz, part * emf, sign)
    for size, emf in SIZES.items()
    for hertz in (60, 50)
    for part in (0.0, 0.44, 1.0)
    for sign in (1, -1)
]


@pytest.mark.parametrize(("size", "hertz", "emf", "sign"), CASES)
def test_steps_of_the_current(size, hertz, emf, sign):
    bench = Bench(size, hertz)
    bench.emf(emf)
    bench.start()
    for start, end, most in ((0, 50, 20), (30, 60, 15), (50, 20, 15)):
        first, last = (round(sign * FULL * part / 100) for part in (start, end))
        rise, over, mean = step(bench, first, last)
        assert 0.0 < rise < 15.0, f"{start} to {end} %"
        assert over < most, f"{start} to {end} %"
        assert abs(mean - last) < 0.01 * abs(last)


@pytest.mark.parametrize("rpm", [300, 600, 1000, 1100, 1150, 1200, 1250, 1300, 1400])
def test_steps_from_zero_of_the_examples_motor_at_speeds_between(rpm):
    """Near 1200 rpm an SCR is fired as the scan ends: there the current comes latest."""
    bench = Bench("150hp")
    bench.plant.motor.speed_rad_s = rpm * 0.10472
    bench.start()
    for sign in (1, -1):
        rise, over, mean = step(bench, 0, sign * 2048)
        assert rise < 15.0
        assert over < 20.0
        assert abs(mean - sign * 2048) < 20


def test_small_currents_settle_in_discontinuous_conduction():
    bench = Bench("150hp")
    bench.emf(200.0)
    bench.start()
    for percent in (2, 5, 10, -3, -8):
        wanted = round(FULL * percent / 100)
        bench.set(reference=wanted)
        scans = bench.run(0.8)[-60:]
        assert all(scan.measured.zero_us > 0 for scan in scans)
        mean = sum(scan.feedback for scan in scans) / len(scans)
        assert abs(mean - wanted) < 0.01 * abs(wanted)
        assert max(abs(scan.feedback - mean) for scan in scans) <= 2


def test_first_pulse_of_a_small_reference_is_small():
    bench = Bench("150hp")
    bench.start()
    bench.set(reference=41)
    scans = bench.run(0.4)
    assert 41 <= max(scan.feedback for scan in scans) < 41 + 0.03 * FULL


@pytest.mark.parametrize("hertz", [48, 55, 62])
@pytest.mark.parametrize("standard", [True, False])
def test_any_line_and_either_rotation_carries_current_of_both_signs(hertz, standard):
    bench = Bench("150hp", hertz, auto_phrot=True)
    data = replace(bench.plant.data, standard_rotation=standard)
    bench.plant = DrivePlant(data)
    bench.hardware = DriveController(bench.plant)
    bench.emf(150.0)
    bench.start()
    bench.plant.circuit.take_events()
    for wanted in (2000, -2000, 300, -300):
        bench.set(reference=wanted)
        tail = bench.run(0.6)[-40:]
        assert sum(scan.feedback for scan in tail) / len(tail) == pytest.approx(wanted, rel=0.01)
        assert {scan.bridge for scan in tail} == {1 if wanted > 0 else 2}
    assert bench.plant.circuit.take_events() == []


def test_the_same_run_repeats_bit_for_bit():
    runs = []
    for _ in range(2):
        bench = Bench("10hp", inertia=2.0)
        bench.start()
        for wanted in (1500, -2500, 90):
            bench.set(reference=wanted)
            bench.run(0.1)
        runs.append((bench.scans, bench.loop.numbers(), bench.plant.state()))
    assert runs[0] == runs[1]
