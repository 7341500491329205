"""How a recorded rack stood at a time, as far as its recording tells: by its operations, scans and states."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from automax_ros.core.names import element_name
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import type_of_name
from automax_ros.core.values import source_text
from automax_ros.language.program import Program
from automax_ros.messages.types.messages import HELD_MARK
from automax_ros.panel.rack_status import Answers, RackStatus, drive_facts, web_facts
from automax_ros.panel.source import Facts
from automax_ros.rack.base.observers import HALT, RESUME, Operation
from automax_ros.rack.operator.faults import meaning_of
from automax_ros.rack.operator.requests import DELETED, PLACES
from automax_ros.rackfile.model.config import driven_plants
from automax_ros.rackfile.modules.processor import ProcessorConfig
from automax_ros.replay.drive_report.drive_run import DriveRun
from automax_ros.replay.drive_report.drive_signals import ReportDrive, report_drives
from automax_ros.replay.recorded.run import RecordedRun, TaskLog
from automax_ros.replay.recorded.values import typed
from automax_ros.replay.scans.state import recorded_fields
from automax_ros.runtime.scan.error_log import ErrorLog, LogEntry
from automax_ros.runtime.tasks.task import EVENT_TIMEOUT, OVERLAP, SCAN_TOO_LONG, Status

_FATAL = (SCAN_TOO_LONG, OVERLAP, EVENT_TIMEOUT)
_QUIET_SCANS = 3
"""A task that has not scanned for more periods than this does not run (decision)."""
_RUNS = frozenset({"run", "run_all", "power_on"})
_STOPS = frozenset({"stop", "stop_all", "power_off", "delete"})
_CLEARS = frozenset({"clear_errors", "reload", "delete"})
_TOLD = _RUNS | _STOPS | _CLEARS | {HALT, RESUME}


@dataclass
class _Operated:
    """What operations have made of a rack; ``stopped``, ``started`` and ``cleared`` are times in ns by task."""

    powered: bool = True
    halted: bool = False
    cause: Operation | None = None
    stopped: dict[str, tuple[int, str]] = field(default_factory=dict)
    cleared: dict[str, int] = field(default_factory=dict)

    def take(self, operation: Operation, tasks: Sequence[str]) -> None:
        what, at_ns = operation.what, operation.at_ns
        concerned = [operation.task] if operation.task and what != "stop_all" else tasks
        if what in (HALT, RESUME):
            self.halted = what == HALT
        if what in ("power_off", "power_on"):
            self.powered = what == "power_on"
        if what == "stop_all" or what in _RUNS:
            self.cause = operation if what == "stop_all" else None
        if what in _STOPS:
            status = DELETED if what == "delete" else Status.STOPPED.value
            self.stopped.update((name, (at_ns, status)) for name in concerned)
        elif what == "reload" and self.stopped.get(operation.task, (0, ""))[1] == DELETED:
            self.stopped[operation.task] = at_ns, Status.STOPPED.value
        if what in _CLEARS:
            self.cleared.update((name, at_ns) for name in concerned)


class RecordedStatus:
    """The status of the rack of one recording."""

    def __init__(self, run: RecordedRun, programs: dict[str, Program]) -> None:
        self._run, self._programs, self._config = run, programs, run.replay.rack.config
        self._status = RackStatus(self._config, [])
        self._told = [item for item in run.operations if item.ok and item.what in _TOLD]
        self._drives = {drive.name: drive for drive in report_drives(run.replay.rack)}

    def facts(self, at_ns: int) -> Facts:
        """Return all keys of the status at a time, ns of the run."""
        operated = _Operated()
        for operation in self._told[: bisect_right(self._told, at_ns, key=lambda item: item.at_ns)]:
            operated.take(operation, list(self._run.tasks))
        logs = {name: self._errors(name, operated, at_ns) for name in self._run.tasks}
        cause = operated.cause
        status: dict[str, Any] = {
            "time_s": at_ns / NS_PER_S,
            "powered": operated.powered,
            "halted": operated.halted,
            "stopped": cause is not None,
        }
        if cause is not None:
            status |= {"stopped_at_s": cause.at_ns / NS_PER_S, "stopped_task": cause.task}
            status |= {"stopped_code": cause.detail, "stopped_reason": cause.reason}
        shown = [(item.name, *self._display(item, operated, logs)) for item in self._processors()]
        for index, key in enumerate(("display_modules", "display_codes", "display_meanings")):
            status[key] = [item[index] for item in shown]
        words = {key: self._run.commons.at(key, at_ns) for key in self._status.registers}
        answers = Answers(
            status,
            {key: value for key, value in words.items() if isinstance(value, int)},
            [self._task(name, slot, operated, logs[name], at_ns) for name, slot in self._slots()],
            [entry for name, log in logs.items() for entry in _entries(name, log)],
            list(self._forced(at_ns)),
            list(self._drive_facts(at_ns)),
            list(self._web_facts(at_ns)),
        )
        return self._status.facts(answers, "")

    def _slots(self) -> Iterator[tuple[str, int]]:
        return ((task.name, module.slot) for module, task in self._config.placed_tasks)

    def _processors(self) -> Iterator[ProcessorConfig]:
        return (module for module in self._config.modules if isinstance(module, ProcessorConfig))

    def _errors(self, name: str, operated: _Operated, at_ns: int) -> ErrorLog:
        errors, log = self._run.tasks[name].errors, ErrorLog()
        begin = bisect_right(errors, operated.cleared.get(name, -1), key=lambda item: item[0])
        end = bisect_right(errors, at_ns, key=lambda item: item[0])
        count = max(0, end - begin)
        for place in dict.fromkeys((*range(begin, begin + min(count, 2)), *([end - 1] if count else []))):
            log.add(LogEntry(*errors[place][1:]))
        log.count = count
        return log

    def _task(self, name: str, slot: int, operated: _Operated, errors: ErrorLog, at_ns: int) -> Facts:
        own = self._run.tasks[name]
        last = own.begun(at_ns)
        return {
            "task": name,
            "slot": slot,
            "status": self._word(name, own, last, operated, errors, at_ns),
            "scans": own.numbers[last] if last >= 0 else 0,
            "skipped": own.skipped[last] if last >= 0 else 0,
            "errors": errors.count,
        }

    def _word(self, name: str, own: TaskLog, last: int, operated: _Operated, errors: ErrorLog, at_ns: int) -> str:
        stopped_ns, word = operated.stopped.get(name, (-1, Status.STOPPED.value))
        if last < 0 or word == DELETED:
            return word
        fatal = errors.last is not None and errors.last.code in _FATAL and errors.last.scan == own.numbers[last]
        if fatal:
            return Status.FAULTED.value
        if stopped_ns >= own.times[last]:
            return word
        program = self._programs.get(name)
        periodic = program is not None and program.event is None and not program.is_basic
        if program is not None and periodic and at_ns - own.ends[last] > _QUIET_SCANS * program.period_ns:
            return Status.ENDED.value
        return Status.RUNNING.value

    def _display(self, module: ProcessorConfig, operated: _Operated, logs: dict[str, ErrorLog]) -> tuple[str, str]:
        """Return what the display of a Processor shows, as ``displays_of`` does for a rack that runs."""
        if not operated.powered:
            return "", "the power is off"
        tasks = [task.name for task in module.tasks]
        cause = operated.cause
        elsewhere = [task.name for other in self._processors() for task in other.tasks if other is not module]
        codes = [cause.detail] if cause is not None and cause.detail and cause.task not in elsewhere else []
        codes += [entry.hardware for name in tasks for entry in reversed(logs[name].entries) if entry.hardware]
        return (codes[0], meaning_of(codes[0])) if codes else ("", "no fault")

    def _forced(self, at_ns: int) -> Iterator[tuple[str, str]]:
        run = self._run
        found = bisect_right(run.forced, at_ns, key=lambda item: item[0])
        for key in sorted(run.forced[found - 1][1]) if found else ():
            value = run.commons.at(key, at_ns)
            if value is not None:
                yield element_name(self._config.variables[key[0]], key[1]), source_text(value)
        for task, own in run.tasks.items():
            recorded = own.state_at(at_ns)
            names = [] if recorded is None else [item for item in recorded.state.field if item.startswith(HELD_MARK)]
            fields = recorded_fields(run.bag, recorded.state) if recorded is not None and names else {}
            for name in (item.removeprefix(HELD_MARK) for item in names):
                for value in fields.get(name, ())[:1]:
                    shown = value if isinstance(value, str) else typed(type_of_name(name), value)
                    yield f"{task}.{name}", source_text(shown)

    def _drive_facts(self, at_ns: int) -> Iterator[Facts]:
        for driven in driven_plants(self._config):
            name, logs = driven.name, self._run.drives
            signals = logs.plants[name].at(at_ns) if name in logs.plants else None
            if signals is not None:
                roll = logs.rolls[name].at(at_ns) if name in logs.rolls else None
                drive = self._drives.get(name)
                loop = {} if drive is None else self._loop(drive, at_ns)
                yield drive_facts(name, driven.slot, signals, roll, **loop)

    def _web_facts(self, at_ns: int) -> Iterator[Facts]:
        for name in (web.name for web in self._config.webs):
            log = self._run.drives.webs.get(name)
            signals = None if log is None else log.at(at_ns)
            if signals is not None:
                yield web_facts(name, signals)

    def _loop(self, drive: ReportDrive, at_ns: int) -> dict[str, Any]:
        """Return what the commons tell of a drive's current minor loop."""
        values: dict[str, float] = {}
        for keyword, signal in drive.signals.items():
            value = self._run.value(self._config.common(signal.variable), at_ns)
            if value is not None and not isinstance(value, str):
                values[keyword] = float(value)
        shown = DriveRun(drive)
        shown.take(0.0, values)
        shown.finish(0.0)
        told = drive.signals.get("DC_CML_STATE")
        runs = None if told is None else bool(values.get(told.keyword, 0.0)) != told.inverted
        return {
            "delta_deg": shown.degrees() if runs and "DELTA" in values else None,
            "state": "" if runs is None else "run" if runs else "standby",
            "faults": [span.text for span in shown.faults],
        }


def _entries(task: str, log: ErrorLog) -> Iterator[Facts]:
    for place, entry in zip(PLACES, log.entries, strict=False):
        problem = PROBLEMS.get(entry.problem)
        text = problem.title if problem else "unknown problem"
        own = {"task": task, "place": place, "line": entry.line, "code": entry.problem, "text": text}
        yield {**own, "scan": entry.scan}
