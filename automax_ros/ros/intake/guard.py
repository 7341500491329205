"""Keeps a client's message or request from ending a program, and limits repeated log messages.

rclpy raises an exception of any callback from ``spin_once``, those of its own services and conversions included: a
``ParameterValue`` of an unknown type is enough, or a string that is not UTF-8. With a guard the program continues.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.node import Node

from automax_ros.runtime.health import Health

FAILED, REFUSED = "failed callback", "refused request"
"""Names under which ``Health`` counts them."""
MOST_SHOWN, MOST_LOGGED = 300, 20
"""Most characters of an error, and most failures, that are logged: a client may repeat a bad request forever."""
_LAST_TYPE = ParameterType.PARAMETER_STRING_ARRAY


class Throttle:
    """Passes at most once per ``interval_s`` seconds of the wall clock.

    rclpy's own throttle works per line of code: messages of one variable or task would suppress those of another.
    """

    def __init__(self, interval_s: float) -> None:
        self._interval_s = interval_s
        self._next_s = 0.0

    def passes(self) -> bool:
        """Return whether the interval is over; if so, the next one begins."""
        now = time.monotonic()
        if now < self._next_s:
            return False
        self._next_s = now + self._interval_s
        return True


class RequestGuard:
    """Reports failures to ``health``, and the first ones to ``log``."""

    def __init__(self, health: Health, log: Callable[[str], object]) -> None:
        self._health, self._log = health, log

    def report(self, what: str, error: Exception) -> None:
        """Count a failure and log it."""
        text = f"{what}: {type(error).__name__}: {str(error)[:MOST_SHOWN]}"
        self._health.note(FAILED, (what, type(error)), lambda: text)
        if self._health.counts[FAILED] <= MOST_LOGGED:
            self._log(text)

    def refused(self, what: str, reason: str, key: str) -> None:
        """Count a refused request, and report the first one of each key with its reason."""
        self._health.note(REFUSED, key, lambda: f"a request was refused: {what}: {reason}")

    def services(self, node: Node) -> None:
        """Guard the services that a node has now: a request that fails is refused."""
        for service in node.services:
            self.service(service)

    def service(self, service: Any) -> None:
        """Guard a service: a request that fails is refused."""
        service.callback = self._answering(service.callback, service.srv_type, service.srv_name)

    def refusal(self, name: str, kind: Any, error: Exception) -> Any:
        """Report a request to the service ``name`` that failed or was not read, and return its response.

        The response has one result, however many parameters were to be set (decision: who asks looks at the first).
        """
        self.report(f"a request to {name} was refused", error)
        reason = str(error)[:MOST_SHOWN]
        if kind is SetParameters:
            return kind.Response(results=[SetParametersResult(successful=False, reason=reason)])
        return conclude(_refusal(kind, None, reason), ok=False, reason=reason)

    def serve(self, executor: Any, context: Context, seconds: float) -> None:
        """Spin an executor once, waiting at most ``seconds`` for work, and report exceptions.

        Raises:
            Exception: what the executor raises once the context is shut down.
        """
        try:
            executor.spin_once(timeout_sec=seconds)
        except Exception as error:
            if not context.ok():
                raise
            self.report("a message or a request was dropped", error)

    def _answering(self, callback: Callable[[Any, Any], Any], kind: Any, name: str) -> Callable[[Any, Any], Any]:
        setting = kind in {SetParameters, SetParametersAtomically}

        def answer(request: Any, response: Any) -> Any:
            try:
                if setting:
                    _check_types(request)
                return callback(request, response)
            except Exception as error:
                self.report(f"a request to {name} was refused", error)
                return _refusal(kind, request, str(error))

        return answer


def _check_types(request: Any) -> None:
    for parameter in request.parameters:
        if parameter.value.type > _LAST_TYPE:
            raise ValueError(f"parameter {parameter.name[:100]!r} has the unknown type {parameter.value.type}")


def _refusal(kind: Any, request: Any, reason: str) -> Any:
    result = SetParametersResult(successful=False, reason=reason[:MOST_SHOWN])
    if kind is SetParameters:
        return kind.Response(results=[result] * len(request.parameters))
    return kind.Response(result=result) if kind is SetParametersAtomically else kind.Response()


def conclude(response: Any, *, ok: bool, reason: str) -> Any:
    """Fill in the outcome of a request; a message of a success stays. Return the response."""
    for name, value in (("ok", ok), ("success", ok), ("reason", reason), ("message", reason)):
        if hasattr(response, name) and (name != "message" or reason):
            setattr(response, name, value)
    return response
