"""The picture of the first difference: recorded and replayed values of the first variables that differ."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from automax_ros.cli.output.figure import new_figure, plain, save
from automax_ros.core.names import element
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UsageError
from automax_ros.messages.types.messages import Scan
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Key
from automax_ros.replay.engine import Replay
from automax_ros.replay.scans.commons import UnknownValue
from automax_ros.replay.scans.report import Difference, DifferenceKind, ReplayReport
from automax_ros.replay.scans.task import TaskReplay

MOST_LANES = 5
"""Most variables in one picture (decision): more cannot be told apart."""
BEFORE_S, AFTER_S = 0.5, 1.5
"""Seconds that a picture shows before and after the first difference (decision) ..."""
BEFORE_SCANS, AFTER_SCANS = 10, 40
"""... or this many scans of the task, whichever is longer (decision)."""
_RECORDED, _REPLAYED = "#1f4e9c", "#c1272d"


@dataclass
class Trace:
    """One variable of one task around the first difference: values after each scan, times since the run's start."""

    difference: Difference
    variable: CommonVariable
    key: Key
    time_s: list[float] = field(default_factory=list)
    recorded: list[Value] = field(default_factory=list)
    replayed: list[Value] = field(default_factory=list)


def can_be_drawn(report: ReplayReport) -> bool:
    """Whether a variable with numbers differs."""
    return bool(_drawable(report))


def traces(replay: Replay, report: ReplayReport, on_progress: Callable[[float], None] | None = None) -> list[Trace]:
    """Execute the recording once more, to shortly after the first difference, and return the traces to draw.

    Raises:
        BagError: the recording cannot be read.
    """
    chosen = _drawable(report)
    if not chosen:
        return []
    periods = {source.name: source.compiled.program.period_ns for source in replay.sources}
    period_s = periods[chosen[0].task] / NS_PER_S
    first_s = chosen[0].first.time_s
    begin_s = first_s - max(BEFORE_S, BEFORE_SCANS * period_s)
    end_s = first_s + max(AFTER_S, AFTER_SCANS * period_s)
    shown = [item for item in chosen if item.first.time_s <= end_s][:MOST_LANES]
    found = [_trace(item, replay.rack.config.variables) for item in shown]

    def watch(task: TaskReplay, scan: Scan) -> None:
        time_s = task.time_s(scan.stamp)
        if not begin_s <= time_s <= end_s:
            return
        for trace in found:
            if trace.difference.task == task.name:
                _sample(trace, task, time_s)

    end_ns = round(end_s * NS_PER_S)
    options = replay.options
    to_ns = end_ns if options.to_ns is None else min(end_ns, options.to_ns)
    replay.run(on_progress, watch, to_ns=to_ns)
    return found


def draw(found: Sequence[Trace], report: ReplayReport, path: Path) -> None:
    """Draw the traces, each in a separate lane, with time axis and units.

    Raises:
        BagError: matplotlib is missing, or the file cannot be written.
    """
    try:
        figure = new_figure(10, 1.2 + 2.2 * len(found), dpi=100)
        _draw_lanes(figure, found, report)
        save(figure, path, dpi=150)
    except UsageError as error:
        raise BagError("AMX6834", path, error.message.removeprefix(f"{path} "), error.hint) from error


def _draw_lanes(figure: Any, found: Sequence[Trace], report: ReplayReport) -> None:
    lanes: Any = figure.subplots(len(found), 1, sharex=True, squeeze=False)
    for (axis,), trace in zip(lanes, found, strict=True):
        _draw_lane(axis, trace)
    lanes[-1][0].set_xlabel("time since the start of the run, s")
    lanes[0][0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=8, ncols=2, frameon=False)
    first = found[0].difference
    figure.suptitle(
        f"{plain(Path(report.bag).name)}: first difference of {first.task}, scan {first.first.scan} "
        f"at {first.first.time_s:.6g} s (open loop)",
        fontsize=10,
    )


def _drawable(report: ReplayReport) -> list[Difference]:
    return [
        item
        for item in report.differences
        if item.kind is DifferenceKind.VARIABLE and not isinstance(item.first.recorded, str)
    ]


def _trace(difference: Difference, variables: Sequence[CommonVariable]) -> Trace:
    """Return an empty trace of the variable, or element, that a difference names."""
    views = {item.name: view for view, item in enumerate(variables)}
    found = element(difference.name, {item.name: item for item in variables}, "the rack has no common variable")
    return Trace(difference, found.variable, (views[found.name], found.index))


def _sample(trace: Trace, task: TaskReplay, time_s: float) -> None:
    try:
        recorded = task.memory.after_recorded(trace.key)
    except UnknownValue:
        return
    trace.time_s.append(time_s)
    trace.recorded.append(recorded)
    trace.replayed.append(task.memory.apart.get(trace.key, recorded))


def _draw_lane(axis: Any, trace: Trace) -> None:
    variable, difference = trace.variable, trace.difference
    for values, colour, width, label in (
        (trace.recorded, _RECORDED, 2.0, "recorded"),
        (trace.replayed, _REPLAYED, 1.0, "replayed"),
    ):
        numbers = [float(value) for value in values]
        axis.step(trace.time_s, numbers, color=colour, linewidth=width, label=label, where="post")
    axis.axvline(difference.first.time_s, color="grey", linewidth=0.8, linestyle="--")
    unit = f", {plain(variable.unit)}" if variable.unit else ""
    axis.set_title(f"{difference.task}: {difference.name}, from scan {difference.first.scan}", fontsize=9, loc="left")
    if variable.type is DataType.BOOLEAN:
        axis.set_yticks((0, 1), ("FALSE", "TRUE"))
        axis.set_ylim(-0.2, 1.2)
    else:
        axis.set_ylabel(f"{difference.name}{unit}", fontsize=8)
    axis.grid(alpha=0.3)
