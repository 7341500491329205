"""What stimuli do to a plant's line: limits, what replaces what, what ends by itself, repair (52.4, 52.5)."""

from __future__ import annotations

import pytest

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.faults import active_faults, values_of
from drive.plants import S, do, plant_of


@pytest.mark.parametrize(
    ("verb", "text", "values"),
    [
        ("line_hz", "59", (59.0,)),
        ("line_hz", "59 0.4", (59.0, 0.4)),
        ("generator_load", "15 1.5", (15.0, 1.5, 0.1, 1.0)),
        ("generator_load", "15 1.5 0.2", (15.0, 1.5, 0.2, 1.0)),
        ("generator_load", "15 1.5 0.2 0.8", (15.0, 1.5, 0.2, 0.8)),
        ("line_notches", "40", (40.0, 300.0, 6.0, -4.0)),
        ("line_notches", "40 200 2 10", (40.0, 200.0, 2.0, 10.0)),
        ("line_noise", "2", (2.0, 0.0)),
        ("line_noise", "2 65535", (2.0, 65535.0)),
        ("line_harmonic", "5 8", (5.0, 8.0, 0.0)),
        ("line_harmonic", "5 8 -30", (5.0, 8.0, -30.0)),
    ],
)
def test_values_that_are_left_out_are_the_usual_ones(verb, text, values):
    assert values_of(verb, text) == values


@pytest.mark.parametrize(
    ("verb", "text"),
    [
        ("line_hz", "47.9"), ("line_hz", "60 0"), ("line_hz", "60 -1"), ("line_hz", "60 1 1"), ("line_hz", ""),
        ("generator_load", "15"), ("generator_load", "-1 1"), ("generator_load", "61 1"), ("generator_load", "5 15"),
        ("generator_load", "5 1 0"), ("generator_load", "5 1 0.1 61"), ("generator_load", "5 1 0.1 1 1"),
        ("line_notches", "-1"), ("line_notches", "201"), ("line_notches", "20 0"), ("line_notches", "20 2001"),
        ("line_notches", "20 300 0"), ("line_notches", "20 300 13"), ("line_notches", "20 300 1.5"),
        ("line_notches", "20 300 6 181"), ("line_notches", "deep"), ("line_notches", "nan"),
        ("line_noise", "-0.1"), ("line_noise", "20.1"), ("line_noise", "1 -1"), ("line_noise", "1 1.5"),
        ("line_noise", "1 65536"), ("line_noise", "inf"),
        ("line_harmonic", "5"), ("line_harmonic", "1 5"), ("line_harmonic", "51 5"), ("line_harmonic", "2.5 5"),
        ("line_harmonic", "5 -1"), ("line_harmonic", "5 51"), ("line_harmonic", "5 5 361"),
    ],
)  # fmt: skip
def test_what_is_too_much_too_little_or_no_number_is_refused_with_what_it_takes(verb, text):
    with pytest.raises(ParameterError, match=f"{verb} cannot be .*: it takes .*0"):
        values_of(verb, text)


def test_a_generator_sags_with_voltage_and_frequency_and_recovers_by_itself():
    plant = plant_of()
    do(plant, "generator_load", "20 2 0.05 0.2")
    plant.advance(3 * S // 20)
    assert plant.line.v_ll_v == pytest.approx(460 * (1 - 0.2 * (1 - 0.0498)), rel=1e-3)
    assert plant.line.frequency_hz == pytest.approx(60 - 2 * (1 - 0.0498), abs=0.01)
    assert active_faults(plant) == ("generator_load 20 2",)
    plant.advance(S)
    assert 450.0 < plant.line.v_ll_v < 460.0
    plant.advance(10 * S)
    assert (plant.line.v_ll_v, plant.line.frequency_hz) == (460.0, 60.0)
    assert active_faults(plant) == ()


def test_a_second_load_counts_from_the_usual_values_not_from_the_dip():
    plant = plant_of()
    for at in (0, S // 10):
        plant.advance(at)
        do(plant, "generator_load", "20 2 0.05 0.2")
    plant.advance(10 * S)
    assert (plant.line.v_ll_v, plant.line.frequency_hz) == (460.0, 60.0)


def test_a_generator_at_another_frequency_recovers_to_that():
    plant = plant_of()
    do(plant, "line_hz", "58")
    do(plant, "generator_load", "10 5")
    plant.advance(30 * S)
    assert plant.line.frequency_hz == 58.0


def test_a_frequency_that_would_fall_too_low_changes_nothing():
    plant = plant_of()
    do(plant, "line_hz", "50")
    before = plant.state()
    with pytest.raises(ParameterError, match=r"fall from 50 to 47\.5 Hz.*dip_hz of 2 at most"):
        do(plant, "generator_load", "10 2.5")
    assert plant.state() == before


def test_a_frequency_drifts_at_its_rate():
    plant = plant_of()
    do(plant, "line_hz", "58 0.5")
    plant.advance(2 * S)
    assert plant.line.frequency_hz == pytest.approx(59.0, abs=1e-3)
    plant.advance(5 * S)
    assert plant.line.frequency_hz == 58.0
    assert active_faults(plant) == ("line_hz 58",)


def test_notches_take_voltage_from_the_bridge_in_a_sag_too():
    """300 us six times in 16,667 us are 10.8 % of the time."""
    plant = plant_of()
    do(plant, "line_notches", "50")
    left = 1 - 0.5 * 6 * 300e-6 * 60
    plant.advance(1)
    assert plant.line.v_ll_v == pytest.approx(460 * left)
    do(plant, "line_sag", "70 0.1")
    plant.advance(S // 20)
    assert plant.line.v_ll_v == pytest.approx(460 * left * 0.7)
    do(plant, "line_notches", "0")
    plant.advance(S // 15)
    assert plant.line.v_ll_v == pytest.approx(460 * 0.7)
    plant.advance(S // 5)
    assert plant.line.v_ll_v == 460.0


@pytest.mark.parametrize("way", ["repair", "zeros"])
def test_all_is_sound_again(way):
    plant, sound = plant_of(), plant_of()
    for verb, text in (
        ("line_notches", "50"), ("line_noise", "2 9"), ("line_harmonic", "5 8 30"), ("line_harmonic", "7 4"),
        ("line_hz", "58 0.1"), ("generator_load", "10 1"),
    ):  # fmt: skip
        do(plant, verb, text)
    told = active_faults(plant)
    assert told == (
        "line_notches 50 300 6 -4", "line_noise 2 9", "line_harmonic 5 8 30", "line_harmonic 7 4 0", "line_hz 58",
        "generator_load 10 1",
    )  # fmt: skip
    plant.advance(S // 2)
    if way == "repair":
        do(plant, "repair", "all")
    else:
        for verb, text in (
            ("line_notches", "0"),
            ("line_noise", "0"),
            ("line_harmonic", "5 0"),
            ("line_harmonic", "7 0"),
            ("line_hz", "60"),
        ):
            do(plant, verb, text)
    for one in (plant, sound):
        one.advance(20 * S)
    assert active_faults(plant) == ()
    assert (plant.line.v_ll_v, plant.line.frequency_hz) == (460.0, 60.0)
    for turn in (0.0, 1.0, 6.0):
        assert plant.sync.since(turn) == turn


def test_a_state_has_them_all():
    plant, again = plant_of(), plant_of()
    for verb, text in (
        ("line_notches", "50"),
        ("line_noise", "2 9"),
        ("line_harmonic", "5 8"),
        ("generator_load", "10 1"),
    ):
        do(plant, verb, text)
    plant.advance(S // 5)
    again.restore(plant.state())
    for one in (plant, again):
        do(one, "line_sag", "50 0.1")
        one.advance(S)
    assert again.state() == plant.state()
    assert again.sync.since(1.0) == plant.sync.since(1.0)
