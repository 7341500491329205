"""The report on a recorded rack: watched signals, alarms, tasks, drives, and what happened."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.ticks import NS_PER_S
from automax_ros.language.program import Program
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import run_facts
from automax_ros.recordings.tables.series import WHOLE_RUN, Progress, Window
from automax_ros.recordings.tables.traces import MAX_LINES, Traces
from automax_ros.replay.drive_report.drive_report import DriveReport, drive_reader
from automax_ros.replay.drive_report.happenings import Happenings
from automax_ros.replay.drive_report.line_run import LineRun
from automax_ros.replay.drive_report.line_signals import alarm_signals, line_signals
from automax_ros.replay.drive_report.numbers import AlarmRun, SignalNumbers
from automax_ros.replay.drive_report.reading import PartReader, RunRead, read_run
from automax_ros.replay.scans.stored_rack import StoredRack, stored_rack

_OF_A_DRIVE = ("state", "fault", "plant")
"""Kinds of a drive's events that the rack's own sequence has not."""


@dataclass(frozen=True)
class TaskRun:
    """A task of the rack with its counts; ``period_ns`` is 0 if it has none, or if its source is not stored."""

    name: str
    where: str
    period_ns: int
    scans: int
    errors: int


@dataclass(frozen=True)
class RackReport:
    """The report on a rack.

    Attributes:
        traces: the watched signals, plants in the background, alarms that came, errors; for a picture.
        tasks: in the order of slots.
        happened: the events of the rack and of its drives.
        numbers: those of all signals that are shown.
        alarms: in the order of the rack file.
        drives: those of the rack, in the order of slots.
        has_webs: whether the rack has webs, or plants with a roll or roller.
        held: the watched currents of loops, which are shown and counted while their loops run.
        has_line: whether rack file or user name signals or alarms, or the rack has webs or no drive: otherwise the
            drives alone are shown (decision).
    """

    traces: Traces
    tasks: tuple[TaskRun, ...]
    happened: Happenings
    numbers: tuple[SignalNumbers, ...]
    alarms: tuple[AlarmRun, ...]
    drives: DriveReport
    has_webs: bool
    held: tuple[str, ...]
    has_line: bool


def rack_report(
    bag: Path,
    window: Window = WHOLE_RUN,
    progress: Progress | None = None,
    watch: Sequence[str] | None = None,
    references: Mapping[str, str] | None = None,
) -> RackReport:
    """Return the report on the rack of a recording, which is read once.

    ``watch`` are names of what to show in place of what the rack file watches: commons, elements of arrays, locals such
    as ``SPEED.RATIO%``, signals of plants such as ``UNWIND/current_a``. ``references`` are commons with speed
    references, by the name of their drive.

    Raises:
        BagError: the recording cannot be read, a name is unknown, or the window has no data.
        SourceRefused: the rack file stored inside has errors.
    """
    reader = BagReader(bag)
    stored = stored_rack(reader)
    config = stored.config
    recorded = {item.name for item in run_facts(reader).table.variables}
    programs = stored.programs()
    signals = line_signals(bag, config, programs, recorded, watch)
    if len(signals) > MAX_LINES:
        raise BagError("AMX6826", bag, f"{len(signals)} variables for one picture: {MAX_LINES} are the limit")
    drives = drive_reader(stored, window, None, references)
    held = None if drives is None else drives.held
    line = LineRun(signals, alarm_signals(config, recorded), held, config.plants)
    parts: list[PartReader] = [line] if drives is None else [line, drives]
    read = read_run(bag, parts, window, progress)
    of_drives = DriveReport(config.name, 0.0, 0.0, ()) if drives is None else drives.report(read)
    shown = _traces(line, read, window)
    for run, _ in of_drives.drives:
        for event in run.happened.events:
            if event.kind in _OF_A_DRIVE:
                line.happened.add_event(
                    event.time_s, event.kind, f"{run.drive.name}: {event.text}", is_end=event.is_end
                )
    line.happened.finish(read.values_set)
    return RackReport(
        traces=shown,
        tasks=tuple(_tasks(stored, programs, line)),
        happened=line.happened,
        numbers=line.numbers,
        alarms=line.alarms,
        drives=of_drives,
        has_webs=line.has_webs,
        held=tuple(line.held),
        has_line=watch is not None or bool(config.watch or config.alarms) or line.has_webs or drives is None,
    )


def _traces(line: LineRun, read: RunRead, window: Window) -> Traces:
    end_s = read.end_ns / NS_PER_S
    line.finish(end_s)
    lines = line.lines
    first = min((float(item.times[0]) for item in lines if len(item.times)), default=window.start_ns / NS_PER_S)
    start_s = max(window.start_ns / NS_PER_S, first)  # a file of a split recording begins later
    return Traces(read.rack, start_s, end_s, lines, tuple(line.marks.marks), line.marks.unmarked)


def _tasks(stored: StoredRack, programs: Sequence[Program], line: LineRun) -> list[TaskRun]:
    by_name = {program.name: program for program in programs}
    found = []
    for module, task in stored.config.placed_tasks:
        program = by_name.get(task.name)
        period_ns = program.period_ns if program is not None else 0
        where = f"{module.model} in slot {module.slot}"
        found.append(TaskRun(task.name, where, period_ns, line.scans[task.name], line.errors[task.name]))
    return found
