"""Decodes three sequences of equal length at once, as Values has them: most of the work of reading a recording."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any

_ORIGIN = 4
"""Numbers stand at multiples of their size, counted from behind the header's four bytes."""
_MOST_ITEMS = 64
"""Longer sequences take the general way: there the gain is small, and the shapes would be many."""
_COUNT = struct.Struct("<I")

DecodeStep = Callable[[bytes, int, list[Any]], int]
"""Takes the bytes, the position and the fields so far; returns the position behind."""


def triple_decoder(codes: Sequence[str], one_by_one: Sequence[DecodeStep]) -> DecodeStep:
    """Return the step for three sequences of numbers (struct codes); ``one_by_one`` are the general steps.

    Those are taken where the lengths differ or are 0 or large, and where the data end early, which they report.
    """
    shapes: dict[int, struct.Struct] = {}

    def build(count: int, position: int) -> struct.Struct:
        text = "<"
        for code in codes:
            for number, format_code in ((1, "I"), (count, code)):
                size = struct.calcsize(f"<{format_code}")
                padding = (_ORIGIN - position) % size
                text += f"{'x' * padding}{number}{format_code}"
                position += padding + number * size
        return struct.Struct(text)

    def general(data: bytes, position: int, fields: list[Any]) -> int:
        for step in one_by_one:
            position = step(data, position, fields)
        return position

    def step(data: bytes, position: int, fields: list[Any]) -> int:
        (count,) = _COUNT.unpack_from(data, position + (-position & 3))
        if not 0 < count <= _MOST_ITEMS:
            return general(data, position, fields)
        shape = count << 3 | position & 7
        packing = shapes.get(shape)
        if packing is None:
            packing = shapes[shape] = build(count, position & 7)
        if position + packing.size > len(data):
            return general(data, position, fields)
        values = packing.unpack_from(data, position)
        second, third = count + 1, 2 * count + 2
        if values[second] != count or values[third] != count:
            return general(data, position, fields)
        fields += (values[1:second], values[second + 1 : third], values[third + 1 :])
        return position + packing.size

    return step
