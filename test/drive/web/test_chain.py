"""Chains of webs against a solver with tolerances of 1e-10; where advancing is cut; couplings; states."""

import json
from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.plant.coupling import CoupledPlants, CouplingData
from automax_ros.drive.plant.faults import execute_verb, values_of
from automax_ros.drive.plant.plant import LoadData
from automax_ros.drive.web.data import Dancer, WebData
from automax_ros.drive.web.verbs import slip
from drive.plants import MS, S, plant_of
from drive.support import fire_all, plan, repeatable
from drive.web.lines import Model, advance, line_of, roll, roller

SURFACES = {"U": roll(), "P": roller(), "Q": roller(0.4, 4.0), "W": roll(0.2)}
PULLS = {"U": 0.0, "P": 20.0, "Q": 60.0, "W": 50.0}


def strand(stiffness=2e5, *, mps=5.0, pulls=PULLS, dancer=None, surfaces=SURFACES, running=True):
    webs = {
        "W1": ("U", "P", WebData(4.0, stiffness)),
        "W2": ("P", "Q", WebData(3.0, 1.2 * stiffness, dancer=dancer)),
        "W3": ("Q", "W", WebData(6.0, stiffness)),
    }
    ends = {name: (surface, LoadData(torque_nm=-pulls[name])) for name, surface in surfaces.items()}
    plants, line = line_of(ends, webs)
    if running:
        for name, plant in plants.items():
            plant.motor.speed_rad_s = mps * 2 * surfaces[name].gear / surfaces[name].surface.diameter_m
        for span in line.spans.values():  # near to what the pulls make of it, so that it stays taut
            span.m = span.data.length_m / (1 + 500.0 / span.stiffness_n)
        line.chains[0].begin()
    return plants, line, Model(plants, list(surfaces.values()), [web for *_, web in webs.values()])


@pytest.mark.parametrize("stiffness", [2e4, 2e5, 1e6, 1e7])
@pytest.mark.parametrize("cuts", [1, 10])
def test_three_spans_and_four_motors_against_a_solver(stiffness, cuts):
    plants, line, model = strand(stiffness)
    spans = list(line.spans.values())
    step = 29 * MS
    times = [number * step for number in range(1, 70)]
    highest = [0.0] * 3
    for time, y in zip(times, model.solve([t / S for t in times], [span.m for span in spans]), strict=True):
        for cut in range(1, cuts + 1):
            advance(plants, time - step + step * cut // cuts)
        for place, (span, tension) in enumerate(zip(spans, model.tensions(y), strict=True)):
            highest[place] = max(highest[place], tension)
            # Free swings go down to a few newtons: there the part of the highest counts.
            assert span.tension_n == pytest.approx(tension, rel=1e-3, abs=3e-4 * highest[place])
        for plant, speed in zip(plants.values(), y, strict=False):
            assert plant.motor.speed_rad_s == pytest.approx(speed, rel=1e-4, abs=1e-3)
    assert max(highest) > 800.0


def test_where_advancing_is_cut_decides_only_the_last_digits():
    found = []
    for cuts in (1, 7, 100):
        plants, line, _ = strand(1e6)
        for step in range(1, 11):
            for cut in range(1, cuts + 1):
                for name in ("WPUQ" if cuts == 7 else "UPQW") if cut % 2 else "QU":
                    plants[name].advance((step - 1) * 100 * MS + 100 * MS * cut // cuts)
            advance(plants, step * 100 * MS)
        found.append([span.tension_n for span in line.spans.values()] + [p.motor.speed_rad_s for p in plants.values()])
    for other in found[1:]:
        assert other == pytest.approx(found[0], rel=1e-5)


def test_the_same_calls_give_the_same_bits():
    runs = []
    for _ in range(2):
        plants, line, _ = strand(1e6)
        for step in range(1, 50):
            plants["UPQW"[step % 4]].advance(step * 7 * MS)
        runs.append(json.dumps([part.state() for part in parts(plants, line)]))
    assert runs[0] == runs[1]


def test_a_dancer_between_driven_rollers_against_a_solver():
    """The torques hold half of the dancer's force, so that it stays between its stops."""
    pulls = {"U": -360.0 * 0.625 / 4, "P": 20.0, "Q": -20.0, "W": 300.0 * 0.1 / 4}
    dancer = Dancer(force_n=600.0, mass_kg=40.0, damping_ns_m=800.0, range_m=2.4)
    plants, line, model = strand(pulls=pulls, dancer=dancer, mps=3.0)
    times = [number * 31 * MS for number in range(1, 40)]
    ways = []
    for time, y in zip(times, model.solve([t / S for t in times], [s.m for s in line.spans.values()]), strict=True):
        advance(plants, time)
        for span, tension in zip(line.spans.values(), model.tensions(y), strict=True):
            assert span.tension_n == pytest.approx(tension, rel=1e-3)
        ways.append(y[4 + 4 + 3 + 1])
        assert line.spans["W2"].dancer_m == pytest.approx(ways[-1], rel=1e-3, abs=1e-5)
    assert max(map(abs, ways)) < 1.2
    assert max(ways) - min(ways) > 0.05


@pytest.mark.parametrize("stiffness", [None, 3000.0])
def test_a_coupling_of_a_plant_in_a_chain_keeps_working(stiffness):
    """The pull of the web turns roll and both motors, and the shaft carries what the second motor takes."""
    surface = roll(0.8, caliper_um=0.1)
    ratio, pull_n_m = 2.0, 90.0
    plants, line = line_of(
        {"U": (surface, None), "X": (None, None, "10hp"), "P": (roller(), LoadData(torque_nm=-pull_n_m))},
        {"W1": ("U", "P", WebData(4.0, 2e5))},
        {"U+X": lambda plants: CoupledPlants(plants["U"], plants["X"], CouplingData(ratio, stiffness))},
    )
    assert len(line.chains) == 1
    one, two, press = (plants[name] for name in "UXP")
    rolled = surface.surface.inertia_kg_m2(0.4) / 16
    data = [plant.data.parameters.motor for plant in (one, two, press)]
    arms = 0.4 / 4.0, 0.25 / 5.25
    one.advance(4 * S)
    assert two.motor.speed_rad_s == pytest.approx(one.motor.speed_rad_s / ratio, rel=1e-2)
    # Power of the press = rate of all kinetic energy + friction, with speeds locked to that of the web.
    before = press.motor.speed_rad_s
    coupling = next(iter(line.chains[0].couplings.values())).coupling
    two.advance(5 * S)
    press.advance(5 * S)
    after = press.motor.speed_rad_s
    speeds = [arms[1] / arms[0], arms[1] / arms[0] / ratio, 1.0]
    inertias = [data[0].inertia_kg_m2 + rolled, data[1].inertia_kg_m2, data[2].inertia_kg_m2]
    inertia = sum(j * k**2 for j, k in zip(inertias, speeds, strict=True))
    drag = sum(d.viscous_n_m_s * k**2 for d, k in zip(data, speeds, strict=True))
    acceleration = (pull_n_m - drag * 0.5 * (before + after)) / inertia
    assert after - before == pytest.approx(acceleration, rel=2e-2)
    second = two.motor
    carried = (data[1].inertia_kg_m2 * acceleration * speeds[1] + data[1].viscous_n_m_s * second.speed_rad_s) / ratio
    if stiffness is None:
        assert coupling.torque_n_m == pytest.approx(carried, rel=0.1)
        whole = data[0].inertia_kg_m2 + rolled + data[1].inertia_kg_m2 / ratio**2
        assert one.motor.inertia_kg_m2 == pytest.approx(whole, rel=1e-4)
        assert second.inertia_kg_m2 == pytest.approx(whole * ratio**2, rel=1e-4)


def test_a_fired_drive_pulls_a_web_from_a_braked_roll():
    """In steady state k I = (tension times radius over gear) + friction of the press's motor."""
    plants, line = line_of(
        {"U": (roll(1.25, caliper_um=0.1), LoadData(friction_nm=40.0)), "P": (roller(), None)},
        {"W1": ("U", "P", WebData(4.0, 2e5))},
    )
    press = plants["P"]
    press.relay(on=True)
    press.advance(100 * MS)
    fire_all(press.circuit, plan([75.0] * 4300, first_window=42))
    plants["U"].advance(10 * S)
    press.advance(10 * S)
    press.sample()
    before = press.motor.speed_rad_s
    tensions = []
    for step in range(1, 101):
        press.advance(10 * S + step * 10 * MS)
        tensions.append(line.spans["W1"].tension_n)
    current = press.sample().mean_current_a
    data = press.data.parameters.motor
    speed = press.motor.speed_rad_s
    assert speed > 10.0
    mean = sum(tensions) / len(tensions)
    load = data.k_v_s * current - data.viscous_n_m_s * speed - data.inertia_kg_m2 * (speed - before)
    assert mean * 0.25 / 5.25 == pytest.approx(load, rel=2e-2)


def parts(plants, line):
    return [*plants.values(), *line.ends.values(), *line.spans.values()]


@repeatable
@given(cut=st.integers(0, 15), stiffness=st.sampled_from([2e5, 1e7]), back=st.booleans())
def test_chains_go_on_from_their_state_bit_for_bit(cut, stiffness, back):
    dancer = Dancer(100.0, 40.0, 300.0, 1.0)
    sets = [strand(stiffness, dancer=dancer, mps=-2.0 if back else 2.0)[:2] for _ in range(2)]
    whole, later = sets
    slip(whole[1].ends["P"], 0.6)
    whole[0]["Q"].relay(on=True)
    for step in range(16):
        if step == cut:
            for part, other in zip(parts(*later), parts(*whole), strict=True):
                part.restore(json.loads(json.dumps(other.state())))
        for plants, line in sets if step >= cut else (whole,):
            if step == 9:
                execute_verb(plants["P"], "repair", values_of("repair", "all"))
            if step > 6:
                circuit = plants["Q"].circuit
                now = circuit.now_ns
                circuit.fire(now + 2 * MS, now + 5 * MS, step % 6 + 1, (step + 4) % 6 + 1)
            plants["UPQW"[step % 4]].advance(10 * step * MS + 123_457)
            assert line.spans["W1"].m > 0.0
    assert json.dumps([p.state() for p in parts(*whole)]) == json.dumps([p.state() for p in parts(*later)])
    assert whole[1].ends["P"].slip is None


def test_a_plant_with_a_roll_but_no_web_carries_its_inertia_and_counts():
    plants, line = line_of({"U": (roll(), LoadData(torque_nm=-50.0))}, {})
    motor = plants["U"].motor
    data = motor.data
    expected = data.inertia_kg_m2 + pi / 2 * 780 * 2.5 * (0.625**4 - 0.075**4) / 16
    assert motor.inertia_kg_m2 == pytest.approx(expected)
    plants["U"].advance(2 * S)
    assert motor.speed_rad_s == pytest.approx(100.0 / expected, rel=1e-2)
    assert line.ends["U"].present_turns == pytest.approx(0.5 * 50.0 / expected * 4 / (2 * pi) / 4, rel=1e-2)
    assert line.ends["U"].diameter_m == 1.25


def test_a_plant_alone_is_as_it_was():
    one, two = plant_of(load=LoadData(torque_nm=-50.0)), plant_of(load=LoadData(torque_nm=-50.0))
    line_of({"U": (None, None)}, {})
    one.advance(S)
    two.advance(S)
    assert one.state() == two.state()
