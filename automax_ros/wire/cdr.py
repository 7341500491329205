"""CDR, the byte form of ROS 2 messages: classic (XCDR1), little-endian, as Fast DDS writes it.

A message starts with four bytes that name the form; numbers stand at multiples of their size, counted from behind these
four. A sequence is its length (uint32) and its items; no padding follows the length of an empty one. A string is its
length with the closing zero byte, its UTF-8 text and that byte.

Encoder and decoder of a type are built once from its definition, as lists of steps. Consecutive numbers are packed by
one ``struct.Struct``; since its padding depends on where it starts, there is one for each of the eight positions.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any

from automax_ros.wire.definitions import TIME, Field, message_types
from automax_ros.wire.messages import CLASSES, NAMES
from automax_ros.wire.triples import triple_decoder

Message = tuple[Any, ...]
"""An instance of one of the classes of wire/messages.py."""

HEADER = b"\x00\x01\x00\x00"
MAX_TRAILING = 64
"""Bytes that may follow a message: ROS sizes its buffers as if padding followed empty sequences."""

_EncodeStep = Callable[[Message, bytearray], None]
_DecodeStep = Callable[[bytes, int, list[Any]], int]

_CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "uint8": "B",
    "int8": "b",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
_SIZES = {kind: struct.calcsize(f"<{code}") for kind, code in _CODES.items()}
_TIME_CODES = ("i", "I")
_SECOND = 1_000_000_000
_COUNT = struct.Struct("<I")
_COUNTS = tuple(struct.Struct(f"<{-position % 4}xI") for position in range(4))
"""A count for each position modulo 4 at which it can start."""
_CACHED_SHAPES = 4096


class CdrError(ValueError):
    """Bytes are not a message of the type, or a value does not fit its field."""


def encode(message: Message) -> bytes:
    """Return the bytes of a message; its class tells the type.

    Raises:
        CdrError: a value does not fit its field.
    """
    return encoder(NAMES[type(message)])(message)


def decode(type_name: str, data: bytes) -> Message:
    """Return the message that the bytes hold.

    Raises:
        CdrError: they are not a message of this type.
    """
    return decoder(type_name)(data)


@functools.cache
def encoder(type_name: str) -> Callable[[Message], bytes]:
    """The function that turns a message of the type into bytes; a caller in a hurry keeps it."""
    fields = message_types()[type_name].definition.fields
    if all(field.kind in _CODES and not field.array for field in fields):
        return _plain_encoder(type_name, fields)
    steps = tuple(_encode_steps(type_name))

    def encode_message(message: Message) -> bytes:
        out = bytearray(HEADER)
        try:
            for step in steps:
                step(message, out)
        except (struct.error, OverflowError, TypeError, AttributeError, UnicodeEncodeError) as error:
            raise CdrError(f"{type_name}: {error}") from error
        return bytes(out)

    return encode_message


def _plain_encoder(type_name: str, fields: Sequence[Field]) -> Callable[[Message], bytes]:
    """The same for a message of nothing but numbers, such as a variable's value."""
    layout, _ = _padded(len(HEADER), [_CODES[field.kind] for field in fields])
    pack = struct.Struct(f"<{len(HEADER)}s{layout}").pack

    def encode_message(message: Message) -> bytes:
        try:
            return pack(HEADER, *message)
        except (struct.error, OverflowError, TypeError) as error:
            raise CdrError(f"{type_name}: {error}") from error

    return encode_message


@functools.cache
def decoder(type_name: str) -> Callable[[bytes], Message]:
    """The function that turns bytes into a message of the type."""
    steps = tuple(_decode_steps(type_name))
    make = CLASSES[type_name]

    def decode_message(data: bytes) -> Message:
        if data[:4] != HEADER:
            raise CdrError(f"{type_name}: starts with {data[:4].hex(' ')}, not with 00 01 00 00 (little-endian CDR)")
        fields: list[Any] = []
        position = 4
        try:
            for step in steps:
                position = step(data, position, fields)
        except (struct.error, UnicodeDecodeError) as error:
            raise CdrError(f"{type_name}: {error}") from error
        if len(data) - position > MAX_TRAILING:
            raise CdrError(f"{type_name}: {len(data) - position} bytes too long")
        return make(*fields)

    return decode_message


def _padded(position: int, codes: Sequence[str]) -> tuple[str, int]:
    """The struct format of numbers that start at ``position`` (the header counts), and the position behind them."""
    parts = []
    for code in codes:
        size = struct.calcsize(f"<{code}")
        padding = (len(HEADER) - position) % size
        parts.append("x" * padding + code)
        position += padding + size
    return "".join(parts), position


def _groups(fields: Sequence[Field]) -> Iterator[tuple[str, int, list[Field]]]:
    """Consecutive fields that one step handles, with the kind of the step and the index of the first field."""
    index = 0
    for group, members in groupby(enumerate(fields), key=lambda item: _group(*item)):
        found = [field for _, field in members]
        yield group[0], index, found
        index += len(found)


def _group(index: int, field: Field) -> tuple[str, int]:
    if field.array not in {"", "[]"} or field.bound is not None or field.kind == "wstring":
        raise TypeError(f"no CDR for {field.kind}{field.array}")
    if field.kind in _CODES:
        return ("sequences" if field.array else "numbers"), -1
    if field.kind == TIME:
        if field.array or index:
            raise TypeError("no CDR for a time that is not the first field")
        return "numbers", -1
    if field.kind == "string":
        return ("strings" if field.array else "string"), index
    return ("messages" if field.array else "message"), index


def _number_structs(fields: Sequence[Field]) -> tuple[struct.Struct, ...]:
    """The packing of single numbers, of which the first may be a time, for each position modulo 8 they can start at."""
    codes = [code for field in fields for code in (_TIME_CODES if field.kind == TIME else _CODES[field.kind])]
    return tuple(struct.Struct("<" + _padded(position, codes)[0]) for position in range(8))


def _encode_steps(type_name: str) -> Iterator[_EncodeStep]:
    for group, first, fields in _groups(message_types()[type_name].definition.fields):
        if group == "numbers":
            yield _numbers_encoder(first, fields)
        elif group == "sequences":
            yield _sequences_encoder(first, first + len(fields), [_CODES[field.kind] for field in fields])
        elif group == "string":
            yield _string_encoder(first)
        elif group == "strings":
            yield _strings_encoder(first)
        elif group == "message":
            yield _message_encoder(first, fields[0].kind)
        else:
            yield _messages_encoder(first, fields[0].kind)


def _numbers_encoder(first: int, fields: Sequence[Field]) -> _EncodeStep:
    end = first + len(fields)
    structs = _number_structs(fields)

    def step(message: Message, out: bytearray) -> None:
        out += structs[len(out) & 7].pack(*message[first:end])

    def timed_step(message: Message, out: bytearray) -> None:
        out += structs[len(out) & 7].pack(*divmod(message[first], _SECOND), *message[first + 1 : end])

    return timed_step if fields[0].kind == TIME else step


def _sequences_encoder(first: int, end: int, codes: list[str]) -> _EncodeStep:
    shapes: dict[tuple[int, ...], struct.Struct] = {}

    def build(shape: tuple[int, ...]) -> struct.Struct:
        position = shape[0]
        parts = []
        for code, count in zip(codes, shape[1:], strict=True):
            text, position = _padded(position, ["I", code] if count else ["I"])
            if count:
                text = text[:-1] + f"{count}{code}"
                position += (count - 1) * struct.calcsize(f"<{code}")
            parts.append(text)
        if len(shapes) >= _CACHED_SHAPES:
            shapes.clear()
        shapes[shape] = packing = struct.Struct("<" + "".join(parts))
        return packing

    def step(message: Message, out: bytearray) -> None:
        sequences = message[first:end]
        shape = (len(out) & 7, *map(len, sequences))
        arguments: list[Any] = []
        for items in sequences:
            arguments.append(len(items))
            arguments += items
        out += (shapes.get(shape) or build(shape)).pack(*arguments)

    def step_of_three(message: Message, out: bytearray) -> None:
        """The same for three sequences, as Values has them: most of the work of a recording."""
        one, two, three = message[first:end]
        counts = len(one), len(two), len(three)
        shape = (len(out) & 7, *counts)
        packing = shapes.get(shape) or build(shape)
        out += packing.pack(counts[0], *one, counts[1], *two, counts[2], *three)

    return step_of_three if end - first == 3 else step


def _string_encoder(index: int) -> _EncodeStep:
    def step(message: Message, out: bytearray) -> None:
        text = message[index].encode()
        out += _COUNTS[len(out) & 3].pack(len(text) + 1) + text + b"\0"

    return step


def _strings_encoder(index: int) -> _EncodeStep:
    def step(message: Message, out: bytearray) -> None:
        texts = message[index]
        out += _COUNTS[len(out) & 3].pack(len(texts))
        for item in texts:
            text = item.encode()
            out += _COUNTS[len(out) & 3].pack(len(text) + 1) + text + b"\0"

    return step


def _message_encoder(index: int, type_name: str) -> _EncodeStep:
    steps = tuple(_encode_steps(type_name))
    nothing = _empty_bytes(type_name)

    def step(message: Message, out: bytearray) -> None:
        nested = message[index]
        if nothing and not any(nested):
            out += bytes(-len(out) & 3) + nothing
            return
        for inner in steps:
            inner(nested, out)

    return step


def _empty_bytes(type_name: str) -> bytes:
    """The bytes of a message that has only sequences, all empty; none for other types."""
    fields = message_types()[type_name].definition.fields
    return bytes(_COUNT.size * len(fields)) if all(field.array for field in fields) else b""


def _messages_encoder(index: int, type_name: str) -> _EncodeStep:
    steps = tuple(_encode_steps(type_name))

    def step(message: Message, out: bytearray) -> None:
        items = message[index]
        out += _COUNTS[len(out) & 3].pack(len(items))
        for item in items:
            for inner in steps:
                inner(item, out)

    return step


def _decode_steps(type_name: str) -> Iterator[_DecodeStep]:
    for group, _, fields in _groups(message_types()[type_name].definition.fields):
        if group == "numbers":
            yield _numbers_decoder(fields)
        elif group == "sequences":
            steps = [_sequence_decoder(_CODES[field.kind], _SIZES[field.kind]) for field in fields]
            if len(steps) == 3:
                yield triple_decoder([_CODES[field.kind] for field in fields], steps)
            else:
                yield from steps
        elif group == "string":
            yield _decode_string
        elif group == "strings":
            yield _decode_strings
        elif group == "message":
            yield _message_decoder(fields[0].kind)
        else:
            yield _messages_decoder(fields[0].kind)


def _numbers_decoder(numbers: Sequence[Field]) -> _DecodeStep:
    structs = _number_structs(numbers)

    def step(data: bytes, position: int, fields: list[Any]) -> int:
        packing = structs[position & 7]
        fields += packing.unpack_from(data, position)
        return position + packing.size

    def timed_step(data: bytes, position: int, fields: list[Any]) -> int:
        packing = structs[position & 7]
        seconds, nanoseconds, *others = packing.unpack_from(data, position)
        if nanoseconds >= _SECOND:
            raise CdrError(f"a time with {nanoseconds} nanoseconds")
        fields.append(seconds * _SECOND + nanoseconds)
        fields += others
        return position + packing.size

    return timed_step if numbers[0].kind == TIME else step


def _count(data: bytes, position: int, smallest: int) -> tuple[int, int]:
    """Read the length of a sequence whose items take at least ``smallest`` bytes each; refuse what cannot be there."""
    position += -position & 3
    (count,) = _COUNT.unpack_from(data, position)
    position += 4
    if count * smallest > len(data) - position:
        raise CdrError(f"a sequence of {count} items in the last {len(data) - position} bytes")
    return count, position


def _sequence_decoder(code: str, size: int) -> _DecodeStep:
    def step(data: bytes, position: int, fields: list[Any]) -> int:
        count, position = _count(data, position, size)
        if not count:
            fields.append(())
            return position
        position += (len(HEADER) - position) % size
        fields.append(struct.unpack_from(f"<{count}{code}", data, position))
        return position + count * size

    return step


def _read_string(data: bytes, position: int) -> tuple[str, int]:
    length, position = _count(data, position, 1)
    end = position + length
    if length and data[end - 1]:
        raise CdrError("a string without its closing zero byte")
    return data[position : max(position, end - 1)].decode(), end


def _decode_string(data: bytes, position: int, fields: list[Any]) -> int:
    text, position = _read_string(data, position)
    fields.append(text)
    return position


def _decode_strings(data: bytes, position: int, fields: list[Any]) -> int:
    count, position = _count(data, position, _COUNT.size)
    texts = []
    for _ in range(count):
        text, position = _read_string(data, position)
        texts.append(text)
    fields.append(tuple(texts))
    return position


def _message_decoder(type_name: str) -> _DecodeStep:
    steps = tuple(_decode_steps(type_name))
    make = CLASSES[type_name]
    nothing = _empty_bytes(type_name)
    empty = make(*[()] * (len(nothing) // _COUNT.size)) if nothing else None

    def step(data: bytes, position: int, fields: list[Any]) -> int:
        if nothing:
            start = position + (-position & 3)
            if data[start : start + len(nothing)] == nothing:
                fields.append(empty)
                return start + len(nothing)
        inner: list[Any] = []
        for inner_step in steps:
            position = inner_step(data, position, inner)
        fields.append(make(*inner))
        return position

    return step


def _messages_decoder(type_name: str) -> _DecodeStep:
    decode_item = _message_decoder(type_name)
    smallest = _smallest_size(type_name)

    def step(data: bytes, position: int, fields: list[Any]) -> int:
        count, position = _count(data, position, smallest)
        items: list[Any] = []
        for _ in range(count):
            position = decode_item(data, position, items)
        fields.append(tuple(items))
        return position

    return step


def _smallest_size(type_name: str) -> int:
    """The fewest bytes that a message of the type takes inside another."""
    total = 0
    for field in message_types()[type_name].definition.fields:
        if field.array or field.kind == "string":
            total += _COUNT.size
        else:
            total += _SIZES[field.kind] if field.kind in _SIZES else _smallest_size(field.kind)
    return total
