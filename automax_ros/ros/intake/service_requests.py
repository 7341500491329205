"""Receives requests to a service without holding the interpreter, and weighs them before converting them.

rclpy converts a whole request to Python objects, whatever its size, while it holds up all threads; a malformed one
raises from the loop. Here rcl reads a request into its C structure, without the interpreter; one that is too large
(its ``request_size``) or malformed is refused, counted and reported. One thing cannot be bounded: DDS itself receives a
request as a whole first, on its own thread.

A service can also respond later, which rclpy does not support: it responds when a callback returns, and EventsExecutor
awaits no callback. The callback returns ``DeferredResponse``; its ``begin`` is called with the function that sends the
response, to be called once, at any later time.
"""

from __future__ import annotations

import ctypes
import functools
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rosidl_parser.definition import AbstractGenericString, AbstractSequence, Array, BasicType, NamespacedType

from automax_ros.ros.intake.rcl import OK, TAKE_FAILED, Library, RequestId, ServiceInfo, capsule_pointer

OF_A_MESSAGE = 64
OF_A_TEXT = 16
CHARACTERS = 16
MOST = 1 << 16
"""Heaviest request that is read (decision): a message in a sequence weighs 64, a text 16 and 1 for each 16 characters,
a number 1. So 680 parameters, 3,800 texts, 65,000 numbers or 1 MB of text are the most. rclpy's conversion takes 30 to
50 us for a parameter, 0.02 us for a text, 0.006 us for a number (measured on a busy machine)."""


_NUMBERS: dict[str, Any] = {
    "boolean": ctypes.c_bool,
    "octet": ctypes.c_uint8,
    "char": ctypes.c_uint8,
    "wchar": ctypes.c_uint16,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "long double": ctypes.c_longdouble,
    **{f"{sign}int{bits}": getattr(ctypes, f"c_{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
Weigh = Callable[[Any], int]


class RequestTooLarge(Exception):
    """A message is larger than a rack accepts."""


class _Many(ctypes.Structure):
    """A string or a sequence."""

    _fields_ = [("data", ctypes.c_void_p), ("size", ctypes.c_size_t), ("capacity", ctypes.c_size_t)]


def request_size(kind: Any, address: int) -> int:
    """Return the weight of a message of a class at an address.

    Raises:
        RequestTooLarge: it is above ``MOST``.
    """
    structure, weigh = _structure(kind)
    return weigh(structure.from_address(address))


def sequences(kind: Any, address: int) -> list[tuple[str, Any, Any, int]]:
    """Return the sequences of messages in a message: field, class of the items, the sequence, bytes per item.

    The sequence has ``data``, the address of the items, and ``size``, their number.
    """
    message = _structure(kind)[0].from_address(address)
    return [
        (name, _class(slot.value_type), getattr(message, name), ctypes.sizeof(_part(slot.value_type)[0]))
        for name, slot in zip(kind.get_fields_and_field_types(), kind.SLOT_TYPES, strict=True)
        if isinstance(slot, AbstractSequence) and isinstance(slot.value_type, NamespacedType)
    ]


@functools.cache
def _structure(kind: Any) -> tuple[Any, Weigh]:
    names = list(kind.get_fields_and_field_types())
    parts = [_part(slot) for slot in kind.SLOT_TYPES]
    fields = [(name, part[0]) for name, part in zip(names, parts, strict=True)] or [("nothing", ctypes.c_uint8)]
    structure = type(kind.__name__, (ctypes.Structure,), {"_fields_": fields})
    weighed = [(name, part[1]) for name, part in zip(names, parts, strict=True) if part[1] is not None]

    def weigh(message: Any) -> int:
        total = 0
        for name, of_part in weighed:
            assert of_part is not None
            total += of_part(getattr(message, name))
            if total > MOST:
                raise RequestTooLarge(f"it is larger than a rack takes: to read it costs more than {MOST:,} numbers")
        return total

    return structure, weigh


def _part(slot: Any) -> tuple[Any, Weigh | None]:
    """Return the C type of a field, and the function that weighs it; None if there is nothing to weigh."""
    if isinstance(slot, BasicType):
        return _NUMBERS[slot.typename], None
    if isinstance(slot, AbstractGenericString):
        return _Many, _of_text
    if isinstance(slot, NamespacedType):
        return _structure(_class(slot))
    kind, weigh = _part(slot.value_type)
    own = OF_A_MESSAGE if isinstance(slot.value_type, NamespacedType) else 1
    if isinstance(slot, Array):
        return kind * slot.size, None if weigh is None else _of_items(weigh, own)
    assert isinstance(slot, AbstractSequence)
    of_items = None if weigh is None else _of_items(weigh, own)

    def of_sequence(found: _Many) -> int:
        if found.size * own > MOST:
            raise RequestTooLarge(f"a sequence of {found.size:,} is longer than a rack takes")
        if of_items is None or not found.size:
            return int(found.size)
        return of_items((kind * found.size).from_address(found.data))

    return _Many, of_sequence


def _of_text(found: _Many) -> int:
    if found.size > MOST * CHARACTERS:
        raise RequestTooLarge(f"a text of {found.size:,} bytes is longer than a rack takes")
    return int(OF_A_TEXT + found.size // CHARACTERS)


def _of_items(weigh: Weigh, own: int) -> Weigh:
    def of_items(items: Any) -> int:
        total = 0
        for item in items:
            total += own + weigh(item)
            if total > MOST:
                raise RequestTooLarge(f"{len(items):,} items are larger than a rack takes")
        return total

    return of_items


def _class(slot: NamespacedType) -> Any:
    return getattr(importlib.import_module(".".join(slot.namespaces)), slot.name)


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
