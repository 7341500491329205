"""Energy of a drive that a loop starts, reverses by bridge changes, and stops: what the line gives is kept."""

import pytest

from drive.current_loop.support import Bench


def books(bench):
    """Line energy, losses, stored in inductances, and what the shaft took, J."""
    energy, motor = bench.plant.circuit.energy, bench.plant.motor
    return energy.source_j, energy.loss_j + energy.stored_j, motor.shaft_j


@pytest.mark.parametrize(("size", "hertz"), [("150hp", 60), ("10hp", 50)])
def test_the_line_gives_losses_stored_and_shaft_energy(size, hertz):
    bench = Bench(size, hertz, inertia=2.0, energy=True)
    bench.start()
    rated = bench.parameters.values["base_speed_rad_s"].value
    turned = 0.0
    last = books(bench)
    throughput = 0.0
    for reference, target in ((3000, 0.8), (-3000, -0.8), (3000, 0.0)):
        bench.set(reference=reference)
        while (bench.plant.motor.speed_rad_s - target * rated) * reference < 0:
            bench.run(0.02)
            now = books(bench)
            throughput += abs(now[0] - last[0])
            last = now
        turned = max(turned, abs(bench.plant.motor.speed_rad_s))
    bench.set(cml_run=False)
    bench.run(0.3)
    source, kept, shaft = books(bench)
    assert turned > 0.75 * rated
    assert throughput > 1000.0
    assert abs(source - kept - shaft) < 1e-3 * throughput
    # The shaft's energy is in its inertia, friction and load.
    motor = bench.plant.motor
    kinetic_j = 0.5 * motor.inertia_kg_m2 * motor.speed_rad_s**2
    assert motor.shaft_j == pytest.approx(kinetic_j + motor.friction_j + motor.load_j, abs=1e-3 * throughput)
    # A reversal gives the motion's energy back to the line: less is drawn in all than moved to and fro.
    assert source < 0.7 * throughput
