"""Generates C code that finds the fields of a message type in its bytes: values of numbers, place and count of others.

``cdr_fields.h`` has the macros of the code. No length is trusted: a message whose fields do not lie within its bytes is
reported as one that does not fit, and so is one that only the scalar decoder can check.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from automax_ros.messages.cdr.parts import CODES, size_of
from automax_ros.messages.types.definitions import TIME, Field, message_types, short_name

MACROS = (Path(__file__).parent / "cdr_fields.h").read_text(encoding="utf-8")
"""The macros, which must precede the generated functions once."""
_TYPES = {"?": "uint8_t", "B": "uint8_t", "b": "int8_t", "H": "uint16_t", "h": "int16_t", "I": "uint32_t"}
_TYPES |= {"i": "int32_t", "Q": "uint64_t", "q": "int64_t"}


@dataclass(frozen=True)
class FieldsSource:
    """A C function ``function`` that finds the fields of a type.

    ``numbers`` are the names of single numbers and times (ns), ``lists`` those of texts and sequences, in their order;
    fields of a nested message have its name and a dot as prefix.
    """

    function: str
    text: str
    numbers: tuple[str, ...]
    lists: tuple[str, ...]


def fields_source(type_name: str) -> FieldsSource:
    """Return the function of a type.

    Raises:
        TypeError: the type has fields that these functions cannot find.
    """
    numbers: list[str] = []
    lists: list[str] = []
    lines = list(_lines(type_name, "", numbers, lists))
    function = f"automax_find_{short_name(type_name).rpartition('/')[2]}"
    head = f"FIND({function},"
    return FieldsSource(function, "\n".join((head, *lines, ")")), tuple(numbers), tuple(lists))


def _lines(type_name: str, prefix: str, numbers: list[str], lists: list[str]) -> Iterator[str]:
    for field in message_types()[type_name].definition.fields:
        name = prefix + field.name
        if field.kind not in CODES and field.kind not in (TIME, "string") and not field.array:
            yield from _lines(field.kind, f"{name}.", numbers, lists)
        elif field.kind == "string" and field.array:
            yield "    TEXTS()"
        elif field.array or field.kind == "string":
            macro = "TEXT" if field.kind == "string" else "LIST"
            yield f"    {macro}({len(lists)}, {_item_bytes(field)})"
            lists.append(name)
        else:
            yield f"    {_number(field)} /* {name} */".replace("#", str(len(numbers)))
            numbers.append(name)


def _number(field: Field) -> str:
    if field.kind == TIME:
        return "TIME(#)"
    code = CODES[field.kind]
    if code not in _TYPES:
        raise TypeError(f"{field.name} is not a whole number")
    return f"NUMBER(#, {_TYPES[code]})"


def _item_bytes(field: Field) -> str:
    if field.kind == "string":
        return "1, 1"
    if field.kind in CODES:
        return f"{size_of(CODES[field.kind])}, {size_of(CODES[field.kind])}"
    members = message_types()[field.kind].definition.fields
    sizes = {size_of(CODES[member.kind]) for member in members if member.kind in CODES and not member.array}
    if len(sizes) != 1 or any(member.array or member.kind not in CODES for member in members):
        raise TypeError(f"the items of {field.name} are not numbers of one size")
    (size,) = sizes
    return f"{size}, {size * len(members)}"
