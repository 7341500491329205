"""The manual's formulas for setting up a drive with SCR bridges: tach loss, bridge change, overcurrent (52.4, 52.6).

Boundary current and ripple are those of an ideal six-pulse bridge without resistance.
"""

from __future__ import annotations

from math import acos, degrees, pi, sqrt, tan

from automax_ros.drive.base.errors import LARGEST, SMALLEST, ParameterError, require
from automax_ros.drive.base.nameplate import KG_M2_PER_LB_FT2
from automax_ros.drive.current_loop.faults import TACH_HIGHEST_DEG
from automax_ros.drive.current_loop.signals import Measured

DEFAULT_THRESHOLD_DEG, LARGEST_THRESHOLD_DEG = Measured(0).tach_threshold, TACH_HIGHEST_DEG
"""Register 4136 after initialisation, and the largest value that the tach loss function uses (52.4.1)."""
DEFAULT_PHASE_STEP_US, DEFAULT_PERIOD_STEP_US = Measured(0).phase_step, Measured(0).period_step
"""Registers 4137 and 4138 after initialisation, us per line cycle (52.5.1)."""
LEAST_JBAR_S = 0.2
"""Least JBAR with which the threshold may be raised, s (52.4.1, equation 2)."""
OVERCURRENT_RATIO = 1.8
"""IOC_THRESH must be less than this times LIM_BAR (52.1.5)."""
TABLE_3_MH_A: dict[float, float] = {230.0: 1264.7127, 460.0: 2346.575, 575.0: 3161.781, 660.0: 3519.8625}
"""Rated current times largest inductance, mH A, of each line voltage: every number of table 3 is this over the current
(decision: the numbers between the rows too)."""
LB_FT_PER_N_M = 1 / 1.3558179483
WIDEST_LINE = 0.1
"""A line voltage that differs by more than this part from the nearest column of table 3 is in none (decision)."""


def delta_bound_deg(armature_v: float, line_v: float) -> float:
    """Return the upper limit of register 4136, degrees of DELTA (52.4.1, equation 1).

    Args:
        armature_v: largest armature voltage, V.
        line_v: nominal line-to-line voltage, V rms.

    Raises:
        ParameterError: this line cannot supply three quarters of that voltage.
    """
    require("armature voltage in V", armature_v, 0.0, LARGEST, above=True)
    require("line-to-line voltage in V", line_v, SMALLEST, LARGEST)
    part = 0.75 * armature_v / (1.35 * line_v)
    if part > 1.0:
        raise ParameterError(
            f"0.75 x {armature_v:g} V is more than the 1.35 x {line_v:g} V that the line can give: the motor does not "
            "belong on this line"
        )
    return 180.0 - degrees(acos(part))


def jbar_s(inertia_kg_m2: float, base_rpm: float, torque_n_m: float) -> float:
    """Return JBAR, s: WR2 x SB / (308 T) in lb ft2, rpm and lb ft (52.4.1, equation 2).

    Args:
        inertia_kg_m2: least inertia at the shaft, kg m2.
        base_rpm: base speed, or the largest one with a weakened field.
        torque_n_m: largest torque, N m: that at LIM_BAR.
    """
    for name, value in (("inertia in kg m2", inertia_kg_m2), ("speed in rpm", base_rpm), ("torque in N m", torque_n_m)):
        require(name, value, 0.0, above=True)
    return inertia_kg_m2 / KG_M2_PER_LB_FT2 * base_rpm / (308 * torque_n_m * LB_FT_PER_N_M)


def table_3_line_v(line_v: float) -> float | None:
    """Return the line voltage of the nearest column of table 3, V; None where none is near."""
    nearest = min(TABLE_3_MH_A, key=lambda column: abs(column - line_v))
    return nearest if abs(line_v - nearest) <= WIDEST_LINE * nearest else None


def largest_inductance_mh(column_v: float, rated_amps: float) -> float:
    """Return the largest armature inductance for fast bridge change, mH (table 3).

    Args:
        column_v: line voltage of a column of the table.
        rated_amps: rated armature current, A.
    """
    return TABLE_3_MH_A[column_v] / require("rated current in A", rated_amps, 0.0, above=True)


def boundary_amps(line_v: float, line_hz: float, inductance_h: float) -> float:
    """Return the mean current, A, from which it is continuous at alpha 90 degrees, where the limit is highest.

    Args:
        line_v: line-to-line voltage, V rms.
        line_hz: frequency, Hz.
        inductance_h: armature circuit with two phases of the source, H.
    """
    reactance = 2 * pi * line_hz * require("inductance in H", inductance_h, 0.0, above=True)
    mean_voltage = 3 * sqrt(2) / pi * line_v
    return mean_voltage / reactance * (1 - pi / 6 / tan(pi / 6))


def ripple_amps(line_v: float, line_hz: float, inductance_h: float) -> float:
    """Return the peak of a continuous current at alpha 90 degrees above its mean, A; arguments as ``boundary_amps``.

    The current rises by sqrt(2) V / (w L) x (1 - sin 60 deg) from its lowest value, which is the boundary current below
    the mean.
    """
    reactance = 2 * pi * line_hz * require("inductance in H", inductance_h, 0.0, above=True)
    return sqrt(2) * line_v / reactance * (1 - sqrt(3) / 2) - boundary_amps(line_v, line_hz, inductance_h)
