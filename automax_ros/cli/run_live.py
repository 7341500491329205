"""A run on the wall clock, with the rack's modules as ROS 2 nodes in this process."""

from __future__ import annotations

from automax_ros.cli.live_session import LiveSession
from automax_ros.cli.managed_run import Managed, ManagedRun
from automax_ros.cli.run_plan import RunPlan
from automax_ros.cli.signals import CutShort, StopRequest
from automax_ros.nodes.discovery_range import range_text
from automax_ros.nodes.lock import RackLock, domain_id
from automax_ros.nodes.process import RosProcess


def run_live(plan: RunPlan, stop: StopRequest) -> int:
    """Run a plan, whose files are read once, until its duration has passed or a stop is requested.

    Returns the exit code. Raises what keeps the rack from running: see ``LiveSession``.
    """
    if plan.seat is None or plan.seat.seat.is_home:
        return run_managed(Managed(plan.config.namespace, lambda: plan, plan, plan.ros), stop)
    domain = domain_id()
    with RackLock(plan.config.namespace, domain, plan.seat.seat.name):
        return _run_part(plan, stop, domain)


def run_managed(managed: Managed, stop: StopRequest) -> int:
    """Run a rack as a managed node: at once where its plan is there, else when a lifecycle manager asks for it.

    Returns the exit code. Raises what keeps the rack from starting at once.
    """
    domain, plan = domain_id(), managed.plan
    seat = None if plan is None or plan.seat is None else plan.seat.seat.name
    with RackLock(managed.namespace, domain, seat):
        process = RosProcess(managed.ros)
        try:
            return _run_managed(ManagedRun(managed, process, stop, domain), _waiting(managed, domain))
        finally:
            process.close()


def _run_managed(run: ManagedRun, waiting: str | None) -> int:
    try:
        if waiting is None:
            run.autostart()
        else:
            print(waiting, flush=True)
        run.run()
    finally:
        run.close()
    return run.code


def _run_part(plan: RunPlan, stop: StopRequest, domain: int) -> int:
    """Run a process of a distributed rack that has no common memory, and so not the node ``rack``."""
    process = RosProcess(plan.ros)
    try:
        session = LiveSession(plan, process, None, stop, domain)
        process.spin(session.live.nodes.nodes[0].guard)
        try:
            if session.start(stop):
                session.run(lambda: stop.requested)
        finally:
            code = session.close()
        return code
    except CutShort:
        return 0
    finally:
        process.close()


def _waiting(managed: Managed, domain: int) -> str | None:
    """Return what is printed where a manager is waited for."""
    if managed.plan is not None:
        return None
    space = f"/{managed.namespace}"
    return (
        f"rack {space} is unconfigured: `ros2 lifecycle set {space}/rack configure`, then activate\n"
        f"in domain {domain}, seen by {range_text()}; Ctrl-C ends the program"
    )
