"""Run one process of a distributed rack: a module, with those that have to share its process.

Processes of one rack find each other by its name in a ROS domain, on one host or on several: start one for each (which
they are: `automax node CONFIG`). The rack starts when all are there; one that comes later joins in. `automax run CONFIG
--distributed` starts all of them on this host.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from automax_ros.cli.options.rack import add_set_argument, config_of, print_refused, settings_of
from automax_ros.cli.options.ros import prepare_ros, ros_arguments
from automax_ros.cli.options.stimuli import StimuliRefused
from automax_ros.cli.options.values import seconds_above_0
from automax_ros.cli.options.work import native_forms
from automax_ros.cli.output.files import held_for_writing
from automax_ros.cli.output.signals import StopRequest, stop_signals
from automax_ros.cli.run.child_process import end_with_watcher
from automax_ros.cli.run.plan import ProcessPlan, RunPlan
from automax_ros.cli.run.run import add_shared_arguments, check_files, watched_commons
from automax_ros.core.text import quoted
from automax_ros.core.user_error import UsageError
from automax_ros.rack.operator.retention import RetentionFault
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.processes import RackProcess, process_named, processes_of
from automax_ros.recordings.write.recorder import RecordingOptions

_MOST_ID = (1 << 63) - 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax node``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file")
    parser.add_argument(
        "--module",
        metavar="MODULE",
        help="slot or name of a module, such as 3 or processor_3; common_memory is the process of common memory "
        "(without --module: say which processes there are)",
    )
    parser.add_argument(
        "--run-id",
        type=_run_id,
        default=0,
        metavar="N",
        help="number of the run, the same for all its processes (default: that of those that are there)",
    )
    parser.add_argument(
        "--duration", type=seconds_above_0, metavar="S", help="seconds of rack time after which the process ends"
    )
    parser.add_argument(
        "--lead",
        type=seconds_above_0,
        metavar="S",
        help="seconds from the moment at which all processes are there to the start, as that of common memory has it "
        "(default: 0.4)",
    )
    parser.add_argument(
        "--await-recorder",
        action="store_true",
        help="do not start before a recorder that was given the rack's file (`automax record CONFIG`) hears it",
    )
    add_set_argument(parser)
    add_shared_arguments(
        parser,
        "(default: .automax/RACK/MODULE next to the rack file)",
        stimuli=": give it to every process of the rack",
        report=" for this process",
    )
    # For `automax run --distributed`: prints the lines of cli/run/process_messages.py, ends when standard input does.
    parser.add_argument("--watched", action="store_true", help=argparse.SUPPRESS)


def run(arguments: argparse.Namespace) -> int:
    """Run the process; 0 after a clean end, 1 where the rack has errors or was stopped by a fault."""
    check_files(arguments)
    with stop_signals() as stop, held_for_writing(arguments.report):
        if arguments.watched:
            end_with_watcher(stop)
        if arguments.module is not None:
            from automax_ros.ros.setup.discovery import avoid_shared_memory

            prepare_ros(arguments, "`automax run --simulated` needs no ROS")
            avoid_shared_memory()
        config = config_of(arguments.config, allow_outside=arguments.allow_outside, quiet=arguments.watched)
        if config is None:
            return 1
        processes = processes_of(config)
        if arguments.module is None:
            for process in processes:
                print(f"{process.name:18}{' '.join(process.modules)}")
                for reason in process.reasons:
                    print(f"{'':18}{reason}")
            return 0
        return _run(arguments, config, processes, stop)


def _run(
    arguments: argparse.Namespace, config: RackConfig, processes: tuple[RackProcess, ...], stop: StopRequest
) -> int:
    process = process_named(processes, arguments.module)
    if arguments.settings and not process.holds_common_memory:
        raise UsageError("--set belongs to the process of common memory", "give it to `--module common_memory`")
    ros = ros_arguments(arguments)
    config = replace(config, namespace=ros.placed(config.namespace))
    plan = RunPlan(
        config,
        arguments.duration,
        None,
        RecordingOptions(),
        tuple(settings_of(config, arguments.settings)),
        watched_commons(config, arguments.watch),
        arguments.state,
        arguments.stimuli,
        arguments.report,
        arguments.allow_outside,
        ros,
        ProcessPlan(process, processes, arguments.run_id, arguments.watched, arguments.lead, arguments.await_recorder),
        native=native_forms(arguments, arguments.duration, wall_clock=True),
        verbose=arguments.verbose,
    )
    try:
        from automax_ros.cli.run.lifecycle import run_live

        return run_live(plan, stop)
    except RackError as error:
        return print_refused("node", error)
    except StimuliRefused:
        return 1
    except RetentionFault as error:
        print(error, file=sys.stderr)
        return 2


def _run_id(text: str) -> int:
    number = int(text) if text.isascii() and text.isdigit() and len(text) <= len(str(_MOST_ID)) else 0
    if not 0 < number <= _MOST_ID:
        raise argparse.ArgumentTypeError(f"{quoted(text)} is not a number from 1 to {_MOST_ID}")
    return number
