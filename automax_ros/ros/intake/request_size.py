"""Estimates the cost of converting a message to Python objects from its C structure, before converting it.

The structures are those that rosidl generates for C: fields in order, aligned as C aligns them; a string or a sequence
is an address, its length and its capacity.
"""

from __future__ import annotations

import ctypes
import functools
import importlib
from collections.abc import Callable
from typing import Any

from rosidl_parser.definition import (
    AbstractGenericString,
    AbstractSequence,
    Array,
    BasicType,
    NamespacedType,
)

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
