"""The picture of ``automax plot``: analog lanes above, logic lanes and the errors of tasks below, one time axis."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros.core.safe_file import atomic_write
from automax_ros.core.text import printable
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UsageError
from automax_ros.recordings.tables.traces import ErrorMark, Floats, Line, TraceRole, Traces, thinned

DPI = 120
_LINE_STYLES: tuple[Any, ...] = ("-", "--", (0, (2, 1)), "-.")
_LOGIC_COLOUR, _ERROR_COLOUR = "#1f4e9c", "#c1272d"
_ANALOG_IN, _ROW_IN, _HEAD_IN = 2.2, 0.32, 1.1
"""Heights in inches: of an analog lane, of a row of logic or errors, of title and time axis together."""
_HIGHEST_IN = 40.0
_ROW_FILL = 0.7
_THICKEST = 1.9
"""Each line is thinner than the one before, and later ones have gaps, so that a covered line remains visible."""
_ROLES: dict[TraceRole, dict[str, Any]] = {
    TraceRole.BACKGROUND: {"color": "#8d9aa1", "linewidth": 0.8, "linestyle": "-", "zorder": 1.9},
    TraceRole.PLANT: {"color": "#b4bfc5", "linewidth": 4.0, "linestyle": "-", "zorder": 2.0},
    TraceRole.FEEDBACK: {"color": "#1565c0", "linewidth": 1.3, "linestyle": "-", "zorder": 2.1},
    TraceRole.LAGGED: {"color": "#ef6c00", "linewidth": 1.3, "linestyle": (0, (5, 4)), "zorder": 2.2},
    TraceRole.REFERENCE: {"color": "#000000", "linewidth": 1.5, "linestyle": (0, (1, 3)), "zorder": 2.3},
}
"""Styles of lines that show the same quantity and mostly agree: the plant's wide and pale underneath, the reference in
thin dots on top, so that each is seen where all are equal (decision)."""
_MOST_LONG_MARKS = 40
"""Up to this many errors are also marked by a line through all lanes."""
_LABEL_PX = 90
"""Width of an error code, in pixels."""


@dataclass(frozen=True)
class FigureLayout:
    """The layout of a picture: title, size in pixels (height 0: as needed), whether each analog variable has a lane."""

    title: str
    width_px: int = 1400
    height_px: int = 0
    separate: bool = False


def figure_of(traces: Traces, layout: FigureLayout) -> Any:
    """Return the matplotlib figure of the traces.

    Raises:
        UsageError: matplotlib is missing.
    """
    analog = _lanes([line for line in traces.lines if line.variable.kind is not DataType.BOOLEAN], layout.separate)
    logic = [line for line in traces.lines if line.variable.kind is DataType.BOOLEAN]
    tasks = list(dict.fromkeys(mark.task for mark in traces.errors))
    heights = [_ANALOG_IN] * len(analog)
    heights += [_ROW_IN * (len(rows) + 0.5) for rows in (logic, tasks) if rows]
    needed = min(_HIGHEST_IN, _HEAD_IN + sum(heights))
    figure = new_figure(layout.width_px / DPI, layout.height_px / DPI or needed)
    axes: Any = list(figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0])
    for axis, lines in zip(axes, analog, strict=False):
        _draw_analog(axis, lines, traces, layout.width_px)
    if logic:
        _draw_logic(axes[len(analog)], logic, traces, layout.width_px)
    if tasks:
        _draw_errors(axes[-1], tasks, traces, layout.width_px)
        _mark_errors(axes[:-1], traces.errors)
    axes[-1].set_xlabel("time from the start of the run, s", fontsize=9)
    axes[-1].set_xlim(traces.start_s, traces.end_s if traces.end_s > traces.start_s else traces.start_s + 1e-3)
    axes[-1].ticklabel_format(axis="x", useOffset=False)
    figure.suptitle(plain(layout.title), fontsize=11)
    figure.align_ylabels(axes[: len(analog)])
    return figure


def require_matplotlib(what: str = "a picture") -> tuple[Any, Any]:
    """Return matplotlib's classes of figures and of canvases.

    Raises:
        UsageError: matplotlib is missing, which ``what`` needs.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise UsageError(f"{what} needs matplotlib", "pip install matplotlib, or `make setup`") from error
    return Figure, FigureCanvasAgg


def new_figure(width: float, height: float, dpi: int = DPI, what: str = "a picture") -> Any:
    """Return an empty matplotlib figure, its size in inches.

    Raises:
        UsageError: matplotlib is missing, which ``what`` needs.
    """
    figure_class, canvas_class = require_matplotlib(what)
    figure = figure_class(figsize=(width, height), dpi=dpi, layout="constrained")
    canvas_class(figure)
    return figure


def save(figure: Any, path: Path, dpi: int = DPI) -> None:
    """Write the figure in the format of the suffix. The same figure gives the same bytes.

    Raises:
        UsageError: the file cannot be written.
    """
    with _writing(path) as place:
        _draw_into(figure, place, path.suffix.lower().lstrip("."), dpi)


def save_picture(picture: bytes, path: Path) -> None:
    """Write a picture that has been drawn already.

    Raises:
        UsageError: the file cannot be written.
    """
    with _writing(path) as place:
        place.write_bytes(picture)


@contextmanager
def _writing(path: Path) -> Iterator[Path]:
    try:
        with atomic_write(path) as place:
            yield place
    except (OSError, ValueError) as error:  # ValueError: the suffix is not that of a picture format
        reason = getattr(error, "strerror", None) or error
        raise UsageError(f"{path} cannot be written: {reason}") from error


def image_of(figure: Any) -> bytes:
    """Return the figure as a PNG file. The same figure gives the same bytes."""
    stream = io.BytesIO()
    _draw_into(figure, stream, "png")
    return stream.getvalue()


def _draw_into(figure: Any, place: Path | io.BytesIO, kind: str, dpi: int = DPI) -> None:
    import matplotlib as mpl

    date = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
    with mpl.rc_context({"svg.hashsalt": "automax"}), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # characters that the font lacks, lanes too low for their labels
        figure.savefig(place, dpi=dpi, metadata=date, format=kind)


def _lanes(lines: Sequence[Line], separate: bool) -> list[list[Line]]:
    """Return analog lines by lane: those of one unit share a lane, in the order of their first line."""
    lanes: dict[object, list[Line]] = {}
    for number, line in enumerate(lines):
        lanes.setdefault(number if separate else line.variable.unit.strip(), []).append(line)
    return list(lanes.values())


def stepped_points(times: Floats, values: Floats, end_s: float, width_px: int) -> tuple[list[float], list[float]]:
    """Return the points of a stepped line over times in s: no more than can be seen, its last value held to the end."""
    xs, ys = (part.tolist() for part in thinned(times, values, width_px))
    if xs and xs[-1] < end_s:
        xs.append(end_s)
        ys.append(ys[-1])
    return xs, ys


def _draw_analog(axis: Any, lines: Sequence[Line], traces: Traces, width_px: int) -> None:
    drawn, roles = [], [line.role for line in lines]
    for number, line in enumerate(lines):
        others = {
            "linewidth": min(1.1 + 0.4 * (len(lines) - 1 - number), _THICKEST),
            "color": f"C{number % 10}",
            "linestyle": _LINE_STYLES[(number + number // 20) % len(_LINE_STYLES)],  # 40 lines look different
        }
        look = _ROLES.get(line.role, others)
        if line.role in roles[:number]:  # a second one of its kind has a colour of its own
            look = {**look, "color": others["color"]}
        points = stepped_points(line.times, line.values, traces.end_s, width_px)
        drawn += axis.plot(*points, drawstyle="steps-post", gid=line.variable.label, **look)
    labels = [f" {plain(line.variable.label)}" for line in lines]  # a name may begin with _, which legends leave out
    axis.legend(
        drawn, labels, loc="center left", bbox_to_anchor=(1.005, 0.5), fontsize=9, frameon=False, handlelength=3
    )
    axis.set_ylabel(plain(lines[0].variable.unit[:40]), fontsize=9)
    axis.tick_params(labelsize=8)
    axis.ticklabel_format(axis="y", useOffset=False)
    if all(line.variable.kind is not DataType.REAL for line in lines):
        axis.yaxis.get_major_locator().set_params(integer=True)
    axis.margins(y=0.08)
    axis.grid(alpha=0.3)


def _draw_logic(axis: Any, lines: Sequence[Line], traces: Traces, width_px: int) -> None:
    for row, line in enumerate(lines):
        xs, ys = stepped_points(line.times, line.values, traces.end_s, width_px)
        base = -row - _ROW_FILL / 2
        levels = [base + _ROW_FILL * (value != 0) for value in ys]
        axis.axhline(base, color="grey", linewidth=0.4, alpha=0.6)
        axis.fill_between(xs, base, levels, step="post", color=_LOGIC_COLOUR, alpha=0.25, linewidth=0)
        axis.plot(xs, levels, drawstyle="steps-post", color=_LOGIC_COLOUR, linewidth=1.0, gid=line.variable.label)
    _name_rows(axis, [line.variable.label for line in lines])


def _draw_errors(axis: Any, tasks: Sequence[str], traces: Traces, width_px: int) -> None:
    """Draw a row for each task, a mark for each error; codes are written where there is room."""
    room = (traces.end_s - traces.start_s) * _LABEL_PX / width_px
    for row, task in enumerate(tasks):
        marks = [mark for mark in traces.errors if mark.task == task]
        axis.plot(
            [mark.time_s for mark in marks],
            [-row] * len(marks),
            "|",
            color=_ERROR_COLOUR,
            markersize=11,
            clip_on=False,
            gid=task,
        )
        free_from = traces.start_s
        for mark in marks:
            if mark.time_s >= free_from:
                at_the_end = traces.end_s - mark.time_s < room
                axis.annotate(
                    f"{mark.code}",
                    (mark.time_s, -row),
                    xytext=(-3 if at_the_end else 3, 0),
                    textcoords="offset points",
                    fontsize=7,
                    color=_ERROR_COLOUR,
                    va="center",
                    ha="right" if at_the_end else "left",
                )
                free_from = mark.time_s + room
    _name_rows(axis, [f"errors of {task}" for task in tasks])
    if traces.unmarked:
        axis.annotate(
            f"and {traces.unmarked} more",
            (1.005, 0.5),
            xycoords="axes fraction",
            fontsize=8,
            color=_ERROR_COLOUR,
            va="center",
        )


def _mark_errors(axes: Sequence[Any], marks: Sequence[ErrorMark]) -> None:
    if len(marks) <= _MOST_LONG_MARKS:
        for axis in axes:
            for mark in marks:
                axis.axvline(mark.time_s, color=_ERROR_COLOUR, linewidth=0.6, alpha=0.35)


def _name_rows(axis: Any, names: Sequence[str]) -> None:
    axis.set_yticks([-row for row in range(len(names))], [plain(name) for name in names], fontsize=8)
    axis.set_ylim(-len(names) + 0.4, 0.6)
    axis.tick_params(axis="y", length=0)
    axis.tick_params(axis="x", labelsize=8)
    axis.grid(alpha=0.3, axis="x")


def plain(text: str) -> str:
    """Return a text that matplotlib draws literally: no formulas, nothing unprintable."""
    return printable(text).replace("$", r"\$")
