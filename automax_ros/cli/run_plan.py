"""What a run was asked for, and what both kinds of run tell."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from automax_ros.bags.recorder import RecordingOptions
from automax_ros.cli.output_files import write_report
from automax_ros.cli.terminal import print_diagnostics
from automax_ros.core.types import Value
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments
from automax_ros.rack.config import RackConfig
from automax_ros.rack.rack import Rack
from automax_ros.rack.report import report_of
from automax_ros.rack.settings import CommonElement
from automax_ros.rack.stimuli.player import Stimulation
from automax_ros.rack.stimuli.stage import Happened


@dataclass(frozen=True)
class RunPlan:
    """A run.

    ``duration_ns`` None runs until it is stopped, ``record`` is the folder of a recording, ``state`` the one that was
    named for values that outlive the run, if any. ``stimuli`` is the file of what happens to the rack, ``report`` that
    in which the run's end is told; ``allow_outside`` lets stimuli name sources in other folders. ``ros`` is what the
    command line says to ROS.
    """

    config: RackConfig
    duration_ns: int | None
    record: Path | None
    recording: RecordingOptions
    settings: tuple[tuple[str, Value], ...]
    watch: tuple[CommonElement, ...]
    state: Path | None = None
    stimuli: Path | None = None
    report: Path | None = None
    allow_outside: bool = False
    ros: RosArguments = NO_ARGUMENTS


def warn(rack: Rack) -> None:
    """Print the warnings that the tasks' checks gave."""
    for source, diagnostics in rack.warnings:
        print_diagnostics(diagnostics, source, sys.stderr)


def report_at_end(rack: Rack, stimulation: Stimulation, others: Sequence[Happened] = ()) -> dict[str, Any]:
    """Return the report of a rack as it is before anything is closed; ``others`` have operated it besides stimuli."""
    return report_of(rack, sorted((*stimulation.happened, *others), key=lambda item: item.at_ns))


def conclude(rack: Rack, plan: RunPlan, report: dict[str, Any] | None, *, failed: bool) -> int:
    """Write the report, print what stopped the rack, and return the exit code.

    The code is 1 after a fault, or where something has ``failed``, such as an operation of the stimuli; a STOP ALL that
    was commanded is as good an end as any.
    """
    if plan.report is not None and report is not None:
        write_report(plan.report, report)
    stopped = rack.operations.stopped
    if stopped is not None:
        print(f"automax run: STOP ALL: {stopped.reason}", file=sys.stderr)
    fault = stopped is not None and stopped.is_fault
    return 1 if fault or failed else 0
