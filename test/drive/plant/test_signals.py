"""What is seen of a plant: means against a fine sampling of the current; one that is looked at goes on alike."""

from math import radians

import numpy as np
import pytest

from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.circuit.firing import ConstantAlpha
from automax_ros.drive.plant.plant import PICK_UP_NS, DrivePlant, Means, PlantData
from automax_ros.drive.plant.signals import signals_of

MS = 1_000_000


def plant():
    """A motor whose field an unloaded shaft turns up: started with alpha 80 degrees once the contactor is closed."""
    made = DrivePlant(PlantData(derive(EXAMPLES["150hp"])))
    made.relay(on=True)
    made.advance(PICK_UP_NS + MS)
    return made


def driven(made, alpha_deg=80.0, bridge=1):
    return ConstantAlpha(made.circuit, radians(alpha_deg), bridge=bridge)


def test_means_are_those_of_the_current_whoever_takes_samples():
    made = plant()
    firing = driven(made)
    made.begin_metering()
    begin = made.now_ns
    found, currents, volts = [], [], []
    for number in range(4000):  # 40 ms, 10 us each
        firing.advance(begin + (number + 1) * 10_000)
        currents.append(made.circuit.current_a)
        volts.append(made.circuit.armature_v)
        if number % 37 == 0:
            made.sample()  # as the controller does, at instants of its own
        if number % 1000 == 999:
            found.append(made.meter.look())
    for means, amps, seen in zip(found, np.split(np.array(currents), 4), np.split(np.array(volts), 4), strict=True):
        assert means.duration_s == pytest.approx(0.01)
        assert means.current_a == pytest.approx(amps.mean(), rel=3e-3, abs=0.2)
        assert means.current_rms_a == pytest.approx(np.sqrt((amps**2).mean()), rel=3e-3, abs=0.2)
        assert means.voltage_v == pytest.approx(seen.mean(), rel=0.01, abs=1.0)
    assert found[-1].current_a > 20.0
    assert found[-1].current_rms_a > found[-1].current_a
    assert made.meter.look() == Means()


def test_metering_changes_nothing_and_its_energies_balance():
    seen, unseen = plant(), plant()
    firings = driven(seen, 60.0), driven(unseen, 60.0)
    seen.begin_metering()
    for number in range(1, 101):
        for firing in firings:
            firing.advance(PICK_UP_NS + MS + number * 10 * MS)
        seen.meter.look()
        signals_of(seen)
    shown, hidden = seen.state(), unseen.state()
    assert shown["circuit"].pop("energy") is not None
    assert hidden["circuit"].pop("energy") is None
    assert shown == hidden
    energies = signals_of(seen).energies
    parts = energies.loss_j + energies.stored_j + energies.shaft_j
    assert energies.line_j == pytest.approx(parts, rel=1e-3)
    kinetic_j = 0.5 * seen.motor.inertia_kg_m2 * seen.motor.speed_rad_s**2
    assert energies.shaft_j == pytest.approx(kinetic_j + seen.motor.friction_j, rel=1e-6)
    assert energies.shaft_j > 1000.0
    assert signals_of(unseen).energies is None


@pytest.mark.parametrize("metered", [False, True])
def test_state_of_a_plant_fits_one_that_is_looked_at_and_one_that_is_not(metered):
    before, after = plant(), DrivePlant(PlantData(derive(EXAMPLES["150hp"])))
    firing = driven(before)
    if metered:
        before.begin_metering()
    else:
        after.begin_metering()
    firing.advance(100 * MS)
    after.restore(before.state())
    again = driven(after)
    again.restore(firing.state())
    for one in (firing, again):
        one.advance(140 * MS)
    left, right = before.state(), after.state()
    for state in (left, right):
        state["circuit"].pop("energy")
    assert left == right
    assert after.meter is None if metered else after.meter.look().duration_s == pytest.approx(0.04)


def test_signals_at_an_instant():
    made = plant()
    resting = signals_of(made)
    assert (resting.current_a, resting.speed_rpm, resting.bridge, resting.contactor) == (0.0, 0.0, 0, True)
    assert (resting.line_hz, resting.line_v, resting.field) == (60.0, 460.0, 1.0)
    firing = driven(made, 60.0, bridge=2)
    firing.advance(made.now_ns + 100 * MS)
    while not made.circuit.conducting:
        firing.advance(made.now_ns + MS // 10)
    running = signals_of(made)
    assert running.time_ns == made.now_ns
    assert running.bridge == 2
    assert running.current_a < 0.0
    assert running.torque_nm < 0.0
    assert running.speed_rpm == pytest.approx(made.motor.speed_rad_s * 9.549296586)
    assert running.speed_rpm < -1.0
    made.relay(on=False)
    made.advance(made.now_ns + 100 * MS)
    assert not signals_of(made).contactor
    assert signals_of(made).bridge == 0
