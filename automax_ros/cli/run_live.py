"""A run on the wall clock, with the rack's modules as ROS 2 nodes in this process."""

from __future__ import annotations

import gc
import sys
import time

from automax_ros.bags.recorder import Recorder
from automax_ros.cli.recording_watch import DiskSync, RecordingWatch, live_options
from automax_ros.cli.run_plan import RunPlan, conclude, report_at_end, warn
from automax_ros.cli.signals import StopRequest
from automax_ros.cli.state_keeping import StateKeeping
from automax_ros.cli.status import StatusDisplay
from automax_ros.cli.stimuli_file import stimulation as stimulation_of
from automax_ros.core.ticks import NS_PER_S
from automax_ros.nodes.bus import Seating
from automax_ros.nodes.discovery_range import range_text
from automax_ros.nodes.launcher import LiveRack
from automax_ros.nodes.lock import RackLock, domain_id
from automax_ros.rack.operation_log import OperationLog
from automax_ros.rack.rack import Rack
from automax_ros.rack.standing import StopCause
from automax_ros.rack.stimuli.player import Stimulation

SWITCH_S = 0.0005
"""How long a thread that saves or sends may keep the interpreter from the scans, s (5 ms is Python's own)."""
PATIENCE_NS = 5 * NS_PER_S
"""After this time a process says for which others it waits (decision)."""
_NEVER_NS = 1 << 63


def run_live(plan: RunPlan, stop: StopRequest) -> int:
    """Run until the duration has passed or a stop is requested; return the exit code."""
    domain = domain_id()
    with RackLock(plan.config.namespace, domain, None if plan.seat is None else plan.seat.seat.name):
        return _run_locked(plan, stop, domain)


def _run_locked(plan: RunPlan, stop: StopRequest, domain: int) -> int:
    rack = Rack(plan.config, stopwatch=time.monotonic_ns, local=plan.slots)
    if not plan.is_watched:
        warn(rack)
    stimulation = stimulation_of(rack, plan.stimuli, allow_outside=plan.allow_outside)
    state = StateKeeping(rack, plan.state_folder)
    live = LiveRack(rack, plan.ros, _seating(plan, stimulation))
    services = OperationLog(lambda: stimulation.is_acting)
    rack.observers.add(services)
    recorder: Recorder | None = None
    sync: DiskSync | None = None
    display = StatusDisplay(rack, plan.watch, live=True, health=live.health, screen=plan.screen)
    recording = RecordingWatch(None, display)
    told: StopCause | None = None

    def on_idle(now_ns: int) -> None:
        nonlocal told
        live.stopping = stop.requested
        display.update(now_ns)
        cause = rack.operations.stopped
        if cause is not None and cause != told:
            told = cause
            display.message(f"{cause.title}: {cause.reason}")
        state.update(now_ns)
        for text in [*state.news(), *stimulation.news()]:
            display.message(text)
        recording.flush(now_ns)
        recording.tell()

    switch_s = sys.getswitchinterval()
    try:
        sys.setswitchinterval(SWITCH_S)
        if plan.record is not None:
            recorder = Recorder(rack, live.stream, plan.record, live_options(plan.recording))
            recording = RecordingWatch(recorder, display)
            sync = DiskSync(recorder.sync)
        # What is there now stays: a look of the collector at all of it would hold up scans by tens of ms.
        gc.collect()
        gc.freeze()
        _open(plan, live, domain, display)
        if _all_are_there(live, display, stop):
            live.start([*state.settings, *plan.settings])
            stimulation.begin(joining=live.is_joining)
            live.run(plan.duration_ns, on_idle)
        report = report_at_end(rack, stimulation, services.happened)
    finally:
        gc.unfreeze()
        sys.setswitchinterval(switch_s)
        state.freeze()
        try:
            live.close()
        finally:
            if sync is not None:
                sync.stop()
            if recorder is not None:
                recorder.close()
                recorder.sync_at_end()
    state.end()
    for text in state.news():
        display.message(text)
    recording.tell()
    display.finish(plan.record, complete=not recording.failed)
    failed = recording.failed or (state.failed and plan.state is not None) or stimulation.refused > 0
    return conclude(rack, plan, report, failed=failed)


def _seating(plan: RunPlan, stimulation: Stimulation) -> Seating | None:
    if plan.seat is None:
        return None
    slots = [seat.slots for seat in plan.seat.seats]
    return Seating(slots, plan.seat.run_id, lambda: stimulation.is_common)


def _all_are_there(live: LiveRack, display: StatusDisplay, stop: StopRequest) -> bool:
    """Wait for the other processes of a distributed rack; FALSE where a stop is requested first."""
    told_ns = time.monotonic_ns() + PATIENCE_NS

    def look() -> bool:
        nonlocal told_ns
        if live.missing and time.monotonic_ns() > told_ns:
            told_ns = _NEVER_NS
            display.message(f"waiting for {', '.join(live.missing)}")
        return stop.requested

    return live.await_others(look)


def _open(plan: RunPlan, live: LiveRack, domain: int, display: StatusDisplay) -> None:
    if not plan.is_watched:
        display.message(_opening(plan, live.rack, domain))
    for text in live.notes:
        display.message(f"warning: {text}")


def _opening(plan: RunPlan, rack: Rack, domain: int) -> str:
    config = rack.config
    modules = ", ".join(
        f"{module.config.model} in slot {module.config.slot} ({' '.join(item.task.name for item in module.tasks)})"
        for module in rack.task_modules
    )
    head = f"rack {config.name}: {modules}"
    if plan.seat is not None:
        head = f"{plan.seat.seat.words} of rack {config.name}"
    return (
        f"{head}; {len(config.declared)} common variables\n"
        f"ROS 2 namespace /{config.namespace} in domain {domain}, seen by {range_text()}; Ctrl-C ends the run"
    )
