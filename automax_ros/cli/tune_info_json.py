"""What ``automax tune-info --json`` prints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.language.program import Program
from automax_ros.tuning.dynamic_calls import DynamicCall, Source
from automax_ros.tuning.frequency import decibels
from automax_ros.tuning.tuning import Corner, LimitNow, Tuning

Found = Sequence[tuple[DynamicCall, Tuning]]


def task_record(path: Path, program: Program, found: Found) -> dict[str, object]:
    """Return the record of a task: frequencies in rad/s and Hz, times in s."""
    period_s = program.period_ns / NS_PER_S
    return {
        "file": str(path),
        "task": program.name,
        "target": program.target,
        "ticks": program.ticks,
        "tick_ms": program.tick_ns / NS_PER_MS,
        "period_s": period_s,
        "nyquist_rad_s": math.pi / period_s,
        "nyquist_hz": 0.5 / period_s,
        "blocks": [block_record(call, tuning) for call, tuning in found],
    }


def block_record(call: DynamicCall, tuning: Tuning) -> dict[str, object]:
    """Return the record of one block."""
    transfer, integrator, ratio = tuning.transfer, tuning.integrator, tuning.ratio
    return {
        "line": call.label,
        "block": call.block.name,
        "section": call.block.section,
        "output": call.output,
        "inside": call.inside or None,
        "period_s": tuning.period_s,
        "parameters": _parameters(call, tuning),
        "missing": list(tuning.missing),
        "laplace": None
        if transfer is None
        else {
            "text": tuning.laplace,
            "numerator": list(transfer.numerator),
            "denominator": list(transfer.denominator),
        },
        "discrete": None if transfer is None else {"b": list(transfer.b), "a": list(transfer.a)},
        "coefficients": dict(tuning.coefficients),
        "mapping_c": None if transfer is None else transfer.mapping,
        "corners": [_corner(item) for item in tuning.corners],
        "integrator": None
        if integrator is None
        else {
            "kx": integrator.kx,
            "formula": integrator.formula,
            "range_counts": integrator.counts,
            "near_edge": integrator.near_edge,
        },
        "limits": [_limit(item) for item in tuning.limits],
        "ratio": None
        if ratio is None
        else {"value": ratio.value, "low": ratio.low, "high": ratio.high, "verdict": ratio.verdict.value},
    }


def _parameters(call: DynamicCall, tuning: Tuning) -> dict[str, object]:
    declared = call.block.coefficients
    assert declared is not None
    found: dict[str, object] = {}
    for name in declared.parameters:
        given = call.parameters.get(name)
        found[name] = {
            "value": tuning.values.get(name) if given is None else call.coefficients[name],
            "in_force": tuning.values.get(name),
            "source": (Source.DEFAULT if given is None else given.source).value,
            "variable": None if given is None or not given.variable else given.variable,
        }
    return found


def _corner(corner: Corner) -> dict[str, object]:
    return {
        "name": corner.name,
        "rad_s": corner.rad_s,
        "hz": corner.hz,
        "time_constant_s": corner.time_constant_s,
        "laplace_db": decibels(corner.laplace),
        "laplace_deg": degrees_of(corner.laplace),
        "discrete_db": None if corner.discrete is None else decibels(corner.discrete),
        "discrete_deg": degrees_of(corner.discrete),
        "mapped_rad_s": corner.mapped_rad_s,
        "warping": corner.warping,
    }


def _limit(limit: LimitNow) -> dict[str, object]:
    return {
        "parameter": limit.parameter,
        "value": limit.value,
        "given": limit.given,
        "low": limit.low,
        "high": limit.high,
        "low_formula": limit.low_text,
        "high_formula": limit.high_text,
        "verdict": limit.verdict.value,
    }


def degrees_of(gain: complex | None) -> float | None:
    """Return the phase of a gain in degrees, None for 0."""
    return math.degrees(math.atan2(gain.imag, gain.real)) if gain else None
