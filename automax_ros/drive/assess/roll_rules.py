"""What a roll asks of the regulators of its drive, from full to core: inertias, and gains of PROP_INT (all ours).

PROP_INT is KP (1 + WLD / s). The speed's regulator sets the current, the tension's trims the reference of the speed.
Both are computed for a full roll and for the core, where the web's other end holds its speed and the web rests, which
damps it least (decision). ``LAG_S`` stands for scans and for the current's loop.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from math import inf, pi, sqrt

from automax_ros.drive.assess.drive_case import DriveCase, Finding, Rating, RollCase

SPEED_RAD_S = 10.0
"""Crossover of the speed's regulator, rad/s (decision: a drive whose scan is 5 to 11 ms has it with ease)."""
LEAD = 0.2
"""WLD over the crossover, of both regulators (decision)."""
LAG_S = 0.02
"""Delay of a loop, s (decision: 1.5 scans of 11 ms and the current's loop)."""
MARGIN = 0.7
"""Least distance of the tension's loop from -1 without its integral part (decision)."""
_GRID = tuple(10 ** (place / 50 - 2) for place in range(251))
"""Frequencies at which the loop is looked at, 0.01 to 1000 rad/s."""


@dataclass(frozen=True)
class _State:
    """The drive at a diameter: inertia at the motor (kg m2), way of the web per radian of the motor (m)."""

    inertia: float
    arm_m: float


def roll_findings(case: DriveCase) -> tuple[Finding, ...]:
    """Return the findings about the roll of a drive; none without a roll."""
    given = case.roll
    if given is None:
        return ()
    states = tuple(_state(case, given, diameter) for diameter in (given.full_m, given.roll.core_m))
    found = (_inertia(given, states), _speed(case, given, states))
    return found if given.stiffness_n is None else (*found, _tension(given, given.stiffness_n, states))


def _state(case: DriveCase, given: RollCase, diameter_m: float) -> _State:
    own = case.parameters.motor.inertia_kg_m2 * case.inertia
    radius = diameter_m / 2
    return _State(own + given.roll.inertia_kg_m2(radius) / given.gear**2, radius / given.gear)


def _inertia(given: RollCase, states: tuple[_State, ...]) -> Finding:
    full, core = (item.inertia for item in states)
    result = (
        f"{full:.4g} kg m2 at the motor with the full roll of {given.full_m:.4g} m, {core:.4g} with the core of "
        f"{given.roll.core_m:.4g} m: {full / core:.3g} to 1"
    )
    formula = "J = J motor and load + (J core + pi / 2 x density x width x (r^4 - r core^4)) / gear^2 (ours)"
    values = {"full_m": given.full_m, "full_kg_m2": full, "core_m": given.roll.core_m, "core_kg_m2": core}
    return Finding("roll, inertia", Rating.FINE, result, formula, "", values)


def _speed(case: DriveCase, given: RollCase, states: tuple[_State, ...]) -> Finding:
    """Propose gains of the speed's regulator: the current that the inertia takes at the crossover."""
    per_amp = case.parameters.motor.k_v_s * 30 / pi
    gains = [SPEED_RAD_S * item.inertia / per_amp for item in states]
    unit, factor = "A per rpm", 1.0
    lim_bar = case.value("LIM_BAR")
    if lim_bar and lim_bar > 0 and given.counts_rpm is not None:
        unit, factor = "counts per count", 4095 * 100 / (lim_bar * case.parameters.amps) / given.counts_rpm
    full, core = (factor * gain for gain in gains)
    result = (
        f"PROP_INT KP {full:.3g} {unit} with the full roll, {core:.3g} with the core, WLD {LEAD * SPEED_RAD_S:g}: "
        f"let KP follow the inertia"
    )
    formula = f"KP = {SPEED_RAD_S:g} rad/s x J / (torque per A), WLD = {LEAD:g} x {SPEED_RAD_S:g} rad/s (ours)"
    numbers = f"torque per A {case.parameters.motor.k_v_s:.4g} N m"
    values = {"full_kp": full, "core_kp": core, "wld": LEAD * SPEED_RAD_S, "is_counts": float(factor != 1.0)}
    return Finding("roll, speed regulator", Rating.FINE, result, formula, numbers, values)


def _tension(given: RollCase, stiffness_n: float, states: tuple[_State, ...]) -> Finding:
    """Propose gains of the tension's regulator: the largest that keep the loop ``MARGIN`` from -1."""
    spring = stiffness_n / given.length_m
    gains = [tension_gains(item.inertia, item.arm_m, spring) for item in states]
    swings = [abs(item.arm_m) * sqrt(spring / item.inertia) for item in states]
    unit, factor = "rpm per N", 1.0
    if given.counts_rpm is not None and given.counts_n is not None:
        unit, factor = "counts per count", given.counts_rpm / given.counts_n
    (full, full_wld), (core, core_wld) = ((factor * kp, wld) for kp, wld in gains)
    both, wld = min(full, core), min(full_wld, core_wld)
    too_stiff = max(swings) * LAG_S > 1.0
    result = (
        f"PROP_INT KP {full:.3g} {unit} with the full roll, {core:.3g} with the core; "
        f"{both:.3g} with WLD {wld:.2g} is stable from full to core"
    )
    if too_stiff:
        result = f"the web swings at {max(swings):.3g} rad/s, which regulators with {LAG_S * 1e3:g} ms of delay excite"
    delay = f"{LAG_S * 1e3:g} ms of delay"
    formula = f"KP = the largest with |1 + loop| >= {MARGIN:g}, WLD = {LEAD:g} x crossover, {delay} (ours)"
    swing = " and ".join(f"{item:.3g}" for item in swings)
    numbers = f"stiffness / length {spring:.4g} N/m; the roll swings on its web at {swing} rad/s"
    values = {"full_kp": full, "core_kp": core, "kp": both, "wld": wld, "is_counts": float(factor != 1.0)}
    verdict = Rating.ATTENTION if too_stiff else Rating.FINE
    return Finding("roll, tension regulator", verdict, result, formula, numbers, values)


def tension_gains(inertia_kg_m2: float, arm_m: float, spring_n_m: float) -> tuple[float, float]:
    """Return KP (rpm per N) and WLD (rad/s) of a tension's regulator on top of the proposed one of the speed.

    Args:
        inertia_kg_m2: at the motor.
        arm_m: meters of web per radian of the motor.
        spring_n_m: stiffness over length of the web, N/m.
    """
    loop = [(omega, _loop(omega, inertia_kg_m2, arm_m, spring_n_m)) for omega in _GRID]
    kp = min(_nearest(way) for _, way in loop)
    crossover = next((omega for omega, way in loop if kp * abs(way) < 1.0), _GRID[-1])
    return kp, LEAD * crossover


def _nearest(way: complex) -> float:
    """Return the least gain with which a point of a loop comes to ``MARGIN`` from -1; infinite if none does."""
    size, room = abs(way) ** 2, way.real**2 - abs(way) ** 2 * (1.0 - MARGIN**2)
    return (-way.real - sqrt(room)) / size if way.real < 0.0 <= room else inf


def _loop(omega: float, inertia_kg_m2: float, arm_m: float, spring_n_m: float) -> complex:
    """Return the way from a trim of the speed (rpm) to the tension (N) at a frequency (rad/s), with the delay."""
    s = 1j * omega
    damping, stiff = SPEED_RAD_S * inertia_kg_m2, spring_n_m * arm_m**2
    control = damping * (1 + LEAD * SPEED_RAD_S / s) * cmath.exp(-LAG_S * s)
    web = stiff / arm_m * control / (inertia_kg_m2 * s * s + control * s + stiff)
    return web * pi / 30 * cmath.exp(-LAG_S * s)
