"""The report on a recorded rack without a drive: its tasks, watched commons, errors and operations."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import NAMES, Operation, Scan
from automax_ros.rackfile.model.value_names import watched
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import run_facts
from automax_ros.recordings.tables.series import WHOLE_RUN, Progress, Window
from automax_ros.recordings.tables.traces import Traces, traces
from automax_ros.replay.drive_report.happenings import Happenings, ValuesSet, error_text, operation_text
from automax_ros.replay.scans.stored_rack import stored_rack


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
    """The commons that the rack file watches, over time, the tasks in the order of slots, and the events."""

    traces: Traces
    tasks: tuple[TaskRun, ...]
    happened: Happenings


def rack_report(bag: Path, window: Window = WHOLE_RUN, progress: Progress | None = None) -> RackReport:
    """Return the report on the rack of a recording.

    Raises:
        BagError: the recording cannot be read, or has no data in the window.
        SourceRefused: the rack file stored inside has errors.
    """
    reader = BagReader(bag)
    stored = stored_rack(reader)
    programs = {program.name: program for program in stored.programs()}
    facts = run_facts(reader).table
    recorded = {item.name for item in facts.variables}
    names = [
        item.label
        for item in watched(stored.config, None, programs.values())
        if item.name in recorded and item.variable.type is not DataType.STRING
    ]
    happened, values_set = Happenings(), ValuesSet()
    scans: Counter[str] = Counter()
    errors: Counter[str] = Counter()

    def take_scan(time_ns: int, scan: Scan) -> None:
        scans[scan.task] += 1
        errors[scan.task] += len(scan.errors)
        for error in scan.errors:
            happened.add_event(time_ns / NS_PER_S, "error", f"{scan.task}: {error_text(error.code, error.line)}")

    half = None if progress is None else lambda share: progress(share / 2)
    shown = traces(bag, names, window, half, take_scan, values_set.take)
    rest = BagReader(bag)
    rest.on_progress = None if progress is None else lambda share: progress((1 + share) / 2)
    for entry in rest.messages(types=frozenset({NAMES[Operation]})):
        message = entry.message
        assert isinstance(message, Operation)
        time_ns = message.stamp - facts.stamp
        if window.holds(time_ns) and (text := operation_text(message)):
            happened.add_event(time_ns / NS_PER_S, "operation", text)
    happened.finish(values_set)
    tasks = []
    for module, task in stored.config.placed_tasks:
        program = programs.get(task.name)
        period_ns = program.period_ns if program is not None else 0
        where = f"{module.model} in slot {module.slot}"
        tasks.append(TaskRun(task.name, where, period_ns, scans[task.name], errors[task.name]))
    return RackReport(shown, tuple(tasks), happened)
