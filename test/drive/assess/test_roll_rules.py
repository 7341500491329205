"""What a roll asks of its regulators: inertias in closed form, loops whose poles another model finds stable."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from automax_ros.drive.assess.assessment import assess
from automax_ros.drive.assess.drive_case import DriveCase, DriveFindings, GivenValue, Rating, RollCase
from automax_ros.drive.assess.roll_rules import LAG_S, LEAD, SPEED_RAD_S, tension_gains
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.web.data import Roll

ROLL = Roll(1.25, 0.15, 2.5, 90.0, 780.0)
PARAMETERS = derive(EXAMPLES["150hp"])


def found(roll: RollCase | None) -> DriveFindings:
    inputs = {"LIM_BAR": GivenValue(150, "150")}
    return assess(DriveCase("UNWIND", "57C406 in slot 7", PARAMETERS, inputs=inputs, roll=roll))


def values(given: RollCase) -> dict[str, dict[str, float | None]]:
    return {item.rule: dict(item.values) for item in found(given).findings if item.rule.startswith("roll")}


def test_a_drive_without_a_roll_has_none_of_these():
    assert not [item for item in found(None).findings if item.rule.startswith("roll")]


def test_inertia_is_that_of_motor_and_roll():
    got = values(RollCase(ROLL, 4.0, 1.25))["roll, inertia"]
    own = PARAMETERS.motor.inertia_kg_m2
    assert got["core_kg_m2"] == pytest.approx(own)
    assert got["full_kg_m2"] == pytest.approx(own + pi / 2 * 780 * 2.5 * (0.625**4 - 0.075**4) / 16)


def test_the_speed_gain_gives_the_crossover():
    got = values(RollCase(ROLL, 4.0, 1.25, counts_rpm=4095 / 1750))["roll, speed regulator"]
    # Counts of speed per count of current and second, 4095 being 150 % and base speed.
    amps, torque = PARAMETERS.amps * 1.5 / 4095, PARAMETERS.motor.k_v_s
    full = values(RollCase(ROLL, 4.0, 1.25))["roll, inertia"]["full_kg_m2"]
    per_count = amps * torque / full * 30 / pi * 4095 / 1750
    assert got["full_kp"] * per_count == pytest.approx(SPEED_RAD_S)
    assert got["full_kp"] / got["core_kp"] == pytest.approx(20.8, rel=0.01)


@pytest.mark.parametrize("length_m", [2.0, 4.0, 20.0])
@pytest.mark.parametrize("diameter_m", [1.25, 0.7, 0.15])
def test_the_proposed_tension_loop_is_stable(diameter_m, length_m):
    """Poles of the loop in discrete time, with its delay as samples: none outside of the unit circle."""
    radius = diameter_m / 2
    inertia = PARAMETERS.motor.inertia_kg_m2 + ROLL.inertia_kg_m2(radius) / 16
    arm, spring = radius / 4, 2e5 / length_m
    kp, wld = tension_gains(inertia, arm, spring)
    step, late = 0.002, round(LAG_S / 0.002)
    damping = SPEED_RAD_S * inertia
    # States: speed, tension, integrators of speed and tension, then the delayed torques and the delayed trims.
    size = 4 + 2 * late
    a = np.eye(size)
    a[0, 1], a[0, 4 + late - 1] = -step * arm / inertia, step / inertia
    a[1, :] += spring * arm * step * a[0, :] * 1.0  # the tension follows the new speed: no gain by the step itself
    error_t = np.zeros(size)
    error_t[1] = -1.0
    a[3] += step * wld * error_t
    trim = kp * pi / 30 * (error_t + np.eye(size)[3])
    delayed = np.eye(size)[size - 1]
    error_w = delayed - np.eye(size)[0]
    a[2] += step * LEAD * SPEED_RAD_S * error_w
    torque = damping * (error_w + np.eye(size)[2])
    for first, new in ((4, torque), (4 + late, trim)):
        a[first] = new
        for place in range(1, late):
            a[first + place] = np.eye(size)[first + place - 1]
    assert kp > 0
    assert np.abs(np.linalg.eigvals(a)).max() < 1.0


def test_gains_for_both_are_the_smaller_ones():
    got = values(RollCase(ROLL, 4.0, 1.25, 2e5, 4.0))["roll, tension regulator"]
    assert got["kp"] == min(got["full_kp"], got["core_kp"])


def test_a_web_that_is_too_stiff_asks_for_attention():
    (told,) = [item for item in found(RollCase(ROLL, 4.0, 1.25, 1e9, 0.5)).findings if "tension" in item.rule]
    assert told.verdict is Rating.ATTENTION
    assert "excite" in told.result
