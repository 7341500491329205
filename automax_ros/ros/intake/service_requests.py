"""Receives requests to a service without holding the interpreter, and weighs them before converting them.

rclpy converts a whole request to Python objects, whatever its size, while it holds up all threads; a malformed one
raises from the loop. Here rcl reads a request into its C structure, without the interpreter; one that is too large
(``request_size``) or malformed is refused, counted and reported. One thing cannot be bounded: DDS itself receives a
request as a whole first, on its own thread.

A service can also respond later, which rclpy does not support: it responds when a callback returns, and EventsExecutor
awaits no callback. The callback returns ``DeferredResponse``; its ``begin`` is called with the function that sends the
response, to be called once, at any later time.
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


Refuse = Callable[[Any, Exception], Any]
"""Returns the response to a failed request, from the service's class and the error."""


@dataclass(frozen=True)
class DeferredResponse:
    """Placeholder for a response that is sent later."""

    begin: Callable[[Respond], None]


def allow_deferred(service: Any) -> None:
    """Allow the callback of an rclpy service to return ``DeferredResponse``."""
    send = service.send_response

    def send_response(response: Any, header: Any) -> None:
        if isinstance(response, DeferredResponse):
            response.begin(lambda found: send(found, header))
        else:
            send(response, header)

    service.send_response = send_response


class ServiceRequests:
    """Receives the requests of one rclpy service."""

    def __init__(self, rcl: Library, service: Any, refuse: Refuse) -> None:
        self.name, self.handle = service.srv_name, service.handle
        self._rcl, self._service, self._kind, self._refuse = rcl, service, service.srv_type, refuse
        self._request, self._response = Conversion(self._kind.Request), Conversion(self._kind.Response)
        self._info = ServiceInfo()
        service.send_response = self.respond

    def take(self) -> bool:
        """Take the next request and answer it, in two tries, since a malformed one may precede it."""
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
            self._rcl.reset_error()  # rclpy's callbacks leave one, and rcutils would print a complaint at the next
        finally:
            self._request.destroy(raw)
        self._service.send_response(response, header)
        return True

    def wake(self, pointer: int, callback: Any, data: int | None) -> int:
        """Set the C function that rcl calls for each request."""
        return int(self._rcl.on_request(pointer, callback, data))

    def respond(self, response: Any, header: RequestId) -> None:
        """Send a response, or defer it.

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
    """The functions of generated code that convert a message from C and to C."""

    def __init__(self, kind: Any) -> None:
        self._kind, code = kind, kind.__class__
        address = capsule_pointer
        # PYFUNCTYPE holds the interpreter, where Python objects are created or read, and raises their exceptions.
        self.create = ctypes.CFUNCTYPE(ctypes.c_void_p)(address(code._CREATE_ROS_MESSAGE))
        self.destroy = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(address(code._DESTROY_ROS_MESSAGE))
        self.to_python = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p)(address(code._CONVERT_TO_PY))
        self.from_python = ctypes.PYFUNCTYPE(ctypes.c_bool, ctypes.py_object, ctypes.c_void_p)(
            address(code._CONVERT_FROM_PY)
        )

    def read(self, raw: int) -> Any:
        """Return the message; items of its sequences are converted one by one, so other threads can run between."""
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
