"""Judges a drive by all rules that apply to it.

Programmed gains are compared with the proposals of ``drive/current_loop/proposals``, shown with their numbers.
A gain that is within a factor of two of the proposal is fine (decision): the loop is not that particular.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from automax_ros.drive.assess.drive_case import DriveCase, DriveFindings, Finding, Rating, Unjudged
from automax_ros.drive.assess.drive_rules import (
    bridge_change,
    inertia_time,
    line_frequency,
    line_synchronization,
    overcurrent,
    pmi_overcurrent,
    tach_loss,
)
from automax_ros.drive.assess.roll_rules import roll_findings
from automax_ros.drive.current_loop.proposals import (
    BOUNDARY,
    LEAST_CONDUCTION,
    LOOP_GAIN,
    VD0,
    ArmatureCircuit,
    ag_factor,
    cc_thresh,
    circuit_of,
    gain_continuous,
    kp,
    pi_w_lead,
    ref_lag,
)

NEAR = 2.0
"""Largest factor between a programmed and a proposed gain that is fine."""
MOST_DELAY = 0.7
"""Largest computing delay with which the proposed gains keep their damping, as part of a sixth of a line cycle
(decision)."""


Rule = Callable[[DriveCase], Finding]
PMI_RULES: tuple[Rule, ...] = (pmi_overcurrent,)
"""The rules for a drive of a UDC, whose loop is in its power module's interface."""


def _kp(circuit: ArmatureCircuit) -> tuple[float, str]:
    gain = gain_continuous(circuit)
    ideal, millihenry = VD0 * circuit.line_v, circuit.inductance_h * 1e3
    per_scan = f"pi / 3 x {ideal:.4g} V x 1 us / {millihenry:.4g} mH x {circuit.counts_a:.4g} counts per A"
    return kp(circuit), f"{LOOP_GAIN:g} / ({per_scan} = {gain:.4g})"


def _pi_w_lead(circuit: ArmatureCircuit) -> tuple[float, str]:
    return pi_w_lead(circuit), f"{circuit.resistance_ohm:.4g} ohm / {circuit.inductance_h * 1e3:.4g} mH"


def _ref_lag(circuit: ArmatureCircuit) -> tuple[float, str]:
    return ref_lag(circuit), ""


def _cc_thresh(circuit: ArmatureCircuit) -> tuple[float, str]:
    amps = cc_thresh(circuit) / circuit.counts_a
    ideal = VD0 * circuit.line_v
    reactance = f"2 pi x {circuit.line_hz:g} Hz x {circuit.inductance_h * 1e3:.4g} mH"
    return (
        cc_thresh(circuit),
        f"{BOUNDARY:g} x {ideal:.4g} V / ({reactance}) = {amps:.4g} A, x {circuit.counts_a:.4g} counts per A",
    )


def _ag_factor(circuit: ArmatureCircuit) -> tuple[float, str]:
    factor, continuous = ag_factor(circuit), kp(circuit) * pi_w_lead(circuit) / (6 * circuit.line_hz)
    each_scan = f"{kp(circuit):.4g} x {pi_w_lead(circuit)} / (6 x {circuit.line_hz:g} Hz) = {continuous:.4g}"
    return factor, f"{factor * continuous:.3g} us per count and scan / ({each_scan})"


_PROPOSALS: dict[str, tuple[Callable[[ArmatureCircuit], tuple[float, str]], str]] = {
    "KP": (_kp, f"KP = {LOOP_GAIN:g} / counts that 1 us of DELTA adds in a scan, continuous, alpha 90 degrees (ours)"),
    "PI_W_LEAD": (_pi_w_lead, "PI_W_LEAD = R / L of armature and line (ours)"),
    "REF_LAG": (_ref_lag, "REF_LAG = the fastest that 50 and 60 Hz allow (ours)"),
    "CC_THRESH": (_cc_thresh, "CC_THRESH = current where it becomes continuous at standstill, in counts (ours)"),
    "AG_FACTOR": (
        _ag_factor,
        f"AG_FACTOR = integral gain where {LEAST_CONDUCTION * 100:g} % of a scan conduct / continuous one (ours)",
    ),
}
"""For each gain the function that computes it with its numbers, and the formula."""


def computing_delay(case: DriveCase) -> Finding:
    """Return how late after its interrupt a scan's DELTA takes effect, and the delay assumed for the gains.

    The loop is given each delay and allows for it, so the same gains are right for all Processors (decision).
    """
    formula = f"SCAN_LOOP with its latch + DC_DRIVE_CML (53) <= {MOST_DELAY:g} of a sixth of a line cycle (ours)"
    computing = case.computing
    if computing is None:
        result = "no task with DC_DRIVE_CML fires it: the delay is not known"
        return Finding("computing delay", Rating.ATTENTION, result, formula)
    delay_us = computing.delay_us if computing.modeled else 0.0
    reckoned_us, most_us = max(delay_us, computing.slowest_us), MOST_DELAY * computing.sixth_us
    if delay_us > most_us:
        verdict, why = Rating.ATTENTION, "too late for the proposed gains: declare fewer commons in this task"
    elif reckoned_us > most_us:
        verdict, why = Rating.FINE, f"too slow for a {computing.slowest}, where it takes {reckoned_us:.0f} us"
    else:
        slowest = f"a {computing.slowest}, the slowest Processor that may run this task"
        verdict, why = Rating.FINE, f"the gains are reckoned with the {reckoned_us:.0f} us of {slowest}"
    when = f"{delay_us:.0f} us after the interrupt" if delay_us else "at the interrupt"
    result = f"{computing.execution} execution on a {computing.model}: DELTA takes effect {when}; {why}"
    numbers = f"{reckoned_us:.0f} us of {computing.sixth_us:.0f} us = {reckoned_us / computing.sixth_us:.2f}"
    values = {"delay_us": delay_us, "reckoned_us": reckoned_us, "sixth_us": computing.sixth_us}
    return Finding("computing delay", verdict, result, formula, numbers, values)


def gain(keyword: str, case: DriveCase) -> Finding:
    """Compare a gain with the proposal for this motor, its line and LIM_BAR."""
    compute, formula = _PROPOSALS[keyword]
    lim_bar = case.value("LIM_BAR")
    if not lim_bar or lim_bar < 0:
        result = f"{case.text(keyword)}; no proposal, LIM_BAR is {case.text('LIM_BAR')}"
        return Finding(keyword, Rating.ATTENTION, result, formula)
    circuit = circuit_of(case.parameters, int(lim_bar), source_ohm=case.source_ohm)
    proposed, numbers = compute(circuit)
    given = case.value(keyword)
    fine = given is None or proposed / NEAR <= given <= proposed * NEAR
    return Finding(
        keyword,
        Rating.FINE if fine else Rating.ATTENTION,
        f"{proposed:.4g} is proposed; programmed: {case.text(keyword)}",
        formula,
        f"{numbers} = {proposed:.4g}" if numbers else "",
        {"proposed": float(proposed), "programmed": given},
    )


GAIN_RULES: tuple[Callable[[DriveCase], Finding], ...] = (
    computing_delay,
    *(partial(gain, keyword) for keyword in _PROPOSALS),
)
"""The rule for the computing delay, and a rule for each gain."""


LOOP_RULES: tuple[Rule, ...] = (
    line_frequency,
    line_synchronization,
    tach_loss,
    inertia_time,
    bridge_change,
    overcurrent,
    *GAIN_RULES,
)
"""The rules for a drive with a 57C406 and a loop in a task, in the order in which they are reported."""


def assess(case: DriveCase | Unjudged) -> DriveFindings:
    """Return the findings of all rules that apply to a drive."""
    if isinstance(case, Unjudged):
        return DriveFindings(case.name, case.where, None, (Finding("plant", Rating.ATTENTION, case.reason, ""),))
    rules = LOOP_RULES if case.registers else PMI_RULES
    found = (*(rule(case) for rule in rules), *roll_findings(case))
    return DriveFindings(case.name, case.where, case, found)
