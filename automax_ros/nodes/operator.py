"""The node ``operator``: the services by which a rack is operated, only where its YAML says ``operator: true``.

Services, all in the rack's namespace: ``run``, ``stop``, ``clear_errors`` (automax_msgs/OperateTask), ``run_all``,
``stop_all`` (std_srvs/Trigger), ``set``, ``force``, ``tune`` (automax_msgs/SetValue), ``unforce``
(automax_msgs/Unforce), ``module``, ``plant`` (automax_msgs/OperateControl), ``reload`` (automax_msgs/Reload), ``get``,
``forces`` (automax_msgs/ReadValues), ``errors`` (automax_msgs/ReadErrors), ``tasks`` (automax_msgs/ReadTasks),
``status`` (automax_msgs/ReadStatus).

A request is carried out between two scans; the answer says whether, and if not, why. The text of a reloaded source
comes from the caller: no path of the rack's computer is opened (decision). It is checked and compiled on a thread of
its own while the rack scans, one at a time: another reload is refused meanwhile (decision: a bound on what callers
can ask for at once).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from automax_msgs.msg import LoggedError, TaskInfo
from automax_msgs.srv import (
    OperateControl,
    OperateTask,
    ReadErrors,
    ReadStatus,
    ReadTasks,
    ReadValues,
    Reload,
    SetValue,
    Unforce,
)
from std_srvs.srv import Trigger

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.nodes.background import Background
from automax_ros.nodes.later import Later, Respond, allow_later
from automax_ros.nodes.module_node import ModuleNode, Site
from automax_ros.rack.installation import Prepared
from automax_ros.rack.operations import OperationRefused
from automax_ros.rack.orders import Orders, ReloadRefused
from automax_ros.running.task import Status

PLACES = ("first", "second", "last")
"""What the error log keeps."""
Answer = Callable[[Any, Any], None]
"""Carries a request out and fills the response in; raises OperationRefused."""


class OperatorNode(ModuleNode):
    """Serves the operator of one rack."""

    def __init__(self, site: Site) -> None:
        """Create the services."""
        super().__init__(site, "operator")
        self._rack = site.rack
        orders = self._orders = Orders(site.rack)
        self._serve(OperateTask, "run", lambda request, _: orders.run(request.task))
        self._serve(OperateTask, "stop", lambda request, _: orders.stop(request.task))
        self._serve(OperateTask, "clear_errors", lambda request, _: orders.clear_errors(request.task))
        self._serve(Trigger, "run_all", lambda *_: orders.run_all())
        self._serve(Trigger, "stop_all", lambda *_: orders.stop_all())
        self._serve(SetValue, "set", lambda request, _: orders.set(request.name, request.value))
        self._serve(SetValue, "force", lambda request, _: orders.force(request.name, request.value))
        self._serve(SetValue, "tune", lambda request, _: orders.tune(request.name, request.value))
        self._serve(Unforce, "unforce", lambda request, _: orders.unforce(list(request.names)))
        self._serve(OperateControl, "module", lambda request, _: orders.module(*_moved(request)))
        self._serve(OperateControl, "plant", lambda request, _: orders.plant(*_moved(request)))
        self._work = Background(self)
        self._reloading = ""
        allow_later(self.create_service(Reload, "reload", self._reload))
        self._serve(ReadValues, "get", self._get)
        self._serve(ReadValues, "forces", self._forces)
        self._serve(ReadErrors, "errors", self._errors)
        self._serve(ReadTasks, "tasks", self._tasks)
        self._serve(ReadStatus, "status", self._status)

    def _serve(self, kind: Any, name: str, answer: Answer) -> None:
        def answered(request: Any, response: Any) -> Any:
            with self.site.present():
                try:
                    answer(request, response)
                except Exception as error:
                    return self._refused(name, response, error)
            return _concluded(response, ok=True, reason="")

        self.create_service(kind, name, answered)

    def _refused(self, name: str, response: Any, error: Exception) -> Any:
        if isinstance(error, OperationRefused):
            return _concluded(response, ok=False, reason=str(error))
        self.guard.report(f"a request to {name} was refused", error)
        return _concluded(response, ok=False, reason=f"{type(error).__name__}: {str(error)[:300]}")

    def _reload(self, request: Any, response: Any) -> Any:
        try:
            with self.site.present():
                self._refuse_second(request.task)
                name, source = self._orders.admit_reload(request.task, request.source)
                self._reloading = name
        except Exception as error:
            return self._refused("reload", response, error)

        def begin(respond: Respond) -> None:
            self._work.do(
                lambda: self._orders.prepare(name, source), lambda found, error: finish(found, error, respond)
            )

        def finish(prepared: Prepared, error: Exception | None, respond: Respond) -> None:
            try:
                with self.site.present():
                    if error is not None:
                        raise error
                    if not self._orders.is_current(prepared):
                        begin(respond)
                        return
                    self._reloading = ""
                    self._orders.install(prepared, keep_state=request.keep_state)
            except Exception as fault:
                self._reloading = ""
                response.findings = list(fault.findings) if isinstance(fault, ReloadRefused) else []
                respond(self._refused("reload", response, fault))
            else:
                respond(_concluded(response, ok=True, reason=""))

        return Later(begin)

    def _refuse_second(self, task: str) -> None:
        if self._reloading:
            reason = f"the new source of {self._reloading} is still being compiled: ask again when that is done"
            self._orders.refuse_reload(task, reason)

    def destroy_node(self) -> None:
        """Leave the graph; a source that is being compiled is not installed."""
        self._work.close()
        super().destroy_node()

    def _get(self, request: Any, response: Any) -> None:
        _fill(response, self._orders.get(list(request.names)))

    def _forces(self, _: Any, response: Any) -> None:
        _fill(response, self._orders.forces())

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
        for module in self._rack.task_modules:
            for item in module.tasks:
                task = item.task
                response.tasks.append(
                    TaskInfo(
                        task=task.name,
                        module=module.config.name,
                        status=task.status.value,
                        priority=task.priority,
                        period_ms=0.0 if task.compiled.program.event is not None else task.period_ns / NS_PER_MS,
                        scans=item.statistics.scans,
                        skipped=item.statistics.skipped,
                        errors=task.errors.count,
                    )
                )

    def _status(self, _: Any, response: Any) -> None:
        rack, operations = self._rack, self._rack.operations
        response.rack, response.run_id = rack.config.name, self.site.stream.run_id
        response.time_s, response.powered = rack.now_ns / NS_PER_S, operations.powered
        cause = operations.stopped
        response.stopped = cause is not None
        if cause is not None:
            response.stopped_at_s = cause.time_ns / NS_PER_S
            response.stopped_code, response.stopped_task = cause.code or "", cause.task
            response.stopped_reason = cause.reason
        response.tasks = len(rack.tasks)
        response.running = sum(task.status is Status.RUNNING for task in rack.tasks)
        response.forced = len(rack.forces())


def _moved(request: Any) -> tuple[str, str, str]:
    return request.name, request.control, request.value


def _concluded(response: Any, *, ok: bool, reason: str) -> Any:
    """Return a response with how it ended, in the words of its type; the readings have none."""
    for name, value in (("ok", ok), ("reason", reason), ("success", ok), ("message", reason)):
        if hasattr(response, name):
            setattr(response, name, value)
    return response


def _fill(response: Any, values: list[tuple[str, str]]) -> None:
    response.found = [name for name, _ in values]
    response.values = [text for _, text in values]
