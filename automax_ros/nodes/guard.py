"""What keeps a client's request from ending a program: callbacks whose exceptions stay inside.

rclpy lets an exception of any callback leave ``spin_once``, those of its own parameter services included: a
``ParameterValue`` of an unknown type is enough. A node that is ``guard``ed refuses instead.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node

_LAST_TYPE = ParameterType.PARAMETER_STRING_ARRAY

Report = Callable[[str, Exception], None]
"""Told what failed, and with what."""


def guard_services(node: Node, report: Report) -> None:
    """Let no exception leave the services that a node has now; a request to set parameters that fails is refused."""
    for service in node.services:
        service.callback = _guarded(service.callback, service.srv_type, service.srv_name, report)


def _guarded(callback: Callable[[Any, Any], Any], kind: Any, name: str, report: Report) -> Callable[[Any, Any], Any]:
    setting = kind in {SetParameters, SetParametersAtomically}

    def answer(request: Any, response: Any) -> Any:
        try:
            if setting:
                _check_types(request)
            return callback(request, response)
        except Exception as error:
            report(f"a request to {name} was refused", error)
            return _refusal(kind, request, str(error))

    return answer


def _check_types(request: Any) -> None:
    for parameter in request.parameters:
        if parameter.value.type > _LAST_TYPE:
            raise ValueError(f"parameter {parameter.name[:100]!r} has the unknown type {parameter.value.type}")


def _refusal(kind: Any, request: Any, reason: str) -> Any:
    result = SetParametersResult(successful=False, reason=reason[:500])
    if kind is SetParameters:
        return kind.Response(results=[result] * len(request.parameters))
    return kind.Response(result=result) if kind is SetParametersAtomically else kind.Response()
