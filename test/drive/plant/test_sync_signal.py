"""The sync signal with notches, noise and harmonics: where its comparator sees the maximum of T1 (52.5)."""

from __future__ import annotations

from itertools import pairwise
from math import asin, inf, pi, radians, sin
from statistics import fmean, pstdev

import pytest

from automax_ros.drive.plant.sync_signal import SyncSignal, first_rise, random_number

CYCLE_US = 1e6 / 60
WIDTH = 300 / CYCLE_US
"""300 us at 60 Hz, 6.48 degrees."""


def notched(depth, phase_deg, *, width=WIDTH, count=1):
    return first_rise((depth, width, count, radians(phase_deg)), [])


def test_without_disturbances_every_angle_is_the_lines_own():
    sync = SyncSignal()
    for turn in (0.0, 0.1, 3.0, 6.28):
        assert sync.since(turn) == turn
    assert sync.state()["_cycle"] == 0


@pytest.mark.parametrize(
    ("depth", "phase_deg", "rise_deg"),
    [
        (0.5, -4.0, -4.0),  # it begins before the zero and is deep enough: the comparator sees its edge
        (0.03, -4.0, -1.719),  # a shallow one: where the wave is 3 % below zero
        (0.5, 1.0, 0.0),  # after the zero: the comparator is deaf
        (0.7, -40.0, -40.0),  # far before it, deeper than the wave there
        (0.6, -40.0, -36.8699),  # where the wave has come to it
        (0.5, -40.0, 0.0),  # not as deep as the wave there
        (1.5, -170.0, 0.0),  # in the three quarters of a cycle in which it is deaf
    ],
)
def test_a_notch_moves_the_first_rise_to_its_edge(depth, phase_deg, rise_deg):
    assert notched(depth, phase_deg) == pytest.approx(radians(rise_deg), abs=1e-5)


def test_several_notches_stand_evenly_in_the_cycle():
    """Six that begin 116 degrees after the zero: one of them begins 4 degrees before it."""
    assert notched(0.5, 116.0, count=6) == pytest.approx(radians(-4.0), abs=1e-9)
    assert notched(0.5, 116.0, count=1) == 0.0


@pytest.mark.parametrize("order", [2, 5, 7, 13, 50])
@pytest.mark.parametrize("phase_deg", [90.0, -60.0, 200.0])
def test_a_harmonic_moves_the_zero(order, phase_deg):
    part = 0.08
    rise = first_rise((0.0, 0.0, 0, 0.0), [(order, part, radians(phase_deg))])
    assert 1e-4 < abs(rise) < 0.1
    assert sin(rise) + part * sin(order * rise + radians(phase_deg)) == pytest.approx(0.0, abs=1e-12)
    for number in range(1, 2000):
        theta = -pi / 2 + (rise + pi / 2) * number / 2000
        assert sin(theta) + part * sin(order * theta + radians(phase_deg)) < 0.0


def test_a_harmonic_in_phase_moves_nothing():
    assert first_rise((0.0, 0.0, 0, 0.0), [(5, 0.1, 0.0)]) == pytest.approx(0.0, abs=1e-12)


def test_a_signal_that_does_not_rise_is_none():
    """Notches without end, deeper than the wave, turn the signal around: there is no sync."""
    assert first_rise((2.0, 0.2, 12, 0.0), []) == inf
    sync = SyncSignal()
    sync.set_notches(2.0, 0.2, 12, 0.0)
    assert not sync.is_there


def test_noise_is_nearly_normal_bounded_and_the_same_for_its_seed():
    numbers = [random_number(7, place) for place in range(20_000)]
    assert fmean(numbers) == pytest.approx(0.0, abs=0.02)
    assert pstdev(numbers) == pytest.approx(1.0, abs=0.02)
    assert max(map(abs, numbers)) < 3.5
    together = fmean(a * b for a, b in pairwise(numbers))
    assert together == pytest.approx(0.0, abs=0.03), "one does not tell of the next"
    assert numbers == [random_number(7, place) for place in range(20_000)]
    assert numbers[:100] != [random_number(8, place) for place in range(100)]


def test_one_number_moves_the_instant_of_a_whole_cycle():
    """Half a cycle before an instant to half a cycle after it all say the same of it."""
    sync = SyncSignal()
    sync.set_noise(0.02, 3)
    moved = []
    for sixth in range(6 * 50):
        turn = (0.3 + sixth * pi / 3) % (2 * pi)
        moved.append((turn - sync.since(turn) + pi) % (2 * pi) - pi)
    for place in range(3, 6 * 49, 6):
        assert max(moved[place : place + 6]) == pytest.approx(min(moved[place : place + 6]), abs=1e-12)
    assert pstdev(moved[::6]) == pytest.approx(0.02, rel=0.3)


def test_notches_take_as_much_voltage_as_area():
    sync = SyncSignal()
    sync.set_notches(0.8, 0.018, 6, 0.0)
    assert sync.lost_part == pytest.approx(0.8 * 0.018 * 6)
    sync.set_notches(2.0, 0.12, 12, 0.0)
    assert sync.lost_part == 1.0
    sync.clear()
    assert sync.lost_part == 0.0


def test_a_state_goes_on_bit_for_bit():
    sync, again = SyncSignal(), SyncSignal()
    sync.set_noise(0.02, 3)
    sync.set_harmonic(5, 0.1, 1.0)
    sync.set_harmonic(7, 0.1, 1.0)
    sync.set_harmonic(5, 0.0, 0.0)
    sync.set_notches(0.1, WIDTH, 6, -0.1)
    turns = [(0.1 + number) % (2 * pi) for number in range(100)]
    for turn in turns:
        sync.since(turn)
    again.restore(sync.state())
    assert [again.since(turn) for turn in turns] == [sync.since(turn) for turn in turns]
    assert asin(0.1) > 0.1, "the notch is deep enough where it begins"
