"""The picture of a sweep: lines for one quantity, heat maps for two, points for more or for a sample."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros.cli.output.figure import new_figure, plain, save
from automax_ros.core.types import Value
from automax_ros.sweep.run import Plan
from automax_ros.sweep.sweeping import Row

MOST_LANES = 8
"""Greatest number of measures, and of quantities, that are drawn (decision)."""
_WIDTH_IN, _LANE_IN, _MAP_IN, _CELL_IN = 9.0, 2.2, 4.5, 2.4
_MOST_TICKS = 20
_COLOUR, _BEST, _FONT = "#1f4e9c", "#c1272d", 8
_LETTERS_AN_INCH, _LEAST_LETTERS = 14.0, 12
"""Letters of that size per inch, and the shortest line of a label, in letters."""


@dataclass(frozen=True)
class _Axis:
    label: str
    numbers: list[float]
    texts: tuple[str, ...] = ()

    @property
    def distinct(self) -> list[float]:
        return sorted(set(self.numbers))


def draw(plan: Plan, rows: Sequence[Row], best: Sequence[Row], path: Path) -> None:
    """Draw the rows, unless nothing varies. The same rows give the same bytes.

    Raises:
        UsageError: matplotlib is missing, or the file cannot be written.
    """
    axes = [_axis(item.label, [row.point[place] for row in rows]) for place, item in enumerate(plan.quantities)]
    varied = [axis for axis in axes if len(axis.distinct) > 1][:MOST_LANES]
    if not varied:
        return
    measures = [
        _Axis(item.label, [math.nan if (value := row.outcome.measures[place]) is None else value for row in rows])
        for place, item in enumerate(plan.measures[:MOST_LANES])
    ]
    marked = [place for place, row in enumerate(rows) if row in best]
    is_grid = len(rows) == math.prod(len(axis.distinct) for axis in varied)
    if len(varied) == 1:
        figure = _lines(varied[0], measures, marked)
    elif len(varied) == 2 and is_grid:
        figure = _maps(varied[0], varied[1], measures, marked)
    else:
        figure = _points(varied, measures, marked)
    save(figure, path)


def _axis(label: str, values: Sequence[Value]) -> _Axis:
    if any(isinstance(value, str) for value in values):
        texts = tuple(sorted(set(map(str, values))))
        places = {text: place for place, text in enumerate(texts)}
        return _Axis(label, [places[str(value)] for value in values], texts)
    return _Axis(label, [float(value) for value in values])


def _lines(varied: _Axis, measures: Sequence[_Axis], marked: Sequence[int]) -> Any:
    figure = new_figure(_WIDTH_IN, _LANE_IN * len(measures) + 0.5)
    axes = figure.subplots(len(measures), 1, squeeze=False)
    order = sorted(range(len(varied.numbers)), key=lambda place: varied.numbers[place])
    for axis, measure in zip(axes[:, 0], measures, strict=True):
        numbers = [varied.numbers[place] for place in order], [measure.numbers[place] for place in order]
        axis.plot(*numbers, ".-", color=_COLOUR, linewidth=1)
        _mark(axis, varied, measure, marked)
        _name(axis, varied, measure)
    return figure


def _maps(across: _Axis, up: _Axis, measures: Sequence[_Axis], marked: Sequence[int]) -> Any:
    figure = new_figure(_WIDTH_IN, _MAP_IN * len(measures))
    axes = figure.subplots(len(measures), 1, squeeze=False)
    columns, lines = across.distinct, up.distinct
    for axis, measure in zip(axes[:, 0], measures, strict=True):
        cells = [[math.nan] * len(columns) for _ in lines]
        for x, y, value in zip(across.numbers, up.numbers, measure.numbers, strict=True):
            cells[lines.index(y)][columns.index(x)] = value
        drawn = axis.pcolormesh(columns, lines, cells, shading="nearest")
        figure.colorbar(drawn, ax=axis).ax.tick_params(labelsize=_FONT)
        axis.plot([across.numbers[at] for at in marked], [up.numbers[at] for at in marked], "o", color=_BEST)
        axis.set_title(_folded(measure.label, _WIDTH_IN), fontsize=_FONT + 1)
        _name(axis, across, up)
    return figure


def _points(varied: Sequence[_Axis], measures: Sequence[_Axis], marked: Sequence[int]) -> Any:
    figure = new_figure(max(_WIDTH_IN, _CELL_IN * len(varied)), _CELL_IN * len(measures) + 0.5)
    axes = figure.subplots(len(measures), len(varied), squeeze=False)
    for line, measure in zip(axes, measures, strict=True):
        for axis, quantity in zip(line, varied, strict=True):
            axis.plot(quantity.numbers, measure.numbers, ".", color=_COLOUR, markersize=3)
            _mark(axis, quantity, measure, marked)
            _name(axis, quantity, measure)
    return figure


def _mark(axis: Any, across: _Axis, up: _Axis, marked: Sequence[int]) -> None:
    axis.plot([across.numbers[at] for at in marked], [up.numbers[at] for at in marked], "o", color=_BEST)


def _name(axis: Any, across: _Axis, up: _Axis) -> None:
    _, _, width, height = axis.get_position().bounds
    inches = axis.figure.get_size_inches()
    axis.set_xlabel(_folded(across.label, width * inches[0]), fontsize=_FONT)
    axis.set_ylabel(_folded(up.label, height * inches[1]), fontsize=_FONT)
    for texts, set_ticks in ((across.texts, axis.set_xticks), (up.texts, axis.set_yticks)):
        if texts:
            every = -(-len(texts) // _MOST_TICKS)
            set_ticks(range(0, len(texts), every), [plain(text) for text in texts[::every]])
    axis.tick_params(labelsize=_FONT)
    axis.grid(alpha=0.3)


def _folded(text: str, inches: float) -> str:
    """Return a label in as many lines as it needs to be no longer than its axis."""
    lines = textwrap.wrap(text, max(_LEAST_LETTERS, int(inches * _LETTERS_AN_INCH)), break_on_hyphens=False)
    return "\n".join(map(plain, lines))
