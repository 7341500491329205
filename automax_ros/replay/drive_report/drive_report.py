"""Reads the drives of a recording, from their commons, errors, plants and operations."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.types.messages import NAMES, Operation, PlantState, Scan
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Cell
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.series import WHOLE_RUN, Progress, Window
from automax_ros.recordings.tables.traces import MAX_LINES, ErrorMarks, Traces
from automax_ros.replay.drive_report.drive_run import HELD, STATE, DriveRun, is_shown
from automax_ros.replay.drive_report.drive_signals import RecordedSignal, ReportDrive, report_drives
from automax_ros.replay.drive_report.happenings import error_text, operation_text
from automax_ros.replay.drive_report.reading import RunRead, read_run
from automax_ros.replay.scans.stored_rack import StoredRack, stored_rack

MOST_DRIVES = 24
"""Most drives of one report (decision: a rack has two CML tasks, and UDCs with two drives each)."""


@dataclass(frozen=True)
class DriveReport:
    """The drives of a recording in the order of slots, and the part of the run that was read, s."""

    rack: str
    start_s: float
    end_s: float
    drives: tuple[tuple[DriveRun, ErrorMarks], ...]

    def traces(self, run: DriveRun, marks: ErrorMarks) -> Traces:
        """Return the lines of one drive for a picture."""
        lines = run.lines
        return Traces(self.rack, self.start_s, self.end_s, tuple(lines[:MAX_LINES]), tuple(marks.marks), marks.unmarked)


def drive_report(
    bag: Path,
    task: str | None = None,
    window: Window = WHOLE_RUN,
    progress: Progress | None = None,
    references: Mapping[str, str] | None = None,
) -> DriveReport:
    """Return the report on the drives of a recording, or on the one whose loop is in ``task``; empty without drives.

    ``references`` are commons with speed references, by the name of their drive (``report_drives``).

    Raises:
        BagError: the recording cannot be read, ``task`` has no drive, or the window has no data of them.
        SourceRefused: the rack file stored inside has errors.
    """
    stored = stored_rack(BagReader(bag))
    drives = drive_reader(stored, window, task, references)
    if drives is None:
        return DriveReport(stored.config.name, 0.0, 0.0, ())
    return drives.report(read_run(bag, [drives], window, progress))


def drive_reader(
    stored: StoredRack,
    window: Window = WHOLE_RUN,
    task: str | None = None,
    references: Mapping[str, str] | None = None,
) -> DriveReader | None:
    """Return what reads the drives of a recorded rack, None if it has none; arguments as of ``drive_report``.

    Raises:
        BagError: ``task`` has no drive, or there are too many.
    """
    drives = report_drives(stored, task, references)
    if len(drives) > MOST_DRIVES:
        raise BagError("AMX6826", stored.bag, f"{len(drives)} drives for one report: {MOST_DRIVES} are the limit")
    return DriveReader(drives, window) if drives else None


class DriveReader:
    """Takes what a recording has of its drives."""

    def __init__(self, drives: Sequence[ReportDrive], window: Window) -> None:
        self._window = window
        self._found = [(DriveRun(drive), ErrorMarks()) for drive in drives]
        self._runs = {run.drive.name: run for run, _ in self._found}
        self._wanted: dict[str, list[tuple[DriveRun, str]]] = defaultdict(list)
        for run, _ in self._found:
            for keyword, signal in run.drive.signals.items():
                if not is_shown(keyword):
                    continue
                self._wanted[signal.variable].append((run, keyword))
        self._start_s: float | None = None
        self._end_s = 0.0

    @property
    def names(self) -> Sequence[str]:
        """The commons of all drives."""
        return list(self._wanted)

    @property
    def held(self) -> dict[str, RecordedSignal]:
        """The signals with the states of loops, by the commons with their currents, which are held in standby."""
        return {
            signals[keyword].variable: signals[STATE]
            for run, _ in self._found
            for signals in (run.drive.signals,)
            if STATE in signals
            for keyword in HELD
            if keyword in signals
        }

    @property
    def types(self) -> Sequence[str]:
        """The type of a plant's messages."""
        return (NAMES[PlantState],)

    def take_values(self, time_ns: int, changed: Mapping[str, Cell]) -> None:
        """Add the values of commons."""
        time_s = time_ns / NS_PER_S
        self._start_s = time_s if self._start_s is None else self._start_s
        by_run: dict[int, tuple[DriveRun, dict[str, float]]] = {}
        for label, value in changed.items():
            if isinstance(value, str):
                continue
            for run, keyword in self._wanted[label]:
                by_run.setdefault(id(run), (run, {}))[1][keyword] = float(value)
        for run, values in by_run.values():
            run.take(time_s, values)

    def take_scan(self, time_ns: int, scan: Scan) -> None:
        """Add the errors of a scan to the drive whose loop it is."""
        if not scan.errors:
            return
        for run, marks in self._found:
            if scan.task == run.drive.task:
                marks.take(time_ns, scan)
                for error in scan.errors:
                    run.happened.add_event(time_ns / NS_PER_S, "error", error_text(error.code, error.line))

    def take_message(self, time_ns: int, message: Any) -> None:
        """Add how a plant stands, or an operation on the rack."""
        time_s = time_ns / NS_PER_S
        if isinstance(message, Operation):
            for run, _ in self._found if (text := operation_text(message)) else ():
                run.happened.add_event(time_s, "operation", text)
        elif isinstance(message, PlantState) and message.plant in self._runs:
            self._runs[message.plant].take_plant(time_s, message)
            self._start_s = time_s if self._start_s is None else min(self._start_s, time_s)
            self._end_s = max(self._end_s, time_s)

    def report(self, read: RunRead) -> DriveReport:
        """Finish the runs and return the report."""
        end_s = max(self._end_s, read.end_ns / NS_PER_S)
        for run, _ in self._found:
            run.finish(end_s)
            run.happened.finish(read.values_set)
        start_s = max(self._start_s or 0.0, self._window.start_ns / NS_PER_S)
        return DriveReport(read.rack, start_s, end_s, tuple(self._found))
