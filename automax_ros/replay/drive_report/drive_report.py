"""Reads the drives of a recording: one pass for commons and errors, one for plants and operations."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.types.messages import NAMES, Operation, PlantState, Scan
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.series import WHOLE_RUN, Progress, Series, Window
from automax_ros.recordings.tables.traces import MAX_LINES, ErrorMarks, Traces
from automax_ros.replay.drive_report.drive_run import DriveRun
from automax_ros.replay.drive_report.drive_signals import ReportDrive, report_drives
from automax_ros.replay.drive_report.happenings import ValuesSet, error_text, operation_text
from automax_ros.replay.scans.stored_rack import stored_rack

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
    drives = report_drives(stored, task, references)
    if len(drives) > MOST_DRIVES:
        raise BagError("AMX6826", bag, f"{len(drives)} drives for one report: {MOST_DRIVES} are the limit")
    if not drives:
        return DriveReport(stored.config.name, 0.0, 0.0, ())
    reader = _Reader(bag, drives, window)
    reader.read_commons(progress and (lambda share: progress(share / 2)))
    reader.read_plants(progress and (lambda share: progress((1 + share) / 2)))
    return reader.report()


class _Reader:
    """Reads a recording for the report on its drives."""

    def __init__(self, bag: Path, drives: Sequence[ReportDrive], window: Window) -> None:
        self._bag, self._window = bag, window
        self._found = [(DriveRun(drive), ErrorMarks()) for drive in drives]
        self._set = ValuesSet()
        self._rack = ""
        self._origin_ns = 0
        self._start_s: float | None = None
        self._end_s = 0.0

    def read_commons(self, progress: Progress | None) -> None:
        """Read the commons of all drives, and the errors of their tasks."""
        wanted: dict[str, list[tuple[DriveRun, str]]] = defaultdict(list)
        for run, _ in self._found:
            for keyword, signal in run.drive.signals.items():
                wanted[signal.variable].append((run, keyword))
        series = Series(self._bag, list(wanted), self._window, progress, self._take_scan, self._set.take)
        self._rack, self._origin_ns = series.rack, series.origin_ns
        of_column = [wanted[item.label] for item in series.columns]
        for time_ns, changed in series.changes():
            time_s = time_ns / NS_PER_S
            self._start_s = time_s if self._start_s is None else self._start_s
            by_run: dict[int, tuple[DriveRun, dict[str, float]]] = {}
            for column, value in changed.items():
                if isinstance(value, str):
                    continue
                for run, keyword in of_column[column]:
                    by_run.setdefault(id(run), (run, {}))[1][keyword] = float(value)
            for run, values in by_run.values():
                run.take(time_s, values)
        self._end_s = series.end_ns / NS_PER_S

    def _take_scan(self, time_ns: int, scan: Scan) -> None:
        for run, marks in self._found:
            if scan.errors and scan.task == run.drive.task:
                marks.take(time_ns, scan)
                for error in scan.errors:
                    run.happened.add_event(time_ns / NS_PER_S, "error", error_text(error.code, error.line))

    def read_plants(self, progress: Progress | None) -> None:
        """Read the plants of all drives, and the operations on the rack."""
        reader = BagReader(self._bag)
        reader.on_progress = progress
        runs = {run.drive.name: run for run, _ in self._found}
        for entry in reader.messages(types=frozenset({NAMES[PlantState], NAMES[Operation]})):
            message = entry.message
            assert isinstance(message, (PlantState, Operation))
            time_ns = message.stamp - self._origin_ns
            if not self._window.holds(time_ns):
                continue
            time_s = time_ns / NS_PER_S
            if isinstance(message, Operation):
                for run, _ in self._found if (text := operation_text(message)) else ():
                    run.happened.add_event(time_s, "operation", text)
            elif message.plant in runs:
                runs[message.plant].take_plant(time_s, message)
                self._start_s = time_s if self._start_s is None else min(self._start_s, time_s)
                self._end_s = max(self._end_s, time_s)

    def report(self) -> DriveReport:
        """Finish the runs and return the report."""
        for run, _ in self._found:
            run.finish(self._end_s)
            run.happened.finish(self._set)
        start_s = max(self._start_s or 0.0, self._window.start_ns / NS_PER_S)
        return DriveReport(self._rack, start_s, self._end_s, tuple(self._found))
