"""Two plants with a shaft between them: against closed solutions, whoever asks first, cut anywhere."""

import json
from math import exp, pi, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.coupling import DAMPING_RATIO, CoupledPlants, CouplingData
from automax_ros.drive.plant.plant import PICK_UP_NS, LoadData
from drive.plants import MS, S, plant_of
from drive.support import fire_all, plan, repeatable


def pair(*, ratio=1.0, stiffness=None, damping=None, first=None, second=None, motors=("150hp", "10hp")):
    loads = (first or LoadData(), second or LoadData())
    plants = [plant_of(motor, load=load) for motor, load in zip(motors, loads, strict=True)]
    return *plants, CoupledPlants(*plants, CouplingData(ratio, stiffness, damping))


def inertia(plant):
    return plant.data.parameters.motor.inertia_kg_m2


def drag(plant):
    return plant.data.parameters.motor.viscous_n_m_s


@pytest.mark.parametrize("ratio", [1.0, 0.5, 3.0])
def test_a_stiff_shaft_turns_both_inertias_as_the_ratio_reflects_them(ratio):
    """(J1 + J2 / r2) dw/dt = -T - (B1 + B2 / r2) w, and the second turns at w / r."""
    one, two, between = pair(ratio=ratio, first=LoadData(torque_nm=60.0))
    one.advance(S)
    whole = inertia(one) + inertia(two) / ratio**2
    rubbing = drag(one) + drag(two) / ratio**2
    expected = -60.0 / rubbing * (1 - exp(-rubbing / whole))
    assert one.motor.speed_rad_s == pytest.approx(expected, rel=2e-4)
    assert one.motor.speed_rad_s == pytest.approx(ratio * two.motor.speed_rad_s, rel=1e-12)
    carried = inertia(two) / ratio**2 * one.motor.acceleration + drag(two) / ratio**2 * one.motor.speed_rad_s
    assert between.coupling.torque_n_m == pytest.approx(carried, rel=2e-3)


@pytest.mark.parametrize("ratio", [1.0, 2.0])
def test_a_spring_swings_at_its_frequency_and_is_damped_as_said(ratio):
    """Slip s'' + 2 z w s' + w2 s = 0 with w2 = K (1 / J1 + r2 / J2): zeros half a period apart, each less by z."""
    one, two, _ = pair(ratio=ratio, stiffness=3000.0, motors=("150hp", "150hp"))
    one.motor.speed_rad_s = 1.0
    compliance = 1 / inertia(one) + ratio**2 / inertia(two)
    swing = sqrt(3000.0 * compliance) * sqrt(1 - DAMPING_RATIO**2)
    peaks, before, rising = [], 1.0, False
    for step in range(1, 3000):
        one.advance(step * MS // 10)
        slip = one.motor.speed_rad_s - ratio * two.motor.speed_rad_s
        if rising and slip < before:
            peaks.append((step * 1e-4, before))
        rising, before = slip > before, slip
    period = (peaks[-1][0] - peaks[0][0]) / (len(peaks) - 1)
    assert period == pytest.approx(2 * pi / swing, rel=5e-3)
    fall = (peaks[-1][1] / peaks[0][1]) ** (1 / (len(peaks) - 1))
    assert fall == pytest.approx(exp(-2 * pi * DAMPING_RATIO / sqrt(1 - DAMPING_RATIO**2)), rel=2e-2)


def test_momentum_of_two_motors_on_a_spring_stays_but_for_friction():
    """At ratio r the torque acts r times on the second: J1 w1 + J2 w2 / r changes by friction alone."""
    one, two, _ = pair(ratio=2.0, stiffness=2000.0)
    one.motor.speed_rad_s = 10.0
    before = inertia(one) * 10.0
    lost = 0.0
    for step in range(1, 1001):
        lost += (drag(one) * one.motor.speed_rad_s + drag(two) * two.motor.speed_rad_s / 2.0) * 1e-4
        one.advance(step * MS // 10)
    after = inertia(one) * one.motor.speed_rad_s + inertia(two) * two.motor.speed_rad_s / 2.0
    assert after == pytest.approx(before - lost, rel=1e-3)


def test_a_held_shaft_drags_the_other_along():
    one, two, between = pair(ratio=0.5, stiffness=2000.0, first=LoadData(held_rpm=300.0))
    two.advance(8 * S)
    assert one.motor.speed_rad_s == pytest.approx(10 * pi)
    assert two.motor.speed_rad_s == pytest.approx(20 * pi, rel=1e-6)
    assert between.coupling.torque_n_m == pytest.approx(drag(two) * 20 * pi / 0.5, rel=1e-3)


def test_a_motor_drives_another_that_is_loaded():
    """In steady state the driven one's load comes over the shaft: k I = T / r + friction of both."""
    one, two, between = pair(ratio=2.0, second=LoadData(torque_per_rpm=((0.0, 0.0), (1750.0, 200.0))))
    one.relay(on=True)
    two.advance(PICK_UP_NS + 10 * MS)
    fire_all(one.circuit, plan([60.0] * 2100, first_window=36))
    two.advance(5 * S)
    one.sample()
    two.advance(5 * S + S // 2)
    current = one.sample().mean_current_a
    turns = two.motor.speed_rad_s
    load = 200.0 * turns / (1750.0 * pi / 30)
    torque = one.data.parameters.motor.k_v_s * current
    expected = load / 2.0 + drag(one) * turns * 2.0 + drag(two) * turns / 2.0
    assert torque == pytest.approx(expected, rel=5e-3)
    assert between.coupling.torque_n_m == pytest.approx((load + drag(two) * turns) / 2.0, rel=2e-2)


@pytest.mark.parametrize("stiffness", [None, 3000.0])
def test_it_does_not_matter_which_of_the_two_is_looked_at(stiffness):
    states = []
    for which in (0, 1):
        one, two, between = pair(stiffness=stiffness, first=LoadData(torque_nm=30.0))
        one.relay(on=True)
        two.relay(on=True)
        for step in range(1, 31):
            (one, two)[(step * which) % 2].advance(step * 7 * MS)
        assert one.is_closed
        assert two.is_closed
        states.append(json.dumps([one.state(), two.state(), between.state()]))
    assert states[0] == states[1]


def test_contacts_move_at_their_instants_whoever_looks():
    one, two, _ = pair()
    one.relay(on=True)
    two.advance(PICK_UP_NS - 1)
    assert (one.is_closed, one.now_ns) == (False, PICK_UP_NS - 1)
    two.advance(PICK_UP_NS)
    assert (one.is_closed, two.is_closed) == (True, False)


@pytest.mark.parametrize(
    ("data", "held", "told"),
    [
        (CouplingData(stiffness_nm_per_rad=1e7), False, "1000 at most"),
        (CouplingData(stiffness_nm_per_rad=1000.0, damping_nms_per_rad=1e5), False, "1000 at most"),
        (CouplingData(stiffness_nm_per_rad=0.0), False, "stiffness"),
        (CouplingData(ratio=0.0, stiffness_nm_per_rad=10.0), False, "ratio"),
        (CouplingData(ratio=-1.0), False, "ratio"),
        (CouplingData(), True, "held"),
    ],
)
def test_what_cannot_be_coupled(data, held, told):
    first = plant_of(load=LoadData(held_rpm=0.0 if held else None))
    with pytest.raises(ParameterError, match=told):
        CoupledPlants(first, plant_of(), data)


@repeatable
@given(cut=st.integers(0, 15), stiffness=st.sampled_from([None, 400.0]), ratio=st.sampled_from([0.7, 1.0, 2.0]))
def test_coupled_plants_go_on_from_their_state_bit_for_bit(cut, stiffness, ratio):
    sets = [pair(ratio=ratio, stiffness=stiffness, second=LoadData(torque_nm=5.0)) for _ in range(2)]
    whole, later = sets
    whole[0].relay(on=True)
    whole[1].relay(on=True)
    for step in range(16):
        if step == cut:
            for part, other in zip(later, whole, strict=True):
                part.restore(json.loads(json.dumps(other.state())))
        for one, two, _ in sets if step >= cut else (whole,):
            now = one.now_ns
            if step > 6:
                one.circuit.fire(now + 2 * MS, now + 5 * MS, step % 6 + 1, (step + 4) % 6 + 1)
                two.circuit.fire(now + MS, now + 4 * MS, step % 6 + 11, (step + 4) % 6 + 11)
            (one, two)[step % 2].advance(now + 10 * MS)
    assert json.dumps([part.state() for part in whole]) == json.dumps([part.state() for part in later])
