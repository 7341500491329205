"""A run on the wall clock, with the rack's modules as ROS 2 nodes in this process."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from automax_ros.cli.options.stimuli import StimuliRefused
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.cli.output.signals import StopRequest, WorkInterrupted
from automax_ros.cli.run.live import LiveSession
from automax_ros.cli.run.plan import RunPlan
from automax_ros.core.diagnostics import render
from automax_ros.core.user_error import UserError
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.tasks.installation import RackError
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.ros.base.lifecycle import ACTIVATE, CLEANUP, CONFIGURE, FINALIZED, SHUTDOWN, Pending, TransitionRefused
from automax_ros.ros.base.module_lifecycle import NOT_OPERATED
from automax_ros.ros.nodes.rack import RackNode
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.discovery import range_text
from automax_ros.ros.setup.leaving import ended_within
from automax_ros.ros.setup.lock import InstanceLock, domain_id
from automax_ros.ros.setup.process import RosProcess
from automax_ros.runtime.health import Health

_LOOK_S = 0.05
"""Longest wait while no rack runs."""
_MOST_SHOWN = 100
"""Most findings of a file that are logged."""
_FAULTS = (RackError, StimuliRefused, BagError, UserError)
"""Errors that keep a rack from being configured and that the user can correct."""
_PARTS_END = "the rack runs in several processes: they are started and ended by `automax run --distributed`"


@dataclass(frozen=True)
class LifecycleRun:
    """A managed rack: its namespace in the graph, and how to read its plan.

    ``plan`` is the plan of the first configuration if it has been read already; ``read`` reads the files (again).
    """

    namespace: str
    read: Callable[[], RunPlan]
    plan: RunPlan | None = None
    ros: RosArguments = NO_ARGUMENTS


class LifecycleRunner:
    """Carries out the transitions of one rack's node, and runs the rack in between."""

    def __init__(self, managed: LifecycleRun, process: RosProcess, stop: StopRequest, domain: int) -> None:
        self._managed, self._process, self._stop, self._domain = managed, process, stop, domain
        self._asked: deque[Callable[[], None]] = deque()
        self._session: LiveSession | None = None
        self._ended = self._was_active = self._is_starting = self._broken = False
        self._sessions = self._code = 0
        self._node = RackNode(managed.namespace, process.context, Health(), self, self._asked.append, managed.ros)
        process.executor.add_node(self._node)
        process.spin(self._node.guard)

    @property
    def code(self) -> int:
        """The exit code: how the last run ended."""
        return 1 if self._broken else self._code

    def autostart(self) -> None:
        """Configure and activate.

        Raises:
            RackError, StimuliRefused, BagError, UserError: the rack cannot be configured or activated.
        """
        self._is_starting = True
        for transition in (CONFIGURE, ACTIVATE):
            if not self._stop.requested:
                self._node.change(transition, self._raise_start_error)
        self._is_starting = False

    def run(self) -> None:
        """Run the rack and carry out transitions until a signal, the end of the duration or a shutdown."""
        while not (self._stop.requested or self._ended):
            if self._node.state == FINALIZED:  # everything has failed, even stopping
                self._broken = True
                return
            while self._asked:
                self._asked.popleft()()
            if self._session is None or not self._session.has_begun:
                time.sleep(_LOOK_S)
                continue
            session = self._session
            session.run(self._is_wanted)
            if session.is_over:
                self._ended = True

    def finish(self) -> None:
        """End the run: save, record and report what it has to."""
        if self._session is not None:
            self._code = self._session.finish()

    def leave(self) -> None:
        """Remove all nodes from the graph."""
        self._leave_session()
        with self._process.resting():
            self._process.executor.remove_node(self._node)
            self._node.destroy_node()

    # Duties

    def refusal(self, transition: str) -> str | None:
        """Without an operator only a rack that was never active may be managed (decision: else nothing could start it).

        A distributed rack is configured and ended by starting and ending its processes (decision).
        """
        plan = None if self._session is None else self._session.plan
        if plan is None:
            return None
        if plan.process_plan is not None and transition in (CLEANUP, SHUTDOWN):
            return _PARTS_END
        return NOT_OPERATED if self._was_active and not plan.config.operator else None

    def configure(self) -> None:
        """Read the files, compile the tasks and create the nodes of the modules."""
        try:
            self._configure()
        except WorkInterrupted as cut:
            raise TransitionRefused("the program ends") from cut
        except _FAULTS as fault:
            self._report_fault(fault)
            raise TransitionRefused(str(fault) or "the stimuli have errors") from fault

    def activate(self) -> Pending | None:
        """Start the rack, or put all of its tasks into RUN again."""
        session = self._expect_session()
        if session.has_begun:
            return self._operate(session.live.nodes.activate)
        self._start(session)
        self._was_active = True
        return None

    def deactivate(self) -> None:
        """STOP ALL."""
        self._operate(self._expect_session().live.nodes.deactivate)

    def cleanup(self) -> None:
        """Remove the nodes of the modules from the graph; save non-volatile values and finish the recording."""
        self._end_session()

    def shutdown(self) -> None:
        """End the program as SIGTERM does."""
        self._ended = True

    def fail(self) -> None:
        """STOP ALL, and remove the nodes of the modules from the graph."""
        session = self._session
        if session is not None and session.rack.operations.powered:
            session.rack.operations.stop_all("a transition of the node rack failed")
        self._end_session()

    def _configure(self) -> None:
        plan = self._managed.plan if self._sessions == 0 and self._managed.plan is not None else self._managed.read()
        if plan.config.namespace != self._managed.namespace:
            now, before = plan.config.namespace, self._managed.namespace
            raise RackError(f"the rack is called {now} now, this is the node of {before}: start the program again")
        plan = replace(plan, record=_numbered_folder(plan.record, self._sessions + 1))
        self._session = LiveSession(plan, self._process, self._node, self._stop, self._domain)
        self._sessions += 1

    def _start(self, session: LiveSession) -> None:
        try:
            if not session.start(self._stop):
                raise TransitionRefused("the program ends")
        except UserError as fault:
            raise TransitionRefused(str(fault)) from fault

    def _end_session(self) -> None:
        try:
            self.finish()
        finally:
            self._leave_session()

    def _leave_session(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            session.leave()

    def _is_wanted(self) -> bool:
        return self._stop.requested or self._ended or bool(self._asked)

    def _raise_start_error(self, error: Exception | None) -> None:
        """Raise the error that prevented the autostart, unless a signal caused it."""
        if error is not None and not self._stop.requested:
            raise error.__cause__ or error

    def _expect_session(self) -> LiveSession:
        assert self._session is not None, "only a configured node has this transition"
        return self._session

    def _operate(self, operation: Callable[[], Pending | None]) -> Pending | None:
        try:
            return operation()
        except OperationRefused as refused:
            raise TransitionRefused(str(refused)) from refused

    def _report_fault(self, fault: Exception) -> None:
        """Log why the rack cannot be configured; at an autostart the command prints it as it ends."""
        findings = getattr(fault, "findings", ())
        if not self._is_starting:
            for source, diagnostics in findings:
                print_diagnostics(diagnostics, source, sys.stderr)
            if str(fault):
                print(f"automax run: {fault}", file=sys.stderr, flush=True)
        found = [(item, where) for where, items in findings for item in items]
        for item, where in found[:_MOST_SHOWN]:
            self._node.get_logger().error(render(item, where))


def _numbered_folder(folder: Path | None, number: int) -> Path | None:
    """Return the folder in which the nth run of a program is recorded: DIR, DIR_2, DIR_3 (decision)."""
    if folder is None or number == 1:
        return folder
    return folder.with_name(f"{folder.name}_{number}")


def run_live(plan: RunPlan, stop: StopRequest) -> int:
    """Run a plan, whose files are read once, until its duration has passed or a stop is requested.

    Returns the exit code. Raises the errors of ``LiveSession``.
    """
    if plan.process_plan is None or plan.process_plan.process.holds_common_memory:
        return run_managed(LifecycleRun(plan.config.namespace, lambda: plan, plan, plan.ros), stop)
    domain = domain_id()
    with InstanceLock(plan.config.namespace, domain, plan.process_plan.process.name):
        return _run_part(plan, stop, domain)


def run_managed(managed: LifecycleRun, stop: StopRequest) -> int:
    """Run a rack as a managed node: at once if it has a plan, else when a lifecycle manager configures it.

    Returns the exit code. Raises the errors of ``LiveSession`` where the rack starts at once.
    """
    domain, plan = domain_id(), managed.plan
    process_name = None if plan is None or plan.process_plan is None else plan.process_plan.process.name
    with InstanceLock(managed.namespace, domain, process_name):
        process, run = RosProcess(managed.ros), None
        try:
            run = LifecycleRunner(managed, process, stop, domain)
            _run_managed(run, _waiting(managed, domain))
        finally:
            with ended_within(0 if run is None else run.code):
                if run is not None:
                    run.leave()
                process.close()
        return run.code


def _run_managed(run: LifecycleRunner, waiting: str | None) -> None:
    try:
        if waiting is None:
            run.autostart()
        else:
            print(waiting, flush=True)
        run.run()
    finally:
        run.finish()


def _run_part(plan: RunPlan, stop: StopRequest, domain: int) -> int:
    """Run a process of a distributed rack that has no common memory, and therefore no node ``rack``."""
    process, session, code = RosProcess(plan.ros), None, 0
    try:
        session = LiveSession(plan, process, None, stop, domain)
        process.spin(session.live.nodes.nodes[0].guard)
        try:
            if session.start(stop):
                session.run(lambda: stop.requested)
        finally:
            code = session.finish()
        return code
    except WorkInterrupted:
        return 0
    finally:
        with ended_within(code):
            if session is not None:
                session.leave()
            process.close()


def _waiting(managed: LifecycleRun, domain: int) -> str | None:
    """Return the text to print while the rack waits for a lifecycle manager, None where it does not wait."""
    if managed.plan is not None:
        return None
    space = f"/{managed.namespace}"
    return (
        f"rack {space} is unconfigured: `ros2 lifecycle set {space}/rack configure`, then activate\n"
        f"in domain {domain}, seen by {range_text()}; Ctrl-C ends the program"
    )
