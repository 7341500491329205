"""Proposed gains of DC_DRIVE_CML for a motor and its line (52.1.2).

Each is computed from the drive's data and LIM_BAR; the result is in the keyword's range and steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Final

from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.drive.current_loop.regulator import BOUNDARY_WAY, FULL, INTEGRAL_STEP, STEPS

VD0: Final = 1.3505
"""Ideal mean voltage of the bridge over the line-to-line voltage: 3 sqrt(2) / pi."""
BOUNDARY: Final = 0.0931
"""Current at the boundary of continuous conduction over Vd0 / (w L), at alpha 90 degrees and R = 0."""
LOOP_GAIN: Final = 0.65
"""Part of an error that the proportional gain corrects in a scan, in continuous conduction at alpha 90 degrees
(decision)."""
LEAST_CONDUCTION: Final = 0.4
"""Conducting part of a scan down to which the integral gain is raised (decision)."""


@dataclass(frozen=True)
class ArmatureCircuit:
    """The data that the gains depend on.

    Attributes:
        line_v: line-to-line voltage, V rms.
        line_hz: frequency, Hz.
        inductance_h: inductance in the current's path: armature, choke and two phases of the line, H.
        resistance_ohm: resistance there, with the overlap's 6 f Ls, ohm.
        counts_a: counts of feedback per ampere: 4095 at LIM_BAR.
    """

    line_v: float
    line_hz: float
    inductance_h: float
    resistance_ohm: float
    counts_a: float


def circuit_of(
    parameters: DriveParameters, lim_bar: int, *, choke_h: float = 0.0, source_ohm: float = 0.005
) -> ArmatureCircuit:
    """Return the data that the gains of a drive depend on.

    Args:
        parameters: motor and line.
        lim_bar: LIM_BAR, % of rated current.
        choke_h: a smoothing choke in the armature's circuit, H.
        source_ohm: resistance of a phase of the line, ohm.
    """
    motor, hertz = parameters.motor, parameters.line_hz
    return ArmatureCircuit(
        parameters.line_v,
        hertz,
        motor.inductance_h + choke_h + 2 * parameters.source_h,
        motor.resistance_ohm + 2 * source_ohm + 6 * hertz * parameters.source_h,
        FULL * 100 / (lim_bar * parameters.amps),
    )


def gain_continuous(circuit: ArmatureCircuit) -> float:
    """Return the counts that 1 us of DELTA adds in a scan, in continuous conduction: pi / 3 Vd0 1e-6 / L x counts_a."""
    return pi / 3 * VD0 * circuit.line_v * 1e-6 / circuit.inductance_h * circuit.counts_a


def kp(circuit: ArmatureCircuit) -> float:
    """KP = 0.65 / (counts per microsecond of DELTA and scan), in steps of 1/1024, 0 to 4."""
    return min(4.0, max(1.0, round(LOOP_GAIN / gain_continuous(circuit) * STEPS)) / STEPS)


def pi_w_lead(circuit: ArmatureCircuit) -> int:
    """PI_W_LEAD = R / L of the whole circuit, rad/s, 10 to 500: it cancels the armature's time constant (decision)."""
    return min(500, max(10, round(circuit.resistance_ohm / circuit.inductance_h)))


def cc_thresh(circuit: ArmatureCircuit) -> int:
    """CC_THRESH = counts of the current where continuous conduction begins at standstill, 0 to 32767 (decision)."""
    reactance = 2 * pi * circuit.line_hz * circuit.inductance_h
    return min(32767, round(BOUNDARY * VD0 * circuit.line_v / reactance * circuit.counts_a))


def ag_factor(circuit: ArmatureCircuit) -> int:
    """AG_FACTOR = integral gain wanted where 40 % of a scan conduct, over the continuous one, 1 to 300 (decision)."""
    continuous = kp(circuit) * pi_w_lead(circuit) / (6 * circuit.line_hz)
    slope = 3e-6 / BOUNDARY_WAY * circuit.line_hz * cc_thresh(circuit) * LEAST_CONDUCTION**2
    return min(300, max(1, round(INTEGRAL_STEP / slope / continuous)))


def ref_lag(circuit: ArmatureCircuit) -> int:  # noqa: ARG001 - as the others
    """REF_LAG = 400 rad/s: the fastest that 50 and 60 Hz allow; the armature follows no faster (decision)."""
    return 400
