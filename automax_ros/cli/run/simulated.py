"""A run in simulated time, without ROS."""

from __future__ import annotations

from automax_ros.cli.options.rack import begin_with
from automax_ros.cli.options.stimuli import stimulation as stimulation_of
from automax_ros.cli.output.signals import StopRequest
from automax_ros.cli.run.plan import RunPlan, conclude, print_forms, report_at_end, warn
from automax_ros.cli.run.saving import RecordingMonitor, SavedState
from automax_ros.cli.run.status import StatusDisplay
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.scenario.stimuli.player import StimuliPlayer

SLICE_NS = 100 * NS_PER_MS
"""Rack time between two checks of signals and updates of the display."""
_ENDLESS_NS = 1 << 62
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
    try:
        if recorder is not None:
            stream.begin()
        if plan.duration_ns is None:
            display.message(_NO_END)
        rack.start([*state.settings, *plan.settings], stimulation.begin)
        while not stop.requested and rack.now_ns < end_ns and _goes_on(rack, plan, stimulation):
            rack.scheduler.run_until(min(rack.now_ns + SLICE_NS, end_ns))
            for text in [*state.news(), *stimulation.news()]:
                display.message(text)
            display.printed()
            display.update(rack.now_ns)
            recording.tell()
    finally:
        if recorder is not None:
            stream.end()
            recorder.close()
    state.end()
    for text in state.news():
        display.message(text)
    recording.tell()
    display.finish(plan.record, complete=not recording.failed)
    failed = recording.failed or state.failed or stimulation.refused > 0
    return conclude(rack, plan, report_at_end(rack, stimulation), failed=failed)


def _goes_on(rack: Rack, plan: RunPlan, stimulation: StimuliPlayer) -> bool:
    """Whether something can still happen: with stimuli a run lasts its duration, or until the last of them.

    So stimuli can put a stopped rack into RUN again; without stimuli nothing would (decision).
    """
    if rack.stop_reason is None or not stimulation.is_over:
        return True
    return plan.stimuli is not None and plan.duration_ns is not None
