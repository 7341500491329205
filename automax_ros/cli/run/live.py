"""A rack on the wall clock, from the compilation of its tasks to its summary."""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from automax_ros.cli.options.rack import begin_with
from automax_ros.cli.options.stimuli import stimulation as stimulation_of
from automax_ros.cli.output.signals import StopRequest
from automax_ros.cli.run.plan import RunPlan, conclude, print_forms, report_at_end, warn
from automax_ros.cli.run.saving import DiskSync, RecordingMonitor, SavedState
from automax_ros.cli.run.shown import rack_shown
from automax_ros.cli.run.status import StatusDisplay
from automax_ros.core.ticks import NS_PER_S
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.rack import Rack
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.ros.base.node import follows_clock
from automax_ros.ros.distributed.bus import LEAD_NS, ProcessLayout
from automax_ros.ros.live_rack import LiveRack
from automax_ros.ros.nodes.rack import RackNode
from automax_ros.ros.setup.discovery import range_text
from automax_ros.ros.setup.process import RosProcess
from automax_ros.scenario.report import OperationLog

SWITCH_S = 0.0005
"""Interpreter switch interval, s: how long a thread that saves or sends may delay scans (Python's default is 5 ms)."""

PATIENCE_NS = 5 * NS_PER_S
"""Time after which a process names the processes that it waits for (decision)."""
_NEVER_NS = 1 << 63


class LiveSession:
    """One rack with its nodes: ``start`` it, ``run`` it any number of times, always ``finish`` it and ``leave``."""

    def __init__(
        self, plan: RunPlan, process: RosProcess, manager: RackNode | None, stop: StopRequest, domain: int
    ) -> None:
        """Compile the rack's tasks and create its nodes, its recording and whatever else the plan asks for.

        Raises:
            RackError: a task has errors.
            StimuliRefused: the stimuli have errors, which were printed.
            BagError, RetentionFault: the recording or the state's folder cannot be used.
            WorkInterrupted: a signal came while tasks were compiled.
        """
        self.plan, self._domain = plan, domain
        self.has_begun = False
        with stop.cut_short():
            self.rack = rack = Rack(plan.config, stopwatch=time.monotonic_ns, local=plan.slots, native=plan.native)
            if not plan.is_watched:
                warn(rack)
            print_forms(rack, plan)
            self._stimulation = stimulation_of(rack, plan.stimuli, allow_outside=plan.allow_outside)
        self._state = SavedState(rack, plan.state_folder)
        self._operated = OperationLog(lambda: self._stimulation.is_acting)
        self._reported_cause: StopCause | None = None
        self._ending, self._leaving = ExitStack(), ExitStack()
        try:
            self.live = LiveRack(
                rack, plan.ros, self._process_layout(), process=process, manager=manager, simulated=plan.simulated
            )
            self._leaving.callback(self.live.close)
            self._ending.callback(self.live.finish)
            begin_with(rack, plan.tunings)
            rack.observers.add(self._operated)
            self._display = StatusDisplay(
                rack, plan.shown(rack), live=True, health=self.live.health, screen=plan.screen
            )
            self._recording = RecordingMonitor(self._recorder(), self._display)
        except BaseException:
            self._ending.close()
            self.leave()
            raise

    @property
    def is_over(self) -> bool:
        """Whether the run's duration has passed."""
        return self.plan.duration_ns is not None and self.rack.now_ns >= self.plan.duration_ns

    def start(self, stop: StopRequest) -> bool:
        """Put the rack into RUN for the first time; FALSE where a stop is requested first.

        Raises:
            ProcessAlreadyRuns: another process of a distributed run has the same modules.
        """
        self._ending.callback(sys.setswitchinterval, sys.getswitchinterval())
        sys.setswitchinterval(SWITCH_S)
        # What exists now stays: if the garbage collector went through all of it, scans would be late by tens of ms.
        gc.collect()
        gc.freeze()
        self._ending.callback(gc.unfreeze)
        if not self.plan.is_watched:
            self._display.message(_opening(self.plan, self.rack, self._domain))
        for text in self.live.notes:
            self._display.message(f"warning: {text}")
        nodes = self.live.nodes
        pace = nodes.nodes[0].rack_context.pacer
        self._ending.enter_context(
            rack_shown(
                self.rack, self.plan, self.live.stream, lambda: nodes.lock, pace, self._display.message, live=True
            )
        )
        if not self._all_are_there(stop):
            return False
        self.has_begun = True
        self.live.start([*self._state.settings, *self.plan.settings], self._stimulation.begin)
        if self.live.bus is not None and self.live.bus.joining:
            self._stimulation.begin(joining=True)
        return True

    def run(self, should_stop: Callable[[], bool]) -> None:
        """Run the rack until its duration has passed or ``should_stop``."""

        def on_idle(now_ns: int) -> None:
            self.live.stopping = should_stop()
            self._chores(now_ns)

        self.live.stopping = False
        self.live.run(self.plan.duration_ns, on_idle)

    def finish(self) -> int:
        """Stop the rack, finish its recording, save its state and report; return the run's exit code."""
        report: dict[str, Any] | None = None
        try:
            if self.has_begun:
                report = report_at_end(self.rack, self._stimulation, self._operated.happened)
            self._state.freeze()
        finally:
            self._ending.close()
        if self.has_begun:
            self._report_end()
        self._recording.report_end(self.plan.record)
        unsaved = self._state.failed and self.plan.state is not None
        failed = self._recording.failed or unsaved or self._stimulation.refused > 0
        return conclude(self.rack, self.plan, report, failed=failed)

    def leave(self) -> None:
        """Remove the nodes from the graph: the last thing, which DDS may never end (``ended_within``)."""
        self._leaving.close()

    def _report_end(self) -> None:
        self._state.end()
        for text in self._state.news():
            self._display.message(text)
        self._recording.report_failure()
        self._display.finish()

    def _recorder(self) -> Recorder | None:
        if self.plan.record is None:
            return None
        recorder = Recorder(self.rack, self.live.stream, self.plan.record, self.plan.recording)
        # Closed after the rack, whose last messages it records.
        rack = self._ending.pop_all()
        self._ending.callback(recorder.sync_at_end)
        self._ending.callback(recorder.close)
        self._ending.callback(DiskSync(recorder.sync).stop)
        self._ending.push(rack.__exit__)
        return recorder

    def _process_layout(self) -> ProcessLayout | None:
        plan = self.plan.process_plan
        if plan is None:
            return None
        start_delay_ns = LEAD_NS if plan.start_delay_ns is None else plan.start_delay_ns
        processes = [process.slots for process in plan.processes]
        return ProcessLayout(
            processes, plan.run_id, lambda: self._stimulation.is_common, start_delay_ns, plan.awaits_recorder
        )

    def _all_are_there(self, stop: StopRequest) -> bool:
        """Wait for the other processes of a distributed rack; FALSE where a stop is requested first."""
        report_at_ns = time.monotonic_ns() + PATIENCE_NS

        def should_stop() -> bool:
            nonlocal report_at_ns
            missing = self.live.bus.missing if self.live.bus is not None else []
            if missing and time.monotonic_ns() > report_at_ns:
                report_at_ns = _NEVER_NS
                self._display.message(f"waiting for {', '.join(missing)}")
            return stop.requested

        return self.live.nodes.await_others(should_stop)

    def _chores(self, now_ns: int) -> None:
        self._display.update(now_ns)
        cause = self.rack.operations.stopped
        if cause is not None and cause != self._reported_cause:
            self._display.message(f"{cause.title}: {cause.reason}")
        self._reported_cause = cause
        self._state.update(now_ns)
        for text in [*self._state.news(), *self._stimulation.news()]:
            self._display.message(text)
        self._recording.flush(now_ns)
        self._recording.report_failure()


def _opening(plan: RunPlan, rack: Rack, domain: int) -> str:
    config = rack.config
    modules = ", ".join(
        f"{module.config.model} in slot {module.config.slot} ({' '.join(item.task.name for item in module.tasks)})"
        for module in rack.task_modules
    )
    head = f"rack {config.name}: {modules}"
    if plan.process_plan is not None:
        head = f"{plan.process_plan.process.words} of rack {config.name}"
    return (
        f"{head}; {len(config.declared)} common variables\n"
        f"ROS 2 namespace /{config.namespace} in domain {domain}, seen by {range_text()}; Ctrl-C ends the run"
        f"{_time(plan)}"
    )


def _time(plan: RunPlan) -> str:
    """Return which clock the rack follows, on a separate line; empty for the wall clock."""
    if plan.simulated is not None:
        rate = plan.simulated.rate
        pace = "as fast as possible" if rate is None else f"{rate:g} times the wall clock"
        return f"\nrack time is simulated, {pace}, and published on /clock"
    if follows_clock(plan.ros, plan.config.namespace):
        return "\nrack time follows /clock, and begins with its first message"
    return ""
