"""The picture of ``automax response --output``: step response, gain and phase, measured and by both designs."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import Any

from automax_ros.cli.output.figure import new_figure, save
from automax_ros.tuning.frequency import decibels, logarithmic
from automax_ros.tuning.response import BlockResponse, FrequencyPoint, followed

_LAPLACE, _DESIGN, _MEASURED, _MARK = "#d1892f", "#1f4e9c", "black", "#7a7a7a"
_CURVE, _STEPS, _TIMES = 300, 2000, 400
_NEAR_A_MARK = (0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064)
"""Distances of additional points from a corner, as shares of its frequency: a notch is narrow."""
_LOWEST_DB = -100.0
"""Lower gains are drawn at this level."""


def plot(response: BlockResponse, path: Path) -> None:
    """Draw a picture into a file.

    Raises:
        UsageError: the file cannot be written.
    """
    save(figure_of(response), path, dpi=130)


def figure_of(response: BlockResponse) -> Any:
    """Return the matplotlib figure: axes for step response, gain and phase."""
    figure = new_figure(9.5, 10, dpi=100)
    time, gain, phase = figure.subplots(3, 1, height_ratios=(3, 3, 2))
    _draw_step(time, response)
    _draw_bode(gain, phase, response)
    tuning = response.tuning
    title = f"{response.path.name}  {response.call.title}     {tuning.laplace}     {tuning.period_text}"
    figure.suptitle(title, fontsize=11)
    if response.remarks:
        lines = [line for remark in response.remarks for line in textwrap.wrap(remark, 150)]
        figure.supxlabel("\n".join(lines), fontsize=7, color=_MARK)
    return figure


def _draw_step(axis: Any, response: BlockResponse) -> None:
    step = response.step
    every = -(-len(step.output) // _STEPS)
    places = range(0, len(step.output), every)
    times = [place * step.period_s for place in places]
    end = (len(step.output) - 1) * step.period_s
    fine = [end * n / _TIMES for n in range(_TIMES + 1)]
    axis.plot(fine, response.laplace_at(fine), color=_LAPLACE, linewidth=1.2, label="Laplace function")
    axis.step(
        times, [step.design[place] for place in places], where="post", color=_DESIGN, alpha=0.45, linewidth=3.0,
        label="discrete, not rounded",
    )  # fmt: skip
    axis.step(
        times, [step.output[place] for place in places], where="post", color=_MEASURED, linewidth=0.9,
        label="OUTPUT as it runs",
    )  # fmt: skip
    if step.final is not None:
        axis.axhline(step.final, color=_MARK, linewidth=0.7, linestyle=":")
    hits = f"  (runs into {', '.join(step.touched)})" if step.touched else ""
    axis.set_title(f"Step of {step.counts} counts{hits}", fontsize=9)
    axis.set_xlabel("time, s")
    axis.set_ylabel("counts")
    axis.set_xlim(0.0, end)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8, frameon=False)


def _draw_bode(gain: Any, phase: Any, response: BlockResponse) -> None:
    from matplotlib.ticker import FuncFormatter

    low, high = response.range.low, response.range.high
    marks = [rad_s for _, rad_s in response.marks[:-1] if low < rad_s < high]
    near = {rad_s * (1.0 + side * share) for rad_s in marks for share in (0.0, *_NEAR_A_MARK) for side in (-1.0, 1.0)}
    grid = sorted({*logarithmic(low, high, _CURVE), *(rad_s for rad_s in near if low < rad_s < high)})
    for laplace, colour, label in ((True, _LAPLACE, "Laplace function"), (False, _DESIGN, "discrete, not rounded")):
        curve = followed(response.transfer, grid, laplace=laplace)
        angles = [angle if abs(value) > 1e-9 else math.nan for value, angle in curve]  # NaN is not drawn: no signal
        gain.plot(grid, [_level(value) for value, _ in curve], color=colour, linewidth=1.2, label=label)
        phase.plot(grid, angles, color=colour, linewidth=1.2)
    for reliable, label in ((True, "measured"), (False, "measured, uncertain or at a limit")):
        points = [p for p in response.points if p.measured is not None and p.measured.reliable is reliable]
        _draw_points(gain, phase, points, label, reliable=reliable)
    _draw_marks(gain, phase, response)
    gain.set_ylabel("gain, dB")
    gain.set_title(_amplitudes(response), fontsize=9)
    phase.set_ylabel("phase, degrees")
    phase.set_xlabel("frequency, rad/s")
    nyquist = response.tuning.nyquist_rad_s
    for axis in (gain, phase):
        axis.set_xscale("log")
        axis.set_xlim(low, nyquist * 1.2 if high > 0.5 * nyquist else high)
        axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.grid(alpha=0.3, which="both")
    hertz = gain.secondary_xaxis("top", functions=(_hertz, _radians))
    hertz.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    hertz.set_xlabel("frequency, Hz", fontsize=8)
    hertz.tick_params(labelsize=8)
    phase.yaxis.get_major_locator().set_params(steps=[1, 1.5, 3, 4.5, 9, 10])
    bottom, top = gain.get_ylim()
    gain.set_ylim(max(bottom, _LOWEST_DB - 5.0), max(top, bottom + 6.0))
    gain.legend(fontsize=8, frameon=False)


def _draw_points(gain: Any, phase: Any, points: list[FrequencyPoint], label: str, *, reliable: bool) -> None:
    """Draw measured points; uncertain ones are hollow and have error bars."""
    if not points:
        return
    style: dict[str, Any] = {
        "linestyle": "none", "marker": "o", "markersize": 5, "color": _MEASURED,
        "markerfacecolor": _MEASURED if reliable else "none", "label": label,
    }  # fmt: skip
    rad_s = [point.rad_s for point in points]
    levels = [_level(point.measured.gain) for point in points if point.measured]
    turned = [point for point in points if point.measured_deg is not None]
    angles = [point.measured_deg for point in turned]
    if reliable:
        gain.plot(rad_s, levels, **style)
        phase.plot([point.rad_s for point in turned], angles, **style)
        return
    downs, ups = zip(*(_bar(point) for point in points), strict=True)
    gain.errorbar(rad_s, levels, yerr=[downs, ups], elinewidth=0.8, capsize=2, **style)
    doubts = [point.measured.uncertainty_deg for point in turned if point.measured]
    known = [place for place, doubt in enumerate(doubts) if doubt < 180.0]
    phase.errorbar(
        [turned[place].rad_s for place in known], [angles[place] for place in known],
        yerr=[doubts[place] for place in known], elinewidth=0.8, capsize=2, **style,
    )  # fmt: skip


def _bar(point: FrequencyPoint) -> tuple[float, float]:
    assert point.measured is not None
    size, doubt = abs(point.measured.gain), point.measured.uncertainty
    level = _level(point.measured.gain)
    return level - _level(max(0.0, size - doubt)), _level(size + doubt) - level


def _draw_marks(gain: Any, phase: Any, response: BlockResponse) -> None:
    nyquist = response.tuning.nyquist_rad_s
    for name, rad_s in response.marks:
        if not response.range.low <= rad_s <= max(response.range.high, nyquist * (response.range.high > 0.5 * nyquist)):
            continue
        line = {"Nyquist": "-", "WM": ":"}.get(name, "--")
        for axis in (gain, phase):
            axis.axvline(rad_s, color=_MARK, linewidth=0.9, linestyle=line)
        gain.annotate(
            name, (rad_s, 0.02), xycoords=("data", "axes fraction"), fontsize=7, color=_MARK, rotation=90,
            ha="left" if name == "Nyquist" else "right", va="bottom",
        )  # fmt: skip


def _amplitudes(response: BlockResponse) -> str:
    found = sorted({point.measured.amplitude for point in response.points if point.measured is not None})
    if not found:
        return "Bode diagram: nothing measured, it would take millions of scans"
    return f"Bode diagram, sines of {found[0] if len(found) == 1 else f'{found[0]} to {found[-1]}'} counts"


def _level(gain: complex) -> float:
    level = decibels(gain)
    return _LOWEST_DB if level is None or not math.isfinite(level) else max(level, _LOWEST_DB)


def _hertz(rad_s: Any) -> Any:
    return rad_s / (2.0 * math.pi)


def _radians(hz: Any) -> Any:
    return hz * 2.0 * math.pi
