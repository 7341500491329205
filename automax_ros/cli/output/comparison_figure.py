"""The picture of `automax compare`: both runs of a variable in one lane, their difference below, one axis of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from automax_ros.cli.output.figure import DPI, new_figure, plain, stepped_points
from automax_ros.comparison.comparison import Compared, Comparison, summary
from automax_ros.comparison.courses import Times, Values
from automax_ros.comparison.differences import both
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType

MOST_LANES = 12
"""Most variables in one picture (decision): more cannot be told apart."""
_BEFORE, _AFTER, _REFERENCE, _APART = "#1f4e9c", "#c1272d", "#000000", "#6a1b9a"
_LANE_IN, _LOGIC_IN, _DIFFERENCE_IN, _HEAD_IN = 1.7, 0.7, 0.9, 1.2
"""Heights in inches: of numbers, of a boolean, of a difference, of title and time axis together."""
_WIDTH_PX = 1400


def drawn(found: Comparison, *, named: bool) -> list[Compared]:
    """Return what a picture shows: all that was named; without names, or of more than have room, what differs first."""
    if named and len(found.variables) <= MOST_LANES:
        return list(found.variables)
    return found.differing[:MOST_LANES]


def comparison_figure(found: Comparison, shown: Sequence[Compared], width_px: int = _WIDTH_PX) -> Any:
    """Return the matplotlib figure of variables of a comparison.

    Raises:
        UsageError: matplotlib is missing.
    """
    heights: list[float] = []
    for item in shown:
        heights += [_LOGIC_IN if _is_logic(item) else _LANE_IN, _LOGIC_IN if _is_logic(item) else _DIFFERENCE_IN]
    figure = new_figure(width_px / DPI, _HEAD_IN + sum(heights))
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for item, values, difference in zip(shown, axes[::2], axes[1::2], strict=True):
        _draw_values(values, item, found, width_px)
        _draw_difference(difference, item, found, width_px)
    axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=8, ncols=3, frameon=False)
    axes[-1].set_xlabel(plain(f"time from {found.alignment.axis}, s"), fontsize=9)
    axes[-1].set_xlim(found.start_s, found.end_s if found.end_s > found.start_s else found.start_s + 1e-3)
    axes[-1].ticklabel_format(axis="x", useOffset=False)
    names = [side.bag.resolve().name[:60] for side in (found.before, found.after)]
    more = f", {len(found.differing) - len(shown)} more differ" if len(found.differing) > len(shown) else ""
    figure.suptitle(plain(f"{names[0]} and {names[1]}: {summary(found)}{more}"), fontsize=11)
    figure.align_ylabels(axes)
    return figure


def _is_logic(item: Compared) -> bool:
    return item.before.variable.kind is DataType.BOOLEAN


def _draw_values(axis: Any, item: Compared, found: Comparison, width_px: int) -> None:
    start_ns, end_ns = _ends(found)
    for label, course, look in (
        ("before", item.before, {"color": _BEFORE, "linewidth": 2.0}),
        ("after", item.after, {"color": _AFTER, "linewidth": 1.2, "linestyle": (0, (6, 2))}),
    ):
        part = course.between(start_ns, end_ns)
        points = _finite_points(part.times, part.values, found, width_px)
        axis.plot(*points, drawstyle="steps-post", label=label, gid=f"{item.name} {label}", **look)
    for label, course in zip(("reference", ""), item.references, strict=False):
        part = course.between(start_ns, end_ns)
        points = _finite_points(part.times, part.values, found, width_px)
        axis.plot(
            *points, drawstyle="steps-post", color=_REFERENCE, linewidth=1.0, linestyle=(0, (1, 3)), label=label or None
        )
    unit = f"\n{item.unit[:40]}" if item.unit else ""
    axis.set_title(plain(item.name), fontsize=9, loc="left")
    if _is_logic(item):
        axis.set_yticks((0, 1), ("FALSE", "TRUE"))
        axis.set_ylim(-0.2, 1.2)
    else:
        axis.set_ylabel(plain(unit.strip()), fontsize=8)
        axis.margins(y=0.1)
        axis.ticklabel_format(axis="y", useOffset=False)
    axis.tick_params(labelsize=8)
    axis.grid(alpha=0.3)


def _draw_difference(axis: Any, item: Compared, found: Comparison, width_px: int) -> None:
    times, one, two = both(item.before, item.after, *_ends(found))
    xs, ys = _finite_points(times, two - one, found, width_px)
    axis.axhline(0.0, color="grey", linewidth=0.6)
    axis.fill_between(xs, 0.0, ys, step="post", color=_APART, alpha=0.2, linewidth=0)
    axis.plot(xs, ys, drawstyle="steps-post", color=_APART, linewidth=1.0, gid=f"{item.name} difference")
    worst = item.difference.greatest if item.difference is not None else None
    if worst is not None:
        axis.axvline(worst.time_s, color="grey", linewidth=0.8, linestyle="--")
    axis.set_ylabel("difference", fontsize=8)
    if _is_logic(item):
        axis.set_yticks((-1, 0, 1))
        axis.set_ylim(-1.3, 1.3)
    else:
        axis.margins(y=0.15)
        axis.ticklabel_format(axis="y", useOffset=False)
    axis.tick_params(labelsize=8)
    axis.grid(alpha=0.3)


def _finite_points(times: Times, values: Values, found: Comparison, width_px: int) -> tuple[list[float], list[float]]:
    finite = np.isfinite(values)
    return stepped_points(times[finite] / NS_PER_S, values[finite], found.end_s, width_px)


def _ends(found: Comparison) -> tuple[int, int]:
    return round(found.start_s * NS_PER_S), round(found.end_s * NS_PER_S)
