"""The plan of a run, and the output that live and simulated runs have in common."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros.cli.options.panel import WantedPanel
from automax_ros.cli.options.work import print_native
from automax_ros.cli.output.files import write_report
from automax_ros.cli.output.screen import print_warning_count
from automax_ros.cli.run.process_messages import ProcessOutput, send_report
from automax_ros.cli.run.status import TerminalOutput
from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms
from automax_ros.core.types import Value
from automax_ros.rack.operator.retention import default_folder
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.config import CommonElement, RackConfig
from automax_ros.rackfile.model.value_names import TunableSetting, watched
from automax_ros.rackfile.processes import RackProcess
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.runtime.time.simulated_pacer import SimulatedTime
from automax_ros.scenario.report import report_of
from automax_ros.scenario.stimuli.player import OperationRecord, StimuliPlayer


@dataclass(frozen=True)
class ProcessPlan:
    """The part of a distributed rack that runs in this process.

    ``processes`` are all processes of the rack. ``run_id`` is the number of the run, 0 for that of the processes that
    already run, or a new one. ``watched``: another process has started this one. ``start_delay_ns`` is how long after
    all processes are present the rack starts, None for the default. ``awaits_recorder``: the rack does not start before
    a recorder receives this process's messages.
    """

    process: RackProcess
    processes: tuple[RackProcess, ...]
    run_id: int = 0
    watched: bool = False
    start_delay_ns: int | None = None
    awaits_recorder: bool = False


@dataclass(frozen=True)
class RunPlan:
    """The plan of a run.

    ``duration_ns`` None runs until it is stopped, ``record`` is the folder of a recording, ``state`` the folder given
    for values that outlive the run, if any. ``watch`` are the variables of ``--watch``, None without it. ``stimuli`` is
    the stimuli file, ``report`` the file for the report of the run's end; ``allow_outside`` allows stimuli to name
    sources in other folders. ``ros`` are the ROS arguments of the command line. ``process_plan`` is the part of the
    rack that is run, None for all of it. ``simulated`` is the simulated time of a rack with ROS nodes, None for the
    wall clock and for a rack without nodes. ``tunings`` are the tunables set with ``--set``. ``native`` says which
    tasks scan as machine code, ``verbose`` prints which of them do. ``panel`` is the panel that shows the rack, if any.
    """

    config: RackConfig
    duration_ns: int | None
    record: Path | None
    recording: RecordingOptions
    settings: tuple[tuple[str, Value], ...]
    watch: tuple[CommonElement, ...] | None
    state: Path | None = None
    stimuli: Path | None = None
    report: Path | None = None
    allow_outside: bool = False
    ros: RosArguments = NO_ARGUMENTS
    process_plan: ProcessPlan | None = None
    simulated: SimulatedTime | None = None
    tunings: tuple[TunableSetting, ...] = ()
    native: NativeForms = IN_PYTHON
    verbose: bool = False
    panel: WantedPanel | None = None

    @property
    def is_watched(self) -> bool:
        """Whether another process has started this one and shows its output."""
        return self.process_plan is not None and self.process_plan.watched

    @property
    def slots(self) -> tuple[int, ...] | None:
        """The slots whose modules are run, None for all."""
        return None if self.process_plan is None else self.process_plan.process.slots

    @property
    def state_folder(self) -> Path | None:
        """The folder of the kept state, in simulated time only where one is given; each process has its own."""
        if self.state is not None or self.simulated is not None:
            return self.state
        whole = default_folder(self.config)
        return whole if self.process_plan is None else whole / self.process_plan.process.name

    def shown(self, rack: Rack) -> Sequence[CommonElement]:
        """Return the commons that the status line shows for a rack, or for this process's part of it."""
        if self.watch is not None:
            return self.watch
        if self.process_plan is not None and not self.process_plan.process.holds_common_memory:
            return ()
        if self.process_plan is None or rack.config.watch is not None:
            return watched(rack.config, None, rack.operations.installation.programs.values())
        programs = [item.result.program for item in check_tasks(rack.config)]  # tasks are in other processes
        return watched(rack.config, None, [program for program in programs if program is not None])

    @property
    def screen(self) -> TerminalOutput:
        """Where the run is shown."""
        return ProcessOutput() if self.is_watched else TerminalOutput()


def warn(rack: Rack) -> None:
    """Print how many warnings the checks of the tasks gave."""
    print_warning_count(rack.warnings, "its tasks", rack.config.path)


def print_forms(rack: Rack, plan: RunPlan) -> None:
    """Print which tasks are native, and why others are not, if the plan asks for it."""
    if plan.verbose:
        print_native(rack.operations.installation.native.values())


def report_at_end(rack: Rack, stimulation: StimuliPlayer, others: Sequence[OperationRecord] = ()) -> dict[str, Any]:
    """Return the report of a rack before anything is closed; ``others`` are the operations not caused by stimuli."""
    return report_of(rack, sorted((*stimulation.happened, *others), key=lambda item: item.at_ns))


def conclude(rack: Rack, plan: RunPlan, report: dict[str, Any] | None, *, failed: bool) -> int:
    """Write the report, print what stopped the rack, and return the exit code.

    The code is 1 after a fault, or where something has ``failed``, such as an operation of the stimuli. A commanded
    STOP ALL is a clean end.
    """
    if plan.report is not None and report is not None:
        write_report(plan.report, report)
    stopped = rack.operations.stopped
    if plan.is_watched:
        send_report(report or {})
    elif stopped is not None:
        print(f"automax run: STOP ALL: {stopped.reason}", file=sys.stderr)
    fault = stopped is not None and stopped.is_fault
    return 1 if fault or failed else 0
