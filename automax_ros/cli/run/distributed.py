"""A run of a distributed rack on the wall clock: starts and supervises each process of the rack."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

from automax_ros.cli.options.stimuli import stimulation
from automax_ros.cli.output.files import write_report
from automax_ros.cli.output.signals import StopRequest
from automax_ros.cli.run.plan import RunPlan, warn
from automax_ros.cli.run.process_messages import ProcessMessage, TextLine, merged_report
from automax_ros.cli.run.status import Progress, Summary, TerminalOutput, merged_progress, merged_summary
from automax_ros.cli.run.supervisor import ProcessSpec, Supervisor
from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UsageError
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.processes import RackProcess, processes_of
from automax_ros.ros.setup.discovery import range_text
from automax_ros.ros.setup.lock import InstanceLock, domain_id

_Part = TypeVar("_Part")
_OTHER_PROCESS, _MEMORY_PROCESS, _RECORDER = range(3)
"""The order in which processes end: tasks first, then common memory, then the recorder."""
_RECORDER_NAME = "recorder"
_RECORDER_WAIT_S = "60"
"""How long the recorder waits for the rack, whose processes take a while to start, s (decision)."""
_RECORDER_AFTER_NS = 25 * NS_PER_S
"""How long the recorder takes the last messages of common memory's process, which waits until they have arrived."""
_WHOLE = "distributed"
"""The name under which the supervising process holds the lock."""


def run_distributed(plan: RunPlan, arguments: argparse.Namespace, stop: StopRequest) -> int:
    """Run until all processes have ended, by themselves or on request; return the exit code.

    ``arguments`` are those of ``automax run``, from which the plan was made.
    """
    domain = domain_id()
    with InstanceLock(plan.config.namespace, domain, _WHOLE):
        rack = Rack(plan.config)
        warn(rack)
        stimulation(rack, plan.stimuli, allow_outside=plan.allow_outside)
        processes = processes_of(plan.config, rack.operations.installation.programs.values())
        watch = _Watch(plan, processes)
        watch.message(_opening(plan, processes, domain))
        posts = list(_posts(plan, processes, arguments))
        supervisor = Supervisor(posts, watch.receive, watch.print_error, watch.print_death, restart=arguments.restart)
        supervisor.run(lambda: stop.requested)
        return watch.conclude(supervisor)


def _posts(plan: RunPlan, processes: Sequence[RackProcess], arguments: argparse.Namespace) -> Iterator[ProcessSpec]:
    # Modules that happen to be in the working folder must not be imported.
    safe = ["-P"] if sys.version_info >= (3, 11) else []
    automax = [sys.executable, *safe, "-m", "automax_ros.cli.main"]
    common = [str(plan.config.path), "--watched", "--run-id", str(int.from_bytes(os.urandom(8), "big") >> 1 or 1)]
    common += ["--allow-outside"] if plan.allow_outside else []
    common += ["--stimuli", str(plan.stimuli)] if plan.stimuli is not None else []
    common += ["--native", arguments.native, *(["--verbose"] if arguments.verbose else [])]
    common += ["--duration", _seconds(plan.duration_ns)] if plan.duration_ns is not None else []
    if plan.record is not None:
        command = [*automax, "record", str(plan.config.path), "--output", str(plan.record), "--wait", _RECORDER_WAIT_S]
        command += [*_recording(arguments), *_ros(plan, arguments)]
        yield ProcessSpec(
            _RECORDER_NAME, command, _RECORDER, reports=False, begins_run=True, after_ns=_RECORDER_AFTER_NS
        )
    for process in processes:
        own = ["--state", str(plan.state / process.name)] if plan.state is not None else []
        own += ["--await-recorder"] if plan.record is not None else []
        own += (
            _option_words("--set", arguments.settings) + _option_words("--watch", arguments.watch)
            if process.holds_common_memory
            else []
        )
        command = [*automax, "node", *common, "--module", process.name, *own, *_ros(plan, arguments)]
        yield ProcessSpec(
            process.name,
            command,
            _MEMORY_PROCESS if process.holds_common_memory else _OTHER_PROCESS,
            ends_run=process.holds_common_memory,
        )


def _recording(arguments: argparse.Namespace) -> list[str]:
    """Return the options of ``automax record`` that correspond to ``--record-...``."""
    if arguments.record_locals:
        raise UsageError("--record-locals is not possible with --distributed: the recorder is a process of its own")
    split_ns = arguments.record_split_s
    options = {
        "--compression": arguments.record_compression,
        "--split-mb": arguments.record_split_mb,
        "--split-s": None if split_ns is None else _seconds(split_ns),
        "--tasks": arguments.record_tasks,
    }
    return [f"{option}={value}" for option, value in options.items() if value is not None]


def _ros(plan: RunPlan, arguments: argparse.Namespace) -> list[str]:
    discovery = ["--range", arguments.discovery] if arguments.discovery is not None else []
    return [*discovery, *plan.ros.command_line]


def _option_words(option: str, values: Sequence[str] | None) -> list[str]:
    return [f"{option}={value}" for value in values or ()]


def _seconds(time_ns: int) -> str:
    return f"{time_ns // NS_PER_S}.{time_ns % NS_PER_S:09d}"


def _opening(plan: RunPlan, processes: Sequence[RackProcess], domain: int) -> str:
    config = plan.config
    return (
        f"rack {config.name} in {count_of(len(processes), 'process')}: "
        f"{', '.join(process.words for process in processes)}\n"
        f"ROS 2 namespace /{config.namespace} in domain {domain}, seen by {range_text()}; Ctrl-C ends the run"
    )


class _Watch:
    def __init__(self, plan: RunPlan, processes: Sequence[RackProcess]) -> None:
        self._plan, self._names = plan, [process.name for process in processes]
        self._memory_process = self._names[0]
        self._screen = TerminalOutput()
        self.message = self._screen.message
        self._progress: dict[str, Progress] = {}
        self._summaries: dict[str, Summary] = {}
        self._reports: dict[str, Any] = {}

    def receive(self, name: str, message: ProcessMessage) -> None:
        """Show a message of a process; progress is shown merged, summaries and reports are kept for the end."""
        if isinstance(message, TextLine):
            self.message(f"{name}: {message.text}")
        elif isinstance(message, Progress):
            self._progress[name] = message
            memory_progress = self._progress.get(self._memory_process)
            if memory_progress is not None and memory_progress.now_ns >= NS_PER_S and self._screen.due():
                self._screen.progress(merged_progress(_in_order(self._names, self._progress)))
        elif isinstance(message, Summary):
            self._summaries[name] = message
        elif message.report:  # the report of a process that has not begun is empty
            self._reports[name] = message.report

    def print_error(self, name: str, line: str) -> None:
        """Show a line that a process has written on standard error."""
        print(f"{name}: {line}", file=sys.stderr, flush=True)

    def print_death(self, name: str, how: str, again_s: float | None) -> None:
        """Show that a process has died."""
        self._progress.pop(name, None)
        again = f"it is started again in {again_s:.1f} s" if again_s is not None else "it is not started again"
        self.message(f"{name} {how}: {again}")

    def conclude(self, supervisor: Supervisor) -> int:
        """Show the summary, write the report, and return the exit code: the highest of all processes."""
        if self._memory_process in self._summaries:
            self._screen.summary(merged_summary(_in_order(self._names, self._summaries)))
        for name, deaths in supervisor.deaths.items():
            self.message(f"  {name} died {count_of(deaths, 'time')}")
        if self._reports:
            report = merged_report(self._reports, self._names, supervisor.deaths)
            if self._plan.report is not None:
                write_report(self._plan.report, report)
            if report["stopped"] is not None:
                print(f"automax run: STOP ALL: {report['stopped']['reason']}", file=sys.stderr)
        codes = supervisor.codes.values()
        return max((code if code >= 0 else 1 for code in codes), default=0)


def _in_order(names: Sequence[str], parts: dict[str, _Part]) -> list[_Part]:
    return [parts[name] for name in names if name in parts]
