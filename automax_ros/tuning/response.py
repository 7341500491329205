"""The results of ``automax response``: measurements of a block, with its discrete and Laplace functions."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.blocks.declare.dynamics import Transfer
from automax_ros.core.types import Value
from automax_ros.tuning.dynamic_calls import DynamicCall
from automax_ros.tuning.frequency import (
    MeasuredResponse,
    Sweep,
    first_phase,
    logarithmic,
    nearest_phase,
    phases,
)
from automax_ros.tuning.step_response import StepResponse, laplace_step, respond
from automax_ros.tuning.tuning import Tuning

_SAME = 1e-3
"""Frequencies that differ by less than this share count as one."""
_BETWEEN = 24
"""Frequencies between two points of a curve, so that phases can be followed without a jump."""


@dataclass(frozen=True)
class FrequencyRange:
    """Frequencies from ``low`` to ``high`` in rad/s."""

    low: float
    high: float
    points: int


@dataclass(frozen=True)
class FrequencyPoint:
    """One frequency: ``mark`` names a corner or WM there; ``measured`` is None if it would take too many scans.

    Gains are complex at ``rad_s``, phases in degrees without jumps.
    """

    rad_s: float
    mark: str
    measured: MeasuredResponse | None
    measured_deg: float | None
    design: complex
    design_deg: float
    laplace: complex
    laplace_deg: float

    @property
    def hz(self) -> float:
        """The frequency in Hz."""
        return self.rad_s / (2.0 * math.pi)


@dataclass(frozen=True)
class BlockResponse:
    """Both responses of a block, and ``remarks`` on how they were made."""

    path: Path
    call: DynamicCall
    tuning: Tuning
    transfer: Transfer
    step: StepResponse
    range: FrequencyRange
    points: tuple[FrequencyPoint, ...]
    remarks: tuple[str, ...]

    @property
    def marks(self) -> list[tuple[str, float]]:
        """Names and frequencies in rad/s of corners, the mapping frequency and Nyquist."""
        return [*marked_frequencies(self.tuning), ("Nyquist", self.tuning.nyquist_rad_s)]

    def laplace_at(self, times_s: Sequence[float]) -> list[float]:
        """Return the Laplace function's step response in counts at times in s."""
        return [self.step.rest + self.step.counts * value for value in laplace_step(self.transfer, times_s)]


def measured_response(
    *,
    path: Path,
    call: DynamicCall,
    tuning: Tuning,
    period_ns: int,
    parameters: Mapping[str, Value],
    frequencies: FrequencyRange,
    amplitude: int | None,
    step: int | None,
    scans: int,
    assumed: Sequence[str],
) -> BlockResponse:
    """Measure both responses of a block, which must have a transfer function."""
    transfer = tuning.transfer
    assert transfer is not None
    wanted = _frequencies(frequencies, tuning)
    sweep = Sweep(call.block, period_ns, parameters, transfer, amplitude)
    found = sweep.measure([rad_s for rad_s, _ in wanted])
    return BlockResponse(
        path=path,
        call=call,
        tuning=tuning,
        transfer=transfer,
        step=respond(call.block, period_ns, parameters, transfer, step, scans),
        range=frequencies,
        points=tuple(_points(transfer, wanted, found)),
        remarks=tuple(_remarks(tuning, parameters, assumed)),
    )


def marked_frequencies(tuning: Tuning) -> list[tuple[str, float]]:
    """Return names and frequencies of the corners below Nyquist and of a separate mapping frequency."""
    found = [(corner.name, corner.rad_s) for corner in tuning.corners if corner.discrete is not None]
    own = tuning.declared.dynamics.exact_at
    if own in tuning.values and own not in (corner.name for corner in tuning.corners):
        found.append((own, tuning.values[own]))
    return sorted(found, key=lambda pair: pair[1])


def followed(transfer: Transfer, frequencies: Sequence[float], *, laplace: bool) -> list[tuple[complex, float]]:
    """Return gains and phases without jumps at rising frequencies, by steps so small that none is missed."""
    respond_at = transfer.laplace_response if laplace else transfer.discrete_response
    fine: list[float] = [frequencies[0] * 1e-3 ** (1.0 - n / _BETWEEN) for n in range(_BETWEEN)]
    places = []
    for low, high in zip([fine[-1], *frequencies], frequencies, strict=False):
        fine += logarithmic(low, high, _BETWEEN)[1:] if high > low else [high]
        places.append(len(fine) - 1)
    gains = [respond_at(rad_s) for rad_s in fine]
    angles = phases(gains, first_phase(transfer))
    return [(gains[place], angles[place]) for place in places]


def _frequencies(wanted: FrequencyRange, tuning: Tuning) -> list[tuple[float, str]]:
    found = [(rad_s, "") for rad_s in logarithmic(wanted.low, wanted.high, wanted.points)]
    for name, rad_s in marked_frequencies(tuning):
        if not wanted.low * (1.0 - _SAME) <= rad_s <= wanted.high * (1.0 + _SAME):
            continue
        same = [item for item in found if abs(item[0] / rad_s - 1.0) < _SAME]
        names = [item[1] for item in same if item[1]]
        found = [item for item in found if item not in same]
        found.append((rad_s, " and ".join([*names, name])))
    return sorted(found)


def _points(
    transfer: Transfer, wanted: Sequence[tuple[float, str]], found: Sequence[MeasuredResponse | None]
) -> list[FrequencyPoint]:
    """Return the points; the functions of a measured point hold at the very frequency of the measurement."""
    exact = [item.rad_s if item is not None else rad_s for (rad_s, _), item in zip(wanted, found, strict=True)]
    order = sorted(range(len(exact)), key=lambda place: exact[place])
    rising = [exact[place] for place in order]
    designs = followed(transfer, rising, laplace=False)
    laplaces = followed(transfer, rising, laplace=True)
    points = []
    for place, design, laplace in zip(order, designs, laplaces, strict=True):
        measured = found[place]
        angle = None
        if measured is not None and measured.gain:
            angle = nearest_phase(math.degrees(cmath.phase(measured.gain)), design[1])
        points.append(FrequencyPoint(exact[place], wanted[place][1], measured, angle, *design, *laplace))
    return points


def _remarks(tuning: Tuning, parameters: Mapping[str, Value], assumed: Sequence[str]) -> list[str]:
    found = []
    if assumed:
        found.append(f"values not known, taken as if not programmed: {', '.join(assumed)}; --set gives others")
    if tuning.moved:
        limited = ", ".join(f"{name} = {tuning.values[name]:.7g}" for name in tuning.moved)
        found.append(f"beyond its limits, so in force is {limited}")
    found += [f"{name} is TRUE" for name in ("HOLD_PLUS", "HOLD_MINUS") if parameters.get(name) is True]
    return found + tuning.declared.dynamics.remarks(parameters)
