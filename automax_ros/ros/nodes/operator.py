"""The node ``operator``: the services by which a rack is operated, only where its YAML says ``operator: true``.

Each row of ``VERBS`` (``rack/operator/requests.py``) is a service in the rack's namespace. A request is executed
between two scans; the response says whether it succeeded, if not, why, and what is true now. Refusals are counted in
the rack's health.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.reloads import ReloadRefused, Reloads
from automax_ros.rack.operator.requests import VERBS, Fields, OperatorRequests
from automax_ros.rack.tasks.installation import PreparedReload
from automax_ros.ros.base.module_lifecycle import Background
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.base.qos import message_class
from automax_ros.ros.clients.recorded_run import ALONE_NS, racks_of
from automax_ros.ros.distributed.forwarding import RequestForwarder
from automax_ros.ros.intake.guard import conclude
from automax_ros.ros.intake.service_requests import DeferredResponse, Respond, allow_deferred
from automax_ros.ros.nodes.tables import task_fields

Conclude = Callable[[Any, Any, Exception | None], Any]
"""Returns the response to a request, with its outcome and what is true now; called between two scans."""


class Reloading:
    """Executes the reload requests of one node; call ``close`` when it leaves the graph.

    The text comes from the caller: no path of the rack's computer is opened (decision). It is compiled on a separate
    thread, one at a time: another reload is refused meanwhile (decision: a bound on what callers can ask for at once).
    """

    def __init__(self, node: ModuleNode, reloads: Reloads, conclude: Conclude) -> None:
        self._rack_context, self._reloads, self._conclude = node.rack_context, reloads, conclude
        self._work = Background(node)
        self._reloading = ""

    def answer(self, request: Any, response: Any) -> Any:
        """Answer a request: at once if it is refused, else when its source is compiled."""
        with self._rack_context.between_scans():
            try:
                if self._reloading:
                    reason = f"the new source of {self._reloading} is still being compiled: ask again when that is done"
                    self._reloads.refuse(request.task, reason)
                name, source = self._reloads.admit(request.task, request.source)
            except Exception as error:
                return self._conclude(request, response, error)
        self._reloading = name

        def begin(respond: Respond) -> None:
            self._work.do(
                lambda: self._reloads.prepare(name, source), lambda found, error: finish(found, error, respond)
            )

        def finish(prepared: PreparedReload, error: Exception | None, respond: Respond) -> None:
            with self._rack_context.between_scans():
                try:
                    if error is not None:
                        raise error
                    if not self._reloads.is_current(prepared):
                        begin(respond)
                        return
                    response.lost = self._reloads.install(prepared, keep_state=request.keep_state)
                except Exception as raised:
                    error = raised
                    response.findings = list(raised.findings) if isinstance(raised, ReloadRefused) else []
                self._reloading = ""
                respond(self._conclude(request, response, error))

        return DeferredResponse(begin)

    def close(self) -> None:
        """End; a source that is being compiled is not installed."""
        self._work.close()


MOST_SHOWN = 300
"""Most characters of an unforeseen error in a response."""


class OperatorServices:
    """The operator's services on one node. Call ``close`` when it leaves the graph.

    ``forward_by``, once set, forwards requests that concern other processes of a distributed rack.
    """

    def __init__(self, node: ModuleNode, name_of: Callable[[str], str] = str) -> None:
        """Create the services; ``name_of`` returns the full name of one."""
        self._node, self._rack_context = node, node.rack_context
        self.forward_by: RequestForwarder | None = None
        self._requests = OperatorRequests(self._rack_context.rack, self._rack_context.pacer)
        self._begun_ns = time.monotonic_ns()
        self._reloading = Reloading(node, self._requests.reloads, partial(self._finish_response, "reload"))
        self._answers: dict[str, Callable[[Any, Any], Any]] = {}
        for name, verb in VERBS.items():
            self._answers[name] = self._reloading.answer if name == "reload" else partial(self._answer, name)
            package, _, kind = verb.type_name.partition("/")
            service = message_class(f"{package}/srv/{kind}")
            allow_deferred(node.create_service(service, name_of(name), partial(self._route, name, service)))

    def close(self) -> None:
        """End; a source that is being compiled is not installed."""
        self._reloading.close()

    def run_everywhere(self, done: Callable[[str], None]) -> None:
        """Put all tasks into RUN, in all processes of the rack; ``done`` gets the reason of a refusal, else ""."""

        def respond(response: Any) -> None:
            done("" if response.success else response.message or "refused")

        kind = message_class("std_srvs/srv/Trigger")
        answer = self._route("run_all", kind, kind.Request(), kind.Response())
        if isinstance(answer, DeferredResponse):
            answer.begin(respond)
        else:
            respond(answer)

    def _route(self, name: str, kind: Any, request: Any, response: Any) -> Any:
        """Return a response, or ``DeferredResponse`` if other processes must answer first."""
        if self.forward_by is None:
            return self._answers[name](request, response)
        with self._rack_context.between_scans():
            return self.forward_by.answer(name, kind, request, response, self._answers[name])

    def _answer(self, name: str, request: Any, response: Any) -> Any:
        """Execute a request in this process, and return its response."""
        with self._rack_context.between_scans():
            error: Exception | None = None
            fields: Fields = {}
            try:
                fields = VERBS[name].act(self._requests, **_fields_of(request)) or {}
                _fill(response, {**fields, **self._of_the_graph(name)})
            except Exception as raised:
                error = raised
            return self._finish_response(name, request, response, error, has_now="now" in fields)

    def _finish_response(
        self, name: str, request: Any, response: Any, error: Exception | None, *, has_now: bool = False
    ) -> Any:
        """Return a response with the outcome of the request, and what is true now, unless it has that already."""
        reason = "" if error is None else str(error)
        if error is not None and not isinstance(error, OperationRefused):
            reason = f"{type(error).__name__}: {reason[:MOST_SHOWN]}"
            self._node.guard.report(f"a request to {name} was refused", error)
        elif error is not None:
            self._node.guard.refused(name, reason, name)
        with suppress(OperationRefused):
            _fill(response, {} if has_now else VERBS[name].now(self._requests, **_fields_of(request)))
        return conclude(response, ok=error is None, reason=reason)

    def _of_the_graph(self, name: str) -> Fields:
        """Return the fields of an answer that the rack itself does not know."""
        rack, stream = self._rack_context.rack, self._rack_context.stream
        if name == "status":
            return {"run_id": stream.run_id, "racks": self._racks()}
        if name == "tasks":
            return {"tasks": [task_fields(rack, module, item) for module in rack.task_modules for item in module.tasks]}
        return {}

    def _racks(self) -> int:
        """Return how many racks of this name are seen; 0 until the graph was watched long enough (decision: 1 s)."""
        if time.monotonic_ns() - self._begun_ns < ALONE_NS:
            return 0
        return len(racks_of(self._node, self._node.get_namespace()))


def _fields_of(request: Any) -> dict[str, Any]:
    return {name: getattr(request, name) for name in request.get_fields_and_field_types()}


def _fill(response: Any, fields: Fields) -> None:
    types = response.get_fields_and_field_types()
    for name, value in fields.items():
        rows = value if isinstance(value, list) and value and isinstance(value[0], Mapping) else []
        if rows:
            package, _, kind = types[name].removeprefix("sequence<").removesuffix(">").partition("/")
            row = message_class(f"{package}/msg/{kind}")
        setattr(response, name, [row(**item) for item in rows] or value)


class OperatorNode(ModuleNode):
    """Serves the operator of one rack."""

    def __init__(self, rack_context: RackContext) -> None:
        super().__init__(rack_context, "operator")
        self.operator_services = OperatorServices(self)

    def destroy_node(self) -> None:
        """Leave the graph; a source that is being compiled is not installed."""
        self.operator_services.close()
        super().destroy_node()
