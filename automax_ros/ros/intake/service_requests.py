"""Requests to a service as the rack's door takes them: without the interpreter, and weighed before they are read.

rclpy makes Python objects of a whole request, whatever its size, while it holds all threads up; one that is malformed
raises from the loop. Here rcl reads a request into its C structure, without the interpreter; one too heavy
(``message_weight``) or malformed is refused, counted and told. What cannot be bounded: DDS itself takes a request in
whole before anybody is asked, on a thread of its own.

Services that answer later: rclpy answers when a callback returns, and EventsExecutor awaits none.

A callback returns ``DeferredResponse``; its ``begin`` is called with what sends the response, at any later time, once.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from automax_ros.ros.intake.rcl import OK, TAKE_FAILED, Library, RequestId, ServiceInfo, capsule_pointer
from automax_ros.ros.intake.request_size import request_size, sequences

Respond = Callable[[Any], None]
"""Sends a response."""


@dataclass(frozen=True)
class DeferredResponse:
    """Stands for a response that is not known yet."""

    begin: Callable[[Respond], None]


def allow_deferred(service: Any) -> None:
    """Let the callback of a service of rclpy's return ``DeferredResponse``."""
    send = service.send_response

    def send_response(response: Any, header: Any) -> None:
        if isinstance(response, DeferredResponse):
            response.begin(lambda found: send(found, header))
        else:
            send(response, header)

    service.send_response = send_response


Refuse = Callable[[Any, Exception], Any]
"""Returns the response to a request that failed: the service's class, why."""


class ServiceRequests:
    """The way in of one service of rclpy's."""

    def __init__(self, rcl: Library, service: Any, refuse: Refuse) -> None:
        """Take the service over: no executor may serve it any more."""
        self.name, self.handle = service.srv_name, service.handle
        self._rcl, self._service, self._kind, self._refuse = rcl, service, service.srv_type, refuse
        self._request, self._response = Conversion(self._kind.Request), Conversion(self._kind.Response)
        self._info = ServiceInfo()
        service.send_response = self.respond

    def take(self) -> bool:
        """Take the next request and answer it; a malformed one may stand before others, so two looks are had."""
        return self._take() or self._take()

    def _take(self) -> bool:
        raw = self._request.create()
        try:
            with self.handle:
                result = self._rcl.take_request(self.handle.pointer, ctypes.addressof(self._info), raw)
            if result != OK:
                self._rcl.reset_error()
                if result in TAKE_FAILED:
                    return False
                raise ValueError(f"a malformed request (rcl returns {result})")
            header = RequestId.from_buffer_copy(self._info.request_id)
            try:
                request_size(self._kind.Request, raw)
                request = self._request.read(raw)
                response = self._service.callback(request, self._kind.Response())
            except Exception as error:
                response = self._refuse(self._kind, error)
            self._rcl.reset_error()  # rclpy's own callbacks leave one, and rcutils complains at the next on the console
        finally:
            self._request.destroy(raw)
        self._service.send_response(response, header)
        return True

    def wake(self, pointer: int, callback: Any, data: int | None) -> int:
        """Let rcl call a function for each request."""
        return int(self._rcl.on_request(pointer, callback, data))

    def respond(self, response: Any, header: RequestId) -> None:
        """Send a response, or let it be sent later.

        Raises:
            TypeError: it is not one of this service.
            RuntimeError: the middleware refuses it.
        """
        if isinstance(response, DeferredResponse):
            response.begin(lambda found: self.respond(found, header))
            return
        if not isinstance(response, self._kind.Response):
            raise TypeError(f"{self.name} answers with {type(response).__name__}")
        raw = self._response.create()
        try:
            self._response.from_python(response, raw)
            with self.handle:
                result = self._rcl.send_response(self.handle.pointer, ctypes.addressof(header), raw)
            if result != OK:
                self._rcl.reset_error()
                raise RuntimeError(f"{self.name}: rcl_send_response returns {result}")
        finally:
            self._response.destroy(raw)


class Conversion:
    """The functions that generated code has for a message, from C and to C."""

    def __init__(self, kind: Any) -> None:
        self._kind, code = kind, kind.__class__
        address = capsule_pointer
        # With the interpreter (PYFUNCTYPE) where Python objects are made or read; an exception of theirs is raised.
        self.create = ctypes.CFUNCTYPE(ctypes.c_void_p)(address(code._CREATE_ROS_MESSAGE))
        self.destroy = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(address(code._DESTROY_ROS_MESSAGE))
        self.to_python = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p)(address(code._CONVERT_TO_PY))
        self.from_python = ctypes.PYFUNCTYPE(ctypes.c_bool, ctypes.py_object, ctypes.c_void_p)(
            address(code._CONVERT_FROM_PY)
        )

    def read(self, raw: int) -> Any:
        """Return the message, the items of its sequences of messages one by one: between two others may go on."""
        found = sequences(self._kind, raw)
        counts = [sequence.size for _, _, sequence, _ in found]
        try:
            for _, _, sequence, _ in found:
                sequence.size = 0
            message = self.to_python(raw)
        finally:
            for (_, _, sequence, _), count in zip(found, counts, strict=True):
                sequence.size = count
        for name, kind, sequence, size in found:
            item = Conversion(kind).to_python
            setattr(message, name, [item(sequence.data + place * size) for place in range(sequence.size)])
        return message
