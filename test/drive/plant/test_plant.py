"""Plants: motion, loads, a held shaft, faults and mending, state."""

import json
from dataclasses import replace
from math import cos, exp, pi, radians, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.circuit.scr import PARTNER
from automax_ros.drive.plant.faults import VERBS, active_faults, values_of
from automax_ros.drive.plant.plant import DROP_OUT_NS, PICK_UP_NS, SCR_DROP_V, DrivePlant, LoadData, PlantData
from automax_ros.drive.plant.signals import SIGNALS, signals_of
from drive.plants import LOCKED, MS, S, closed, do, fired, plant_of
from drive.support import repeatable

RPM = pi / 30


def mean_current(plant, alpha_deg, *, bridge=1, settle_ns=S // 2, over_ns=S // 2):
    """The mean armature current under constant alpha, once it has settled."""
    fired(plant, alpha_deg, plant.now_ns + settle_ns, bridge=bridge)
    plant.sample()
    fired(plant, alpha_deg, plant.now_ns + over_ns, bridge=bridge)
    return plant.sample().mean_current_a


# Motion


def test_a_load_alone_turns_the_shaft_as_friction_allows():
    """J dw/dt = -T - B w from rest: w(t) = -(T / B) (1 - exp(-B t / J))."""
    plant = plant_of(inertia=3.0, load=LoadData(torque_nm=100.0))
    motor = plant.data.parameters.motor
    plant.advance(2 * S)
    drag = motor.viscous_n_m_s
    expected = -(100.0 / drag) * (1 - exp(-drag * 2.0 / (3.0 * motor.inertia_kg_m2)))
    assert plant.motor.speed_rad_s == pytest.approx(expected, rel=1e-6)


def test_a_load_that_is_set_replaces_the_one_of_the_file():
    plant = plant_of(load=LoadData(torque_nm=100.0))
    plant.load_torque_nm = 0.0
    plant.advance(S)
    assert plant.motor.speed_rad_s == 0.0
    with pytest.raises(ParameterError, match="load torque"):
        plant.load_torque_nm = float("nan")
    assert plant.load_torque_nm == 0.0


def test_friction_holds_a_load_below_it_and_not_one_above():
    below = plant_of(load=LoadData(torque_nm=19.0, friction_nm=20.0))
    above = plant_of(load=LoadData(torque_nm=21.0, friction_nm=20.0))
    for plant in (below, above):
        plant.advance(S)
    motor = above.data.parameters.motor
    drag = motor.viscous_n_m_s
    assert below.motor.speed_rad_s == 0.0
    expected = -(1.0 / drag) * (1 - exp(-drag / motor.inertia_kg_m2))
    assert above.motor.speed_rad_s == pytest.approx(expected, rel=1e-6)


def test_a_table_is_straight_between_its_pairs_level_beyond_and_brakes_both_ways():
    load = LoadData(torque_per_rpm=((0.0, 10.0), (1000.0, 50.0), (1750.0, 300.0)))
    asked = [0.0, 250.0, 1000.0, 1375.0, 1750.0, 5000.0]
    assert [load.torque_at(rpm) for rpm in asked] == [10.0, 20.0, 50.0, 175.0, 300.0, 300.0]
    assert [load.torque_at(-rpm) for rpm in asked[1:]] == [-20.0, -50.0, -175.0, -300.0, -300.0]
    both = LoadData(torque_per_rpm=((-100.0, -5.0), (100.0, 15.0)))
    assert [both.torque_at(rpm) for rpm in (-200.0, -100.0, 0.0, 100.0)] == [-5.0, -5.0, 5.0, 15.0]


def test_a_table_makes_a_fan_settle_where_its_torque_is_the_motors():
    """At constant alpha: torque of the table at the speed it settles at = k x mean current - viscous friction."""
    plant = closed(plant_of(load=LoadData(torque_per_rpm=((0.0, 0.0), (1750.0, 300.0)))))
    current = mean_current(plant, 60.0, settle_ns=6 * S)
    speed = plant.motor.speed_rad_s
    motor = plant.data.parameters.motor
    assert motor.k_v_s * current == pytest.approx(speed / RPM * 300.0 / 1750.0 + motor.viscous_n_m_s * speed, rel=2e-3)


@pytest.mark.parametrize("motor", ["10hp", "150hp", "800hp"])
def test_a_locked_rotor_takes_the_current_of_its_resistance(motor):
    """12.2: Id = (Vd0 cos alpha - 2 VT) / (Ra + 2 Rs + 6 f Ls), with an overlap so short that ripple does not count."""
    parameters = replace(derive(EXAMPLES[motor]), source_h=1e-7)
    plant = closed(DrivePlant(PlantData(parameters, resistance_ohm=0.0005, load=LOCKED)))
    ideal = 3 * sqrt(2) / pi * parameters.line_v * cos(radians(80.0))
    ohms = parameters.motor.resistance_ohm + 2 * 0.0005 + 6 * 60.0 * 1e-7
    assert mean_current(plant, 80.0) == pytest.approx((ideal - 2 * SCR_DROP_V) / ohms, rel=1e-3)
    assert plant.motor.speed_rad_s == plant.motor.angle_rad == 0.0


def test_a_held_shaft_keeps_its_speed_and_its_load_takes_what_is_left():
    plant = closed(plant_of(load=LoadData(held_rpm=875.0)))
    fired(plant, 40.0, plant.now_ns + S)
    motor = plant.motor
    assert motor.speed_rad_s == pytest.approx(875.0 * RPM, rel=1e-12)
    assert motor.load_j > 10_000.0
    assert motor.shaft_j == pytest.approx(motor.load_j + motor.friction_j, rel=1e-9)


def test_both_rotations_of_a_line_fire_in_their_own_order():
    """The angle of natural commutation follows the rotation: the same mean current either way."""
    currents = [
        mean_current(closed(plant_of(load=LOCKED, standard_rotation=standard)), 80.0) for standard in (True, False)
    ]
    assert currents[0] == pytest.approx(currents[1], rel=1e-3)


def test_contacts_follow_the_relay():
    plant = plant_of()
    plant.relay(on=True)
    plant.advance(PICK_UP_NS - 1)
    seen = [plant.is_closed]
    plant.advance(PICK_UP_NS + 1)
    seen.append(plant.is_closed)
    plant.relay(on=False)
    plant.advance(PICK_UP_NS + DROP_OUT_NS)
    seen.append(plant.is_closed)
    plant.advance(PICK_UP_NS + DROP_OUT_NS + 2)
    assert [*seen, plant.is_closed] == [False, True, True, False]


# Signals


def test_signals_are_instantaneous_and_signed():
    plant = closed(plant_of(load=LoadData(held_rpm=-500.0)))
    assert SIGNALS["speed_rpm"](plant) == pytest.approx(-500.0)
    assert SIGNALS["armature_v"](plant) == pytest.approx(-500.0 * RPM * plant.data.parameters.motor.k_v_s)
    assert SIGNALS["armature_a"](plant) == SIGNALS["torque_nm"](plant) == 0.0
    fired(plant, 70.0, plant.now_ns + S // 10, bridge=2)
    assert SIGNALS["armature_a"](plant) < 0.0
    ratio = SIGNALS["torque_nm"](plant) / SIGNALS["armature_a"](plant)
    assert ratio == pytest.approx(plant.data.parameters.motor.k_v_s)
    assert SIGNALS["line_hz"](plant) == 60.0


# Faults


@pytest.mark.parametrize("number", [*range(1, 7), *range(11, 17)])
def test_a_shorted_scr_needs_no_gate(number):
    """Of the two SCRs of a path only the sound one is fired, at the maximum of their line voltage: current flows."""
    other = number - 1 if number % 10 > 1 else number + 5
    amps = []
    for text in ("", str(number), str(PARTNER[number])):
        plant = closed(plant_of(load=LOCKED))
        if text:
            do(plant, "short_scr", text)
            assert active_faults(plant) == (f"short_scr {text}",)
        for cycle in range(6, 12):
            plant.circuit.fire(cycle * S // 60, (cycle + 1) * S // 60, other)
        plant.advance(S // 4)
        amps.append(plant.sample().mean_current_a)
        do(plant, "repair", "all")
        assert (plant.bridge.wiring.shorted, active_faults(plant)) == (0, ())
    sound, shorted, partner = amps
    assert sound == 0.0
    assert shorted == partner
    assert abs(shorted) > 10.0
    assert (shorted > 0.0) is (number < 10)


def test_an_open_gate_takes_its_pulses_out_of_the_current():
    sound, broken = (closed(plant_of(load=LOCKED)) for _ in range(2))
    do(broken, "open_gate", "3")
    full, less = mean_current(sound, 80.0), mean_current(broken, 80.0)
    assert 0.2 * full < less < 0.9 * full
    do(broken, "repair", "all")
    assert mean_current(broken, 80.0, settle_ns=2 * S) == pytest.approx(full, rel=1e-6)


@pytest.mark.parametrize(("verb", "sees_line"), [("blow_fuse", True), ("lose_phase", False)])
@pytest.mark.parametrize(("text", "phase"), [("1", 0), ("T2", 1), ("3", 2), ("A", 2), ("B", 1), ("c", 0)])
def test_a_phase_is_gone_before_or_after_the_sync_transformers(verb, sees_line, text, phase):
    plant = closed(plant_of(load=LOCKED))
    full = mean_current(plant, 80.0)
    do(plant, verb, text)
    assert mean_current(plant, 80.0) < 0.7 * full
    assert plant.bridge.wiring.open_phases == 1 << phase
    assert (phase not in plant.line.missing) is sees_line
    assert active_faults(plant) == (f"{verb} T{phase + 1}",)
    do(plant, "repair", "all")
    assert mean_current(plant, 80.0, settle_ns=2 * S) == pytest.approx(full, rel=1e-6)
    assert plant.line.missing == set()


def test_a_lost_tachometer_shows_0_while_the_shaft_turns():
    plant = plant_of(load=LoadData(held_rpm=1000.0))
    assert SIGNALS["tach_rpm"](plant) == pytest.approx(1000.0)
    do(plant, "lose_tach", "true")
    assert (SIGNALS["tach_rpm"](plant), SIGNALS["speed_rpm"](plant)) == (0.0, pytest.approx(1000.0))
    do(plant, "repair", "all")
    assert SIGNALS["tach_rpm"](plant) == pytest.approx(1000.0)


def test_the_field_dies_with_its_time_constant_and_the_emf_with_the_flux():
    """i(t) = exp(-t / 0.5 s); flux = 1.5 i / (0.5 + i): drive.md 12.5."""
    plant = plant_of(load=LoadData(held_rpm=1000.0))
    plant.advance(S)
    rated_v, rated_field = SIGNALS["armature_v"](plant), SIGNALS["field_a"](plant)
    assert rated_field == pytest.approx(0.015 * plant.rated_amps)
    do(plant, "lose_field", "true")
    plant.advance(S + S // 2)
    x = exp(-1.0)
    assert SIGNALS["field_a"](plant) == pytest.approx(rated_field * x, rel=1e-9)
    assert SIGNALS["armature_v"](plant) == pytest.approx(rated_v * 1.5 * x / (0.5 + x), rel=1e-2)
    do(plant, "repair", "all")
    plant.advance(20 * S)
    assert SIGNALS["armature_v"](plant) == pytest.approx(rated_v, rel=1e-6)


def test_a_sag_ends_by_itself_or_stays():
    plant = plant_of()
    do(plant, "line_sag", "70 0.5")
    plant.advance(1)
    assert plant.line.v_ll_v == pytest.approx(322.0)
    assert signals_of(plant).faults == active_faults(plant) == ("line_sag 70",)
    plant.advance(S // 2 + 1)
    assert plant.line.v_ll_v == 460.0
    assert active_faults(plant) == ()
    do(plant, "line_sag", "70 0.5")
    do(plant, "line_sag", "80")
    plant.advance(5 * S)
    assert (plant.line.v_ll_v, active_faults(plant)) == (pytest.approx(368.0), ("line_sag 80",))
    do(plant, "repair", "all")
    plant.advance(6 * S)
    assert (plant.line.v_ll_v, active_faults(plant)) == (460.0, ())


def test_another_frequency_is_a_fault_until_the_usual_one_is_back():
    plant = plant_of()
    do(plant, "line_hz", "59.5")
    plant.advance(S)
    assert (plant.line.frequency_hz, active_faults(plant)) == (59.5, ("line_hz 59.5",))
    do(plant, "line_hz", "60")
    plant.advance(2 * S)
    assert (plant.line.frequency_hz, active_faults(plant)) == (60.0, ())


@pytest.mark.parametrize(
    ("verb", "text"),
    [
        ("short_scr", "7"), ("short_scr", "0"), ("short_scr", ""), ("short_scr", "3.5"), ("open_gate", "17"),
        ("blow_fuse", "4"), ("lose_phase", "D"), ("lose_tach", "false"), ("lose_field", "1"), ("repair", "some"),
        ("line_sag", "101"), ("line_sag", "-1"), ("line_sag", "70 0"), ("line_sag", "70 0.2 1"), ("line_sag", "nan"),
        ("line_hz", "47.9"), ("line_hz", "inf"), ("load_torque_nm", "1e7"), ("load_torque_nm", "much"),
    ],
)  # fmt: skip
def test_what_a_verb_does_not_take_is_refused(verb, text):
    with pytest.raises(ParameterError, match=verb):
        values_of(verb, text)


def test_a_verb_that_is_not_there_is_refused_with_the_nearest():
    with pytest.raises(ParameterError, match="short_scr"):
        values_of("shrt_scr", "3")


# State

WORK = (
    ("short_scr", "4"), ("open_gate", "2"), ("blow_fuse", "1"), ("lose_phase", "B"), ("lose_tach", "true"),
    ("lose_field", "true"), ("line_sag", "60 0.03"), ("line_hz", "59"), ("load_torque_nm", "200"),
    ("line_notches", "40"), ("line_noise", "2 5"), ("line_harmonic", "5 8 30"), ("generator_load", "15 1 0.02 0.05"),
    ("repair", "all"),
)  # fmt: skip


@repeatable
@given(faults=st.lists(st.sampled_from(WORK), max_size=3), cut=st.integers(0, 19), load=st.booleans())
def test_a_plant_goes_on_from_its_state_bit_for_bit(faults, cut, load):
    """Whatever has broken, and wherever it is cut: what comes after is the same, through JSON."""
    data = {"load": LoadData(torque_per_rpm=((0.0, 0.0), (1750.0, 300.0)))} if load else {}
    whole, later = plant_of(**data), plant_of(**data)
    whole.relay(on=True)
    for step in range(20):
        if step == cut:
            later.restore(json.loads(json.dumps(whole.state())))
        for plant in (whole, later) if step >= cut else (whole,):
            now = plant.now_ns
            if step in (8, 11, 14) and len(faults) > (step - 8) // 3:
                do(plant, *faults[(step - 8) // 3])
            if step == 17:
                plant.relay(on=False)
            if step > 6:
                plant.circuit.fire(now + 2 * MS, now + 5 * MS, step % 6 + 1, (step + 4) % 6 + 1)
            plant.advance(now + 10 * MS)
            plant.sample()
    assert json.dumps(whole.state()) == json.dumps(later.state())


def test_every_verb_is_cut_here():
    assert {verb for verb, _ in WORK} == set(VERBS)
