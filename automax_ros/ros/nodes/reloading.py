"""The service ``reload``: a task's new source is checked and compiled while the rack scans, then installed.

The text comes from the caller: no path of the rack's computer is opened (decision). It is compiled on a separate
thread, one at a time: another reload is refused meanwhile (decision: a bound on what callers can ask for at once).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from automax_ros.rack.operator.reloads import ReloadRefused, Reloads
from automax_ros.rack.tasks.installation import PreparedReload
from automax_ros.ros.base.module_lifecycle import Background
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.intake.service_requests import DeferredResponse, Respond

Conclude = Callable[[Any, Any, Exception | None], Any]
"""Returns the response to a request, with its outcome and what is true now; called between two scans."""


class Reloading:
    """Executes the reload requests of one node; call ``close`` when it leaves the graph."""

    def __init__(self, node: ModuleNode, reloads: Reloads, conclude: Conclude) -> None:
        self._site, self._reloads, self._conclude = node.site, reloads, conclude
        self._work = Background(node)
        self._reloading = ""

    def answer(self, request: Any, response: Any) -> Any:
        """Answer a request: at once if it is refused, else when its source is compiled."""
        with self._site.between_scans():
            try:
                self._refuse_second(request.task)
                name, source = self._reloads.admit(request.task, request.source)
            except Exception as error:
                return self._conclude(request, response, error)
        self._reloading = name

        def begin(respond: Respond) -> None:
            self._work.do(
                lambda: self._reloads.prepare(name, source), lambda found, error: finish(found, error, respond)
            )

        def finish(prepared: PreparedReload, error: Exception | None, respond: Respond) -> None:
            with self._site.between_scans():
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

    def _refuse_second(self, task: str) -> None:
        if self._reloading:
            reason = f"the new source of {self._reloading} is still being compiled: ask again when that is done"
            self._reloads.refuse(task, reason)
