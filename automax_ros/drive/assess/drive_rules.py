"""The manual's formulas as rules for a drive: each with its numbers put in, and its verdict (52.4 to 52.6)."""

from __future__ import annotations

from math import ceil, floor

from automax_ros.blocks.cml import ioc_is_possible
from automax_ros.drive.assess.drive_case import DriveCase, Finding, Verdict
from automax_ros.drive.assess.limits import (
    DEFAULT_THRESHOLD_DEG,
    LARGEST_THRESHOLD_DEG,
    LB_FT_PER_N_M,
    LEAST_JBAR_S,
    OVERCURRENT_RATIO,
    TABLE_3_MH_A,
    delta_bound_deg,
    jbar_s,
    largest_inductance_mh,
    ripple_amps,
    table_3_line_v,
)
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.nameplate import KG_M2_PER_LB_FT2

PMI_TRIP_POINTS, PMI_MOST_TRIP = 75, 225
"""Margin of a PMI's trip above the largest current, and its highest trip, % of rated current (S-3006 p. 109)."""


def line_frequency(case: DriveCase) -> Finding:
    """AC_LINE_FREQ must not be above the lowest frequency of the line (52.1.1)."""
    line_hz, given = case.parameters.line_hz, case.value("AC_LINE_FREQ")
    if given is None:
        verdict, why = Verdict.ATTENTION, "no task with DC_DRIVE_CML gives it"
    elif given == line_hz:
        verdict, why = Verdict.FINE, "that of the line"
    elif given > line_hz:
        verdict, why = Verdict.WRONG, "more than the line has: enter the lowest frequency that is expected"
    else:
        verdict, why = Verdict.ATTENTION, "less than the line has: right only where the frequency falls as low"
    return Finding(
        "AC_LINE_FREQ",
        verdict,
        f"{case.text('AC_LINE_FREQ')}{'' if given is None else ' Hz'}, {why}",
        "AC_LINE_FREQ = lowest frequency of the line (52.1.1)",
        f"line {line_hz:g} Hz",
        {"ac_line_freq": given, "line_hz": line_hz},
    )


def tach_loss(case: DriveCase) -> Finding:
    """Register 4136 and its upper limit (52.4.1, equation 1); above the default JBAR must allow it (equation 2)."""
    formula = "DELTA THRESHOLD <= 180 - ARCOS[(0.75 VDC) / (1.35 VLL)] (52.4.1, equation 1)"
    volts, line_v = case.armature_v, case.parameters.line_v
    try:
        bound = min(delta_bound_deg(volts, line_v), float(LARGEST_THRESHOLD_DEG))
        exact = delta_bound_deg(volts, line_v)
    except ParameterError as error:
        return Finding("tach loss threshold", Verdict.WRONG, str(error), formula)
    numbers = f"180 - ARCOS[(0.75 x {volts:.4g}) / (1.35 x {line_v:.4g})] = {exact:.1f} deg"
    used, jbar = case.threshold.value, _jbar(case)
    return Finding(
        "tach loss threshold",
        _threshold_verdict(used, bound, jbar),
        f"register 4136: {case.threshold.text}; at most {_bound_text(exact)}" + _raise_hint(used, jbar),
        formula,
        numbers,
        {"delta_bound_deg": exact, "register_4136": used},
    )


def _bound_text(exact: float) -> str:
    if exact > LARGEST_THRESHOLD_DEG:
        return f"{exact:.1f} deg, of which {LARGEST_THRESHOLD_DEG} are used"
    return f"{exact:.1f} deg"


def _threshold_verdict(used: float | None, bound: float, jbar: float | None) -> Verdict:
    if used is None:
        return Verdict.ATTENTION
    if used > bound:
        return Verdict.WRONG
    if used > DEFAULT_THRESHOLD_DEG and (jbar is None or jbar < LEAST_JBAR_S):
        return Verdict.ATTENTION if jbar is None else Verdict.WRONG
    return Verdict.FINE


def _raise_hint(used: float | None, jbar: float | None) -> str:
    if used is None or used <= DEFAULT_THRESHOLD_DEG or (jbar is not None and jbar >= LEAST_JBAR_S):
        return ""
    return f"; it may be above {DEFAULT_THRESHOLD_DEG} only with a JBAR of {LEAST_JBAR_S:g} s or more"


def _jbar(case: DriveCase) -> float | None:
    lim_bar = case.value("LIM_BAR")
    if not lim_bar or lim_bar < 0:
        return None
    inertia = case.parameters.motor.inertia_kg_m2 * case.inertia
    return floor(1000 * jbar_s(inertia, case.base_rpm, case.most_n_m * lim_bar / 100)) / 1000


def inertia_time(case: DriveCase) -> Finding:
    """JBAR, which says whether the threshold may be raised (52.4.1, equation 2).

    WR2 is that of motor and load in the plant. T is the armature's torque at LIM_BAR of the rated current, with its
    full torque per ampere: friction and a braking load, which reduce it, could be absent. JBAR is rounded down to a
    millisecond. Both err on the safe side (decision).
    """
    formula = "JBAR = (WR x WR x SB) / (308 T) >= 0.2 s (52.4.1, equation 2)"
    jbar = _jbar(case)
    if jbar is None:
        result = f"LIM_BAR is {case.text('LIM_BAR')}: the largest torque is not known"
        return Finding("JBAR", Verdict.ATTENTION, result, formula)
    wr2 = case.parameters.motor.inertia_kg_m2 * case.inertia / KG_M2_PER_LB_FT2
    percent = case.value("LIM_BAR") or 0.0
    torque = case.most_n_m * percent / 100
    enough = jbar >= LEAST_JBAR_S
    result = (
        f"{jbar:.3f} s: the tach loss threshold may be raised"
        if enough
        else f"{jbar:.3f} s, less than {LEAST_JBAR_S:g}: leave register 4136 at {DEFAULT_THRESHOLD_DEG}"
    )
    result += f"; T is the {torque:.4g} N m of this plant's armature at LIM_BAR, JBAR is rounded down"
    verdict = Verdict.FINE if enough else Verdict.ATTENTION
    pounds = ceil(10 * torque * LB_FT_PER_N_M) / 10
    numbers = f"({wr2:.4g} lb ft2 x {case.base_rpm:.4g} rpm) / (308 x {pounds:.1f} lb ft) = {jbar:.3f} s"
    return Finding("JBAR", verdict, result, formula, numbers, {"jbar_s": jbar, "torque_n_m": torque})


def line_synchronization(case: DriveCase) -> Finding:
    """Registers 4137 and 4138: above 0, one twice the other (52.5.1); what is not so is used as it is (decision)."""
    formula = "register 4137 = 2 x register 4138 > 0 (52.5.1)"
    phase, period = case.phase_step, case.period_step
    programmed = f"register 4137: {phase.text}, 4138: {period.text}"
    values = {"register_4137": phase.value, "register_4138": period.value}
    if phase.value is None or period.value is None:
        verdict, why = Verdict.ATTENTION, "not known whether one is twice the other"
    elif min(phase.value, period.value) <= 0:
        verdict, why = Verdict.WRONG, "neither may be 0 or less: the line sync is lost"
    elif phase.value != 2 * period.value:
        verdict, why = Verdict.ATTENTION, "the first is not twice the second: both are used as they are (AMX7117)"
    else:
        verdict, why = Verdict.FINE, "one is twice the other"
    return Finding("line synchronization", verdict, f"{programmed}; {why}", formula, "", values)


def bridge_change(case: DriveCase) -> Finding:
    """The armature inductance against table 3, and the other conditions of fast bridge change (52.6)."""
    inductance = case.parameters.motor.inductance_h * 1e3
    column = table_3_line_v(case.parameters.line_v)
    formula = "largest inductance = K / RATED I (every number of table 3, 52.6)"
    switched = case.fast_change.value
    values: dict[str, float | None] = {"inductance_mh": inductance, "largest_inductance_mh": None}
    if column is None:
        verdict = Verdict.ATTENTION if switched != 0 else Verdict.FINE
        columns = ", ".join(f"{volts:g}" for volts in TABLE_3_MH_A)
        result = f"table 3 has no column for {case.parameters.line_v:g} V (it has {columns})"
        return Finding("fast bridge change", verdict, result, formula, values=values)
    amps = case.parameters.amps
    largest = values["largest_inductance_mh"] = largest_inductance_mh(column, amps)
    numbers = f"{TABLE_3_MH_A[column]:.7g} mH A / {amps:.4g} A = {largest:.4g} mH at {column:g} V"
    verdict, result = _change_verdict(case, inductance <= largest)
    text = f"armature {inductance:.4g} mH, at most {largest:.4g}: {result}"
    return Finding("fast bridge change", verdict, text, formula, numbers, values)


def _change_verdict(case: DriveCase, small: bool) -> tuple[Verdict, str]:
    switched = case.fast_change.value
    state = f"register 4146 bit 0: {case.fast_change.text}"
    if not small:
        verdict = Verdict.ATTENTION if switched is None else Verdict.WRONG if switched else Verdict.FINE
        return verdict, f"too large, leave it off ({state})"
    if switched == 0:
        return Verdict.FINE, f"small enough; it is off ({state})"
    if not case.voltage:
        verdict = Verdict.ATTENTION if switched is None else Verdict.WRONG
        return verdict, f"without the armature voltage at a 57C405 it ends in IOC ({state})"
    return Verdict.FINE, f"small enough ({state})"


def overcurrent(case: DriveCase) -> Finding:
    """IOC_THRESH against LIM_BAR: below 1.8 times (52.1.5), and above the peaks of the largest current (decision)."""
    formula = f"IOC_THRESH < {OVERCURRENT_RATIO:g} LIM_BAR (52.1.5); above LIM_BAR and the ripple's peak"
    level, lim_bar = case.value("IOC_THRESH"), case.value("LIM_BAR")
    programmed = f"IOC_THRESH {case.text('IOC_THRESH')}, LIM_BAR {case.text('LIM_BAR')}"
    if level is None or lim_bar is None:
        return Finding("IOC_THRESH", Verdict.ATTENTION, f"{programmed}: give both to compare them", formula)
    most = OVERCURRENT_RATIO * lim_bar
    peak = lim_bar + _ripple_percent(case)
    if not ioc_is_possible(int(level), int(lim_bar)):
        verdict, why = Verdict.WRONG, "IOC calculation error at task initialization: the drive will not run"
    elif level <= peak:
        verdict, why = Verdict.ATTENTION, f"at LIM_BAR the ripple's peaks reach {peak:.4g} %: it will trip"
    else:
        verdict, why = Verdict.FINE, f"above the peaks at LIM_BAR, {peak:.4g} %"
    numbers = f"{level:g} < {OVERCURRENT_RATIO:g} x {lim_bar:g} = {most:g}; peaks {lim_bar:g} + {peak - lim_bar:.3g} %"
    values = {"ioc_thresh": level, "lim_bar": lim_bar, "most": most, "peak": peak}
    return Finding("IOC_THRESH", verdict, f"{programmed}: {why}", formula, numbers, values)


def _ripple_percent(case: DriveCase) -> float:
    amps = ripple_amps(case.parameters.line_v, case.parameters.line_hz, case.loop_inductance_h)
    return 100 * amps / case.parameters.amps


def pmi_overcurrent(case: DriveCase) -> Finding:
    """The trip of a UDC's drive: 75 points above the Motor Overload Ratio, 225 % at most (S-3006 p. 109)."""
    formula = f"trip = armature amps x (maximum current + {PMI_TRIP_POINTS} %) <= {PMI_MOST_TRIP} % (S-3006 p. 109)"
    lim_bar = case.value("LIM_BAR")
    if lim_bar is None:
        result = "give the plant its motor_overload_ratio"
        return Finding("overcurrent trip", Verdict.ATTENTION, result, formula)
    trip = lim_bar + PMI_TRIP_POINTS
    peak = lim_bar + _ripple_percent(case)
    amps = case.parameters.amps
    if trip > PMI_MOST_TRIP:
        verdict, why = Verdict.ATTENTION, f"the parameter screen takes {PMI_MOST_TRIP} % of the power module at most"
    elif trip <= peak:
        verdict, why = Verdict.ATTENTION, f"at the largest current the ripple's peaks reach {peak:.4g} %: it will trip"
    else:
        verdict, why = Verdict.FINE, f"above the peaks at the largest current, {peak:.4g} %"
    numbers = f"{amps:.4g} A x ({lim_bar:g} + {PMI_TRIP_POINTS}) % = {amps * trip / 100:.4g} A"
    values = {"lim_bar": lim_bar, "trip": trip, "most": float(PMI_MOST_TRIP), "peak": peak}
    return Finding("overcurrent trip", verdict, f"{trip:g} %: {why}", formula, numbers, values)
