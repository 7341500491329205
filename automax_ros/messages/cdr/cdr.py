"""CDR, the byte form of ROS 2 messages: classic (XCDR1), little-endian, as Fast DDS writes it.

The functions that encode and decode a type are generated from its definition at first use. rosbags' serializer takes
9 us to build and encode a scan of the example, this one 2 us; rclpy's takes more than 30 us and needs ROS 2, which the
library runs without.

The source consists of field names and structs of our own table of types, never of text from a bag. An encoder packs a
whole message in one ``struct`` call, which is kept for the next message with the same sizes. Rare messages (with a text
or message inside a sequence, or neighbouring sequences of different lengths) are packed part by part.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.cdr.parts import (
    CODES,
    COUNT,
    HEADER,
    CdrError,
    number_layouts,
    put_count,
    put_text,
    put_texts,
    read_head_text,
    read_items,
    read_numbers,
    read_text,
    read_texts,
    sequence_packings,
    size_of,
    together,
    whole_packings,
)
from automax_ros.messages.types.definitions import TIME, Field, message_types
from automax_ros.messages.types.messages import CLASSES, NAMES, NO_VALUES, Values

MAX_TRAILING = 64
"""Bytes that may follow a message: ROS sizes its buffers as if padding followed empty sequences."""

Encode = Callable[[Any], bytes]
Decode = Callable[[bytes], Any]
_Append = Callable[[Any, bytearray], None]
_Read = Callable[[bytes, int], tuple[Any, int]]

_HELPERS: dict[str, Any] = {
    "HEADER": HEADER,
    "MAX_TRAILING": MAX_TRAILING,
    "SECOND": NS_PER_S,
    "CdrError": CdrError,
    "misfits": (struct.error, OverflowError, TypeError, AttributeError, ValueError),
    "malformed": (struct.error, UnicodeDecodeError),
    "new": tuple.__new__,
    "put_count": put_count,
    "put_text": put_text,
    "put_texts": put_texts,
    "read_head_text": read_head_text,
    "read_items": read_items,
    "read_numbers": read_numbers,
    "read_text": read_text,
    "read_texts": read_texts,
}


class _Source:
    """Lines of one function, and the objects that they name."""

    def __init__(self, signature: str, type_name: str) -> None:
        self._signature = signature
        self._lines = [f"def {signature}:"]
        self._objects = {**_HELPERS, "TYPE": type_name}
        self.indent = 1

    def add(self, *lines: str) -> None:
        self._lines += [" " * (4 * self.indent) + line for line in lines]

    def name(self, stem: str, value: object) -> str:
        name = f"{stem}{len(self._objects)}"
        self._objects[name] = value
        return name

    def made(self) -> Any:
        exec(compile("\n".join(self._lines), f"<CDR of {self._objects['TYPE']}>", "exec"), self._objects)
        return self._objects[self._signature.partition("(")[0]]


@functools.cache
def encoder(type_name: str) -> Encode:
    """Return the function that encodes a message of the type; fast callers keep it.

    It also accepts a plain tuple of all fields instead of an instance. It raises CdrError if a value does not fit.
    """
    source = _Source("encode(message)", type_name)
    append = _appender(type_name)

    def encode_in_parts(message: Any) -> bytes:
        out = bytearray(HEADER)
        append(message, out)
        return bytes(out)

    general = source.name("general", encode_in_parts)
    source.add("try:")
    source.indent += 1
    packing = _WholePacking(source, f"return {general}(message)")
    packing.add_message(type_name, "", "message")
    packing.finish()
    source.indent -= 1
    source.add("except misfits as error:", "    raise CdrError(f'{TYPE}: {error}') from error")
    made: Encode = source.made()
    return made


@functools.cache
def decoder(type_name: str) -> Decode:
    """Return the function that decodes a message of the type; it raises CdrError if the bytes are not one."""
    source = _Source("decode(data)", type_name)
    fields = _fields(type_name)
    _add_entry(source, fields, "read_text")
    source.add(
        "if len(data) - position > MAX_TRAILING:",
        "    raise CdrError(f'{TYPE}: {len(data) - position} bytes too long')",
        f"return new({source.name('kind', CLASSES[type_name])}, ({_variables(fields)}))",
    )
    made: Decode = source.made()
    return made


@functools.cache
def head_reader(type_name: str, head: type[tuple[Any, ...]]) -> Decode:
    """Return the function that reads the fields named by ``head``, a NamedTuple, and none after the last of them.

    A text in a head must be short and ASCII: any program may have sent it. The function raises CdrError.
    """
    names: tuple[str, ...] = head._fields  # type: ignore[attr-defined]
    fields = _fields(type_name)
    last = max(index for index, field in enumerate(fields) if field.name in names)
    source = _Source("read_head(data)", type_name)
    _add_entry(source, fields[: last + 1], "read_head_text")
    source.add(f"return new({source.name('kind', head)}, ({''.join(f'{name}_, ' for name in names)}))")
    made: Decode = source.made()
    return made


def _fields(type_name: str) -> tuple[Field, ...]:
    """Return the fields of a type.

    Raises:
        TypeError: the codec does not know one: arrays of fixed or bounded size or of times, bounded and wide strings.
    """
    fields = message_types()[type_name].definition.fields
    for field in fields:
        unknown = field.array not in {"", "[]"} or field.bound is not None or field.kind == "wstring"
        if unknown or (field.kind == TIME and field.array):
            raise TypeError(f"no CDR for {field.kind}{field.array}")
    return fields


def _groups(fields: Sequence[Field]) -> Iterator[tuple[str, list[Field]]]:
    """Yield consecutive fields that one step handles: ``numbers``, ``sequences`` of numbers; others one by one."""

    def group(item: tuple[int, Field]) -> tuple[str, int]:
        index, field = item
        if field.kind in CODES or field.kind == TIME:
            return ("sequences" if field.array else "numbers"), -1
        return field.kind, index

    for (word, _), members in groupby(enumerate(fields), key=group):
        yield word, [field for _, field in members]


def _codes(fields: Sequence[Field]) -> str:
    return "".join("iI" if field.kind == TIME else CODES[field.kind] for field in fields)


def _variables(fields: Sequence[Field], prefix: str = "") -> str:
    """Return the variables of fields, as a tuple; the underscore avoids keywords of Python and names of helpers."""
    return "".join(f"{prefix}{field.name}_, " for field in fields).rstrip()


def _arguments(fields: Sequence[Field], prefix: str = "") -> str:
    return ", ".join(
        f"*divmod({prefix}{field.name}_, SECOND)" if field.kind == TIME else f"{prefix}{field.name}_"
        for field in fields
    )


@functools.cache
def _empty(type_name: str) -> Any:
    """Return the empty message of a type that has only sequences; None for other types."""
    if CLASSES[type_name] is Values:
        return NO_VALUES
    fields = _fields(type_name)
    return CLASSES[type_name](*[()] * len(fields)) if all(field.array for field in fields) else None


@functools.cache
def _appender(type_name: str) -> _Append:
    source = _Source("append(message, out)", type_name)
    fields = _fields(type_name)
    if _empty(type_name) is not None:
        source.add(
            "if not any(message):", f"    out += bytes((-len(out) & 3) + {COUNT.size * len(fields)})", "    return"
        )
    source.add(f"{_variables(fields)} = message")
    for group, members in _groups(fields):
        value = f"{members[0].name}_"
        if group == "numbers":
            layouts = source.name("layouts", number_layouts(_codes(members)))
            source.add(f"out += {layouts}[len(out) & 7].pack({_arguments(members)})")
        elif group == "sequences":
            packings = source.name("packings", sequence_packings(_codes(members)))
            counts = ", ".join(f"len({field.name}_)" for field in members)
            items = ", ".join(f"len({field.name}_), *{field.name}_" for field in members)
            source.add(f"out += {packings}[len(out) & 7, {counts}]({items})")
        elif group == "string":
            source.add(f"put_text{'s' if members[0].array else ''}(out, {value})")
        elif members[0].array:
            append = source.name("append", _appender(group))
            source.add(f"put_count(out, len({value}))", f"for item in {value}:", f"    {append}(item, out)")
        else:
            source.add(f"{source.name('append', _appender(group))}({value}, out)")
    made: _Append = source.made()
    return made


class _WholePacking:
    """The lines that pack a whole message at once, and the line ``rare`` where that is impossible."""

    def __init__(self, source: _Source, rare: str) -> None:
        self._source, self._rare = source, f"    {rare}"
        self._plan: list[tuple[str, str]] = []
        self._sizes: list[str] = []
        self._arguments = ["HEADER"]

    def add_message(self, type_name: str, prefix: str, message: str) -> None:
        fields = _fields(type_name)
        empty = _empty(type_name)
        if empty is not None and prefix:
            # most messages of a recording contain the one empty message
            self._source.add(*(f"{prefix}{field.name}_ = ()" for field in fields))
            self._source.add(*(f"{prefix}{members[0].name}_count = 0" for _, members in _groups(fields)))
            self._source.add(f"if {message} is not {self._source.name('empty', empty)}:")
            self._source.indent += 1
        self._source.add(f"{_variables(fields, prefix)} = {message}")
        for group, members in _groups(fields):
            self._add_group(group, members, prefix)
        if empty is not None and prefix:
            self._source.indent -= 1

    def _add_group(self, group: str, fields: list[Field], prefix: str) -> None:
        value = f"{prefix}{fields[0].name}_"
        if group == "numbers":
            self._plan.append(("numbers", _codes(fields)))
            self._arguments.append(_arguments(fields, prefix))
        elif group == "sequences":
            self._add_sequences([f"{prefix}{field.name}_" for field in fields], _codes(fields))
        elif fields[0].array:
            self._source.add(f"if {value}:", self._rare)
            self._plan.append(("numbers", "I"))
            self._arguments.append("0")
        elif group == "string":
            self._source.add(f"{value}text = {value}.encode()", f"{value}size = len({value}text) + 1")
            self._plan.append(("text", ""))
            self._sizes.append(f"{value}size")
            self._arguments += [f"{value}size", f"{value}text"]
        else:
            self.add_message(group, value, value)

    def _add_sequences(self, values: list[str], codes: str) -> None:
        count = f"{values[0]}count"
        self._source.add(f"{count} = len({values[0]})")
        for value in values[1:]:
            self._source.add(f"if len({value}) != {count}:", self._rare)
        self._plan.append(("sequences", codes))
        self._sizes.append(count)
        self._arguments += [f"{count}, *{value}" for value in values]

    def finish(self) -> None:
        packings = whole_packings(self._plan)
        if self._sizes:
            pack = f"{self._source.name('packings', packings)}[{''.join(f'{size}, ' for size in self._sizes)}]"
        else:
            pack = self._source.name("pack", packings[()])
        self._source.add(f"return {pack}({', '.join(self._arguments)})")


@functools.cache
def _smallest_size(type_name: str) -> int:
    total = 0
    for field in _fields(type_name):
        if field.array or field.kind == "string":
            total += COUNT.size
        elif field.kind in CODES:
            total += size_of(CODES[field.kind])
        else:
            total += _smallest_size(field.kind)
    return total


@functools.cache
def _reader(type_name: str) -> _Read:
    source = _Source("read(data, position)", type_name)
    fields = _fields(type_name)
    empty = _empty(type_name)
    if empty is not None:
        nothing = bytes(COUNT.size * len(fields))
        source.add(
            "start = position + (-position & 3)",
            f"if data[start : start + {len(nothing)}] == {source.name('nothing', nothing)}:",
            f"    return {source.name('empty', empty)}, start + {len(nothing)}",
        )
    _add_reading(source, fields, "read_text")
    source.add(f"return new({source.name('kind', CLASSES[type_name])}, ({_variables(fields)})), position")
    made: _Read = source.made()
    return made


def _add_entry(source: _Source, fields: Sequence[Field], text_reader: str) -> None:
    source.add(
        "if data[:4] != HEADER:",
        "    begins = f'starts with {data[:4].hex(chr(32))}, not with 00 01 00 00 (little-endian CDR)'",
        "    raise CdrError(f'{TYPE}: {begins}')",
        f"position = {len(HEADER)}",
        "try:",
    )
    source.indent += 1
    _add_reading(source, fields, text_reader)
    source.indent -= 1
    source.add("except malformed as error:", "    raise CdrError(f'{TYPE}: {error}') from error")


def _add_reading(source: _Source, fields: Sequence[Field], text_reader: str) -> None:
    for group, members in _groups(fields):
        field = members[0]
        target = f"{field.name}_, position"
        if group == "numbers":
            _add_numbers_reading(source, members)
        elif group == "sequences":
            _add_sequences_reading(source, members)
        elif group == "string":
            source.add(f"{target} = {'read_texts' if field.array else text_reader}(data, position)")
        elif field.array:
            read = source.name("read", _reader(group))
            source.add(f"{target} = read_items(data, position, {read}, {_smallest_size(group)})")
        else:
            source.add(f"{target} = {source.name('read', _reader(group))}(data, position)")


def _add_numbers_reading(source: _Source, fields: Sequence[Field]) -> None:
    layouts = source.name("layouts", number_layouts(_codes(fields)))
    times = [f"{field.name}_" for field in fields if field.kind == TIME]
    targets = "".join(
        f"{field.name}_seconds, {field.name}_rest, " if field.kind == TIME else f"{field.name}_, " for field in fields
    )
    source.add(
        f"layout = {layouts}[position & 7]",
        f"{targets}= layout.unpack_from(data, position)",
        "position += layout.size",
    )
    for time in times:
        source.add(
            f"if {time}rest >= SECOND:",
            f"    raise CdrError(f'a time with {{{time}rest}} nanoseconds')",
            f"{time} = {time}seconds * SECOND + {time}rest",
        )


def _add_sequences_reading(source: _Source, fields: Sequence[Field]) -> None:
    codes = _codes(fields)
    one_by_one = [
        f"{field.name}_, position = read_numbers(data, position, {code!r}, {size_of(code)})"
        for field, code in zip(fields, codes, strict=True)
    ]
    if len(fields) == 1:
        source.add(*one_by_one)
        return
    source.add(f"count, numbers, position = {source.name('together', together(codes))}(data, position)", "if count:")
    for place, field in enumerate(fields):
        begin, end = (f"{number} * count + {place + 1}" for number in (place, place + 1))
        source.add(f"    {field.name}_ = numbers[{begin} : {end}]")
    source.add("else:", *(f"    {line}" for line in one_by_one))


__all__ = ["HEADER", "MAX_TRAILING", "CdrError", "Message", "decode", "decoder", "encode", "encoder", "head_reader"]

Message = tuple[Any, ...]
"""An instance of one of the classes of messages/types/messages.py."""


def encode(message: Message) -> bytes:
    """Return the bytes of a message; its class determines the type.

    Raises:
        CdrError: a value does not fit its field.
    """
    return encoder(NAMES[type(message)])(message)


def decode(type_name: str, data: bytes) -> Message:
    """Return the message in the bytes.

    Raises:
        CdrError: they are not a message of this type.
    """
    message: Message = decoder(type_name)(data)
    return message
