"""What ``automax drive-check`` prints: for a person, and for programs."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from typing import Any

from automax_ros.core.text import printable
from automax_ros.drive.drive_case import DriveCase, DriveFindings, Finding

_WIDTH = 120
_INDENT = " " * 14


def lines_of(found: Iterable[DriveFindings]) -> list[str]:
    """Return the lines that describe drives: each rule with its verdict, then its formula and the numbers in it."""
    lines: list[str] = []
    for drive in found:
        lines += [*([""] if lines else []), *_drive(drive)]
    return lines


def _drive(drive: DriveFindings) -> list[str]:
    lines = [f"{drive.name}: {drive.where}", *(f"  {text}" for text in _facts(drive.case))]
    for item in drive.findings:
        lines += ["", *_finding(item)]
    return lines


def _facts(case: DriveCase | None) -> list[str]:
    if case is None:
        return []
    motor, parameters = case.parameters.motor, case.parameters
    rated = f"{case.armature_v:.4g} V, {parameters.amps:.4g} A, {case.base_rpm:.4g} rpm, {case.rated_n_m:.4g} N m"
    armature = f"{motor.resistance_ohm:.4g} ohm, {motor.inductance_h * 1e3:.4g} mH"
    line = f"{parameters.line_v:.4g} V, {parameters.line_hz:g} Hz, {parameters.source_h * 1e3:.4g} mH a phase"
    computing = case.computing
    loop = "" if computing is None else f" on a {computing.model}, {computing.execution} execution"
    return [
        f"motor: {rated}; armature {armature}; inertia {motor.inertia_kg_m2 * case.inertia:.4g} kg m2 with its load",
        f"line: {line}" + (f"; current minor loop: task {case.task}{loop}" if case.task else ""),
    ]


def _finding(item: Finding) -> list[str]:
    head = f"  {item.verdict.value:<10}  {item.rule}: {printable(item.result)}"
    lines = textwrap.wrap(head, _WIDTH, subsequent_indent=_INDENT, break_long_words=False)
    lines[0] = head[: len(head) - len(head.lstrip())] + lines[0].lstrip()
    if item.formula:
        lines.append(f"{_INDENT}{item.formula}")
    if item.numbers:
        lines.append(f"{_INDENT}{item.numbers}")
    return lines


def records_of(found: Iterable[DriveFindings]) -> list[dict[str, Any]]:
    """Return the same for JSON; numbers that are not known are null."""
    return [
        {
            "drive": drive.name,
            "where": drive.where,
            "task": drive.case.task or None if drive.case is not None else None,
            **_execution(drive.case),
            "verdict": drive.verdict.value,
            "findings": [_record(item) for item in drive.findings],
        }
        for drive in found
    ]


def _execution(case: DriveCase | None) -> dict[str, str | None]:
    """Return how the loop's task is executed, and on what Processor; null where there is no such task."""
    computing = case.computing if case is not None else None
    if computing is None:
        return {"execution": None, "model": None}
    return {"execution": computing.execution, "model": computing.model}


def _record(item: Finding) -> dict[str, Any]:
    told = {"rule": item.rule, "verdict": item.verdict.value, "result": item.result, "formula": item.formula}
    return {**told, "numbers": item.numbers, "values": dict(item.values)}
