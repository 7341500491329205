"""The node ``operator``: the services by which a rack is operated, only where its YAML says ``operator: true``.

Services, all in the rack's namespace: ``run``, ``stop``, ``clear`` (also ``clear_errors``), ``delete``
(automax_msgs/OperateTask), ``run_all``, ``stop_all``, ``pause``, ``resume`` (std_srvs/Trigger), ``step``
(automax_msgs/Step), ``power`` (automax_msgs/Power), ``set``, ``force``, ``tune`` (automax_msgs/SetValue), ``unforce``
(automax_msgs/Unforce), ``module``, ``plant`` (automax_msgs/OperateControl), ``reload`` (automax_msgs/Reload), ``get``,
``forces`` (automax_msgs/ReadValues), ``errors`` (automax_msgs/ReadErrors), ``tasks`` (automax_msgs/ReadTasks),
``status`` (automax_msgs/ReadStatus).

A request is executed between two scans; the response says whether it succeeded, if not, why, and what is true now.
Refusals are counted in the rack's health.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

from automax_msgs.msg import LoggedError, TaskInfo
from automax_msgs.srv import (
    OperateControl,
    OperateTask,
    Power,
    ReadErrors,
    ReadStatus,
    ReadTasks,
    ReadValues,
    Reload,
    SetValue,
    Step,
    Unforce,
)
from std_srvs.srv import Trigger

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S, seconds_ns
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.faults import DriveTrips, displays_of
from automax_ros.rack.operator.halting import Halting
from automax_ros.rack.operator.requests import OperatorRequests, Reading
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.clients.recorded_run import ALONE_NS, racks_of
from automax_ros.ros.distributed.forwarding import RequestForwarder
from automax_ros.ros.intake.service_requests import DeferredResponse, allow_deferred
from automax_ros.ros.nodes.reloading import Reloading
from automax_ros.ros.nodes.tables import status_of_task, task_fields
from automax_ros.runtime.tasks.task import Status

PLACES = ("first", "second", "last")
"""The entries that the error log keeps."""
MOST_TOLD = 300
"""Most characters of an unforeseen error in a response."""
Act = Callable[[Any, Any], object]
"""Executes a request and may fill in the response; raises OperationRefused."""
Tell = Callable[[Any, Any], None]
"""Fills in what is true now, after a request was executed or refused."""


def _nothing(_: Any, __: Any) -> None:
    """Fill in nothing."""


class OperatorServices:
    """The operator's services on one node. Call ``close`` when it leaves the graph.

    ``forward_by``, once set, forwards requests that concern other processes of a distributed rack.
    """

    def __init__(self, node: ModuleNode, name_of: Callable[[str], str] = str) -> None:
        """Create the services; ``name_of`` returns the full name of one."""
        self._node, self._site, self._rack = node, node.site, node.site.rack
        self._name_of = name_of
        self.forward_by: RequestForwarder | None = None
        orders = self._orders = OperatorRequests(self._rack)
        self._halting = Halting(self._rack, self._site.pacer)
        self._trips = DriveTrips(self._rack)
        self._begun_ns = time.monotonic_ns()
        self._serve(OperateTask, "run", lambda request, _: orders.run(request.task), self._task_now)
        self._serve(OperateTask, "stop", lambda request, _: orders.stop(request.task), self._task_now)
        self._serve(OperateTask, "delete", lambda request, _: orders.delete(request.task), self._task_now)
        for name in ("clear", "clear_errors"):
            self._serve(OperateTask, name, lambda request, _: orders.clear_errors(request.task), self._task_now)
        self._run_all = self._serve(Trigger, "run_all", lambda *_: orders.run_all(), self._running_now)
        self._serve(Trigger, "stop_all", lambda *_: orders.stop_all(), self._running_now)
        self._serve(Trigger, "pause", lambda *_: self._halting.halt(), self._time_now)
        self._serve(Trigger, "resume", lambda *_: self._halting.resume(), self._time_now)
        self._serve(Step, "step", self._step, self._stepped_now)
        self._serve(Power, "power", self._power, self._powered_now)
        for name, act in (("set", orders.set), ("force", orders.force), ("tune", orders.tune)):
            self._serve(SetValue, name, partial(self._give, act), self._value_now)
        self._serve(Unforce, "unforce", lambda request, _: orders.unforce(list(request.names)), self._forced_now)
        self._serve(OperateControl, "module", lambda request, _: orders.module(*_moved(request)))
        self._serve(OperateControl, "plant", lambda request, _: orders.plant(*_moved(request)))
        self._reloading = Reloading(node, orders, self._reloaded)
        self._create(Reload, "reload", self._reloading.answer)
        self._serve(ReadValues, "get", lambda request, response: _fill(response, orders.read(list(request.names))))
        self._serve(ReadValues, "forces", lambda _, response: _fill(response, _readings(orders.forces())))
        self._serve(ReadErrors, "errors", self._errors)
        self._serve(ReadTasks, "tasks", self._tasks)
        self._serve(ReadStatus, "status", self._status)

    def close(self) -> None:
        """End; a source that is being compiled is not installed."""
        self._reloading.close()

    def run_everywhere(self, done: Callable[[str], None]) -> None:
        """Put all tasks into RUN, in all processes of the rack; ``done`` gets the reason of a refusal, else ""."""

        def respond(response: Any) -> None:
            done("" if response.success else response.message or "refused")

        answer = self._run_all(Trigger.Request(), Trigger.Response())
        if isinstance(answer, DeferredResponse):
            answer.begin(respond)
        else:
            respond(answer)

    def _serve(self, kind: Any, name: str, act: Act, tell: Tell = _nothing) -> Callable[[Any, Any], Any]:
        """Create a service, and return its callback, which returns a response or ``DeferredResponse``."""

        def answered(request: Any, response: Any) -> Any:
            with self._site.between_scans():
                error: Exception | None = None
                try:
                    act(request, response)
                except Exception as raised:
                    error = raised
                return self._concluded(name, request, response, error, tell)

        return self._create(kind, name, answered)

    def _create(self, kind: Any, name: str, answered: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        def routed(request: Any, response: Any) -> Any:
            if self.forward_by is None:
                return answered(request, response)
            with self._site.between_scans():
                return self.forward_by.answer(name, kind, request, response, answered)

        allow_deferred(self._node.create_service(kind, self._name_of(name), routed))
        return routed

    def _concluded(self, name: str, request: Any, response: Any, error: Exception | None, tell: Tell) -> Any:
        """Return a response with the outcome of the request, and what is true now."""
        reason = "" if error is None else str(error)
        if error is not None and not isinstance(error, OperationRefused):
            reason = f"{type(error).__name__}: {reason[:MOST_TOLD]}"
            self._node.guard.report(f"a request to {name} was refused", error)
        elif error is not None:
            self._node.guard.refused(name, reason, name)
        for field, value in (
            ("ok", error is None),
            ("reason", reason),
            ("success", error is None),
            ("message", reason),
        ):
            if hasattr(response, field):
                setattr(response, field, value)
        with suppress(OperationRefused):
            tell(request, response)
        return response

    def _reloaded(self, request: Any, response: Any, error: Exception | None) -> Any:
        return self._concluded("reload", request, response, error, self._task_now)

    # What is true now

    def _task_now(self, request: Any, response: Any) -> None:
        """Fill in the status of a task; nothing if the request names none, or an unknown one."""
        if request.task.strip():
            (name,) = self._orders.tasks_named(request.task)
            response.status = status_of_task(self._rack, self._rack.task(name))

    def _running_now(self, _: Any, response: Any) -> None:
        running = sum(task.status is Status.RUNNING for task in self._rack.tasks)
        response.message = response.message or f"{running} of {count_of(len(self._rack.tasks), 'task')} run"

    def _time_now(self, _: Any, response: Any) -> None:
        stands = "stands still" if self._halting.halted else "goes on"
        response.message = response.message or f"rack time {stands} at {self._rack.now_ns / NS_PER_S:.9g} s"

    def _stepped_now(self, _: Any, response: Any) -> None:
        response.time_s = self._rack.now_ns / NS_PER_S

    def _powered_now(self, _: Any, response: Any) -> None:
        response.powered = self._rack.operations.powered

    def _give(self, act: Callable[[str, str], None], request: Any, response: Any) -> None:
        """Write a variable; the response contains its previous value, too."""
        with suppress(OperationRefused):
            response.before = self._held(request.name)
        act(request.name, request.value)

    def _held(self, name: str) -> str:
        ((_, value),) = self._orders.get([name])
        return value

    def _value_now(self, request: Any, response: Any) -> None:
        """Fill in the value of a variable; nothing if the request names none, or an unknown one."""
        if request.name.strip():
            response.now = self._held(request.name)

    def _forced_now(self, _: Any, response: Any) -> None:
        response.forced = [name for name, _ in self._orders.forces()]

    # Services that need more than one operation

    def _step(self, request: Any, response: Any) -> None:
        try:
            until_ns = seconds_ns(request.until_s) if request.what == "until" else 0
        except ValueError as error:
            raise OperationRefused(str(error)) from error
        task = self._orders.task_word(request.task)
        stepped = self._halting.step(request.what, task, request.count or 1, until_ns)
        response.why, response.scans = stepped.why, stepped.scans

    def _power(self, request: Any, _: Any) -> None:
        self._orders.power(request.what, request.off_for_s, without_battery=request.without_battery)

    def _errors(self, request: Any, response: Any) -> None:
        for name in self._orders.tasks_named(request.task):
            for place, entry in zip(PLACES, self._rack.task(name).errors.entries, strict=False):
                problem = PROBLEMS.get(entry.problem)
                response.errors.append(
                    LoggedError(
                        task=name,
                        place=place,
                        line=entry.line,
                        code=entry.problem,
                        text=problem.title if problem else "unknown problem",
                        scan=entry.scan,
                    )
                )

    def _tasks(self, _: Any, response: Any) -> None:
        response.tasks = [
            TaskInfo(**task_fields(self._rack, module, item))
            for module in self._rack.task_modules
            for item in module.tasks
        ]

    def _status(self, _: Any, response: Any) -> None:
        rack, operations = self._rack, self._rack.operations
        response.rack, response.run_id = rack.config.name, self._site.stream.run_id
        response.time_s, response.powered = rack.now_ns / NS_PER_S, operations.powered
        response.halted = self._halting.halted
        cause = operations.stopped
        response.stopped = cause is not None
        if cause is not None:
            response.stopped_at_s = cause.time_ns / NS_PER_S
            response.stopped_code, response.stopped_task = cause.code or "", cause.task
            response.stopped_reason = cause.reason
        response.tasks = len(rack.tasks)
        response.running = sum(task.status is Status.RUNNING for task in rack.tasks)
        response.ended = sum(task.is_done for task in rack.tasks)
        response.forced = len(rack.forces())
        displays = displays_of(rack)
        response.display_modules = [item.module for item in displays]
        response.display_codes = [item.code for item in displays]
        response.display_meanings = [item.meaning for item in displays]
        response.drive_faults = self._trips.lines()
        response.racks = self._racks()

    def _racks(self) -> int:
        """Return how many racks of this name are seen; 0 until the graph was watched long enough (decision: 1 s)."""
        if time.monotonic_ns() - self._begun_ns < ALONE_NS:
            return 0
        return len(racks_of(self._node, self._node.get_namespace()))


def _moved(request: Any) -> tuple[str, str, str]:
    return request.name, request.control, request.value


def _readings(values: list[tuple[str, str]]) -> list[Reading]:
    return [Reading(name, text) for name, text in values]


def _fill(response: Any, values: list[Reading]) -> None:
    response.found = [item.name for item in values]
    response.values = [item.value for item in values]
    response.shown = [item.shown for item in values]


class OperatorNode(ModuleNode):
    """Serves the operator of one rack."""

    def __init__(self, site: RackContext) -> None:
        """Create the services."""
        super().__init__(site, "operator")
        self.operator_services = OperatorServices(self)

    def destroy_node(self) -> None:
        """Leave the graph; a source that is being compiled is not installed."""
        self.operator_services.close()
        super().destroy_node()
