"""Simulated seconds per wall second of line, bridge and motor with a trivial controller, beside a fixed-step RK4."""

from __future__ import annotations

import gc
import time
from math import cos, pi, sqrt

from automax_ros.drive.ac_line import AcLine
from automax_ros.drive.bridge import Bridge
from automax_ros.drive.circuit import Circuit
from automax_ros.drive.firing import natural_angle
from automax_ros.drive.motor import Motor, MotorData
from automax_ros.drive.nameplate import EXAMPLES, derive

PARAMETERS = derive(EXAMPLES["150hp"])
SECONDS = 2.0
REPEATS = 12
FIRINGS_PER_S = 360
STEP_S = 20e-6
SOURCE_OHM = 0.003
CASES = (("rated torque, continuous current", 1.0, 1.15), ("5 % torque, discontinuous current", 0.05, 0.05))
"""What is run: load torque and current reference over rated."""


def drive(load: float, reference: float, seconds: float) -> tuple[float, list[int], Motor]:
    """Run the closed-form circuit; return wall seconds, ns of each firing interval, and the motor.

    The controller does the least that keeps a current: alpha moves in proportion to the error of the mean.
    """
    line = AcLine(PARAMETERS.line_v, inductance_h=PARAMETERS.source_h, resistance_ohm=SOURCE_OHM)
    torque = PARAMETERS.values["shaft_torque_n_m"].value
    motor = Motor(PARAMETERS.motor, load=load * torque, speed_rad_s=150.0)
    circuit = Circuit(line, Bridge(), motor)
    wanted = reference * PARAMETERS.amps
    start = line.instant_of(natural_angle(1, line), 0)
    alpha_us = 1900.0
    taken = []
    clock = time.perf_counter_ns
    gc.collect()
    gc.disable()
    began = before = clock()
    for number in range(int(seconds * FIRINGS_PER_S)):
        on_ns = start + number * 25_000_000 // 9 + int(alpha_us * 1000)
        circuit.advance(on_ns)
        error = wanted - circuit.sample().mean_current_a
        alpha_us = min(max(alpha_us - 0.05 * error, 300.0), 5000.0)
        circuit.fire(on_ns, on_ns + 60_000, number % 6 + 1, (number - 1) % 6 + 1)
        now = clock()
        taken.append(now - before)
        before = now
    wall = (clock() - began) * 1e-9
    gc.enable()
    return wall, taken, motor


def runge_kutta(seconds: float) -> float:
    """Run the same circuit at a fixed step, firings and overlap rounded to the grid; return wall seconds.

    As a programmer would write it first: derivatives of current and speed by the SCR pair that conducts, without
    overlap.
    """
    peak = sqrt(2) * PARAMETERS.line_v
    data: MotorData = PARAMETERS.motor
    inductance, resistance = data.inductance_h + 2 * PARAMETERS.source_h, data.resistance_ohm + 2 * SOURCE_OHM
    omega, torque = 2 * pi * 60, PARAMETERS.values["shaft_torque_n_m"].value
    offset = 0.0

    def slope(t: float, current: float, speed: float) -> tuple[float, float]:
        volts = peak * cos(omega * t - offset)
        return (
            (volts - resistance * current - data.k_v_s * speed) / inductance,
            (data.k_v_s * current - torque - data.viscous_n_m_s * speed) / data.inertia_kg_m2,
        )

    current, speed, half = PARAMETERS.amps, 150.0, STEP_S / 2
    gc.collect()
    gc.disable()
    began = time.perf_counter()
    for step in range(int(seconds / STEP_S)):
        t = step * STEP_S
        offset = int(t * FIRINGS_PER_S) * pi / 3 - 0.2
        a1, b1 = slope(t, current, speed)
        a2, b2 = slope(t + half, current + half * a1, speed + half * b1)
        a3, b3 = slope(t + half, current + half * a2, speed + half * b2)
        a4, b4 = slope(t + STEP_S, current + STEP_S * a3, speed + STEP_S * b3)
        current = max(0.0, current + STEP_S / 6 * (a1 + 2 * (a2 + a3) + a4))
        speed += STEP_S / 6 * (b1 + 2 * (b2 + b3) + b4)
    wall = time.perf_counter() - began
    gc.enable()
    return wall


def main() -> None:
    """Print the figures."""
    for title, load, reference in CASES:
        runs = [drive(load, reference, SECONDS) for _ in range(REPEATS)]
        wall = min(run[0] for run in runs)
        times = sorted(min(samples) for samples in zip(*(run[1] for run in runs), strict=True))
        everything = sorted(sample for run in runs for sample in run[1])
        print(f"{title}: {SECONDS / wall:.0f} simulated s per wall s; wanted: at least 150")
        print(f"  a firing interval: {_quantiles(everything)}; the best of {REPEATS} runs each: {_quantiles(times)}")
    wall = min(runge_kutta(SECONDS / 4) for _ in range(REPEATS))
    print(f"RK4 at 20 us, no overlap, no extinction found: {SECONDS / 4 / wall:.0f} simulated s per wall s")


def _quantiles(ordered: list[int]) -> str:
    p50, p99 = ordered[len(ordered) // 2], ordered[len(ordered) * 99 // 100]
    return f"p50 {p50 / 1000:.1f}, p99 {p99 / 1000:.1f}, max {ordered[-1] / 1000:.1f} us"


if __name__ == "__main__":
    main()
