"""Judges a drive by all rules that are for it."""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.drive.drive_case import DriveCase, DriveFindings, Finding, Unjudged, Verdict
from automax_ros.drive.drive_rules import (
    bridge_change,
    inertia_time,
    line_frequency,
    line_synchronization,
    overcurrent,
    pmi_overcurrent,
    tach_loss,
)
from automax_ros.drive.gain_rules import GAIN_RULES

Rule = Callable[[DriveCase], Finding]
LOOP_RULES: tuple[Rule, ...] = (
    line_frequency,
    line_synchronization,
    tach_loss,
    inertia_time,
    bridge_change,
    overcurrent,
    *GAIN_RULES,
)
"""The rules for a drive with a 57C406 and a loop in a task, in the order in which they are told."""
PMI_RULES: tuple[Rule, ...] = (pmi_overcurrent,)
"""The rules for a drive of a UDC, whose loop is in its power module's interface."""


def assess(case: DriveCase | Unjudged) -> DriveFindings:
    """Return what the rules say of a drive."""
    if isinstance(case, Unjudged):
        return DriveFindings(case.name, case.where, None, (Finding("plant", Verdict.ATTENTION, case.reason, ""),))
    rules = LOOP_RULES if case.registers else PMI_RULES
    return DriveFindings(case.name, case.where, case, tuple(rule(case) for rule in rules))
