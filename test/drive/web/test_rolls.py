"""Rolls: unwound under constant torque, balanced at rest, run out, spliced; a tension regulator from full to core."""

from math import pi

import pytest
from blocks.support import run

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.plant import LoadData
from automax_ros.drive.web.data import Roll, SurfaceData, WebData
from automax_ros.drive.web.verbs import splice
from drive.plants import MS, S
from drive.web.lines import Model, held, line_of, roll, roller

THICK = {"caliper_um": 2000.0, "core_m": 0.3}


@pytest.mark.parametrize("gear", [1.0, 4.0])
def test_a_roll_unwound_under_constant_torque_against_a_solver(gear):
    """A held press at 6 m/s pulls it against 150 N m (its radius halves in 40 s): diameter, speed, tension, energy."""
    surfaces = {"U": roll(0.9, gear, **THICK), "P": roller()}
    web = WebData(4.0, 2e5)
    loads = {"U": LoadData(torque_nm=150.0 / gear), "P": held(6.0, surfaces["P"])}
    plants, line = line_of({n: (surfaces[n], loads[n]) for n in "UP"}, {"W": ("U", "P", web)})
    unwinder, end, span = plants["U"].motor, line.ends["U"], line.spans["W"]
    unwinder.speed_rad_s = 6.0 / 0.45 * gear
    span.m = 4.0 / (1 + 330.0 / 2e5)
    line.chains[0].begin()
    model = Model(plants, list(surfaces.values()), [web])
    times = [step * 0.97 for step in range(1, 40)]
    pulled, start = 0.0, end.wound_m
    for time, y in zip(times, model.solve(times, [span.m]), strict=True):
        plants["P"].advance(round(time * 1e9))
        plants["U"].advance(round(time * 1e9))
        radius = model.radius(0, y[2])
        assert end.diameter_m == pytest.approx(2 * radius, rel=1e-5)
        assert end.present_web_m == pytest.approx(start - y[2], rel=1e-5)
        assert unwinder.speed_rad_s == pytest.approx(y[0], rel=1e-5)
        assert span.tension_n == pytest.approx(model.tensions(y)[0], rel=1e-3)
        kinetic = 0.5 * model.inertia(0, radius) * y[0] ** 2
        assert 0.5 * unwinder.inertia_kg_m2 * unwinder.speed_rad_s**2 == pytest.approx(kinetic, rel=1e-3)
        pulled += span.tension_n * 6.0 * 0.97
    # What the web pulled is what the load took, less what the momentum gave.
    assert end.diameter_m < 0.6
    assert pulled == pytest.approx(unwinder.load_j + unwinder.friction_j, rel=0.15)


def test_a_winder_grows_by_what_it_winds_under_tension():
    """Held rollers at a draw of 0.5 % wind stretched web: w is what has come less the stretch, in the roll's area."""
    surface = roll(0.4, **THICK)
    plants, line = line_of(
        {"P": (roller(), held(5.0, roller())), "W": (surface, held(5.025, surface))},
        {"W1": ("P", "W", WebData(1.0, 2e5))},
    )
    before, m = line.ends["W"].wound_m, line.spans["W1"].m
    plants["W"].advance(10 * S)
    plants["P"].advance(10 * S)
    end = line.ends["W"]
    assert end.wound_m == pytest.approx(before + 50.0 + m - line.spans["W1"].m, abs=0.02)
    assert end.diameter_m == pytest.approx(2 * (0.2**2 + 2e-3 * (end.wound_m - before) / pi) ** 0.5, rel=1e-4)
    assert end.speed_mps > 5.3  # the shaft is held


@pytest.mark.parametrize("gear", [1.0, 4.0])
@pytest.mark.parametrize("bottom", [False, True])
def test_at_rest_the_tension_is_torque_times_gear_over_radius(gear, bottom):
    """Friction lets the shaft stand, and holds it: so the balance is that of torque, within the friction."""
    surface = roll(1.0, gear, runs_from="bottom" if bottom else "top")
    sign = -1.0 if bottom else 1.0
    plants, line = line_of(
        {"U": (surface, LoadData(torque_nm=sign * 80.0, friction_nm=2.0)), "P": (roller(), LoadData(held_rpm=0.0))},
        {"W": ("U", "P", WebData(4.0, 2e5))},
    )
    plants["U"].advance(40 * S)
    assert plants["U"].motor.speed_rad_s == 0.0
    balance = 80.0 * gear / 0.5
    assert abs(line.spans["W"].tension_n - balance) <= 2.5 * gear / 0.5
    assert plants["U"].motor.web_n_m == pytest.approx(line.spans["W"].tension_n * 0.5 / gear * sign, rel=1e-6)
    # The press feels the same tension over its own radius and gear, the other way.
    assert plants["P"].motor.web_n_m == pytest.approx(-line.spans["W"].tension_n * 0.25 / 5.25, rel=1e-6)


def test_an_empty_roll_lets_the_tail_go():
    surface = SurfaceData(Roll(0.302, 0.3, 2.5, 100.0, 780.0))
    plants, line = line_of(
        {"U": (surface, LoadData(torque_nm=5.0)), "P": (roller(), held(4.0, roller()))},
        {"W": ("U", "P", WebData(1.0, 2e5))},
    )
    end, span = line.ends["U"], line.spans["W"]
    length = pi / 4 * (0.302**2 - 0.3**2) / 1e-4
    assert end.wound_m == pytest.approx(length)
    plants["U"].motor.speed_rad_s = 4.0 / 0.151 * 1.0
    line.chains[0].begin()
    plants["U"].advance(round(0.95 * length / 4.0 * 1e9))
    assert not span.broken
    plants["P"].advance(round(1.1 * length / 4.0 * 1e9))
    assert span.broken
    assert (span.tension_n, end.wound_m, end.diameter_m) == (0.0, 0.0, pytest.approx(0.3))
    assert plants["U"].motor.web_n_m == plants["P"].motor.web_n_m == 0.0
    assert plants["U"].motor.inertia_kg_m2 == pytest.approx(plants["U"].motor.data.inertia_kg_m2)


def test_a_flying_splice_keeps_speed_and_tension_of_the_web():
    surface = roll(0.5, **THICK)
    plants, line = line_of(
        {"U": (surface, LoadData(torque_nm=20.0)), "P": (roller(), held(6.0, roller()))},
        {"W": ("U", "P", WebData(4.0, 2e5))},
    )
    end, motor, span = line.ends["U"], plants["U"].motor, line.spans["W"]
    motor.speed_rad_s = 6.0 / 0.25 * 4
    span.m = 4.0 / (1 + 320 / 2e5)
    line.chains[0].begin()
    plants["U"].advance(2 * S)
    speed, tension, inertia = end.speed_mps, span.tension_n, motor.inertia_kg_m2
    splice(end, 1.25)
    assert end.diameter_m == pytest.approx(1.25)
    assert end.speed_mps == pytest.approx(speed, rel=1e-12)
    assert motor.speed_rad_s == pytest.approx(speed / 0.625 * 4)
    assert span.tension_n == pytest.approx(tension, rel=1e-4)
    assert motor.inertia_kg_m2 > 3 * inertia
    with pytest.raises(ParameterError, match="core"):
        splice(end, 0.2)
    with pytest.raises(ParameterError, match="roller"):
        splice(line.ends["P"], 1.0)


def test_a_tension_regulator_stays_stable_from_full_to_core():
    """PROP_INT on the unwinder's torque every 22 ms, gains as for the full roll times what the radius leaves of it."""
    surface = roll(0.9, **THICK)
    plants, line = line_of(
        {"U": (surface, LoadData(torque_nm=25.0)), "P": (roller(), held(2.0, roller()))},
        {"W": ("U", "P", WebData(4.0, 5e4))},
    )
    unwinder, end, span = plants["U"], line.ends["U"], line.spans["W"]
    unwinder.motor.speed_rad_s = 2.0 / 0.45 * 4
    span.m = 4.0 / (1 + 200 / 5e4)
    line.chains[0].begin()
    block = run("PROP_INT", 22 * MS, kp=0.1, wld=3.0, limit_plus=4095, limit_minus=0)
    reference, errors, now = 1600, {}, 0
    while end.wound_m > 10.0:
        now += 22 * MS
        span.advance(now)
        counts = round(min(span.tension_n, 1000.0) * 4.095)
        braking = block.scan(input=reference - counts)["output"] / 4095 * 100.0 * end.diameter_m / 0.9
        unwinder.load_torque_nm = braking
        if now > 40 * S:
            errors.setdefault(now // (5 * S), []).append(abs(counts - reference))
    assert end.diameter_m < 0.35
    assert len(errors) > 5
    assert max(max(found) for found in errors.values()) < 0.1 * reference
    assert max(max(found) - min(found) for found in errors.values()) < 0.03 * reference
