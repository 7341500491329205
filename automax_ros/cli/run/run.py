"""Run a rack from its YAML file.

On the wall clock the rack's modules are ROS 2 nodes in this process, until Ctrl-C or for --duration seconds. With
--simulated time passes as fast as the machine can and nothing of ROS is started: the same rack gives the same bag, byte
for byte; with --simulated --ros the nodes are there too, and the rack sends /clock. With `--ros-args -p
use_sim_time:=true` it follows another's /clock. --panel shows the rack in the browser.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

from automax_ros.cli.options.panel import add_panel_arguments, wanted_panel
from automax_ros.cli.options.rack import (
    add_outside_argument,
    add_set_argument,
    begin_with,
    config_of,
    namespace_of,
    print_refused,
    split_settings,
    usable_config,
)
from automax_ros.cli.options.recording import add_record_arguments, recording_options
from automax_ros.cli.options.ros import add_ros_arguments, prepare_ros, ros_arguments
from automax_ros.cli.options.stimuli import StimuliRefused
from automax_ros.cli.options.stimuli import stimulation as stimulation_of
from automax_ros.cli.options.values import add_watch_argument, naming, option_number, seconds_above_0, watch_list
from automax_ros.cli.options.work import add_native_arguments, native_forms
from automax_ros.cli.output.files import held_for_writing, require_different_files, require_folder, require_writable
from automax_ros.cli.output.signals import StopRequest, WorkInterrupted, stop_signals
from automax_ros.cli.run.plan import RunPlan, conclude, print_forms, report_at_end, warn
from automax_ros.cli.run.saving import RecordingMonitor, SavedState
from automax_ros.cli.run.shown import rack_shown
from automax_ros.cli.run.status import StatusDisplay
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.types import bare_name
from automax_ros.core.user_error import UsageError
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.operator.retention import RetentionFault
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.model.config import CommonElement, RackConfig
from automax_ros.rackfile.model.value_names import watched
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.ros.setup.arguments import NO_ARGUMENTS
from automax_ros.runtime.time.simulated_pacer import SimulatedTime
from automax_ros.runtime.time.turns import Turns
from automax_ros.scenario.stimuli.player import StimuliPlayer

SLICE_NS = 100 * NS_PER_MS
"""Rack time between two checks of signals and updates of the display."""
_ENDLESS_NS = 1 << 62
_LOOK_S = 0.05
"""Longest wait while no rack runs, s."""
_NO_END = "simulated time without an end: Ctrl-C ends the run (or give --duration S)"


def run_simulated(plan: RunPlan, stop: StopRequest) -> int:
    """Run until the duration has passed, nothing can happen any more, or a stop is requested; return the exit code.

    Raises:
        WorkInterrupted: a signal came while tasks were compiled.
    """
    with stop.cut_short():
        rack = Rack(plan.config, native=plan.native)
        warn(rack)
        print_forms(rack, plan)
        stimulation = stimulation_of(rack, plan.stimuli, allow_outside=plan.allow_outside)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, plan.record, plan.recording) if plan.record is not None else None
    display = StatusDisplay(rack, plan.shown(rack), live=False)
    recording = RecordingMonitor(recorder, display)
    state = SavedState(rack, plan.state)
    begin_with(rack, plan.tunings)
    end_ns = _ENDLESS_NS if plan.duration_ns is None else plan.duration_ns
    turns = Turns()
    with rack_shown(rack, plan, stream, turns.turn, turns, display.message, live=False) as shown:
        sends = recorder is not None or shown is not None
        try:
            with turns.turn():
                if sends:
                    stream.begin()
                if plan.duration_ns is None:
                    display.message(_NO_END)
                rack.start([*state.settings, *plan.settings], stimulation.begin)
            while not stop.requested and rack.now_ns < end_ns and _goes_on(rack, plan, stimulation):
                if turns.halted:
                    time.sleep(_LOOK_S)
                    continue
                with turns.turn():
                    rack.scheduler.run_until(min(rack.now_ns + SLICE_NS, end_ns))
                    for text in [*state.news(), *stimulation.news()]:
                        display.message(text)
                    display.printed()
                    display.update(rack.now_ns)
                    recording.report_failure()
        finally:
            with turns.turn():
                if shown is not None:
                    shown.over = "the run is over"
                if sends:
                    stream.end()
                if recorder is not None:
                    recorder.close()
        state.end()
        for text in state.news():
            display.message(text)
        recording.report_failure()
        display.finish()
        recording.report_end(plan.record)
        failed = recording.failed or state.failed or stimulation.refused > 0
        code = conclude(rack, plan, report_at_end(rack, stimulation), failed=failed)
        if shown is not None and not stop.requested:
            display.message("the panel shows how it ended, until Ctrl-C")
            while not stop.requested:
                time.sleep(_LOOK_S)
    return code


def _goes_on(rack: Rack, plan: RunPlan, stimulation: StimuliPlayer) -> bool:
    """Whether something can still happen: with stimuli a run lasts its duration, or until the last of them.

    So stimuli can put a stopped rack into RUN again; without stimuli nothing would (decision).
    """
    if rack.stop_reason is None or not stimulation.is_over:
        return True
    return plan.stimuli is not None and plan.duration_ns is not None


MOST_RATE = 1000.0
"""Fastest ``--rate`` (decision: as that of `automax play`)."""
WITHOUT_ROS = "or run with --simulated, which needs no ROS"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax run``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file")
    parser.add_argument(
        "--simulated", action="store_true", help="simulated time, as fast as the machine can, without ROS"
    )
    parser.add_argument(
        "--distributed",
        action="store_true",
        help="on the wall clock: each module in a process of its own (docs/distributed.md)",
    )
    parser.add_argument(
        "--no-restart",
        dest="restart",
        action="store_false",
        help="with --distributed: do not start a process again that has died",
    )
    parser.add_argument(
        "--no-autostart",
        dest="autostart",
        action="store_false",
        help="on the wall clock: wait unconfigured for a ROS 2 lifecycle manager, which configures and activates the "
        "node `rack` (docs/ros.md)",
    )
    parser.add_argument(
        "--ros",
        action="store_true",
        dest="with_ros",
        help="with --simulated: with ROS nodes nevertheless, which publish /clock and may be written",
    )
    parser.add_argument(
        "--rate",
        metavar="R",
        help="with --simulated --ros: R times as fast as the wall clock (default: as fast as possible)",
    )
    parser.add_argument(
        "--duration", type=seconds_above_0, metavar="S", help="seconds of rack time after which the run ends"
    )
    parser.add_argument("--record", type=Path, metavar="DIR", help="record the run into a new rosbag2 folder")
    add_set_argument(parser, tunables=True)
    add_record_arguments(parser)
    add_panel_arguments(parser, optional=True)
    add_shared_arguments(
        parser,
        "from run to run (default on the wall clock: .automax/RACK next to the rack file; simulated: nowhere)",
        stimuli=" (docs/stimuli.md)",
        report=": tasks, commons, forces, operations",
    )


def add_shared_arguments(parser: argparse.ArgumentParser, state: str, *, stimuli: str, report: str) -> None:
    """Add the options that `automax run` and `automax node` share; the texts end the help of those they name."""
    add_watch_argument(parser, "those of the rack file's `watch`")
    state = f"keep what outlives a power cycle in this folder {state}"
    parser.add_argument("--state", type=_folder, metavar="DIR", help=state)
    stimuli = f"play this stimuli file, by rack time{stimuli}"
    parser.add_argument("--stimuli", type=Path, metavar="FILE", help=stimuli)
    parser.add_argument("--report", type=Path, metavar="FILE.json", help=f"write how the run ended{report}")
    add_native_arguments(parser)
    add_outside_argument(parser)
    add_ros_arguments(parser)


def _folder(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("names no folder")
    return Path(text)


def run(arguments: argparse.Namespace) -> int:
    """Run the rack; 0 after a clean end, 1 where it has errors or was stopped by a fault.

    A simulated run without ROS that a signal ends before it begins returns the signal's code: after 0 a script would
    read the report of an earlier run as this one's.
    """
    if arguments.simulated and arguments.record is not None and arguments.duration is None:
        raise UsageError("--record of a simulated run needs --duration: without an end it fills the disk")
    _check_time(arguments)
    if arguments.simulated and arguments.distributed:
        raise UsageError("--distributed needs the wall clock, by which its processes agree", "leave out --simulated")
    if not (arguments.distributed or arguments.restart):
        raise UsageError("--no-restart belongs to --distributed")
    if not arguments.autostart and (arguments.simulated or arguments.distributed):
        raise UsageError("--no-autostart: a lifecycle manager starts racks on the wall clock, in one process")
    if arguments.panel and arguments.distributed:
        raise UsageError("--panel shows a rack in one process", "join this one: automax panel RACK")
    wanted_panel(arguments)
    check_files(arguments)
    with stop_signals() as stop, held_for_writing(arguments.report):
        if arguments.with_ros or not arguments.simulated:
            prepare_ros(arguments, WITHOUT_ROS)
        try:
            return _run(arguments, stop)
        except WorkInterrupted:
            if arguments.with_ros or not arguments.simulated:
                return 0
            print("automax run: ended before its first scan; nothing was recorded or reported", file=sys.stderr)
            return stop.code
        except RackError as error:
            return print_refused("run", error)
        except StimuliRefused:
            return 1
        except (BagError, RetentionFault) as error:
            print(error, file=sys.stderr)
            return 2


def _run(arguments: argparse.Namespace, stop: StopRequest) -> int:
    if not arguments.autostart:
        return _run_managed(arguments, stop)
    with stop.cut_short():
        config = config_of(arguments.config, allow_outside=arguments.allow_outside)
    if config is None:
        return 1
    plan = _plan(arguments, config)
    if arguments.simulated and not arguments.with_ros:
        return run_simulated(plan, stop)
    if arguments.distributed:
        from automax_ros.cli.run.distributed import run_distributed
        from automax_ros.ros.base.node import follows_clock

        if follows_clock(plan.ros, plan.config.namespace):
            raise UsageError(
                "use_sim_time: processes of a distributed rack agree by the wall clock", "run it without --distributed"
            )
        return run_distributed(plan, arguments, stop)
    from automax_ros.cli.run.lifecycle import LifecycleRun, run_managed

    return run_managed(LifecycleRun(plan.config.namespace, lambda: _read(arguments, stop), plan, plan.ros), stop)


def _run_managed(arguments: argparse.Namespace, stop: StopRequest) -> int:
    from automax_ros.cli.run.lifecycle import LifecycleRun, run_managed

    ros = ros_arguments(arguments)
    with stop.cut_short():
        space = ros.placed(namespace_of(arguments.config))
    return run_managed(LifecycleRun(space, lambda: _read(arguments, stop), ros=ros), stop)


def _read(arguments: argparse.Namespace, stop: StopRequest) -> RunPlan:
    with stop.cut_short():
        return _plan(arguments, usable_config(arguments.config, allow_outside=arguments.allow_outside))


def _plan(arguments: argparse.Namespace, config: RackConfig) -> RunPlan:
    simulated = SimulatedTime(_rate(arguments.rate)) if arguments.with_ros else None
    ros = NO_ARGUMENTS if arguments.simulated and not arguments.with_ros else ros_arguments(arguments)
    if simulated is not None:  # a rack that publishes /clock does not follow it
        ros = ros.without("use_sim_time")
    config = replace(config, namespace=ros.placed(config.namespace))
    settings, tunings = split_settings(config, arguments.settings)
    if tunings and arguments.distributed:
        text = f"{tunings[0].task}.{bare_name(tunings[0].name)}"
        raise UsageError(f"--set: {text} is a tunable", f"of a distributed rack: --ros-args -p {text}:=VALUE")
    return RunPlan(
        config,
        arguments.duration,
        arguments.record,
        recording_options(arguments, config),
        tuple(settings),
        watched_commons(config, arguments.watch),
        arguments.state,
        arguments.stimuli,
        arguments.report,
        arguments.allow_outside,
        ros,
        simulated=simulated,
        tunings=tuple(tunings),
        native=native_forms(arguments, arguments.duration, wall_clock=not arguments.simulated),
        verbose=arguments.verbose,
        panel=wanted_panel(arguments),
    )


def _check_time(arguments: argparse.Namespace) -> None:
    """Refuse options that would have no effect on this run, in simulated time or on the wall clock."""
    if arguments.with_ros and not arguments.simulated:
        raise UsageError("--ros belongs to --simulated", "on the wall clock the rack has ROS nodes anyway")
    if arguments.rate is not None and not arguments.with_ros:
        raise UsageError("--rate belongs to --simulated --ros", "without ROS time passes as fast as possible")
    if arguments.simulated and not arguments.with_ros and arguments.ros is not None and arguments.ros.given:
        raise UsageError("--ros-args: with --simulated nothing of ROS is started", "add --ros, or leave them out")


def _rate(text: str | None) -> float | None:
    rate = None if text is None else option_number("--rate", text, 0, MOST_RATE)
    if rate == 0:
        raise UsageError("--rate: at 0 no time would pass")
    return rate


def check_files(arguments: argparse.Namespace) -> None:
    """Refuse a report that cannot be written or would overwrite an input, and a state folder that cannot be used."""
    if arguments.state is not None:
        require_folder("--state", arguments.state)
    if arguments.report is not None:
        require_writable(arguments.report)
        read = {"CONFIG": arguments.config, "--stimuli": arguments.stimuli}
        given = {key: path for key, path in read.items() if path is not None}
        require_different_files(given, {"--report": arguments.report})


def watched_commons(config: RackConfig, texts: list[str] | None) -> tuple[CommonElement, ...] | None:
    """Return the variables that ``--watch`` names, None without it.

    Raises:
        UsageError: the rack has no such variable.
    """
    with naming("--watch"):
        return None if texts is None else tuple(watched(config, watch_list(texts)))
